"""Newton and the path: convergence, control, cut-back, failures that tell, cancellation."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from rig.mechanics.fe import (
    AngleControl,
    DisplacementControl,
    Kinematics,
    Model,
    Options,
    Point,
    PressureSurface,
    Progress,
    Solid,
    Support,
    VolumeControl,
    discretise,
    follow,
    gravity,
    rotation_vector,
)
from rig.mechanics.fe.control import PressureControl
from rig.mechanics.fe.errors import SingularError
from rig.mechanics.fe.frontal import Multifrontal
from rig.mechanics.fe.linear import SuperLU
from rig.mechanics.fe.newton import Target, solve_step
from rig.mechanics.hyperelastic import (
    Mode,
    MooneyRivlin,
    NeoHookean,
    QuadraticVolume,
    check_stability,
)
from tests.mechanics.fe_problems import bending_tube, ring

KPA = 1e3
PRESSURES = (10 * KPA, 20 * KPA, 30 * KPA)
NEO_HOOKEAN = NeoHookean(1.0)
SHARP = Options(tolerance=1e-9, correction=0.0)


@pytest.fixture(scope="module")
def tube():
    return bending_tube()


@pytest.fixture(scope="module")
def inflated(tube):
    result = follow(tube.model, [Point(p) for p in PRESSURES], options=SHARP)
    assert result.failure is None
    return result


def _angles(result) -> np.ndarray:
    return np.array([rotation_vector(s.state.poses[0].rotation)[1] for s in result.solutions])


@pytest.mark.parametrize("mixed_points", [True, False])
def test_newton_converges_quadratically(tube, mixed_points: bool) -> None:
    options = Options(tolerance=1e-12, correction=0.0, mixed_points=mixed_points, extrapolate=False)
    result = follow(tube.model, [Point(20 * KPA)], options=options)
    assert result.failure is None
    residuals = np.array([i.residual for i in result.history[-1].iterations[1:]])
    tail = residuals[residuals > 1e-12][-3:]
    orders = [np.log(b) / np.log(a) for a, b in itertools.pairwise(tail) if a < 1e-2]
    assert orders
    assert min(orders) > 1.7
    assert residuals[-1] < 1e-12


def test_mixed_points_and_plain_newton_find_the_same_equilibrium(tube, inflated) -> None:
    plain = follow(
        tube.model, [Point(p) for p in PRESSURES], options=replace(SHARP, mixed_points=False)
    )
    np.testing.assert_allclose(_angles(plain), _angles(inflated), rtol=1e-7)
    for a, b in zip(plain.solutions, inflated.solutions, strict=True):
        np.testing.assert_allclose(a.state.x, b.state.x, atol=1e-7 * np.abs(a.state.x).max())


def test_the_default_tolerance_leaves_no_trace_in_the_angle(tube, inflated) -> None:
    quick = follow(tube.model, [Point(p) for p in PRESSURES])
    np.testing.assert_allclose(_angles(quick), _angles(inflated), rtol=2e-5)
    assert quick.solves < inflated.solves


def test_the_first_step_of_a_path_is_as_short_as_told_and_the_others_are_not(tube) -> None:
    points = [Point(p) for p in (0.0, 10 * KPA, 20 * KPA)]
    result = follow(tube.model, points, options=replace(SHARP, first_step=0.35))
    assert result.failure is None
    taken = [(step.point, step.fraction) for step in result.history]
    # on the way to the first point the dead load grows, too
    assert taken == [(0, 1.0), (1, 0.35), (1, 1.0), (2, 1.0)]


def test_where_it_was_told_not_to_alternate_a_failed_step_is_only_cut(tube) -> None:
    few = Options(iterations=2, least_step=1 / 4)
    for alternate in (True, False):
        result = follow(tube.model, [Point(200 * KPA)], options=replace(few, alternate=alternate))
        assert result.failure is not None
        tried = [(step.fraction, step.mixed_points) for step in result.history]
        expected = [(f, m) for f in (1.0, 0.5, 0.25) for m in ((True, False)[: 1 + alternate])]
        assert tried == expected


def test_a_step_that_arrives_leaves_out_the_last_tangent(tube, monkeypatch) -> None:
    asked: list[bool] = []
    assemble = tube.model.assemble

    def watched(state, tangent=True):
        asked.append(tangent)
        return assemble(state, tangent)

    monkeypatch.setattr(tube.model, "assemble", watched)
    target = Target(10 * KPA, 1.0, 1.0)
    outcome = solve_step(
        tube.model, tube.model.start(), target, PressureControl(), Multifrontal(), SHARP
    )
    assert outcome.converged
    assert not asked[-1]
    assert asked.count(True) == len(outcome.iterations) - 1, "each iteration had its own"


def test_volume_control_equals_pressure_control(tube, inflated) -> None:
    volumes = [s.volume for s in inflated.solutions]
    result = follow(tube.model, [Point(v) for v in volumes], VolumeControl(), options=SHARP)
    assert result.failure is None
    np.testing.assert_allclose([s.pressure for s in result.solutions], PRESSURES, rtol=1e-6)
    np.testing.assert_allclose(_angles(result), _angles(inflated), rtol=1e-6)


def test_angle_control_equals_pressure_control(tube, inflated) -> None:
    result = follow(
        tube.model, [Point(a) for a in _angles(inflated)], AngleControl(), options=SHARP
    )
    assert result.failure is None
    np.testing.assert_allclose([s.pressure for s in result.solutions], PRESSURES, rtol=1e-6)


def test_symmetric_load_stiffness_changes_nothing_but_the_way(inflated) -> None:
    general = bending_tube(symmetric=False)
    assert not general.model.symmetric
    result = follow(general.model, [Point(p) for p in PRESSURES], options=SHARP)
    np.testing.assert_allclose(_angles(result), _angles(inflated), rtol=1e-7)
    assert result.solves <= inflated.solves + 1


def test_reactions_balance_pressure_and_weight(tube) -> None:
    density, pull = 1160.0, np.array([9.81, 0.0, 0.0])
    weight = gravity(tube.solid, density, pull)
    d = tube.discretisation
    supports = [
        Support.of(d, d.nodes_on("clamp"), (0, 1, 2)),
        Support.of(d, d.nodes_on("symmetry"), (1,)),
    ]
    model = Model(
        d,
        [tube.solid],
        supports=supports,
        surface=tube.surface,
        dead_load=weight,
        bodies=[tube.cap],
    )
    solution = follow(model, [Point(15 * KPA)], options=SHARP).solutions[0]
    reaction = solution.residual.reshape(-1, 3)[d.nodes_on("clamp")].sum(axis=0)
    # the tube is open at the clamp: pressure pulls there on the cross section of the cavity
    area = (5e-3 - 1.5e-3) * (10e-3 - 1.5e-3 - 3e-3)
    total = weight.reshape(-1, 3).sum(axis=0) + 15 * KPA * area * np.array([1.0, 0.0, 0.0])
    np.testing.assert_allclose(reaction[[0, 2]], -total[[0, 2]], atol=1e-6 * total[0])


def test_a_rigid_cap_stays_rigid_and_free_of_resultants(tube, inflated) -> None:
    state = inflated.solutions[-1].state
    cap = tube.cap
    where = tube.discretisation.nodes[cap.nodes]
    moved = where + state.x[cap.dofs].reshape(-1, 3)
    np.testing.assert_allclose(
        np.linalg.norm(moved[1:] - moved[0], axis=1),
        np.linalg.norm(where[1:] - where[0], axis=1),
        rtol=1e-12,
    )
    force = cap.directions(state.poses[0]).T @ inflated.solutions[-1].residual[cap.dofs]
    assert np.abs(force[:2]).max() < 1e-5
    assert _angles(inflated)[-1] > np.radians(1)


def _balloon(energy=NEO_HOOKEAN):
    """A thick sphere: neo-Hookean, its pressure has a maximum at a bore of about 1.9."""
    mesh = ring(3, 6, 1.0, 1.5)
    d = discretise(mesh, Kinematics.AXISYMMETRIC)
    supports = [Support.of(d, d.nodes_at(r=0.0), (0,)), Support.of(d, d.nodes_at(z=0.0), (1,))]
    solid = Solid(d, energy, QuadraticVolume(1e4))
    surface = PressureSurface(d, d.facets_on("bore"))
    bore = 2 * int(d.nodes_at(r=1.0, z=0.0)[0])
    return Model(d, [solid], supports=supports, surface=surface), bore


def _sphere_pressure(bore: float) -> float:
    """mu/2 [4/s + 1/s^4] between outer and inner stretch, incompressible."""
    outer = (1.5**3 + bore**3 - 1) ** (1 / 3) / 1.5

    def primitive(s: float) -> float:
        return -(4 / s + s**-4) / 2

    return primitive(bore) - primitive(outer)


def test_volume_and_displacement_control_pass_a_limit_point() -> None:
    model, bore = _balloon()
    bores = np.array([1.2, 1.5, 1.9, 2.4, 3.0])
    by_bore = follow(
        model, [Point(b - 1) for b in bores], DisplacementControl((bore,)), options=SHARP
    )
    assert by_bore.failure is None
    found = np.array([s.pressure for s in by_bore.solutions])
    np.testing.assert_allclose(found, [_sphere_pressure(b) for b in bores], rtol=2e-3)
    assert found[-1] < found.max()
    by_volume = follow(
        model, [Point(s.volume) for s in by_bore.solutions], VolumeControl(), options=SHARP
    )
    assert by_volume.failure is None
    np.testing.assert_allclose([s.pressure for s in by_volume.solutions], found, rtol=1e-6)


def test_beyond_the_limit_point_pressure_control_keeps_what_it_reached_and_says_where() -> None:
    model, _ = _balloon()
    limit = max(_sphere_pressure(b) for b in np.linspace(1, 3, 500))
    result = follow(model, [Point(0.5 * limit), Point(0.8 * limit), Point(1.3 * limit)])
    assert len(result.solutions) == 2
    assert result.failure is not None
    assert "on the way to pressure" in result.failure
    assert "residual" in result.failure
    reached = max(s.pressure for s in result.history if s.converged)
    assert reached == pytest.approx(limit, rel=0.02)
    assert any(not s.converged for s in result.history)


def test_an_unstable_energy_ends_the_path_where_its_check_says_and_keeps_what_was_reached() -> None:
    energy = MooneyRivlin(0.6, -0.1)
    (limit,) = (r.high for r in check_stability(energy).ranges if r.mode is Mode.EQUIBIAXIAL)
    model, bore = _balloon(energy)
    bores = np.array([1.2, 1.5, 1.9, 2.4, 3.0])
    result = follow(model, [Point(b - 1) for b in bores], DisplacementControl((bore,)))
    assert result.failure is not None
    assert not result.cancelled
    # what is stable throughout is reached; the bore stretches as the test does, the rest less
    assert np.count_nonzero(bores < limit) <= len(result.solutions) < len(bores)
    assert 1.5 < limit < 1.9


def test_steps_are_cut_where_one_is_too_long() -> None:
    model, bore = _balloon()
    options = replace(SHARP, iterations=5)
    result = follow(model, [Point(2.0)], DisplacementControl((bore,)), options=options)
    assert result.failure is None
    failed = [s for s in result.history if not s.converged]
    assert failed
    assert all(s.reason for s in failed)
    direct = follow(model, [Point(2.0)], DisplacementControl((bore,)), options=SHARP)
    assert result.solutions[0].pressure == pytest.approx(direct.solutions[0].pressure, rel=1e-6)


def test_a_watcher_hears_of_every_step_and_can_stop(tube) -> None:
    heard: list[Progress] = []

    def watch(progress: Progress) -> bool:
        heard.append(progress)
        return progress.point < 1

    result = follow(tube.model, [Point(p) for p in PRESSURES], progress=watch)
    assert [h.point for h in heard] == [0, 1]
    assert heard[0].pressure == PRESSURES[0]
    assert len(result.solutions) == 1
    assert result.failure is not None
    assert "cancelled" in result.failure


def test_a_path_continues_from_any_state(tube, inflated) -> None:
    start = inflated.solutions[1].state
    result = follow(tube.model, [Point(PRESSURES[2])], start=start, options=SHARP)
    np.testing.assert_allclose(_angles(result)[-1], _angles(inflated)[-1], rtol=1e-7)


def test_the_record_adds_up(inflated) -> None:
    assert inflated.solver in ("multifrontal", "PARDISO")
    assert inflated.solves == sum(len(s.iterations) - 1 for s in inflated.history)
    assert 0 < inflated.assembly_seconds + inflated.solve_seconds <= inflated.seconds


def test_a_body_that_nothing_holds_is_reported_not_solved() -> None:
    tube = bending_tube()
    model = Model(tube.discretisation, [tube.solid], surface=tube.surface)
    result = follow(model, [Point(KPA)], options=Options(least_step=0.3))
    assert result.failure is not None
    assert not result.solutions


def test_a_singular_matrix_is_named() -> None:
    from scipy import sparse

    with pytest.raises(SingularError, match="singular"):
        SuperLU().factorise(sparse.csc_array(np.diag([1.0, 0.0])))


def test_prescribed_motion_and_its_factor() -> None:
    tube = bending_tube()
    d = tube.discretisation
    supports = [
        Support.of(d, d.nodes_on("clamp"), (0, 1, 2)),
        Support.of(d, d.nodes_on("symmetry"), (1,)),
        Support.of(d, tube.cap.nodes, (0, 2), 1e-3),
    ]
    model = Model(d, [tube.solid], supports=supports, surface=tube.surface)
    result = follow(model, [Point(0.0, motion=m) for m in (0.5, 1.0, -0.2)])
    assert result.failure is None
    for solution, factor in zip(result.solutions, (0.5, 1.0, -0.2), strict=True):
        x = solution.state.x.reshape(-1, 3)[tube.cap.nodes]
        np.testing.assert_allclose(x[:, [0, 2]], factor * 1e-3, atol=1e-12)


def test_one_step_can_be_taken_alone(tube) -> None:
    from rig.mechanics.fe.control import PressureControl

    outcome = solve_step(
        tube.model,
        tube.model.start(),
        Target(5 * KPA, 1.0, 1.0),
        PressureControl(),
        SuperLU(),
        replace(SHARP, mixed_points=False),
    )
    assert outcome.converged
    assert outcome.state.pressure == 5 * KPA
