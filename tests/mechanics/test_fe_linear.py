"""The multifrontal solver against SuperLU, on matrices it likes and on those it does not."""

from __future__ import annotations

import sys
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from rig.mechanics.fe import Model, Point, Solid, Support, discretise, follow
from rig.mechanics.fe.errors import SingularError
from rig.mechanics.fe.frontal import Multifrontal
from rig.mechanics.fe.linear import SuperLU, default_solver
from rig.mechanics.hyperelastic import NeoHookean, QuadraticVolume
from tests.mechanics.fe_problems import bending_tube, meshes


def _shell(nx: int, ny: int, dofs: int, shift: float, seed: int = 0) -> sparse.csc_array:
    """A symmetric matrix on a grid of nodes with `dofs` unknowns each."""
    line = [
        sparse.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(n, n)) for n in (nx, ny)
    ]
    grid = sparse.kron(line[0], sparse.eye_array(ny)) + sparse.kron(sparse.eye_array(nx), line[1])
    mix = np.random.default_rng(seed).standard_normal((dofs, dofs))
    block = mix @ mix.T + np.eye(dofs)
    full = sparse.kron(grid, block) + shift * sparse.eye_array(nx * ny * dofs)
    result = sparse.csc_array(full)
    result.sort_indices()
    return result


@settings(max_examples=20)
@given(
    nx=st.integers(1, 40),
    ny=st.integers(1, 12),
    dofs=st.integers(1, 3),
    shift=st.sampled_from([0.0, -0.5, -3.0]),
)
def test_solutions_solve_whatever_the_shape_and_the_sign(nx, ny, dofs, shift) -> None:
    matrix = _shell(nx, ny, dofs, shift + 1e-3)
    right = np.random.default_rng(1).standard_normal((matrix.shape[0], 2))
    x = Multifrontal().factorise(matrix).solve(right)
    error = np.linalg.norm(matrix @ x - right) / np.linalg.norm(right)
    assert error < 1e-9 * max(1.0, np.abs(x).max())


def test_neighbours_with_other_rows_are_kept_apart() -> None:
    # inner nodes of few hexahedra: many columns of equal length whose rows add up to the same
    mesh, kinematics = meshes()["hexahedra"]
    d = discretise(mesh, kinematics)
    edge = np.unique(d.basis.get_dofs().flatten())
    model = Model(
        d,
        [Solid(d, NeoHookean(1.0), QuadraticVolume(50.0))],
        supports=[Support.of(d, edge, (0, 1, 2))],
    )
    matrix = model.free_matrix(model.assemble(model.start()).data)
    right = np.ones(matrix.shape[0])
    x = Multifrontal().factorise(matrix).solve(right)
    np.testing.assert_allclose(matrix @ x, right, atol=1e-11)


def test_round_off_in_a_small_column_beside_a_large_one_is_refined(monkeypatch) -> None:
    matrix = _shell(30, 8, 3, 0.1)
    factor = Multifrontal().factorise(matrix)
    exact = factor._solve
    monkeypatch.setattr(factor, "_solve", lambda columns: exact(columns) * [1.0, 1 + 1e-6])
    right = np.random.default_rng(4).standard_normal((matrix.shape[0], 2)) * [1.0, 1e-6]
    miss = np.linalg.norm(matrix @ factor.solve(right) - right, axis=0)
    assert np.all(miss < 1e-10 * np.linalg.norm(right, axis=0))


def test_it_tells_whether_the_matrix_is_positive_definite() -> None:
    assert not Multifrontal().factorise(_shell(30, 10, 3, 0.0)).negative
    assert Multifrontal().factorise(_shell(30, 10, 3, -3.0)).negative


def test_one_analysis_serves_all_matrices_of_a_pattern_and_only_those() -> None:
    solver = Multifrontal()
    for matrix in (_shell(30, 8, 3, 0.1), _shell(30, 8, 3, 0.7, seed=5), _shell(12, 20, 2, 0.1)):
        right = np.arange(matrix.shape[0], dtype=float)
        expected = SuperLU().factorise(matrix).solve(right)
        np.testing.assert_allclose(
            solver.factorise(matrix).solve(right), expected, atol=1e-9 * np.abs(expected).max()
        )


@pytest.mark.parametrize("shift", [0.1, -3.0])
def test_threads_share_large_fronts_and_change_not_a_bit(shift) -> None:
    matrix = _shell(60, 60, 3, shift)
    right = np.random.default_rng(2).standard_normal(matrix.shape[0])
    one, two, five = (Multifrontal(n).factorise(matrix).solve(right) for n in (1, 2, 5))
    np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(one, five)
    np.testing.assert_allclose(matrix @ one, right, atol=1e-8 * np.abs(one).max())


def test_parts_that_do_not_touch_are_solved_side_by_side() -> None:
    part = _shell(20, 6, 3, 0.1)
    matrix = sparse.csc_array(sparse.block_diag((part, 2 * part, part)))
    matrix.sort_indices()
    right = np.ones(matrix.shape[0])
    np.testing.assert_allclose(matrix @ Multifrontal().factorise(matrix).solve(right), right)


def test_a_singular_matrix_is_named() -> None:
    for solver in (Multifrontal(), SuperLU()):
        with pytest.raises(SingularError, match="singular"):
            solver.factorise(sparse.csc_array(np.zeros((3, 3)) + np.diag([1.0, 0.0, 1.0])))


def test_without_pardiso_only_systems_that_need_superlu_are_warned_of(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "pypardiso", None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert default_solver(symmetric=True, continuous_pressure=False).name == "multifrontal"
    for symmetric, continuous in ((False, False), (True, True)):
        with pytest.warns(RuntimeWarning, match="pypardiso is not installed"):
            assert default_solver(symmetric, continuous).name == "SuperLU"


@pytest.mark.parametrize("symmetric", [True, False])
def test_pardiso_solves_what_needs_it(symmetric: bool) -> None:
    pytest.importorskip("pypardiso", reason="pypardiso is not installed")
    solver = default_solver(symmetric, continuous_pressure=True)
    assert solver.name == "PARDISO"
    rng = np.random.default_rng(3)
    block = rng.normal(size=(30, 30))
    dense = block + block.T if symmetric else block
    right = rng.normal(size=(30, 2))
    solution = solver.factorise(sparse.csc_array(dense)).solve(right)
    np.testing.assert_allclose(dense @ solution, right, atol=1e-10)


def test_both_solvers_walk_the_same_path() -> None:
    tube = bending_tube()
    points = [Point(p) for p in (10e3, 20e3)]
    a = follow(tube.model, points, solver=Multifrontal())
    b = follow(tube.model, points, solver=SuperLU())
    assert a.solves == b.solves
    for one, other in zip(a.solutions, b.solutions, strict=True):
        np.testing.assert_allclose(one.state.x, other.state.x, atol=1e-10)
