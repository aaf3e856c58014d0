"""Facets as surfaces of their own against scikit-fem's traces of the elements."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from rig.mechanics.fe import Kinematics, discretise
from rig.mechanics.fe.facets import Facets
from tests.mechanics.fe_problems import meshes

MESHES = meshes()


@pytest.mark.parametrize("name", MESHES)
def test_middles_and_normals_are_those_of_the_deformed_elements(name: str) -> None:
    mesh, kinematics = MESHES[name]
    d = discretise(mesh, kinematics)
    facets = mesh.boundary_facets()
    x = 0.02 * np.random.default_rng(2).standard_normal(d.size)
    # the middle is the same point whichever corner a facet starts from
    middle = np.full((1, d.dim - 1), 1 / 3 if name == "tetrahedra" else 1 / 2)
    places, normals = Facets.of(d, facets).at(x, middle)
    basis = skfem.FacetBasis(mesh, d.element, facets=facets, quadrature=(middle.T, np.ones(1)))
    parts = [basis.interpolate(x[i : d.displacement_size : d.dim]) for i in range(d.dim)]
    moved = basis.global_coordinates() + np.stack([np.asarray(part) for part in parts])
    np.testing.assert_allclose(places[:, 0], np.asarray(moved)[:, :, 0].T, atol=1e-13)
    slopes = np.stack([part.grad[:, :, 0] for part in parts])
    gradient = np.eye(d.dim) + np.moveaxis(slopes, 2, 0)
    # Nanson: n da = cof F N dA
    rest = np.asarray(basis.normals)[:, :, 0].T
    areas = np.linalg.solve(gradient.swapaxes(1, 2), rest[..., None])[..., 0]
    expected = areas / np.linalg.norm(areas, axis=1, keepdims=True)
    np.testing.assert_allclose(normals[:, 0], expected, atol=1e-11)


@pytest.mark.parametrize("name", ["hexahedra", "tetrahedra", "quads"])
def test_shapes_reproduce_quadratic_fields_and_their_slopes(name: str) -> None:
    family = {"hexahedra": skfem.MeshHex, "tetrahedra": skfem.MeshTet, "quads": skfem.MeshQuad}
    mesh = family[name]().refined(1)
    d = discretise(mesh, Kinematics.PLANE_STRAIN if mesh.dim() == 2 else Kinematics.SOLID)
    facets = Facets.of(d, mesh.boundary_facets())
    s = np.random.default_rng(4).uniform(0.1, 0.4, (5, d.dim - 1))
    values, slopes = facets.shapes(s)
    # places of nodes are linear in s on these straight facets, so their squares are quadratic
    at = values @ facets.places
    corners = facets.places[:, list(facets.outline)]
    np.testing.assert_allclose(facets.hats(s) @ corners, at, atol=1e-13)
    np.testing.assert_allclose(values @ facets.places**2, at**2, atol=1e-13)
    tangents = np.einsum("qak,fai->fqik", slopes, facets.places**2)
    linear = np.einsum("qak,fai->fqik", slopes, facets.places)
    np.testing.assert_allclose(tangents, 2 * at[..., None] * linear, atol=1e-12)
