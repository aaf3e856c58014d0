"""What makes a length, a curvature or an angle from a picture uncertain, source by source.

With the relative error s of the scale, the lean e of the ruler's leg and the turn t of directions
by the lens, each with what the picture says that it does to the value v that was read,

    result = v + scale s + shear e + lens t + marks + pixel + scatter.

The scale is that of the ruler's pitch, and that of a thing which stands z before the ruler's plane
at the distance d of the camera: z / d.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rig.spec.calibration import CameraCalibration, RulerCalibration
from rig.validate.uncertainty import Component
from rig.vision.parts import SeenParts


@dataclass(frozen=True)
class Picturing:
    """What pictures are taken with."""

    camera: CameraCalibration
    ruler: RulerCalibration
    out_of_plane_u_mm: float
    """Standard uncertainty of how far before or behind the ruler's plane the measured thing is."""

    def components(self, seen: SeenParts, unit: str) -> tuple[Component, ...]:
        """The budget of what was read, in its `unit`."""
        pitch_u = self.ruler.pitch_u / self.ruler.pitch
        lean_u, turn_u = self.ruler.squareness_u_deg, self.camera.angle_u_deg
        return (
            Component("scatter", seen.scatter_u, seen.scatter_dof, unit=unit, kind="A"),
            Component("ruler marks", seen.marks_u, seen.marks_dof, unit=unit, kind="A"),
            Component("place in the pixel", seen.pixel_u, unit=unit),
            Component("lens", math.radians(turn_u), sensitivity=seen.lens, unit="rad"),
            Component("ruler pitch", pitch_u, sensitivity=seen.scale, unit="1"),
            Component("ruler squareness", math.radians(lean_u), sensitivity=seen.shear, unit="rad"),
            Component(
                "distance from the ruler's plane",
                self.out_of_plane_u_mm,
                sensitivity=seen.scale / seen.distance_mm,
                unit="mm",
            ),
        )
