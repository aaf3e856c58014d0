"""Geometry of actuators that are a row of rectangular chambers: bellows and cast blocks.

Cross sections are rectangles, x runs along the row, z up from the layer that does not stretch.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import Field, model_validator

from rig.spec.base import Count, SpecModel, require
from rig.spec.geometry import ActuatorGeometry
from rig.spec.quantity import Length, Modulus


class BellowGroup(SpecModel):
    """Bellows of one length, each followed by its spacer; lengths in metres."""

    bellow_number: Count = Field(le=200, description="bellows in a row")
    bellow_length: Length = Field(gt=0, description="inside, between the two faces")
    spacer_length: Length = Field(gt=0, description="between the faces of neighbours")


class BellowRectangularGeometry(ActuatorGeometry):
    """Rectangular bellows on a strain-limiting layer (Yin et al., Table I); lengths in metres.

    The table swaps wall and face; its caption has the face at 1.2 mm, the thinnest. Its lengths
    settle the rest: N bellows, N + 1 spacers, two faces a bellow and 18 mm for both ends give the
    printed 134.6 mm (5 and 5 mm, N = 9) and 133.4 mm (1 and 1 mm, N = 26) to the digit, and with
    2 and 2 mm the 77.6 mm of the original. The paper says nothing of the spacers' section: by
    default half the bellow's, on the strain-limiting layer.
    """

    deformation = "bending"
    family: Literal["bellow-rectangular"] = Field(description="which geometry this is")
    bellow_number: Count = Field(9, le=200, description="N")
    bellow_length: Length = Field(0.005, gt=0, description="inside, between the two faces")
    spacer_length: Length = Field(0.005, gt=0, description="between the faces of neighbours")
    further_groups: tuple[BellowGroup, ...] = Field(
        (), description="hybrids: bellows of other lengths that follow, towards the tip"
    )
    bellow_height: Length = Field(0.018, gt=0, description="outside, with strain-limiting layer")
    bellow_width: Length = Field(0.018, gt=0, description="outside")
    wall_thickness: Length = Field(0.002, gt=0, description="of top, sides and spacers")
    face_thickness: Length = Field(0.0012, gt=0, description="of the faces, which bulge")
    strain_limiting_thickness: Length = Field(0.001, gt=0, description="of the layer below")
    spacer_height: Length = Field(0.009, gt=0, description="outside; the paper does not say")
    spacer_width: Length = Field(0.009, gt=0, description="outside; the paper does not say")
    end_length: Length = Field(
        0.009, gt=0, description="plug and connector at either end, half of 18 mm"
    )

    @property
    def cavity_radius(self) -> float:
        """Half of the chamber's larger side in metres."""
        height = self.bellow_height - self.wall_thickness - self.strain_limiting_thickness
        return max(height, self.bellow_width - 2 * self.wall_thickness) / 2

    def groups(self) -> Iterator[BellowGroup]:
        """All groups of bellows, from the connector to the tip."""
        yield BellowGroup.model_construct(  # of checked values, which are in metres already
            bellow_number=self.bellow_number,
            bellow_length=self.bellow_length,
            spacer_length=self.spacer_length,
        )
        yield from self.further_groups

    @model_validator(mode="after")
    def _has_room_inside(self) -> BellowRectangularGeometry:
        t, layer = self.wall_thickness, self.strain_limiting_thickness
        problems = [
            f"the {name} leave no channel: {what} = {1e3 * size:.3g} mm must be above "
            f"{1e3 * least:.3g} mm, {why}; increase {what} or reduce wall_thickness"
            for name, what, size, least, why in (
                ("spacers", "spacer_height", self.spacer_height, t + layer, "wall and layer"),
                ("spacers", "spacer_width", self.spacer_width, 2 * t, "two walls"),
            )
            if size <= least * (1 + 1e-9)
        ]
        problems += [
            f"the faces have no room: {bellow} = {1e3 * size:.3g} mm must be above {spacer} = "
            f"{1e3 * neck:.3g} mm; increase {bellow} or reduce {spacer}"
            for bellow, size, spacer, neck in (
                ("bellow_height", self.bellow_height, "spacer_height", self.spacer_height),
                ("bellow_width", self.bellow_width, "spacer_width", self.spacer_width),
            )
            if size <= neck * (1 + 1e-9)
        ]
        if self.end_length <= t * (1 + 1e-9):
            problems.append(
                f"the ends are thinner than their soft wall: end_length = "
                f"{1e3 * self.end_length:.3g} mm must be above wall_thickness = {1e3 * t:.3g} mm"
            )
        require(not problems, "; ".join(problems))
        return self


class _MultiChamberGeometry(ActuatorGeometry):
    """Chambers in a cast block, one wall thickness around and between them (Agarwal et al.).

    The design tool's arguments are `--chamber 8 8 2 --wall 7`: height, width and length of a
    chamber and the wall. The passages' section is not printed.
    """

    chamber_number: Count = Field(4, le=200, description="chambers in a row")
    chamber_height: Length = Field(0.008, gt=0, description="inner, square to the layer")
    chamber_width: Length = Field(0.008, gt=0, description="inner, across the actuator")
    chamber_length: Length = Field(0.002, gt=0, description="along the row")
    wall_thickness: Length = Field(0.007, gt=0, description="around and between chambers")
    passage_height: Length = Field(0.002, gt=0, description="our choice: the paper does not say")
    passage_width: Length = Field(0.002, gt=0, description="our choice: the paper does not say")
    end_cap_thickness: Length = Field(
        0.002, gt=0, description="rigid, at the tip; our choice, as the fixture of the tests"
    )

    @property
    def cavity_radius(self) -> float:
        """Half of the chamber's larger side in metres."""
        return max(self.chamber_height, self.chamber_width) / 2

    @model_validator(mode="after")
    def _passages_fit(self) -> _MultiChamberGeometry:
        problems = [
            f"the passages are larger than the chambers: {passage} = {1e3 * inner:.3g} mm must be "
            f"below {chamber} = {1e3 * outer:.3g} mm"
            for passage, inner, chamber, outer in (
                ("passage_height", self.passage_height, "chamber_height", self.chamber_height),
                ("passage_width", self.passage_width, "chamber_width", self.chamber_width),
            )
            if inner >= outer * (1 - 1e-9)
        ]
        require(not problems, "; ".join(problems))
        return self


class MultiChamberBendingGeometry(_MultiChamberGeometry):
    """On an inextensible layer: silk in 0.75 mm of silicone (Fabrication, step 4); in metres."""

    deformation = "bending"
    family: Literal["multi-chamber-bending"] = Field(description="which geometry this is")
    layer_thickness: Length = Field(0.00075, gt=0, description="silicone with silk in it")
    layer_modulus: Modulus = Field(
        10e6,
        gt=0,
        description="Young's modulus of the layer; our choice, a hundred times the silicone's: "
        "the paper says only linear elastic and inextensible",
    )


class MultiChamberLinearGeometry(_MultiChamberGeometry):
    """Without a layer: lengthens; lengths in metres."""

    deformation = "elongation"
    family: Literal["multi-chamber-linear"] = Field(description="which geometry this is")
