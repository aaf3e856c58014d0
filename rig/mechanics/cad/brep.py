"""Solids with exact surfaces, by Open Cascade as netgen packs it; STEP files.

Netgen (LGPL) is the smallest maintained package with Open Cascade, and meshes with curved
tetrahedra, too.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rig.mechanics.cad.construct import Arc, Combined, Line, Part, Point, Prism, Revolved, Solid
from rig.mechanics.cad.errors import CadError

MILLIMETRE = 1e3
"""Shapes are built in millimetres: Open Cascade's tolerances and STEP files suit them."""

_SOFT_COLOUR = (0.16, 0.47, 0.71)
_RIGID_COLOUR = (0.55, 0.55, 0.58)


def build(solid: Solid) -> Any:
    """Open Cascade shape of a solid, millimetres.

    Raises CadError where netgen is missing or Open Cascade finds no single solid.
    """
    occ = kernel()
    try:
        shape = _evaluate(occ, solid)
    except occ.OCCException as error:
        raise CadError(
            f"Open Cascade could not build the solid: {error}. Check the geometry with `rig check`."
        ) from error
    if len(shape.solids) != 1:
        raise CadError(
            f"The geometry makes {len(shape.solids)} separate solids instead of one. Check its "
            f"dimensions with `rig check`."
        )
    return shape.solids[0]


def write_step(path: Path, parts: Sequence[Part]) -> None:
    """Write all parts as named solids into one STEP file (AP214, millimetres)."""
    occ = kernel()
    shapes = []
    for part in parts:
        shape = build(part.solid)
        shape.name = part.name
        shape.col = _SOFT_COLOUR if part.is_soft else _RIGID_COLOUR
        shapes.append(shape)
    whole = shapes[0] if len(shapes) == 1 else occ.Compound(shapes, separate_layers=False)
    if not path.parent.is_dir():
        raise CadError(f"{path} cannot be written: there is no folder {path.parent}. Make it.")
    whole.WriteStep(str(path))
    if not path.is_file():
        raise CadError(f"{path} cannot be written. Choose another file.")


def kernel() -> Any:
    """The module `netgen.occ`; raises CadError where it is missing."""
    try:
        return importlib.import_module("netgen.occ")
    except ImportError as error:
        raise CadError(
            "Exact solids (STEP files, tetrahedral meshes) need netgen, which is not installed. "
            "Install it with `pip install netgen-mesher`, or all of CAD with `pip install "
            "'rig[cad]'`. STL files do without."
        ) from error


def _evaluate(occ: Any, solid: Solid) -> Any:
    if isinstance(solid, Revolved):
        return _revolved(occ, solid)
    if isinstance(solid, Prism):
        return _prism(occ, solid)
    return _combined(occ, solid)


def _combined(occ: Any, solid: Combined) -> Any:
    body = _united(occ, solid.added)
    return body - _united(occ, solid.removed) if solid.removed else body


def _united(occ: Any, solids: Sequence[Solid]) -> Any:
    first, *others = (_evaluate(occ, solid) for solid in solids)
    for other in others:
        first = first + other
    return first


def _revolved(occ: Any, solid: Revolved) -> Any:
    upright = solid.axis == "z"

    def point(at: Point) -> Any:
        axial, radial = at[0] * MILLIMETRE, at[1] * MILLIMETRE
        return occ.Pnt(radial, 0, axial) if upright else occ.Pnt(axial, 0, radial)

    first, last = solid.profile[0].start, solid.profile[-1].end
    closing = [Line(last, (last[0], 0.0)), Line((last[0], 0.0), (first[0], 0.0))]
    closing.append(Line((first[0], 0.0), first))
    edges = [
        occ.ArcOfCircle(point(piece.start), point(piece.middle), point(piece.end))
        if isinstance(piece, Arc)
        else occ.Segment(point(piece.start), point(piece.end))
        for piece in (*solid.profile, *closing)
    ]
    axis = occ.Axis(occ.Pnt(0, 0, 0), occ.Z if upright else occ.X)
    return occ.Face(occ.Wire(edges)).Revolve(axis, 360)


def _prism(occ: Any, solid: Prism) -> Any:
    start = solid.start * MILLIMETRE
    points = [occ.Pnt(start, y * MILLIMETRE, z * MILLIMETRE) for y, z in solid.section]
    sides = zip(points, [*points[1:], points[0]], strict=True)
    face = occ.Face(occ.Wire([occ.Segment(a, b) for a, b in sides]))
    return face.Extrude((solid.end - solid.start) * MILLIMETRE * occ.X)
