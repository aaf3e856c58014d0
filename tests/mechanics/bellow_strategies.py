"""Hypothesis strategies for bending bellows that eq. (1) admits, its boundary included."""

from __future__ import annotations

from hypothesis import strategies as st

from rig.spec.actuator import BellowBendingGeometry


@st.composite
def bending_bellows(draw: st.DrawFn) -> BellowBendingGeometry:
    number = draw(st.integers(2, 12))
    arc_mm = draw(st.floats(1.0, 5.0))
    room = draw(st.one_of(st.just(1.0), st.floats(1.0, 4.0)))  # 1: no flank at all
    ratio = draw(st.floats(0.1, 0.8))
    wall = draw(st.floats(0.1, 0.95))
    return BellowBendingGeometry.model_validate(
        {
            "family": "bellow-bending",
            "effective_length": arc_mm * 4 * number,
            "bellow_number": number,
            "average_radius": room * arc_mm / (1 - ratio) * (1 + 1e-9),
            "radius_ratio": ratio,
            "wall_thickness": wall * arc_mm,
        }
    )
