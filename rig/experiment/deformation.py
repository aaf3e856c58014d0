"""What the camera measures of an actuator whose tip is free, in one frame or in many.

One that bends is measured by the edges of its rigid parts, frame by frame. One that lengthens
carries two markers, and is measured against a frame of its own at rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

from rig.experiment.errors import ExperimentError
from rig.spec.measurand import MEASURANDS, Measurand
from rig.spec.workspace import BenchCalibrations, Setup
from rig.validate.picture_budget import Picturing
from rig.validate.uncertainty import Component, combine
from rig.vision.displacement import DisplacementMeasurement, DisplacementMeter
from rig.vision.errors import UntrustedFrameError
from rig.vision.measure import AngleMeasurement, AngleMeter
from rig.vision.overlay import COVERAGE_FACTOR, draw_displacement, draw_overlay, draw_rejected
from rig.vision.segment import UNREADABLE, Image, decoded

FLAG_PLANE_U_MM = 1.0
"""Standard uncertainty of how far before or behind the ruler's plane the markers are: glued to
parts that hang in that plane."""
MAX_U_MM = 1.0
"""Standard uncertainty from which an elongation is no measurement."""


@dataclass(frozen=True)
class Sight:
    """What one frame tells."""

    value: float | None
    """In the unit of the measurand; None if the frame cannot be trusted."""
    parts: tuple[Component, ...]
    """Budget of the value, common to all frames of a still scene; empty when rejected."""
    quality: float
    """0 to 1; 0 when rejected."""
    reason: str
    """Why it was rejected; empty when accepted."""

    @property
    def accepted(self) -> bool:
        """Whether there is a value."""
        return self.value is not None

    @property
    def u(self) -> float:
        """Combined standard uncertainty."""
        return combine(0.0, self.parts).u


def rejected(reason: str) -> Sight:
    """A frame that tells nothing."""
    return Sight(None, (), 0.0, reason)


class DeformationMeter(Protocol):
    """Measures one actuator on one set-up."""

    @property
    def measurand(self) -> Measurand:
        """What it measures, and in which unit."""
        ...

    def see(self, image: Image) -> Sight:
        """What a frame (h, w, 3) shows; raises VisionError for what is no picture of the camera."""
        ...

    def drawn(self, image: Image) -> tuple[Sight, Image]:
        """The same, and a copy of the frame with what was measured drawn on it."""
        ...


@dataclass(frozen=True)
class BendingMeter:
    """The angle between connector and end cap."""

    meter: AngleMeter
    measurand: Measurand = MEASURANDS["bending"]

    def see(self, image: Image) -> Sight:
        """What a frame shows."""
        return self._sight(self.meter.measure(image))

    def drawn(self, image: Image) -> tuple[Sight, Image]:
        """The same with edges and angle."""
        found = self.meter.measure(image)
        return self._sight(found), draw_overlay(image, found)

    def _sight(self, found: AngleMeasurement) -> Sight:
        if found.angle_deg is None:
            return rejected(found.reason)
        camera = self.meter.camera
        lens = min(camera.angle_u_deg if camera else 0.0, found.u_deg)
        parts = (
            Component("edges and ruler", math.sqrt(found.u_deg**2 - lens**2), unit="deg"),
            Component("lens", lens, unit="deg"),
        )
        return Sight(found.angle_deg, parts, found.quality, "")


@dataclass(frozen=True)
class ElongationMeter:
    """How far the marker below the cap has moved from that on the connector since rest."""

    meter: DisplacementMeter
    picturing: Picturing
    measurand: Measurand = MEASURANDS["elongation"]

    @classmethod
    def at_rest(cls, image: Image, calibrations: BenchCalibrations) -> ElongationMeter:
        """The meter whose zero is this frame; raises UntrustedFrameError or VisionError."""
        camera, ruler = calibrations.camera, calibrations.ruler
        return cls(
            DisplacementMeter.at_rest(image, camera, ruler),
            Picturing(camera, ruler, FLAG_PLANE_U_MM),
        )

    def see(self, image: Image) -> Sight:
        """What a frame shows."""
        return self._sight(self.meter.measure(image))

    def drawn(self, image: Image) -> tuple[Sight, Image]:
        """The same with markers and elongation."""
        found = self.meter.measure(image)
        sight = self._sight(found)
        if sight.value is None:
            return sight, draw_rejected(image, sight.reason, found.geometry)
        words = f"{sight.value:.2f} +- {COVERAGE_FACTOR * sight.u:.2f} mm"
        return sight, draw_displacement(image, found.geometry, words)

    def _sight(self, found: DisplacementMeasurement) -> Sight:
        if found.displacement_mm is None or found.parts is None:
            return rejected(found.reason)
        parts = self.picturing.components(found.parts, self.measurand.unit)
        u = combine(0.0, parts).u
        if u > MAX_U_MM:
            return rejected(f"the elongation would be uncertain by {u:.1f} mm")
        return Sight(found.displacement_mm, parts, 1 - u / MAX_U_MM, "")


@dataclass
class LiveElongationMeter:
    """Takes the first frame that can be trusted for the one at rest: for people who watch."""

    calibrations: BenchCalibrations
    measurand: Measurand = MEASURANDS["elongation"]
    _meter: ElongationMeter | None = field(default=None, init=False)

    def see(self, image: Image) -> Sight:
        """What a frame shows."""
        return self.drawn(image)[0]

    def drawn(self, image: Image) -> tuple[Sight, Image]:
        """The same with markers and elongation."""
        if self._meter is None:
            try:
                self._meter = ElongationMeter.at_rest(image, self.calibrations)
            except UntrustedFrameError as why:
                return rejected(str(why)), draw_rejected(image, str(why))
        return self._meter.drawn(image)


def needs_rest(setup: Setup) -> bool:
    """Whether the actuator is measured against a frame of its own at rest."""
    return setup.actuator.geometry.deformation == "elongation"


def live_meter(setup: Setup) -> DeformationMeter:
    """For people who watch: nobody has said which frame shows rest."""
    if needs_rest(setup):
        return LiveElongationMeter(setup.calibrations)
    return bending_meter(setup)


def recorded_meter(setup: Setup, rest_jpeg: bytes | None) -> DeformationMeter:
    """The meter of a run, with the frame at rest that it recorded.

    Raises ExperimentError where it needs one and there is none that can be trusted.
    """
    if not needs_rest(setup):
        return bending_meter(setup)
    image = None if rest_jpeg is None else decoded(rest_jpeg)
    why = "there is none" if rest_jpeg is None else UNREADABLE
    if image is not None:
        try:
            return ElongationMeter.at_rest(image, setup.calibrations)
        except UntrustedFrameError as error:
            why = str(error)
    raise ExperimentError(
        f"the frame at rest, from which elongations count, cannot be used: {why}. Both markers and "
        "the ruler must be in view, in focus; `rig measure --quantity displacement` on a frame "
        "tells more."
    )


def bending_meter(setup: Setup) -> BendingMeter:
    """The meter of an actuator that bends."""
    return BendingMeter(AngleMeter(setup.calibrations.camera, setup.calibrations.ruler))
