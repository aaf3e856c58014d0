"""Bring a bench from power-on to ready: parameters, home, zero, tare; and back to safe."""

from __future__ import annotations

import math
from collections.abc import Mapping

from rig.experiment.errors import ExperimentError, LimitError
from rig.experiment.plan import TRIP_MARGIN
from rig.experiment.sweep import pressures_kpa, reach_top
from rig.link.client import RigLink
from rig.link.errors import CommandRefusedError, LinkError
from rig.link.faults import HINTS
from rig.link.schema import load_schema
from rig.spec.actuator import ActuatorSpec
from rig.spec.bench import BenchSpec
from rig.spec.calibration import SyringeCalibration, TransducerCalibration
from rig.spec.protocol import SweepProtocol
from rig.spec.workspace import Setup

HOMING_TIMEOUT_S = 60.0
VENT_TIMEOUT_S = 60.0
FAULT_VENT_S = 30.0
OFF_HOME_ML_S = 3.0
OFF_HOME_S = 1.0
"""A jog ends by itself after half a second; the rest is for the gas to come to rest."""
ZERO_TIMEOUT_S = 10.0
VENTED_READING_S = 0.5
TARE_TIMEOUT_S = 30.0

BENCH_FIELDS: dict[str, str] = {
    "proportional_ml_s_kpa": "controller.proportional",
    "integral_ml_s2_kpa": "controller.integral",
    "feed_forward": "controller.feed_forward",
    "deadband_kpa": "controller.deadband",
    "max_flow_ml_s": "controller.max_flow",
    "max_flow_acceleration_ml_s2": "controller.max_flow_acceleration",
    "setpoint_rate_kpa_s": "controller.setpoint_rate",
    "syringe_volume_ml": "syringe.volume",
    "volume_per_step_ul": "syringe.inner_diameter, lead_screw.lead, stepper.microsteps and "
    "syringe.calibration",
    "system_volume_ml": "syringe.volume, syringe.dead_volume and tubing.length",
    "ambient_pressure_kpa": "ambient.pressure",
    "transducer_gain_kpa_v": "transducer.calibration",
    "transducer_offset_v": "transducer.calibration",
    "adc_reference_v": "adc.reference",
    "pressure_limit_kpa": "safety.pressure and transducer.pressure_high",
    "communication_timeout_s": "safety.communication_timeout",
}
"""Where in the bench spec each parameter of the board comes from."""


def board_parameters(
    bench: BenchSpec,
    actuator: ActuatorSpec,
    transducer: TransducerCalibration,
    cavity_volume: float,
    syringe: SyringeCalibration | None = None,
) -> dict[str, float]:
    """Parameters to write to the board, by schema name in the unit of the name.

    `cavity_volume` of the actuator in m3 enters the feed-forward only.
    """
    limit = TRIP_MARGIN * actuator.limits.pressure
    return bench_parameters(bench, transducer, syringe, cavity_volume, limit)


def bench_parameters(
    bench: BenchSpec,
    transducer: TransducerCalibration,
    drive: SyringeCalibration | None,
    cavity_volume: float,
    pressure_limit: float = math.inf,
) -> dict[str, float]:
    """As `board_parameters`, with whatever is at the tube's end: it stands `pressure_limit` in Pa.

    Without a calibration of the `drive` it is taken as drawn.
    """
    syringe, tube = bench.syringe, bench.tubing
    dead_volume = syringe.dead_volume if drive is None else drive.dead_volume
    per_step = bench.volume_per_step if drive is None else 1e-6 / drive.steps_per_ml
    system = syringe.volume + dead_volume + tube.volume + cavity_volume
    max_flow = min(bench.controller.max_flow, bench.stepper.max_step_rate * per_step)
    controller = bench.controller
    return {
        "proportional_ml_s_kpa": controller.proportional * 1e9,
        "integral_ml_s2_kpa": controller.integral * 1e9,
        "feed_forward": controller.feed_forward,
        "deadband_kpa": controller.deadband / 1e3,
        "max_flow_ml_s": max_flow * 1e6,
        "max_flow_acceleration_ml_s2": controller.max_flow_acceleration * 1e6,
        "setpoint_rate_kpa_s": controller.setpoint_rate / 1e3,
        "syringe_volume_ml": syringe.volume * 1e6,
        "volume_per_step_ul": per_step * 1e9,
        "system_volume_ml": system * 1e6,
        "ambient_pressure_kpa": bench.ambient.pressure / 1e3,
        "transducer_gain_kpa_v": transducer.gain / 1e3,
        "transducer_offset_v": transducer.offset_voltage,
        "adc_reference_v": bench.adc.reference,
        "pressure_limit_kpa": min(
            bench.safety.pressure,
            bench.transducer.pressure_high,
            pressure_limit,
        )
        / 1e3,
        "communication_timeout_s": bench.safety.communication_timeout,
    }


def require_board_takes(parameters: Mapping[str, float]) -> None:
    """Raise LimitError that names every bench field with a value the board would refuse."""
    rules = load_schema().parameters
    problems = [
        f"{BENCH_FIELDS[name]}: it makes the board's {name} {value:g}; the board takes "
        f"{rules[name].low:g} to {rules[name].high:g}"
        for name, value in parameters.items()
        if not rules[name].low <= value <= rules[name].high
    ]
    if problems:
        raise LimitError(
            "the bench asks for what the board refuses; nothing was moved.\n" + "\n".join(problems)
        )


def parameters_for(setup: Setup, cavity_volume: float) -> dict[str, float]:
    """`board_parameters` of a set-up; raises LimitError for what the board would refuse."""
    calibrations = setup.calibrations
    parameters = board_parameters(
        setup.bench, setup.actuator, calibrations.transducer, cavity_volume, calibrations.syringe
    )
    require_board_takes(parameters)
    return parameters


def write_parameters(link: RigLink, wanted: dict[str, float]) -> dict[str, float]:
    """Write and read back; returns all parameters in force on the board.

    Raises CommandRefusedError that names the parameter and the bench field it comes from.
    """
    for name, value in wanted.items():
        try:
            link.write_parameter(name, value)
        except CommandRefusedError as error:
            raise CommandRefusedError(
                f"{error} In the bench spec it is {BENCH_FIELDS[name]}."
            ) from error
    return {name: link.read_parameter(name) for name in link.parameter_names}


def take_over(link: RigLink) -> None:
    """From any state to one in which parameters may be written: no fault, plunger at rest.

    After a killed run the board has vented by itself and holds a fault; it is cleared once the
    plunger has come home. Raises CommandRefusedError if the cause of a fault still stands.
    """
    link.raise_faults(False)
    end_s = link.now_s + FAULT_VENT_S
    while link.status is not None and link.status.fault != "none":
        try:
            link.command("clear_fault")
        except CommandRefusedError as error:
            if link.now_s > end_s:
                code = link.status.fault
                raise CommandRefusedError(
                    f"the board holds the fault '{code}' and does not let it be cleared: "
                    f"{HINTS.get(code, '')} ({error})"
                ) from error
            link.wait(1.0)
    if link.status is not None and link.status.state not in ("idle", "boot"):
        vent(link)
    link.raise_faults(True)


def make_ready(link: RigLink) -> None:
    """From idle to homed, vented, and zeroed at ambient pressure."""
    link.command("home")
    link.await_state("idle", HOMING_TIMEOUT_S)
    link.command("zero_pressure")
    _await_flag(link, "zeroed", ZERO_TIMEOUT_S, "check that the valve opens to ambient")


def tare(link: RigLink) -> None:
    """Tare the load cell; nothing may touch it meanwhile."""
    link.command("tare")
    _await_flag(link, "tared", TARE_TIMEOUT_S, "check the load cell and its HX711")


def leave_home(link: RigLink) -> None:
    """Push the plunger a little off its home switch while the valve is open.

    From home it cannot pull: a pressure slightly above 0 kPa could then not be regulated away.
    """
    link.command("jog", OFF_HOME_ML_S)
    link.wait(OFF_HOME_S)


def condition(link: RigLink, section: SweepProtocol) -> None:
    """Cycles to the top pressure and back, against first-cycle effects of the elastomer."""
    for _ in range(section.conditioning):
        reach_top(link, section)
        vent(link)


def vent(link: RigLink) -> None:
    """Open the valve, bring the plunger home, and wait until the board is idle."""
    link.expect_state(None)
    link.command("vent")
    link.await_state("idle", VENT_TIMEOUT_S)


def vented_pressure_kpa(link: RigLink) -> float:
    """What the transducer reads while the valve is open; raises ExperimentError if nothing."""
    readings = pressures_kpa(link.wait(VENTED_READING_S))
    if len(readings) == 0:
        raise ExperimentError("no pressure telemetry came from the vented bench; check the link.")
    return float(readings.mean())


def make_safe(link: RigLink) -> str:
    """Vent whatever happened before; returns a sentence about how that went.

    Used on the way out of a failed run, so it reports instead of raising; a person who will not
    wait for it is told what happens then.
    """
    link.ignore_interruptions()
    link.raise_faults(False)
    link.expect_state(None)
    try:
        if link.status is not None and link.status.state == "fault":
            return _watch_fault_vent(link)
        vent(link)
    except LinkError as error:
        return f"The bench could not be vented from here ({error}) Vent it by hand."
    except KeyboardInterrupt:
        return "Venting was interrupted; the board's own watchdog vents when it hears nothing."
    return "The bench was vented and the plunger is home."


def _watch_fault_vent(link: RigLink) -> str:
    """On a fault the board vents by itself; stay until the plunger is home, or for a while."""
    end_s = link.now_s + FAULT_VENT_S
    while link.now_s < end_s:
        link.receive()
        if link.status is not None and link.status.home_switch:
            return "The board vented by itself, its plunger is home, and it holds its fault."
    return "The board has opened its valve and holds its fault; the plunger is not home."


def _await_flag(link: RigLink, flag: str, timeout_s: float, hint: str) -> None:
    # the heartbeat that acknowledged the command may precede the end of the action
    end_s = link.now_s + timeout_s
    while link.now_s < end_s:
        link.receive()
        if link.status is not None and getattr(link.status, flag):
            return
    raise ExperimentError(f"the board was not {flag} within {timeout_s:g} s; {hint}.")
