"""Hypothesis strategies for bending bellows that eq. (1) admits, its boundary included."""

from __future__ import annotations

from hypothesis import strategies as st

from rig.spec.actuator import BellowAxisymmetricGeometry, BellowBendingGeometry


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


@st.composite
def axisymmetric_bellows(draw: st.DrawFn) -> BellowAxisymmetricGeometry:
    """Geometries within the constraints: half circles to flat arcs, thin to half solid."""
    radius = draw(st.floats(5.0, 40.0))
    room = draw(st.floats(5.0, 60.0))
    base = draw(st.floats(1.0, 10.0))
    return BellowAxisymmetricGeometry.model_validate(
        {
            "family": "bellow-axisymmetric",
            "wall_thickness": draw(st.floats(0.05, 0.5)) * min(radius, room),
            "bellow_number": draw(st.integers(1, 12)),
            "divided_ratio": draw(st.floats(2.0, 12.0)),
            "top_diameter": 2 * radius,
            "height": base + room,
            "base_height": base,
        }
    )
