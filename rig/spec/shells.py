"""Geometry of actuators with one round chamber in a soft core inside a slit shell (Agarwal et al.).

The paper gives an outer diameter of 4 mm with a wall of 2 mm, which leaves no chamber: the 4 mm are
taken as the chamber's. What it prints beside that are 40 mm of length, the slits' numbers and
widths, and that those at the ends are half as wide. All other values are ours.
"""

from __future__ import annotations

from math import pi
from typing import Literal

from pydantic import Field, model_validator

from rig.spec.base import Count, require
from rig.spec.geometry import ActuatorGeometry
from rig.spec.quantity import Length, Modulus, Ratio


class _ShellReinforcedGeometry(ActuatorGeometry):
    """A soft tube with solid ends inside a stiff shell that slides on it; lengths in metres."""

    total_length: Length = Field(0.040, gt=0, description="of the soft core, solid ends included")
    chamber_diameter: Length = Field(
        0.004, gt=0, description="printed as the outer diameter, which a wall of 2 mm excludes"
    )
    wall_thickness: Length = Field(0.002, gt=0, description="t, of the core round the chamber")
    end_length: Length = Field(
        0.002, gt=0, description="solid at either end, gripped; our choice, as thick as the wall"
    )
    end_cap_thickness: Length = Field(
        0.002, gt=0, description="rigid, over the gripped end at the tip; our choice"
    )
    shell_thickness: Length = Field(
        0.0001, gt=0, description="our choice: a transparency film of polyester"
    )
    shell_modulus: Modulus = Field(
        3e9, gt=0, description="Young's modulus of the shell; our choice, a film of polyester"
    )
    shell_poisson_ratio: Ratio = Field(
        0.38, ge=0, lt=0.5, description="of the shell; our choice, a film of polyester"
    )
    friction: Ratio = Field(
        0.3,
        ge=0,
        le=1,
        description="Coulomb's coefficient, core on shell; our choice: the paper says only that "
        "one is specified",
    )

    slit_number: Count = Field(description="of full width; half ones at both ends")
    slit_width: Length = Field(description="along the axis")

    @property
    def chamber_length(self) -> float:
        """Between the solid ends in metres; what the shell and its slits span."""
        return self.total_length - 2 * self.end_length

    @property
    def cavity_radius(self) -> float:
        """Of the chamber in metres."""
        return self.chamber_diameter / 2

    @property
    def core_radius(self) -> float:
        """Outside of the core, inside of the shell, in metres."""
        return self.cavity_radius + self.wall_thickness

    @property
    def ring_width(self) -> float:
        """Of the shell between two slits in metres: two slits more, at the ends, are half as
        wide."""
        return (self.chamber_length - (self.slit_number + 1) * self.slit_width) / (
            self.slit_number + 1
        )

    @model_validator(mode="after")
    def _has_rings(self) -> _ShellReinforcedGeometry:
        problems = []
        if self.chamber_length <= 0:
            problems.append(
                f"the solid ends leave no chamber: end_length = {1e3 * self.end_length:.3g} mm "
                f"must be below half of total_length = {1e3 * self.total_length:.3g} mm"
            )
        elif self.ring_width <= self.shell_thickness:
            room = 1e3 * self.chamber_length / (self.slit_number + 1)
            problems.append(
                f"the slits leave no rings: slit_width = {1e3 * self.slit_width:.3g} mm must be "
                f"below {room - 1e3 * self.shell_thickness:.3g} mm, the pitch of {room:.3g} mm "
                f"less the shell's thickness; reduce slit_width or slit_number"
            )
        require(not problems, "; ".join(problems))
        return self


class ShellReinforcedBendingGeometry(_ShellReinforcedGeometry):
    """Slits all round but for a strip below, which is bonded to the core; lengths in metres."""

    deformation = "bending"
    family: Literal["shell-reinforced-bending"] = Field(description="which geometry this is")
    slit_number: Count = Field(7, le=200, description="of full width; half ones at both ends")
    slit_width: Length = Field(0.001, gt=0, description="the paper's cut spacing")
    strip_width: Length = Field(
        0.002, gt=0, description="of the bonded strip, round the core; our choice: thin"
    )

    @model_validator(mode="after")
    def _strip_leaves_slits(self) -> ShellReinforcedBendingGeometry:
        most = pi * self.core_radius
        require(
            self.strip_width < most,
            f"the strip leaves no slits: strip_width = {1e3 * self.strip_width:.3g} mm must be "
            f"below half the core's circumference, {1e3 * most:.3g} mm",
        )
        return self


class ShellReinforcedLinearGeometry(_ShellReinforcedGeometry):
    """Slits interrupted by two bridges each, a quarter turn further from slit to slit; metres.

    The paper's pattern is in a figure only: two symmetric halves, glued to each other. Bridges that
    lay in a line would keep their length; those of neighbouring slits alternate here, so that the
    rings between them give way.
    """

    deformation = "elongation"
    family: Literal["shell-reinforced-linear"] = Field(description="which geometry this is")
    slit_number: Count = Field(13, le=200, description="of full width; half ones at both ends")
    slit_width: Length = Field(0.0005, gt=0, description="the paper's cut spacing")
    bridge_width: Length = Field(
        0.001, gt=0, description="of either bridge across a slit, round the core; our choice"
    )

    @model_validator(mode="after")
    def _bridges_leave_slits(self) -> ShellReinforcedLinearGeometry:
        most = pi * self.core_radius / 2
        require(
            self.bridge_width < most,
            f"the bridges leave no slits: bridge_width = {1e3 * self.bridge_width:.3g} mm must be "
            f"below a quarter of the core's circumference, {1e3 * most:.3g} mm",
        )
        return self


ShellReinforcedGeometry = ShellReinforcedBendingGeometry | ShellReinforcedLinearGeometry
