"""The flat board with a chessboard and markers that lenses are calibrated with (ChArUco)."""

from __future__ import annotations

from pydantic import Field, model_validator

from rig.spec.base import Integer, SpecModel, require
from rig.spec.quantity import Length


class CharucoTarget(SpecModel):
    """A chessboard with markers of OpenCV's dictionary 4X4_50 in its white squares.

    As printed and measured: squares by a calliper over many of them.
    """

    columns: Integer = Field(9, ge=4, le=20, description="squares across")
    rows: Integer = Field(6, ge=4, le=20, description="of squares")
    square: Length = Field("16 mm", gt=0, validate_default=True, description="edge of a square")
    marker: Length = Field("12 mm", gt=0, validate_default=True, description="edge of a marker")

    @model_validator(mode="after")
    def _markers_fit(self) -> CharucoTarget:
        require(self.marker < self.square, "expected marker smaller than square")
        require(
            self.columns * self.rows <= 100,
            "expected at most 100 squares: the dictionary has 50 markers, one for two squares",
        )
        return self

    @property
    def corners(self) -> int:
        """Inner corners of the chessboard."""
        return (self.columns - 1) * (self.rows - 1)
