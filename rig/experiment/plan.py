"""The plan of a run: which points in which order, how long it takes, whether it may be done at all.

A plan is made and checked before anything moves.
"""

from __future__ import annotations

from dataclasses import dataclass

from rig.experiment.errors import LimitError
from rig.record.documents import ExperimentName, PointKey
from rig.spec.actuator import ActuatorSpec
from rig.spec.bench import BenchSpec
from rig.spec.protocol import BlockedForceProtocol, ProtocolSpec, SweepProtocol

TRIP_MARGIN = 1.1
"""The board trips at this multiple of the actuator's limit, or at its own limit if lower."""
MEASURE_S = 1.0
"""Bench time over which camera frames of one point are spread."""
SETTLE_GUESS_S = 3.0
"""What settling usually takes; for the expected duration only."""
PREPARE_GUESS_S = 20.0
VENT_GUESS_S = 5.0


@dataclass(frozen=True)
class Sweep:
    """One repeat of one experiment."""

    experiment: ExperimentName
    repeat: int
    keys: tuple[PointKey, ...]


@dataclass(frozen=True)
class Plan:
    """Everything that will be done, in order."""

    protocol: ProtocolSpec
    sweeps: tuple[Sweep, ...]
    duration_s: float
    """Expected bench time."""

    @property
    def keys(self) -> tuple[PointKey, ...]:
        """All points in order."""
        return tuple(key for sweep in self.sweeps for key in sweep.keys)

    def settings(self, experiment: ExperimentName) -> SweepProtocol:
        """The protocol's section for an experiment."""
        section = (
            self.protocol.deformation
            if experiment == "deformation"
            else self.protocol.blocked_force
        )
        assert section is not None
        return section


def make_plan(protocol: ProtocolSpec, actuator: ActuatorSpec, bench: BenchSpec) -> Plan:
    """Lay out a protocol for an actuator on a bench.

    Raises LimitError when a pressure is above what actuator, transducer or board allow.
    """
    sections: list[tuple[ExperimentName, SweepProtocol]] = []
    if protocol.deformation is not None:
        sections.append(("deformation", protocol.deformation))
    if protocol.blocked_force is not None:
        sections.append(("blocked_force", protocol.blocked_force))
    sweeps: list[Sweep] = []
    duration_s = 0.0
    for name, section in sections:
        what = f"the experiment {name} of the protocol '{protocol.name}'"
        check_pressure(what, section.pressures.stop, actuator, bench)
        sweeps += [_sweep(name, section, repeat) for repeat in range(1, section.repeats + 1)]
        duration_s += _duration_s(section, bench)
    return Plan(protocol, tuple(sweeps), duration_s)


def _sweep(experiment: ExperimentName, section: SweepProtocol, repeat: int) -> Sweep:
    up = [round(p / 1e3, 9) for p in section.pressures.values()]
    keys = [
        PointKey(experiment=experiment, repeat=repeat, direction="up", target_kpa=p) for p in up
    ]
    if repeat > section.repeats - section.descending_repeats:
        keys += [
            PointKey(experiment=experiment, repeat=repeat, direction="down", target_kpa=p)
            for p in reversed(up[:-1])
        ]
    return Sweep(experiment, repeat, tuple(keys))


def check_pressure(what: str, highest: float, actuator: ActuatorSpec, bench: BenchSpec) -> None:
    """Raise LimitError if `what` asks for more than actuator, bench or transducer allow, in Pa."""
    limits = [
        (f"limits.pressure of the actuator '{actuator.name}'", actuator.limits.pressure),
        (f"safety.pressure of the bench '{bench.name}'", bench.safety.pressure),
        (f"the range of the transducer {bench.transducer.model}", bench.transducer.pressure_high),
    ]
    for of, limit in limits:
        if highest > limit:
            raise LimitError(
                f"{what} asks for {highest / 1e3:g} kPa, above {limit / 1e3:g} kPa, {of}. Nothing "
                "was moved. Lower the pressures of the protocol, or raise the limit if you are "
                "sure that it may be."
            )


def _duration_s(section: SweepProtocol, bench: BenchSpec) -> float:
    measure_s = MEASURE_S
    if isinstance(section, BlockedForceProtocol):
        measure_s = section.readings / bench.load_cell.sample_rate
    ups = len(section.pressures.values())
    points = section.repeats * ups + section.descending_repeats * (ups - 1)
    each_s = SETTLE_GUESS_S + section.hold + measure_s
    return PREPARE_GUESS_S + section.repeats * (section.rest + VENT_GUESS_S) + points * each_s
