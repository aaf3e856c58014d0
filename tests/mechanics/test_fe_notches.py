"""Where stress has no limit: re-entrant edges and the ends of clamps, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from rig.mechanics.fe import Kinematics, Model, Point, Solid, Support, discretise, follow, summarise
from rig.mechanics.fe.notches import near_notches, notch_nodes
from rig.mechanics.hyperelastic import NeoHookean, QuadraticVolume
from tests.mechanics.fe_problems import BULK, SHEAR, bending_tube, curved_triangles, ring


def _model(d, supports=()) -> Model:
    return Model(d, [Solid(d, NeoHookean(SHEAR), QuadraticVolume(BULK))], supports=supports)


def _ell(mesh):
    """The unit square or cube of 2 cells a side, the cell at high x and y left out."""
    centre = mesh.p[:, mesh.t].mean(axis=1)
    return mesh.remove_elements(np.flatnonzero(np.all(centre[:2] > 0.5, axis=0)))


MESHES = {
    "quads": (skfem.MeshQuad().refined(1), Kinematics.PLANE_STRAIN),
    "triangles": (skfem.MeshTri().refined(2), Kinematics.PLANE_STRAIN),
    "hexahedra": (skfem.MeshHex().refined(1), Kinematics.SOLID),
    "tetrahedra": (skfem.MeshTet().refined(2), Kinematics.SOLID),
}


@pytest.mark.parametrize("name", MESHES)
def test_a_re_entrant_edge_is_a_notch_and_convex_ones_are_not(name: str) -> None:
    mesh, kinematics = MESHES[name]
    assert not len(notch_nodes(_model(discretise(mesh, kinematics))))
    d = discretise(_ell(mesh), kinematics)
    found = d.nodes[notch_nodes(_model(d))]
    assert len(found)
    np.testing.assert_allclose(found[:, :2], 0.5)
    if d.dim == 3:  # all along the edge
        cells = round(1 / mesh.param()) if name == "hexahedra" else len(found)
        assert len(found) == cells
        assert np.ptp(found[:, 2]) >= 0.5


def test_left_handed_elements_have_the_same_notches() -> None:
    mesh = _ell(skfem.MeshHex().refined(1))
    d = discretise(type(mesh)(mesh.p * np.array([[-1.0], [1.0], [1.0]]), mesh.t))
    found = d.nodes[notch_nodes(_model(d))]
    np.testing.assert_allclose(found[:, :2], np.broadcast_to([-0.5, 0.5], (len(found), 2)))
    assert len(found) == 2


def test_the_end_of_a_clamp_is_a_notch() -> None:
    d = discretise(skfem.MeshQuad().refined(1), Kinematics.PLANE_STRAIN)
    clamp = Support.of(d, d.nodes_at(x=0.0), (0, 1))
    found = d.nodes[notch_nodes(_model(d, [clamp]))]
    np.testing.assert_allclose(found[np.argsort(found[:, 1])], [[0.0, 0.0], [0.0, 1.0]])


@pytest.mark.parametrize(("lean", "is_notch"), [(0.0, False), (0.7, True), (-0.7, False)])
def test_a_plane_of_symmetry_doubles_the_angle(lean: float, is_notch: bool) -> None:
    mesh = skfem.MeshQuad().refined(1)
    # the top rises or falls away from the plane of symmetry x = 0
    mesh = skfem.MeshQuad(mesh.p + np.stack((0 * mesh.p[0], lean * mesh.p[0] * mesh.p[1])), mesh.t)
    d = discretise(mesh, Kinematics.PLANE_STRAIN)
    sliding = Support.of(d, d.nodes_at(x=0.0), (0,))
    found = d.nodes[notch_nodes(_model(d, [sliding]))]
    assert found.tolist() == ([[0.0, 1.0]] if is_notch else [])


def test_a_smooth_bore_has_no_notch_however_coarse_the_mesh() -> None:
    for mesh in (ring(1, 2, 1.0, 2.0), curved_triangles(ring(1, 2, 1.0, 2.0))):
        assert not len(notch_nodes(_model(discretise(mesh, Kinematics.PLANE_STRAIN))))


def test_rigid_bodies_and_inner_corners_of_a_cavity_are_found() -> None:
    tube = bending_tube(along=3)
    d = tube.discretisation
    found = d.nodes[notch_nodes(tube.model)]
    assert np.isclose(found[:, 0], d.nodes[:, 0].max()).any(), "the rigid cap's edge"
    assert np.isclose(found[:, 0], 0.0).any(), "the clamp's edge"
    inner = (np.abs(found[:, 1] - 3.5e-3) < 1e-9) & (np.abs(found[:, 2] - 3e-3) < 1e-9)
    assert inner.sum() == 3, "the cavity's lower corner, all along the tube"
    # on the plane of symmetry floor and end wall meet the mirror image of themselves: no notch
    flat = (np.abs(found[:, 1]) < 1e-9) & (found[:, 0] > 1e-3) & (found[:, 0] < 19e-3)
    assert not flat.any()


def test_a_peak_in_a_notched_element_is_marked() -> None:
    d = discretise(_ell(skfem.MeshQuad().refined(3)), Kinematics.PLANE_STRAIN)
    supports = [
        Support.of(d, d.nodes_at(y=0.0), (0, 1)),
        Support.of(d, d.nodes_at(y=1.0), (0,), 0.02),
    ]
    model = _model(d, supports)
    near = near_notches(model)
    assert 0 < near.sum() < 0.5 * len(near)
    peak = summarise(model, follow(model, [Point(0.0)]).solutions[0]).von_mises
    assert peak.at_notch
    np.testing.assert_allclose(peak.place, [0.5, 0.5], atol=0.13)
    # away from its clamps and corners a bar has none
    bar = discretise(skfem.MeshQuad().refined(2), Kinematics.PLANE_STRAIN)
    pulled = [
        Support.of(bar, bar.nodes_at(y=0.0), (1,)),
        Support.of(bar, bar.nodes_at(y=1.0), (1,), 0.1),
        Support.of(bar, bar.nodes_at(x=0.0), (0,)),
    ]
    whole = _model(bar, pulled)
    assert not summarise(whole, follow(whole, [Point(0.0)]).solutions[0]).von_mises.at_notch
