"""A hyperelastic solid in mixed form: residual and tangent of all elements by batched kernels.

The energy is that of displacements u and pressures p,

    Pi = int W(F) + p J - U*(p) dV,        U*(p) = sup_J (p J - U(J)),

so that the pressure equation J = dU*/dp is the inverse of p = U'(J). For U = K/2 (J - 1)^2 it is
the perturbed Lagrangian W + p (J - 1) - p^2 / (2 K) (Sussman & Bathe, Comput. Struct. 26 (1987)
357). Discontinuous pressures are eliminated element by element, which leaves a symmetric system
in the displacements; continuous ones stay in the system.

With mixed integration points (Magisano, Leonetti & Garcea, Comput. Methods Appl. Mech. Eng. 313
(2017) 986) strain and stress at the quadrature points are independent during the iterations and
eliminated as well: Newton then extrapolates the strain, not the displacement, and bending
shells cost a fraction of the iterations. Both agree at convergence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from rig.mechanics.fe._native import ffi, lib
from rig.mechanics.fe.discretisation import Discretisation, Integers
from rig.mechanics.fe.pointers import reals
from rig.mechanics.fe.state import PointState
from rig.mechanics.fe.threads import available_threads
from rig.mechanics.hyperelastic import Energy, Flowing, Hyperelastic, Volumetric
from rig.mechanics.hyperelastic.tensors import (
    add_cofactor_slope,
    cofactor,
    determinant,
    product,
    right_cauchy_green,
)

Array = NDArray[np.float64]

_CHUNK_POINTS = 2048
"""Quadrature points handled at once: their tensors stay in the processor's cache."""
_VOLUME_ITERATIONS = 60
_MAX_WORKERS = 4
"""Threads beyond which numpy's own locking leaves nothing to gain."""
_T = TypeVar("_T")


@dataclass(frozen=True)
class Condensed:
    """What elimination left for the update of one solid after the displacements are known."""

    pressure: Array
    """Change of pressure at fixed displacements in Pa, (elements, m)."""
    pressure_slope: Array
    """Change of pressure per displacement in Pa/m, (elements, m, a * dim)."""
    gradient: Array
    """F at the displacements of the evaluation, (3, 3, points)."""
    inverse: Array
    """Inverse of the gradient that belongs to the independent strain, (3, 3, points)."""
    gap: Array
    """Strain of the displacements less the independent one, (3, 3, points)."""
    stress: Array
    """P at the independent strain in Pa, (3, 3, points)."""
    material: Array
    """H = A - I (x) S at the independent strain in Pa, (3, 3, 3, 3, points)."""
    cofactor: Array
    """Cofactor of the gradient that belongs to the independent strain, (3, 3, points)."""


@dataclass(frozen=True)
class Evaluation:
    """Residual and tangent of one solid, with what is needed to update its eliminated unknowns."""

    residual: Array
    """dPi/dx, (elements, dofs)."""
    tangent: Array | None
    """d2Pi/dx2, (elements, dofs, dofs); None where only the residual was asked for."""
    gap: float
    """Largest difference between independent strain and strain of the displacements."""
    volume_error: float
    """Largest mean over an element of the volume ratio less that of the pressure; 0 where
    pressures are continuous, whose equations are in the residual."""
    least_volume_ratio: float
    """Smallest det F at a quadrature point."""
    condensed: Condensed | None
    """None where strain and stress follow from the displacements or nothing was eliminated."""


class Solid:
    """The elements of one material; `dofs` tells where residual and tangent belong."""

    def __init__(
        self,
        discretisation: Discretisation,
        distortion: Energy | Flowing,
        volume: Volumetric,
        elements: Integers | None = None,
    ) -> None:
        """All elements, or those given; `volume` must not be that of an incompressible solid.

        On a discretisation without pressures displacements alone carry both energies.
        """
        every = np.arange(len(discretisation.connectivity))
        self.elements = every if elements is None else np.asarray(elements, dtype=np.int64)
        self.discretisation = discretisation
        d = discretisation
        self.distortion = distortion
        self.volume = volume
        self._flowing = distortion if isinstance(distortion, Flowing) else None
        self._elastic = None if isinstance(distortion, Flowing) else self._carried(distortion)
        self._dim = d.dim
        self._components = d.kinematics.components
        self._gradients = _unique_arrays(d.gradients, self.elements)
        self._weights = d.weights[self.elements]
        self._phi = d.pressure_values[self.elements]
        self._u_dofs = d.dofs[self.elements]
        self._continuous = d.pressure_connectivity is not None
        self.dofs = self._u_dofs
        if d.pressure_connectivity is not None:
            shifted = d.displacement_size + d.pressure_connectivity[self.elements]
            self.dofs = np.concatenate((self._u_dofs, shifted), axis=1)

    def initial(self) -> PointState:
        """The state without stress."""
        modes = 0 if self._continuous else self._phi.shape[2]
        flowing = self._flowing
        return PointState(
            np.zeros((len(self.elements), modes)),
            history=None if flowing is None else flowing.virgin(self._weights.shape),
        )

    def settled(self, x: Array, points: PointState) -> PointState:
        """The points of a step that is accepted: strain and stress follow from the displacements
        in x, and what has flowed has flowed for good."""
        history = points.history
        if self._flowing is not None and history is not None:
            history = self._flowing.afterwards(history, self.deformation_gradient(x))
        return PointState(points.pressure, history=history)

    def law(self, points: PointState, chunk: slice = slice(None)) -> Energy:
        """The energy that the displacements alone carry, in some elements whose points lie side by
        side; the pressures, if any, carry the rest."""
        if self._elastic is not None:
            return self._elastic
        assert self._flowing is not None
        assert points.history is not None
        history = points.history[:, chunk]
        return self._carried(self._flowing.since(history.reshape(len(history), -1)))

    def _carried(self, distortion: Energy) -> Energy:
        return distortion if self.discretisation.mixed else Hyperelastic(distortion, self.volume)

    def deformation_gradient(self, x: Array) -> Array:
        """F at the quadrature points, (3, 3, elements, q), for the displacements in x."""
        result = np.empty((3, 3, *self._weights.shape))
        for chunk in self._chunks():
            result[:, :, chunk] = self._gradient(x, chunk)
        return result

    def pressure(self, x: Array, points: PointState) -> Array:
        """The pressure p = U'(J) at the quadrature points in Pa, (elements, q)."""
        modes = self._pressure_modes(x, points)
        return np.asarray((self._phi @ modes[:, :, None])[..., 0])

    def energy(self, x: Array, points: PointState) -> float:
        """The value of Pi in J, of which residual and tangent are the derivatives."""
        f = self.deformation_gradient(x)
        p = self.pressure(x, points)
        flat = f.reshape(3, 3, -1)
        j = determinant(flat, cofactor(flat)).reshape(p.shape)
        j_of_p, _ = volume_ratio(self.volume, p)
        conjugate = p * j_of_p - self.volume.energy(j_of_p)
        density = self.law(points).energy(flat).reshape(p.shape) + p * j - conjugate
        return float(np.sum(self._weights * density))

    def free_points(self, x: Array, points: PointState) -> PointState:
        """Strain and stress made independent, starting at those of the displacements."""
        f = self.deformation_gradient(x)
        flat = f.reshape(3, 3, -1)
        cof = cofactor(flat)
        p = self.pressure(x, points).reshape(-1)
        first = self.law(points).first_piola(flat) + p * cof
        inverse = _inverse(flat, cof)
        return replace(
            points,
            strain=right_cauchy_green(flat).reshape(f.shape),
            stress=product(inverse, first).reshape(f.shape),
        )

    def evaluate(self, x: Array, points: PointState, tangent: bool = True) -> Evaluation:
        """Residual and, if wanted, tangent at `x`; what is not defined becomes not a number."""
        n_elements, n_points = self._weights.shape
        n_u = self._u_dofs.shape[1]
        n_p = self._phi.shape[2]
        size = self.dofs.shape[1]
        modes = self._pressure_modes(x, points)
        residual = np.zeros((n_elements, size))
        stiffness = np.empty((n_elements, size, size)) if tangent else None
        keep = tangent and not self._continuous
        mixed = points.strain is not None
        n_all = n_elements * n_points
        store = _Store(n_all if tangent and mixed else 0)
        delta_p = np.zeros((n_elements, n_p if keep else 0))
        slope_p = np.zeros((n_elements, n_p if keep else 0, n_u))

        def work(chunk: slice) -> tuple[float, float, float]:
            w = self._weights[chunk]
            phi = self._phi[chunk]
            f = self._gradient(x, chunk).reshape(3, 3, -1)
            p = (phi @ modes[chunk, :, None])[..., 0]
            at = self._point(f, p.reshape(-1), points, chunk, tangent)
            j_of_p, compliance = volume_ratio(self.volume, p)
            r_p = np.einsum("eq,eqm->em", w * (at.j.reshape(w.shape) - j_of_p), phi)
            volume_error = 0.0
            if not self._continuous:
                miss = np.abs(r_p).max(axis=1, initial=0.0) / w.sum(axis=1)
                volume_error = float(miss.max(initial=0.0))
            r_u = self._divergence(at.stress, w, chunk)
            coupling = self._coupling(at.cofactor, w, phi, chunk)
            bulk = np.einsum("eq,eqm,eqn->emn", w * compliance, phi, phi)
            if self._continuous:
                residual[chunk, :n_u] = r_u
                residual[chunk, n_u:] = r_p
                if stiffness is not None:
                    block = stiffness[chunk]
                    none = np.zeros((len(w), 0, n_u))
                    dyads = (none.swapaxes(1, 2), none)
                    self._stiffness(at.tangent, w, chunk, dyads, block[:, :n_u, :n_u])
                    block[:, :n_u, n_u:] = coupling
                    block[:, n_u:, :n_u] = coupling.swapaxes(1, 2)
                    block[:, n_u:, n_u:] = -bulk
            else:
                right = np.concatenate((r_p[:, :, None], coupling.swapaxes(1, 2)), axis=2)
                solved = np.linalg.solve(bulk, right)
                residual[chunk] = r_u + (coupling @ solved[:, :, :1])[..., 0]
                if stiffness is not None:
                    dyads = (coupling, solved[:, :, 1:])
                    self._stiffness(at.tangent, w, chunk, dyads, stiffness[chunk])
                    delta_p[chunk] = solved[:, :, 0]
                    slope_p[chunk] = solved[:, :, 1:]
            store.put(chunk, n_points, f, at)
            return at.gap_size, volume_error, at.least

        # every chunk writes where no other does: threads change nothing in the result
        gaps, errors, ratios = zip(*_in_parallel(work, list(self._chunks())), strict=True)
        condensed = None
        if tangent and (keep or mixed):
            condensed = Condensed(
                delta_p,
                slope_p,
                store.gradient,
                store.inverse,
                store.gap,
                store.stress,
                store.material,
                store.cofactor,
            )
        return Evaluation(residual, stiffness, max(gaps), max(errors), min(ratios), condensed)

    def advance(
        self, points: PointState, evaluation: Evaluation, x: Array, dx: Array, length: float
    ) -> PointState:
        """Eliminated unknowns after the step `length * dx` from `x`, where it was evaluated."""
        c = evaluation.condensed
        if c is None:
            return points
        du = dx[self._u_dofs]
        modes = points.pressure
        if self._continuous:
            d = self.discretisation
            change = dx[d.displacement_size + _pressure_nodes(d)[self.elements]]
        else:
            change = c.pressure + (c.pressure_slope @ du[:, :, None])[..., 0]
            modes = modes + length * change
        if points.strain is None or points.stress is None:
            return replace(points, pressure=modes)
        shape = points.strain.shape
        df = (self.deformation_gradient(x + dx) - self.deformation_gradient(x)).reshape(3, 3, -1)
        linear = product(c.gradient.swapaxes(0, 1), df)
        strain = c.gap + (linear + linear.swapaxes(0, 1)) / 2
        slope = np.einsum("iakln,kln->ian", c.material, product(c.inverse.swapaxes(0, 1), strain))
        dp = (self._phi @ change[:, :, None]).reshape(-1)
        stress = product(c.inverse, c.stress + slope + dp * c.cofactor)
        return replace(
            points,
            pressure=modes,
            strain=points.strain + 2 * length * strain.reshape(shape),
            stress=points.stress + length * (stress.reshape(shape) - points.stress),
        )

    def _pressure_modes(self, x: Array, points: PointState) -> Array:
        if not self._continuous:
            return points.pressure
        return x[self.dofs[:, self._u_dofs.shape[1] :]]

    def _chunks(self) -> Iterator[slice]:
        step = max(1, _CHUNK_POINTS // self._weights.shape[1])
        for start in range(0, len(self.elements), step):
            yield slice(start, min(start + step, len(self.elements)))

    def _gradient(self, x: Array, chunk: slice) -> Array:
        """F in one chunk, (3, 3, elements, q)."""
        u = x[self._u_dofs[chunk]].reshape(len(self._u_dofs[chunk]), -1, self._dim)
        f = np.zeros((9, *self._weights[chunk].shape))
        f[0::4] = 1.0
        for i, entries in enumerate(self._components):
            g = self._gradients[i][chunk]
            part = np.matmul(g.reshape(len(g), -1, g.shape[3]), u[:, :, i, None])
            f[list(entries)] += np.moveaxis(part.reshape(g.shape[:3]), 2, 0)
        return f.reshape(3, 3, *f.shape[1:])

    def _point(self, f: Array, p: Array, points: PointState, chunk: slice, tangent: bool) -> _Point:
        law = self.law(points, chunk)
        if points.strain is None or points.stress is None:
            cof = cofactor(f)
            stress = law.first_piola(f) + p * cof
            slope = None
            if tangent:
                slope = law.tangent(f)
                add_cofactor_slope(slope, p, f)
            j = determinant(f, cof)
            return _Point(stress, slope, cof, j, 0.0, float(j.min()))
        # C and S are independent: the material sees the Cholesky factor of C, any rotation of it
        # would do; `turn` brings the result to the displacements
        c = points.strain[:, :, chunk].reshape(3, 3, -1)
        own = _cholesky(c)
        cof = cofactor(own)
        inverse = _inverse(own, cof)
        gap = (right_cauchy_green(f) - c) / 2
        first = law.first_piola(own) + p * cof
        material = law.tangent(own)
        add_cofactor_slope(material, p, own)
        second = product(inverse, first)
        _add_second(material, -second)
        turn = product(f, inverse)
        pulled = product(inverse.swapaxes(0, 1), gap)
        stress = product(turn, first + np.einsum("iakln,kln->ian", material, pulled))
        j = determinant(own, cof) + np.einsum("ian,ian->n", cof, pulled)
        slope = None
        if tangent:
            slope = _turned(material, turn)
            _add_second(slope, points.stress[:, :, chunk].reshape(3, 3, -1))
        return _Point(
            stress,
            slope,
            product(turn, cof),
            j,
            float(np.abs(gap).max()),
            float(determinant(f, cofactor(f)).min()),
            _Independent(inverse, gap, first, material, cof),
        )

    def _divergence(self, stress: Array, w: Array, chunk: slice) -> Array:
        weighted = stress.reshape(9, *w.shape) * w
        result = np.empty((len(w), self._u_dofs.shape[1] // self._dim, self._dim))
        for i, entries in enumerate(self._components):
            g = self._gradients[i][chunk]
            s = np.moveaxis(weighted[list(entries)], 0, 2).reshape(len(w), 1, -1)
            result[:, :, i] = (s @ g.reshape(len(g), -1, g.shape[3]))[:, 0]
        return result.reshape(len(w), -1)

    def _coupling(self, cof: Array, w: Array, phi: Array, chunk: slice) -> Array:
        weighted = cof.reshape(9, *w.shape) * w
        result = np.empty((len(w), self._u_dofs.shape[1] // self._dim, self._dim, phi.shape[2]))
        for i, entries in enumerate(self._components):
            g = self._gradients[i][chunk]
            s = np.moveaxis(weighted[list(entries)], 0, 2)[..., None] * phi[:, :, None]
            flat = g.reshape(len(g), -1, g.shape[3])
            result[:, :, i] = flat.swapaxes(1, 2) @ s.reshape(*flat.shape[:2], phi.shape[2])
        return result.reshape(len(w), self._u_dofs.shape[1], phi.shape[2])

    def _stiffness(
        self, slope: Array | None, w: Array, chunk: slice, dyads: tuple[Array, Array], out: Array
    ) -> None:
        """B^T A B and the product of `dyads`, (elements, dofs, m) and (elements, m, dofs), which
        must be symmetric."""
        assert slope is not None
        gradients = [g[chunk] for g in self._gradients]
        left, right = (np.ascontiguousarray(part) for part in dyads)
        entry = np.zeros((3, 3), dtype=np.int32)
        for component, entries in enumerate(self._components):
            entry[component, : len(entries)] = entries
        given = ffi.new(
            "element_matrices *",
            {
                "elements": len(w),
                "points": w.shape[1],
                "nodes": gradients[0].shape[3],
                "dim": self._dim,
                "modes": left.shape[2],
                "entries": [len(entries) for entries in self._components],
                "entry": entry.reshape(-1).tolist(),
                "gradient": [reals(g) for g in gradients],
                "weight": reals(w),
                "slope": reals(slope),
                "left": reals(left),
                "right": reals(right),
            },
        )
        strides = (step // out.itemsize for step in out.strides[:2])
        if not lib.elements_stiffness(given, reals(out), *strides):
            raise MemoryError(f"no room for the matrices of {len(w)} elements")


@dataclass(frozen=True)
class _Independent:
    inverse: Array
    gap: Array
    stress: Array
    material: Array
    cofactor: Array


@dataclass(frozen=True)
class _Point:
    """What the kernels need at the quadrature points of one chunk."""

    stress: Array
    tangent: Array | None
    cofactor: Array
    j: Array
    gap_size: float
    least: float
    own: _Independent | None = None


class _Store:
    """Point data of every chunk side by side; empty where nothing is to be kept."""

    def __init__(self, n: int) -> None:
        self.gradient = np.empty((3, 3, n))
        self.inverse = np.empty((3, 3, n))
        self.gap = np.empty((3, 3, n))
        self.stress = np.empty((3, 3, n))
        self.cofactor = np.empty((3, 3, n))
        self.material = np.empty((3, 3, 3, 3, n))

    def put(self, chunk: slice, n_points: int, f: Array, at: _Point) -> None:
        if at.own is None or not self.gradient.size:
            return
        where = slice(chunk.start * n_points, chunk.stop * n_points)
        self.gradient[..., where] = f
        self.inverse[..., where] = at.own.inverse
        self.gap[..., where] = at.own.gap
        self.stress[..., where] = at.own.stress
        self.cofactor[..., where] = at.own.cofactor
        self.material[..., where] = at.own.material


def _in_parallel(work: Callable[[slice], _T], chunks: list[slice]) -> list[_T]:
    workers = min(len(chunks), available_threads(), _MAX_WORKERS)
    if workers == 1:
        return [work(chunk) for chunk in chunks]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(work, chunks))


def volume_ratio(volume: Volumetric, pressure: Array) -> tuple[Array, Array]:
    """J with U'(J) = p, and dJ/dp in 1/Pa: the derivatives of the conjugate energy U*(p).

    Not a number where U' never reaches p: a line search may ask there.
    """
    j = np.ones_like(pressure)
    with np.errstate(all="ignore"):
        for _ in range(_VOLUME_ITERATIONS):
            miss = (pressure - volume.pressure(j)) / volume.stiffness(j)
            # never past zero volume: U' of some laws has a pole there
            j = np.maximum(j + miss, j / 4)
            if not np.any(np.abs(miss) > 1e-14 * np.abs(j)):
                break
        found = np.abs(miss) <= 1e-12 * np.abs(j)
        j = np.where(found & np.isfinite(j), j, np.nan)
        return j, 1 / volume.stiffness(j)


def _pressure_nodes(d: Discretisation) -> Integers:
    assert d.pressure_connectivity is not None
    return d.pressure_connectivity


def _unique_arrays(arrays: tuple[Array, ...], elements: Integers) -> tuple[Array, ...]:
    """`arrays` for some elements; arrays that are one in memory stay one."""
    kept = {id(a): np.ascontiguousarray(a[elements]) for a in arrays}
    return tuple(kept[id(a)] for a in arrays)


def _inverse(f: Array, cof: Array) -> Array:
    return np.ascontiguousarray(cof.swapaxes(0, 1) / determinant(f, cof))


def _cholesky(c: Array) -> Array:
    """The upper triangular F with F^T F = C, (3, 3, n); not a number where C is not a strain."""
    u = np.zeros_like(c)
    with np.errstate(invalid="ignore", divide="ignore"):
        u[0, 0] = np.sqrt(c[0, 0])
        u[0, 1] = c[0, 1] / u[0, 0]
        u[0, 2] = c[0, 2] / u[0, 0]
        u[1, 1] = np.sqrt(c[1, 1] - u[0, 1] ** 2)
        u[1, 2] = (c[1, 2] - u[0, 1] * u[0, 2]) / u[1, 1]
        u[2, 2] = np.sqrt(c[2, 2] - u[0, 2] ** 2 - u[1, 2] ** 2)
    return u


def _add_second(tangent: Array, second: Array) -> None:
    """Add d_ik S_jl to A_ijkl in place."""
    for i in range(3):
        tangent[i, :, i] += second


def _turned(material: Array, turn: Array) -> Array:
    """turn_ia turn_kb H_ajbl, (3, 3, 3, 3, n)."""
    half = np.einsum("ian,ajbln->ijbln", turn, material)
    return np.asarray(np.einsum("kbn,ijbln->ijkln", turn, half))


__all__ = ["Condensed", "Evaluation", "Solid", "volume_ratio"]
