"""Outlines as inline SVG in millimetres; colours are classes of the style sheet."""

from __future__ import annotations

import html
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.response import SideProfile
from rig.studio.section import Outline

Array = NDArray[np.float64]
Box = tuple[float, float, float, float]
"""Left, bottom, right and top in mm."""

MARGIN_MM = 4.0
SCALE_MM = 10
BAR_MM = 4.0
"""Room for the scale beneath what is drawn."""


def box_of(shapes: Sequence[Array]) -> Box:
    """What shapes, each (n, 2) in m, fill, with a margin."""
    points = 1e3 * np.concatenate(shapes)
    (left, bottom), (right, top) = points.min(axis=0), points.max(axis=0)
    return (
        float(left) - MARGIN_MM,
        float(bottom) - MARGIN_MM - BAR_MM,
        float(right) + MARGIN_MM,
        float(top) + MARGIN_MM,
    )


def section_svg(outlines: Sequence[Outline], title: str) -> str:
    """The section at rest."""
    box = box_of([outline.points for outline in outlines])
    painted = "".join(_polygon(outline.points, outline.paint) for outline in outlines)
    return _svg(painted + _scale_bar(box), box, title)


def profile_svg(profile: SideProfile, box: Box, title: str) -> str:
    """The bent side view in a fixed window, so that it does not jump while it bends."""
    painted = "".join(
        (
            _polygon(profile.connector, "rigid"),
            *(_polygon(outline, "soft") for outline in profile.soft),
            _polygon(profile.end_cap, "rigid"),
        )
    )
    return _svg(painted + _scale_bar(box), box, title)


def profile_shapes(profile: SideProfile) -> list[Array]:
    """All outlines of a side view."""
    return [profile.connector, *profile.soft, profile.end_cap]


def _polygon(points: Array, paint: str) -> str:
    # SVG counts downwards
    places = " ".join(f"{1e3 * x:.2f},{-1e3 * z:.2f}" for x, z in points)
    return f'<polygon class="{paint}" points="{places}"/>'


def _scale_bar(box: Box) -> str:
    left, bottom, _, _ = box
    x, y = left + 1.0, -bottom - 1.0
    return (
        f'<path class="scale" d="M{x:.2f},{y:.2f}h{SCALE_MM}"/>'
        f'<text class="scale" x="{x:.2f}" y="{y - 0.8:.2f}">{SCALE_MM} mm</text>'
    )


def _svg(content: str, box: Box, title: str) -> str:
    left, bottom, right, top = box
    return (
        f'<svg class="drawing" role="img" viewBox="{left:.2f} {-top:.2f} {right - left:.2f} '
        f'{top - bottom:.2f}"><title>{html.escape(title)}</title>{content}</svg>'
    )
