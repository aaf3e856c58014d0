"""The surface for pictures: closed, turned outwards, outside and inside told apart."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from rig.mechanics.fe import FiniteElementError, Kinematics, Model, Solid, discretise
from rig.mechanics.fe.surface import Surface, surface_of
from rig.mechanics.hyperelastic import NeoHookean, QuadraticVolume
from rig.mechanics.mesh.curved import CurvedHex
from tests.mechanics.fe_problems import BULK, SHEAR, bending_tube, distorted


def _model(d) -> Model:
    return Model(d, [Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK))])


def _measures(nodes: np.ndarray, triangles: np.ndarray) -> tuple[float, np.ndarray]:
    """Volume within, positive where triangles turn outwards, and the vector area."""
    a, b, c = np.moveaxis(nodes[triangles], 1, 0)
    volume = np.einsum("ni,ni->", a, np.cross(b, c)) / 6
    return float(volume), np.cross(b - a, c - a).sum(axis=0) / 2


def _all(surface: Surface) -> np.ndarray:
    return np.concatenate((surface.outside, surface.inside))


@pytest.mark.parametrize(
    ("mesh", "per_facet"), [(skfem.MeshHex().refined(1), 8), (skfem.MeshTet().refined(1), 4)]
)
def test_triangles_close_the_solid_and_turn_outwards(mesh, per_facet: int) -> None:
    mesh = distorted(mesh)
    d = discretise(mesh)
    surface = surface_of(_model(d))
    assert len(surface.outside) == per_facet * len(mesh.boundary_facets())
    assert len(surface.inside) == 0
    volume, area = _measures(d.nodes[surface.node], surface.outside)
    assert volume == pytest.approx(1.0)
    np.testing.assert_allclose(area, 0.0, atol=1e-12)


def test_mirrored_elements_turn_outwards_too() -> None:
    mesh = skfem.MeshHex().refined(1)
    mirrored = type(mesh)(mesh.p * np.array([[-1.0], [1.0], [1.0]]), mesh.t)
    d = discretise(mirrored)
    surface = surface_of(_model(d))
    assert _measures(d.nodes[surface.node], surface.outside)[0] == pytest.approx(1.0)


def test_curved_facets_are_cut_at_their_own_nodes() -> None:
    curved = CurvedHex.from_mesh(skfem.MeshHex().refined(1))
    curved.doflocs[2] += 0.2 * curved.doflocs[2] * np.sin(np.pi * curved.doflocs[0])
    d = discretise(curved)
    surface = surface_of(_model(d))
    volume, area = _measures(d.nodes[surface.node], surface.outside)
    # a polyhedron through the nodes, four pieces along the wave
    assert volume == pytest.approx(1.0 + 0.2 / 4 * (1 + np.sqrt(2)))
    np.testing.assert_allclose(area, 0.0, atol=1e-12)


def test_cavity_and_section_are_inside_and_keep_their_own_vertices() -> None:
    tube = bending_tube()
    d = tube.discretisation
    surface = surface_of(tube.model, mirror=1)
    places = d.nodes[surface.node]
    volume, area = _measures(places, _all(surface))
    assert volume == pytest.approx(d.weights.sum())
    np.testing.assert_allclose(area, 0.0, atol=1e-15)
    facets = sum(len(d.facets_on(name)) for name in ("cavity", "symmetry"))
    assert len(surface.inside) == 8 * facets
    # the outside and its mirror image enclose the body with its cavity, open at the clamp
    half, _ = _measures(places, surface.outside)
    assert half == pytest.approx(d.weights.sum() + tube.surface.rest_volume)
    # edges stay sharp: no vertex belongs to the section and to another face
    middle = np.isclose(places[:, 1], 0.0)
    section = np.all(middle[surface.inside], axis=1)
    assert not np.intersect1d(surface.inside[section], surface.outside).size


def test_a_model_in_the_plane_has_no_surface_in_space() -> None:
    d = discretise(skfem.MeshQuad(), Kinematics.PLANE_STRAIN)
    with pytest.raises(FiniteElementError, match="plane strain has no surface"):
        surface_of(_model(d))
