"""Small meshes and models that the finite element tests share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import skfem

from rig.mechanics.fe import (
    Discretisation,
    Kinematics,
    Model,
    PressureSurface,
    RigidBody,
    Solid,
    Support,
    discretise,
)
from rig.mechanics.hyperelastic import NeoHookean, QuadraticVolume

SHEAR, BULK = 150e3, 7.5e6
"""Agilus30 in Pa, about: E 450 kPa, nu 0.49."""


def distorted(mesh, amount: float = 0.15, seed: int = 1):
    """The mesh with its inner vertices moved by up to `amount` of the spacing."""
    rng = np.random.default_rng(seed)
    moved = mesh.p.copy()
    inner = mesh.interior_nodes()
    moved[:, inner] += amount * mesh.param() / 2 * rng.uniform(-1, 1, (mesh.dim(), len(inner)))
    return type(mesh)(moved, mesh.t)


def driven(d: Discretisation, solids: list[Solid], slope: np.ndarray) -> Model:
    """The whole surface moved as u = slope X."""
    edge = np.unique(d.basis.get_dofs().flatten())
    moved = d.nodes[edge] @ slope.T
    supports = [Support(d.dim * edge + i, moved[:, i]) for i in range(d.dim)]
    return Model(d, solids, supports=supports)


def meshes() -> dict[str, tuple[object, Kinematics]]:
    """One distorted mesh for each element and kinematics."""
    hexes, tets = skfem.MeshHex().refined(1), skfem.MeshTet().refined(1)
    quads, triangles = skfem.MeshQuad().refined(1), skfem.MeshTri().refined(1)
    return {
        "hexahedra": (distorted(hexes), Kinematics.SOLID),
        "tetrahedra": (distorted(tets), Kinematics.SOLID),
        "plane quads": (distorted(quads), Kinematics.PLANE_STRAIN),
        "plane triangles": (distorted(triangles), Kinematics.PLANE_STRAIN),
        "axisymmetric quads": (distorted(quads).translated((1.0, 0.0)), Kinematics.AXISYMMETRIC),
        "axisymmetric triangles": (
            distorted(triangles).translated((1.0, 0.0)),
            Kinematics.AXISYMMETRIC,
        ),
    }


def scattered(dofs: np.ndarray, values: np.ndarray, size: int) -> np.ndarray:
    """Element vectors added up."""
    return np.bincount(dofs.reshape(-1), weights=values.reshape(-1), minlength=size)


def ring(radial: int, around: int, inner: float, outer: float):
    """A quarter of a ring of quads with true arcs: section of a cylinder, or of half a sphere."""
    mesh = skfem.MeshQuad.init_tensor(
        np.linspace(inner, outer, radial + 1), np.linspace(0.0, np.pi / 2, around + 1)
    )
    curved = skfem.MeshQuad2.from_mesh(mesh)
    radius, angle = curved.doflocs
    places = np.stack((radius * np.cos(angle), radius * np.sin(angle)))
    # nodes that belong on an axis belong there exactly
    places[np.abs(places) < 1e-15] = 0.0
    curved = skfem.MeshQuad2(places, curved.t)
    facets = curved.boundary_facets()
    away = np.linalg.norm(curved.p[:, curved.facets[:, facets]], axis=0)
    slack = 1e-9 * outer
    bore = facets[np.all(np.abs(away - inner) < slack, axis=0)]
    return curved.with_boundaries({"bore": bore})


def curved_triangles(quads):
    """A ring of triangles with true arcs for sides, from one of quads; its bore is named, too."""
    straight = skfem.MeshQuad1(quads.p[:, : quads.nvertices], quads.t).to_meshtri()
    places = skfem.MeshTri2.from_mesh(straight).doflocs.copy()
    away = np.linalg.norm(straight.p, axis=0)
    middle = places[:, straight.nvertices :]
    middle *= away[straight.facets].mean(axis=0) / np.linalg.norm(middle, axis=0)
    curved = skfem.MeshTri2(places, straight.t)
    facets = curved.boundary_facets()
    inner = away.min()
    bore = facets[np.all(np.abs(away[curved.facets[:, facets]] - inner) < 1e-9 * inner, axis=0)]
    return curved.with_boundaries({"bore": bore})


@dataclass(frozen=True)
class Tube:
    """A soft box beam, one end clamped, the other a rigid cap, thicker at the bottom; half of it
    by symmetry. Pressure elongates its top, so it bends downwards."""

    discretisation: Discretisation
    solid: Solid
    surface: PressureSurface
    cap: RigidBody
    model: Model


def bending_tube(symmetric: bool = True, along: int = 6) -> Tube:
    """Length 20 mm, width 10 mm, height 10 mm, wall 1.5 mm, floor 3 mm."""
    length, width, wall = 20e-3, 10e-3, 1.5e-3
    mesh = skfem.MeshHex.init_tensor(
        np.append(np.linspace(0, length, along + 1), length + wall),
        np.array([0, width / 2 - wall, width / 2]),
        np.array([0, 3e-3, width - wall, width]),
    )
    centre = mesh.p[:, mesh.t].mean(axis=1)
    hollow = (
        (centre[0] < length)
        & (centre[1] < width / 2 - wall)
        & (centre[2] > 3e-3)
        & (centre[2] < width - wall)
    )
    mesh = mesh.remove_elements(np.flatnonzero(hollow))
    facets = mesh.boundary_facets()
    x, y, z = mesh.p[:, mesh.facets[:, facets]].mean(axis=1)
    small = 1e-9
    outside = (
        (x < small)
        | (x > length + wall - small)
        | (y < small)
        | (y > width / 2 - small)
        | (z < small)
        | (z > width - small)
    )
    mesh = mesh.with_boundaries(
        {
            "clamp": facets[x < small],
            "cap": facets[x > length + wall - small],
            "symmetry": facets[y < small],
            "cavity": facets[~outside],
        }
    )
    d = discretise(mesh)
    solid = Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK))
    surface = PressureSurface(d, d.facets_on("cavity"), symmetric=symmetric)
    cap = RigidBody(
        d,
        d.nodes_on("cap"),
        free=("x", "z", "about_y"),
        centre=np.array([length + wall, 0.0, 5e-3]),
    )
    supports = [
        Support.of(d, d.nodes_on("clamp"), (0, 1, 2)),
        Support.of(d, d.nodes_on("symmetry"), (1,)),
    ]
    return Tube(
        d, solid, surface, cap, Model(d, [solid], supports=supports, surface=surface, bodies=[cap])
    )
