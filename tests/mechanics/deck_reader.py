"""Reads `.inp` decks back, and integrates over their elements with shape functions of its own."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from skfem.quadrature import get_quadrature
from skfem.refdom import RefHex, RefQuad, RefTet, RefTri

# Abaqus Analysis User's Guide, Section 28.1.4: nodes (from 1) of the faces of C3D10 and C3D20
_FACES = {
    10: ((1, 2, 3), (1, 4, 2), (2, 4, 3), (3, 4, 1)),
    20: (
        (1, 2, 3, 4),
        (5, 8, 7, 6),
        (1, 5, 6, 2),
        (2, 6, 7, 3),
        (3, 7, 8, 4),
        (4, 8, 5, 1),
    ),
}
_TET_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
_HEX = np.array(
    [
        *((-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1)),
        *((-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)),
        *((0, -1, -1), (1, 0, -1), (0, 1, -1), (-1, 0, -1)),
        *((0, -1, 1), (1, 0, 1), (0, 1, 1), (-1, 0, 1)),
        *((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)),
    ]
)
_QUAD = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0)])
_TET = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])


@dataclass
class Block:
    """One keyword with its parameters and data lines."""

    keyword: str
    parameters: dict[str, str]
    lines: list[list[str]] = field(default_factory=list)


@dataclass
class DeckFile:
    """A deck as it was read: mm, N, MPa."""

    blocks: list[Block]
    nodes: dict[int, np.ndarray]
    elements: dict[int, list[int]]
    element_type: str
    node_sets: dict[str, list[int]]
    element_sets: dict[str, list[int]]

    def all(self, keyword: str) -> list[Block]:
        return [block for block in self.blocks if block.keyword == keyword]

    def volume(self) -> float:
        """Of all elements, in mm3; left-handed ones count as negative."""
        return float(sum(determinant @ weights for determinant, weights in self.jacobians()))

    def jacobians(self):
        """Determinants at quadrature points and their weights, element by element."""
        count = len(next(iter(self.elements.values())))
        points, weights = get_quadrature(RefTet if count == 10 else RefHex, 6)
        if count == 20:
            points, weights = 2 * points - 1, 8 * weights
        slopes = slopes_at(count, points)
        for nodes in self.elements.values():
            places = np.array([self.nodes[n] for n in nodes])
            yield np.linalg.det(np.einsum("nd,njq->qdj", places, slopes)), weights

    def boundary(self) -> list[tuple[int, int]]:
        """(element, face from 1) of every face that no other element has."""
        owners: dict[tuple[int, ...], list[tuple[int, int]]] = {}
        for number, nodes in self.elements.items():
            for face, corners in enumerate(_FACES[len(nodes)], start=1):
                key = tuple(sorted(nodes[c - 1] for c in corners))
                owners.setdefault(key, []).append((number, face))
        assert all(len(who) <= 2 for who in owners.values())
        return [who[0] for who in owners.values() if len(who) == 1]

    def surface(self, faces: list[tuple[int, int]]) -> tuple[np.ndarray, float]:
        """Integral of the outward normal in mm2, and a third of that of x . n in mm3."""
        area, volume = np.zeros(3), 0.0
        count = len(next(iter(self.elements.values())))
        flat, weights = get_quadrature(RefTri if count == 10 else RefQuad, 6)
        local = _TET if count == 10 else _HEX[:8]
        for element, face in faces:
            nodes = self.elements[element]
            places = np.array([self.nodes[n] for n in nodes])
            corner = local[np.array(_FACES[count][face - 1]) - 1]
            sides = np.stack((corner[1] - corner[0], corner[-1] - corner[0]), axis=1)
            points = corner[0][:, None] + sides @ flat
            gradient = np.einsum("nd,njq->qdj", places, slopes_at(count, points))
            tangents = gradient @ sides
            # corners go round a face so that its normal points into the element
            normal = -np.cross(tangents[:, :, 0], tangents[:, :, 1]) * weights[:, None]
            at = np.einsum("nd,nq->qd", places, values_at(count, points))
            area += normal.sum(axis=0)
            volume += float((at * normal).sum()) / 3
        return area, volume


def read_deck(path: Path) -> DeckFile:
    """Every keyword of a deck; a data line that ends with a comma goes on in the next."""
    blocks: list[Block] = []
    going_on = False
    for line in path.read_text(encoding="ascii").splitlines():
        if line.startswith("**"):
            continue
        if line.startswith("*"):
            keyword, *rest = (part.strip() for part in line[1:].split(","))
            pairs = (part.partition("=") for part in rest)
            parameters = {name.strip().upper(): value.strip() for name, _, value in pairs}
            blocks.append(Block(keyword.upper(), parameters))
            going_on = False
            continue
        parts = [part.strip() for part in line.rstrip(",").split(",")]
        if going_on:
            blocks[-1].lines[-1] += parts
        else:
            blocks[-1].lines.append(parts)
        going_on = line.endswith(",")
    deck = DeckFile(blocks, {}, {}, "", {}, {})
    for block in blocks:
        numbers = [[*line] for line in block.lines]
        if block.keyword == "NODE":
            for number, *place in numbers:
                deck.nodes[int(number)] = np.array(place, dtype=float)
            deck.node_sets[block.parameters["NSET"]] = [int(line[0]) for line in numbers]
        elif block.keyword == "ELEMENT":
            deck.element_type = block.parameters["TYPE"]
            for number, *nodes in numbers:
                deck.elements[int(number)] = [int(node) for node in nodes]
        elif block.keyword == "NSET":
            deck.node_sets[block.parameters["NSET"]] = [int(n) for line in numbers for n in line]
        elif block.keyword == "ELSET":
            deck.element_sets[block.parameters["ELSET"]] = [
                int(n) for line in numbers for n in line
            ]
    return deck


def values_at(count: int, points: np.ndarray) -> np.ndarray:
    """Shape functions of an element of `count` nodes at points (dim, n), (count, n)."""
    if count == 10:
        bary = np.vstack((1 - points.sum(axis=0), points))
        middles = [4 * bary[a] * bary[b] for a, b in _TET_EDGES]
        return np.stack([*(b * (2 * b - 1) for b in bary), *middles])
    dim, result = len(points), []
    for node in {8: _QUAD, 20: _HEX}[count]:
        factor = 1 + node[:, None] * points
        if np.all(node != 0):
            corner = (node[:, None] * points).sum(axis=0) - (dim - 1)
            result.append(factor.prod(axis=0) / 2**dim * corner)
        else:
            along = int(np.flatnonzero(node == 0)[0])
            others = [i for i in range(dim) if i != along]
            result.append((1 - points[along] ** 2) * factor[others].prod(axis=0) / 2 ** (dim - 1))
    return np.stack(result)


def slopes_at(count: int, points: np.ndarray) -> np.ndarray:
    """By complex steps, (nodes, dim, points): nothing to derive, nothing to get wrong."""
    tiny = 1e-30
    slopes = []
    for i in range(len(points)):
        moved = points.astype(complex)
        moved[i] += 1j * tiny
        slopes.append(values_at(count, moved).imag / tiny)
    return np.stack(slopes, axis=1)
