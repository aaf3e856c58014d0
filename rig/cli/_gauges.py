"""What `rig measure` can measure in frames: angle, displacement, backbone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count
from typing import Protocol

from rig.validate.picture_budget import Picturing
from rig.validate.uncertainty import Component, combine
from rig.vision.backbone import fit_backbone
from rig.vision.displacement import DisplacementTracker
from rig.vision.errors import UntrustedFrameError
from rig.vision.footage import Frame
from rig.vision.marker_angle import MarkerAngleMeter
from rig.vision.measure import AngleMeasurement, AngleMeter
from rig.vision.overlay import COVERAGE_FACTOR, draw_overlay
from rig.vision.segment import Image
from rig.vision.table import ANGLE, BACKBONE, DISPLACEMENT, Column


@dataclass(frozen=True)
class Reading:
    """What one frame gave."""

    values: tuple[float | None, ...]
    """By the gauge's columns."""
    accepted: bool
    reason: str
    budgets: dict[str, tuple[Component, ...]] = field(default_factory=dict)
    """Of the quantities, by the name of their column."""
    overlay: Image | None = None


Read = Callable[[Frame], Reading]


class Gauge(Protocol):
    """Reads one quantity, or what belongs together, from frames."""

    @property
    def columns(self) -> tuple[Column, ...]:
        """What `Reading.values` are."""
        ...

    def film(self) -> Read:
        """What reads the frames of a film, or a series of stills, in order; raises VisionError."""
        ...


@dataclass(frozen=True)
class AngleGauge:
    """The bending angle; with `track` films are followed."""

    meter: AngleMeter
    track: bool
    overlay: bool
    columns: tuple[Column, ...] = ANGLE

    def film(self) -> Read:
        """Stills are measured one by one, even where films are followed."""
        if not self.track:
            return lambda frame: self._read(frame, self.meter.measure(frame.image))
        from rig.vision.track import AngleTracker  # imports slowly

        tracker = AngleTracker(self.meter)

        def read(frame: Frame) -> Reading:
            if frame.time_s is None:
                return self._read(frame, self.meter.measure(frame.image))
            return self._read(frame, tracker.measure(frame.image, frame.time_s).measurement)

        return read

    def _read(self, frame: Frame, found: AngleMeasurement) -> Reading:
        return _angle_reading(frame, found, self.overlay)


@dataclass(frozen=True)
class MarkerAngleGauge:
    """The bending angle between two markers."""

    meter: MarkerAngleMeter
    overlay: bool
    columns: tuple[Column, ...] = ANGLE

    def film(self) -> Read:
        """No frame needs another one."""
        return lambda frame: _angle_reading(frame, self.meter.measure(frame.image), self.overlay)


def _angle_reading(frame: Frame, found: AngleMeasurement, overlay: bool) -> Reading:
    u95 = COVERAGE_FACTOR * found.u_deg if found.accepted else None
    return Reading(
        (found.angle_deg, u95, found.quality),
        found.accepted,
        found.reason,
        overlay=draw_overlay(frame.image, found) if overlay else None,
    )


@dataclass(frozen=True)
class DisplacementGauge:
    """The displacement between the markers `fixed` and `moving` since the first frame of a film."""

    picturing: Picturing
    fixed: int
    moving: int
    columns: tuple[Column, ...] = DISPLACEMENT

    def film(self) -> Read:
        """Stills have no clock: they are taken for seconds apart, and so never for a jump."""
        seconds = count()
        tracker = DisplacementTracker(
            self.picturing.camera, self.picturing.ruler, self.fixed, self.moving
        )

        def read(frame: Frame) -> Reading:
            time_s = float(next(seconds)) if frame.time_s is None else frame.time_s
            found = tracker.measure(frame.image, time_s)
            if found.displacement_mm is None or found.parts is None:
                return Reading((None, None), False, found.reason)
            lines = self.picturing.components(found.parts, "mm")
            estimate = combine(found.displacement_mm, lines)
            return Reading(
                (estimate.value, estimate.u95), True, "", budgets={"displacement_mm": lines}
            )

        return read


@dataclass(frozen=True)
class BackboneGauge:
    """Radius, angle and roundness of the free edge of the flat layer."""

    meter: AngleMeter
    picturing: Picturing
    columns: tuple[Column, ...] = BACKBONE

    def film(self) -> Read:
        """Every frame for itself."""
        return self._read

    def _read(self, frame: Frame) -> Reading:
        nothing = (None,) * len(self.columns)
        angle = self.meter.measure(frame.image)
        if angle.sighting is None:
            why = angle.reason or "the frame is sharp at half its size only: no edge of the body"
            return Reading(nothing, False, why)
        try:
            found = fit_backbone(frame.image, angle.sighting)
        except UntrustedFrameError as why:
            return Reading(nothing, False, str(why))
        turn_lines = self.picturing.components(found.angle_parts, "deg")
        bend_lines = self.picturing.components(found.curvature_parts, "1/mm")
        turn = combine(found.angle_deg, turn_lines)
        bend = combine(found.curvature_per_mm, bend_lines)
        residual_u95 = combine(
            found.residual_mm,
            [Component("scatter", found.residual_u_mm, found.residual_dof, kind="A")],
        ).u95
        # where the interval of the curvature holds zero that of the radius has no end
        curved = bend.u95 < bend.value
        return Reading(
            (
                turn.value,
                turn.u95,
                found.radius_mm if curved else None,
                bend.u95 * found.radius_mm**2 if curved else None,
                1e3 * bend.value,
                1e3 * bend.u95,
                found.residual_mm,
                residual_u95,
            ),
            True,
            "",
            budgets={"bend_angle_deg": turn_lines, "curvature_per_mm": bend_lines},
        )
