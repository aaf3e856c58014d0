"""Movements of the plunger that make a pressure system show its dynamics.

Every excitation is a list of flows with durations; the plunger comes back to where it began. The
pseudo-random one is a maximum-length sequence (Soderstrom and Stoica, System Identification, 1989,
section 5.3) of the plunger's position, not of its flow: so it stays within one amplitude.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scipy.signal import max_len_seq

from rig.control.errors import ControlError

GRID_S = 0.02
"""Durations are whole multiples of this: the interval of the board's pressure telemetry."""
CLOCK_STROKES = 2
"""Length of a bit of the pseudo-random sequence, in strokes: half of it is rest."""


@dataclass(frozen=True)
class Segment:
    """A constant flow of the plunger for a while."""

    duration_s: float
    flow_ml_s: float


@dataclass(frozen=True)
class Stroke:
    """A quick move of the plunger by `volume_ml` that the drive can follow exactly."""

    volume_ml: float
    duration_s: float

    @property
    def flow_ml_s(self) -> float:
        """Commanded flow while it lasts."""
        return self.volume_ml / self.duration_s

    @property
    def clock_s(self) -> float:
        """Length of a bit of the pseudo-random sequence."""
        return CLOCK_STROKES * self.duration_s


def fastest_stroke(volume_ml: float, max_flow_ml_s: float, acceleration_ml_s2: float) -> Stroke:
    """The shortest move by `volume_ml` whose flow the drive reaches before it has to brake.

    A commanded pulse then sweeps exactly its flow times its duration, whatever the acceleration.
    Raises ControlError for a volume, flow or acceleration that is not positive.
    """
    if min(volume_ml, max_flow_ml_s, acceleration_ml_s2) <= 0:
        raise ControlError(
            f"a stroke needs positive volume, flow and acceleration; there are {volume_ml:g} mL, "
            f"{max_flow_ml_s:g} mL/s and {acceleration_ml_s2:g} mL/s2."
        )
    shortest = max(volume_ml / max_flow_ml_s, math.sqrt(volume_ml / acceleration_ml_s2))
    return Stroke(volume_ml, math.ceil(shortest / GRID_S - 1e-9) * GRID_S)


def step(stroke: Stroke, rest_s: float) -> list[Segment]:
    """Twice the stroke in, rest, out again, rest."""
    doubled = 2 * stroke.duration_s
    return [
        Segment(doubled, stroke.flow_ml_s),
        Segment(rest_s, 0.0),
        Segment(doubled, -stroke.flow_ml_s),
        Segment(rest_s, 0.0),
    ]


def ramp(stroke: Stroke, slowness: float, rest_s: float) -> list[Segment]:
    """Twice the stroke at its flow over `slowness`, rest, and back."""
    duration_s = 2 * slowness * stroke.duration_s
    flow = stroke.flow_ml_s / slowness
    return [
        Segment(duration_s, flow),
        Segment(rest_s, 0.0),
        Segment(duration_s, -flow),
        Segment(rest_s, 0.0),
    ]


def pseudo_random(stroke: Stroke, bits: int, seed: int) -> list[Segment]:
    """The plunger out or in by one stroke after a maximum-length sequence of 2**bits - 1 values.

    `seed` says where the sequence begins. Raises ControlError for fewer than 3 or more than 12
    bits.
    """
    if not 3 <= bits <= 12:
        raise ControlError(
            f"a pseudo-random sequence of {bits} bits was asked for; expected 3 to 12 (7 last "
            f"{127 * stroke.clock_s:.0f} s)."
        )
    length = 2**bits - 1
    state = [(1 + seed % length) >> bit & 1 for bit in range(bits)]
    sequence, _ = max_len_seq(bits, state=state)
    return _toggled([*(int(value) for value in sequence), 0], stroke)


def _toggled(positions: Sequence[int], stroke: Stroke) -> list[Segment]:
    """Flows that bring the plunger to each position (0 or 1) at the beginning of its bit."""
    segments = []
    rest_s = stroke.clock_s - stroke.duration_s
    before = 0
    for position in positions:
        flow = (position - before) * stroke.flow_ml_s
        segments += [Segment(stroke.duration_s, flow), Segment(rest_s, 0.0)]
        before = position
    return segments


def duration_s(segments: Sequence[Segment]) -> float:
    """Duration of a list of segments."""
    return sum(segment.duration_s for segment in segments)
