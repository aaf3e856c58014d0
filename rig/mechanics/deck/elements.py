"""Elements as Abaqus and CalculiX number them: nodes, faces, right-handed.

Abaqus Analysis User's Guide, Sections 28.1.4 "Three-dimensional solid element library" and 2.3.2
(surfaces); CalculiX 2.20 numbers its elements the same way.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray

from rig.mechanics.deck.errors import DeckError
from rig.mechanics.fe import Discretisation, Kinematics

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Program(Enum):
    """Which program shall read the deck."""

    ABAQUS = "abaqus"
    CALCULIX = "calculix"


@dataclass(frozen=True)
class ElementType:
    """A quadratic solid element: corners, then the middles of edges."""

    names: Mapping[Program, str]
    """Abaqus has hybrid elements for nearly incompressible materials. CalculiX has not: there
    reduced integration keeps hexahedra from locking, tetrahedra stay too stiff."""
    corners: tuple[tuple[float, ...], ...]
    """In the reference element of scikit-fem, right-handed."""
    edges: tuple[tuple[int, int], ...]
    """Corners (from 0) of the edges whose middles follow."""
    faces: tuple[tuple[int, ...], ...]
    """Corners (from 0) of faces 1, 2, ..."""
    mirrored: tuple[int, ...]
    """Corners renumbered so that a left-handed element becomes right-handed."""


TETRAHEDRON = ElementType(
    names={Program.ABAQUS: "C3D10H", Program.CALCULIX: "C3D10"},
    corners=((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
    edges=((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    faces=((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    mirrored=(0, 2, 1, 3),
)
HEXAHEDRON = ElementType(
    names={Program.ABAQUS: "C3D20RH", Program.CALCULIX: "C3D20R"},
    corners=(
        *((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)),
        *((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
    ),
    edges=(
        *((0, 1), (1, 2), (2, 3), (3, 0)),
        *((4, 5), (5, 6), (6, 7), (7, 4)),
        *((0, 4), (1, 5), (2, 6), (3, 7)),
    ),
    faces=((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
    mirrored=(4, 5, 6, 7, 0, 1, 2, 3),
)
QUADRILATERAL = ElementType(
    names={Program.ABAQUS: "CAX8RH", Program.CALCULIX: "CAX8R"},
    corners=((0, 0), (1, 0), (1, 1), (0, 1)),
    edges=((0, 1), (1, 2), (2, 3), (3, 0)),
    faces=((0, 1), (1, 2), (2, 3), (3, 0)),
    mirrored=(0, 3, 2, 1),
)
"""Of a meridian, r and z as x and y."""


@dataclass(frozen=True)
class Elements:
    """All elements of a discretisation, anew."""

    type: ElementType
    nodes: Indices
    """(elements, nodes) in the order of `type`."""


def elements_of(discretisation: Discretisation) -> Elements:
    """The elements in the other programs' order; raises DeckError for those of plane strain.

    Of 27-node hexahedra and 9-node quadrilaterals the nodes on edges are kept: CalculiX has no
    others.
    """
    d = discretisation
    kinds = (
        (skfem.ElementTetP2, Kinematics.SOLID, TETRAHEDRON),
        (skfem.ElementHex2, Kinematics.SOLID, HEXAHEDRON),
        (skfem.ElementQuad2, Kinematics.AXISYMMETRIC, QUADRILATERAL),
    )
    kind = next(
        (kind for element, how, kind in kinds if (type(d.element), d.kinematics) == (element, how)),
        None,
    )
    if kind is None:
        raise DeckError(
            f"a deck is made of tetrahedra, hexahedra or a meridian's quadrilaterals, not of "
            f"{type(d.mesh).__name__} in {d.kinematics.value}."
        )
    places = np.asarray(d.element.doflocs)
    straight = range(len(kind.corners))
    as_is = d.connectivity[:, _order(kind, places, straight)]
    turned = d.connectivity[:, _order(kind, places, kind.mirrored)]
    left_handed = d.mesh.mapping().detDF(places.mean(axis=0)[:, None])[:, 0] < 0
    return Elements(kind, np.where(left_handed[:, None], turned, as_is))


def faces_of(elements: Elements, mesh: Any, facets: Indices) -> Indices:
    """(facets, 2): element and face, both from 0, of boundary facets of the mesh."""
    owners = mesh.f2t[0, facets]
    wanted = np.sort(mesh.facets[:, facets].T, axis=1)
    face = np.full(len(facets), -1, dtype=np.int64)
    for number, corners in enumerate(elements.type.faces):
        found = np.sort(elements.nodes[owners][:, corners], axis=1)
        face[np.all(found == wanted, axis=1)] = number
    return np.stack((owners, face), axis=1)


def _order(kind: ElementType, places: Array, corners: Iterable[int]) -> list[int]:
    """scikit-fem's numbers of the nodes of `kind`, its corners taken in the order given."""
    corner = np.array(kind.corners, dtype=float)[list(corners)]
    wanted = [*corner, *((corner[a] + corner[b]) / 2 for a, b in kind.edges)]
    return [int(np.argmin(np.abs(places - place).sum(axis=1))) for place in wanted]
