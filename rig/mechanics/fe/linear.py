"""Direct solution of the linear systems, behind one small interface.

Our own multifrontal Cholesky for symmetric systems in displacements. For the rest pypardiso (MKL)
where it is installed, or SciPy's SuperLU with the ordering for symmetric patterns, which is fifteen
times faster here than its default.
"""

from __future__ import annotations

import warnings
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from rig.mechanics.fe.errors import SingularError
from rig.mechanics.fe.frontal import Multifrontal

Array = NDArray[np.float64]


class Factor(Protocol):
    """A matrix ready to be solved with."""

    def solve(self, right: Array) -> Array:
        """x with A x = `right`, (n,) or (n, k)."""
        ...


class LinearSolver(Protocol):
    """Factorises matrices that share one sparsity pattern."""

    name: str

    def factorise(self, matrix: sparse.csc_array) -> Factor:
        """The factors of a square matrix; raises SingularError."""
        ...


class SuperLU:
    """SciPy's SuperLU, ordered for a symmetric pattern and pivoting on the diagonal if it can."""

    name = "SuperLU"

    def factorise(self, matrix: sparse.csc_array) -> Factor:
        """The factors; raises SingularError."""
        with np.errstate(all="ignore"):
            try:
                factor = splu(
                    matrix,
                    permc_spec="MMD_AT_PLUS_A",
                    diag_pivot_thresh=0.01,
                    options={"SymmetricMode": True},
                )
            except RuntimeError as error:
                raise SingularError(
                    f"the tangent of {matrix.shape[0]} unknowns is singular ({error}): some part "
                    "is not held, or the body is at a limit of stability. Check the supports."
                ) from error
        return factor  # type: ignore[no-any-return]


class Pardiso:
    """MKL's PARDISO by pypardiso, which repeats the analysis for every matrix: on the default
    actuator 2.4 times as long in all as our own solver, in one run."""

    name = "PARDISO"

    def __init__(self, symmetric: bool) -> None:
        from pypardiso import PyPardisoSolver  # type: ignore[import-not-found]

        self._symmetric = symmetric
        self._solver: Any = PyPardisoSolver(mtype=-2 if symmetric else 11)

    def factorise(self, matrix: sparse.csc_array) -> Factor:
        """The factors; raises SingularError."""
        # symmetric: upper triangle by rows = lower triangle by columns
        rows = sparse.csr_matrix(sparse.triu(matrix) if self._symmetric else matrix)
        try:
            self._solver.factorize(rows)
        except Exception as error:
            raise SingularError(
                f"PARDISO could not factorise the tangent of {matrix.shape[0]} unknowns ({error})."
            ) from error
        return _PardisoFactor(self._solver, rows)


class _PardisoFactor:
    def __init__(self, solver: Any, matrix: sparse.csr_matrix) -> None:
        self._solver = solver
        self._matrix = matrix

    def solve(self, right: Array) -> Array:
        return np.asarray(self._solver.solve(self._matrix, right)).reshape(right.shape)


def default_solver(symmetric: bool, continuous_pressure: bool) -> LinearSolver:
    """What suits the system best.

    Continuous pressures make it indefinite throughout, which needs pivoting across fronts: there
    PARDISO serves where pypardiso is installed, and a warning says what the missing package costs.
    """
    if symmetric and not continuous_pressure:
        return Multifrontal()
    try:
        return Pardiso(symmetric)
    except ImportError:
        warnings.warn(
            "pypardiso is not installed: SuperLU takes its place and several times as long. "
            "Install pypardiso, or use hexahedra and a closed cavity, which need neither.",
            RuntimeWarning,
            stacklevel=2,
        )
        return SuperLU()
