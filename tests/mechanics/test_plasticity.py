"""Elastic-plastic flow: its derivatives, and problems with closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.mechanics.errors import MechanicsError
from rig.mechanics.fe import (
    Kinematics,
    Model,
    Options,
    Point,
    PressureSurface,
    Solid,
    Support,
    VolumeControl,
    discretise,
    follow,
)
from rig.mechanics.fe.fields import cauchy_stress
from rig.mechanics.hyperelastic import HenckyVolume
from rig.mechanics.hyperelastic.tensors import cofactor, determinant
from rig.mechanics.plasticity import J2Plasticity
from tests.mechanics.fe_problems import driven, meshes, ring

YOUNG, POISSON, YIELD, HARDENING = 80e6, 0.4, 10e6, 6e6
SHEAR, BULK = YOUNG / (2 * (1 + POISSON)), YOUNG / (3 * (1 - 2 * POISSON))
EVA = J2Plasticity(SHEAR, YIELD, HARDENING)
GROWN = 3e-3
"""Volume of the bore at the limit, relative to that at rest, less one."""
SHARP = Options(tolerance=1e-9, correction=0.0)


def strained(seed: int, size: float, points: int = 6) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.eye(3)[..., None] + size * rng.uniform(-1, 1, (3, 3, points))


@given(seed=st.integers(0, 10**6), before=st.floats(0.0, 0.4), size=st.floats(0.02, 0.3))
@settings(max_examples=25)
def test_stress_and_tangent_are_the_derivatives_of_the_step_s_energy(
    seed: int, before: float, size: float
) -> None:
    history = EVA.afterwards(EVA.virgin((6,)), strained(seed, before))
    step = EVA.since(history)
    f = strained(seed + 1, size)
    stress, tangent = step.first_piola(f), step.tangent(f)
    h = 1e-6
    for k in range(3):
        for m in range(3):
            up, down = f.copy(), f.copy()
            up[k, m] += h
            down[k, m] -= h
            slope = (step.energy(up) - step.energy(down)) / (2 * h)
            np.testing.assert_allclose(slope, stress[k, m], atol=3e-6 * SHEAR)
            by_f = (step.first_piola(up) - step.first_piola(down)) / (2 * h)
            # a point whose difference straddles the yield surface has no tangent to compare with
            here = [step.flow(logs_of(step, x)).yields for x in (up, down)]
            smooth = here[0] == here[1]
            np.testing.assert_allclose(
                by_f[..., smooth], tangent[:, :, k, m][..., smooth], atol=1e-5 * SHEAR
            )
    np.testing.assert_allclose(tangent, np.moveaxis(tangent, (2, 3), (0, 1)), atol=1e-9 * SHEAR)


def logs_of(step, f: np.ndarray) -> np.ndarray:
    trial = np.einsum("ikn,kjn->nij", f, step.inverse)
    logs = np.log(np.linalg.svd(trial, compute_uv=False)).T
    return logs - logs.mean(axis=0)


@given(seed=st.integers(0, 10**6))
@settings(max_examples=15)
def test_flow_keeps_the_volume_and_ends_on_the_yield_surface(seed: int) -> None:
    before = EVA.afterwards(EVA.virgin((6,)), strained(seed + 1, 0.3))
    f = strained(seed, 0.3)
    history = EVA.afterwards(before, f)
    inverse = history[:9].reshape(3, 3, -1)
    np.testing.assert_allclose(determinant(inverse, cofactor(inverse)), 1.0, rtol=1e-12)
    step = EVA.since(history)
    flow = step.flow(logs_of(step, f))
    hardened = YIELD + HARDENING * history[9]
    assert np.all(flow.stress <= hardened * (1 + 1e-12))
    yielded = history[9] > before[9]
    assert yielded.any()
    np.testing.assert_allclose(flow.stress[yielded], hardened[yielded], rtol=1e-12)
    # what has flowed once does not flow again
    np.testing.assert_allclose(EVA.afterwards(history, f), history, atol=1e-14)


def test_a_turned_body_is_stressed_the_same_turned() -> None:
    history = EVA.afterwards(EVA.virgin((6,)), strained(1, 0.2))
    step, f = EVA.since(history), strained(2, 0.2)
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    turned = np.einsum("ij,jkn->ikn", turn, f)
    expected = np.einsum("ij,jkn->ikn", turn, step.first_piola(f))
    np.testing.assert_allclose(step.first_piola(turned), expected, atol=1e-9 * SHEAR)
    np.testing.assert_allclose(
        EVA.afterwards(history, turned), EVA.afterwards(history, f), atol=1e-12
    )


@pytest.mark.parametrize("constants", [(0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, -0.1)])
def test_constants_of_no_solid_are_refused(constants: tuple[float, float, float]) -> None:
    with pytest.raises(MechanicsError, match="no solid flows like"):
        J2Plasticity(*constants)


@pytest.mark.parametrize("mixed", [True, False])
@pytest.mark.parametrize("mixed_points", [True, False])
def test_a_bar_is_drawn_let_go_and_pressed_as_the_closed_form_says(
    mixed: bool, mixed_points: bool
) -> None:
    """Kirchhoff stress over logarithmic strain: bilinear, unloading elastic, yield grown by H."""
    mesh = skfem.MeshQuad().refined(1)
    d = discretise(mesh, Kinematics.AXISYMMETRIC, mixed=mixed)
    solid = Solid(d, EVA, HenckyVolume(BULK))
    foot, top, axis = d.nodes_at(z=0.0), d.nodes_at(z=1.0), d.nodes_at(r=0.0)
    stretch = 0.35
    model = Model(
        d,
        [solid],
        supports=[
            Support.of(d, foot, (1,)),
            Support.of(d, axis, (0,)),
            Support.of(d, top, (1,), stretch),
        ],
    )
    way = [0.2, 0.6, 1.0, 0.9, -0.3]
    result = follow(
        model,
        [Point(0.0, motion=m) for m in way],
        options=Options(tolerance=1e-9, correction=0.0, mixed_points=mixed_points),
    )
    assert result.failure is None
    plastic, hardened = 0.0, 0.0
    for share, solution in zip(way, result.solutions, strict=True):
        strain = np.log1p(share * stretch)
        trial = YOUNG * (strain - plastic)
        excess = max(0.0, abs(trial) - YIELD - HARDENING * hardened)
        plastic += np.sign(trial) * excess / (YOUNG + HARDENING)
        hardened += excess / (YOUNG + HARDENING)
        kirchhoff = YOUNG * (strain - plastic)
        volume = np.exp(kirchhoff / (3 * BULK))
        state = solution.state
        stress = cauchy_stress(solid, state.x, state.points[0])
        np.testing.assert_allclose(stress[1, 1], kirchhoff / volume, rtol=1e-6)
        np.testing.assert_allclose(stress[0, 0], 0.0, atol=1e-6 * YIELD)
        np.testing.assert_allclose(state.points[0].history[9], hardened, rtol=1e-6)
    assert hardened > plastic + 0.1, "the way back must have flowed, too"


@pytest.mark.parametrize("name", meshes())
def test_a_homogeneous_plastic_deformation_passes_the_patch_test(name: str) -> None:
    mesh, kinematics = meshes()[name]
    d = discretise(mesh, kinematics)
    solid = Solid(d, EVA, HenckyVolume(BULK))
    slope = {
        Kinematics.SOLID: [[0.3, 0.2, 0.0], [0.05, -0.2, 0.1], [0.0, 0.1, 0.05]],
        Kinematics.PLANE_STRAIN: [[0.3, 0.2], [0.05, -0.2]],
        Kinematics.AXISYMMETRIC: [[0.2, 0.0], [0.0, -0.25]],
    }[kinematics]
    expected = d.nodes @ np.array(slope).T
    result = follow(driven(d, [solid], np.array(slope)), [Point(0.0)], options=SHARP)
    assert result.failure is None
    state = result.solutions[0].state
    found = state.x[: d.displacement_size].reshape(-1, d.dim)
    np.testing.assert_allclose(found, expected, atol=1e-10)
    strain = state.points[0].history[9]
    assert strain.min() > 0.05
    np.testing.assert_allclose(strain, strain.flat[0], rtol=1e-9)


def limit_pressure(kinematics: Kinematics, radial: int) -> float:
    """Of a perfectly plastic wall of radii 1 and 2, stiff against its yield stress, over that."""
    d = discretise(ring(radial, 4, 1.0, 2.0), kinematics)
    solid = Solid(d, J2Plasticity(1e4, 1.0), HenckyVolume(3e4))
    wall = PressureSurface(d, d.facets_on("bore"))
    model = Model(
        d,
        [solid],
        supports=[
            Support.of(d, np.flatnonzero(np.abs(d.nodes[:, i]) < 1e-9), (i,)) for i in (0, 1)
        ],
        surface=wall,
    )
    # driven by the volume: at the limit no pressure could be prescribed
    volumes = wall.rest_volume * (1 + np.array([2e-4, 1e-3, GROWN]))
    result = follow(model, [Point(v) for v in volumes], VolumeControl())
    assert result.failure is None, result.failure
    pressures = [s.pressure for s in result.solutions]
    assert abs(pressures[2] - pressures[1]) < 5e-3 * pressures[2], "it must have become level"
    return pressures[-1]


@pytest.mark.parametrize(
    ("kinematics", "exponent", "factor"),
    [
        # Hill (1950), Sections V.2 and V.5; s0 / sqrt(3) is the yield stress in shear
        (Kinematics.PLANE_STRAIN, 2, 2 / np.sqrt(3)),
        (Kinematics.AXISYMMETRIC, 3, 2.0),
    ],
)
def test_a_thick_wall_carries_its_plastic_limit_pressure(
    kinematics: Kinematics, exponent: int, factor: float
) -> None:
    # the wall has become a little thinner on the way
    bore, outside = 1 + GROWN, 2.0**exponent + GROWN
    expected = factor * np.log(outside / bore) / exponent
    coarse, fine = (abs(limit_pressure(kinematics, n) / expected - 1) for n in (1, 4))
    assert coarse < 2e-2
    assert fine < 1e-4


def test_a_wall_unloaded_from_its_plastic_state_keeps_the_hill_residual_stress() -> None:
    """A sphere yielded to radius c and let go: hoop stress at the bore s0 - 3/2 p / (1 - a3/b3)
    ... less the yielded one's, by superposing an elastic unloading (Hill, Section V.2)."""
    a, b, c = 1.0, 2.0, 1.2
    d = discretise(ring(10, 6, a, b), Kinematics.AXISYMMETRIC)
    solid = Solid(d, J2Plasticity(1e4, 1.0), HenckyVolume(3e4))
    model = Model(
        d,
        [solid],
        supports=[
            Support.of(d, np.flatnonzero(np.abs(d.nodes[:, i]) < 1e-9), (i,)) for i in (0, 1)
        ],
        surface=PressureSurface(d, d.facets_on("bore")),
    )
    pressure = 2 * np.log(c / a) + 2 / 3 * (1 - c**3 / b**3)
    result = follow(model, [Point(pressure), Point(0.0)])
    assert result.failure is None
    loaded, free = (s.state for s in result.solutions)
    radius = np.linalg.norm(np.moveaxis(np.asarray(d.basis.global_coordinates()), 0, -1), axis=-1)
    flowed = free.points[0].history[9] > 0
    assert radius[flowed].max() == pytest.approx(c, abs=0.06)
    np.testing.assert_array_equal(
        loaded.points[0].history[9] > 0, flowed, "unloading must be elastic"
    )
    hoop = cauchy_stress(solid, free.x, free.points[0])[2, 2]
    r = radius[flowed]
    radial = -2 * np.log(c / r) - 2 / 3 * (1 - c**3 / b**3)
    # loaded hoop stress less Lame's of the pressure taken away
    lame = pressure * (a**3 / (b**3 - a**3)) * (1 + b**3 / (2 * r**3))
    np.testing.assert_allclose(hoop[flowed], radial + 1 - lame, atol=0.02)
