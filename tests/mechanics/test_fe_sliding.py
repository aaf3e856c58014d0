"""Contact of two deformable parts: balance, exact tangent, a lined tube, the friction cone."""

from __future__ import annotations

import numpy as np
import pytest

from rig.mechanics.fe import (
    MeshError,
    Model,
    Point,
    PressureSurface,
    Solid,
    Support,
    discretise,
    follow,
    traction,
)
from rig.mechanics.fe.facets import Facets
from rig.mechanics.fe.rotation import rotation_matrix
from rig.mechanics.fe.sliding import Sliding
from rig.mechanics.hyperelastic import NeoHookean, QuadraticVolume
from rig.mechanics.mesh.lattice import Block, join

APART = 1e-8
PENALTY = 1e10
SOFTNESS = 1e-7
SLIP = 1e-5
YOUNG, POISSON = 100e3, 0.3


def material(young, poisson):
    shear, bulk = young / 2 / (1 + poisson), young / 3 / (1 - 2 * poisson)
    return NeoHookean(shear), QuadraticVolume(bulk)


def sliding(d, **changed):
    options = {"penalty": PENALTY, "friction": 0.0, "direction": (1.0, 0.0, 0.0), "reach": 1e-3}
    fine = {"rim": 1e-4, "softness": SOFTNESS, "slip": SLIP}
    return Sliding(d, d.facets_on("upper"), d.facets_on("lower"), **options | fine | changed)


def stacked(length=2e-3, elements=(2, 1, 1)):
    """A slab (`upper` below it) on a longer one (`lower` above it), along x, all 1 mm high."""

    def slab(start, end, low, count, names):
        axes = [np.linspace(start, end, 2 * count + 1)]
        axes.append(np.linspace(0.0, 1e-3, 2 * elements[1] + 1))
        axes.append(np.linspace(low, low + 1e-3, 2 * elements[2] + 1))
        return Block(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1), names)

    margin = 1e-3
    mesh, named = join(
        [
            slab(-margin, length + margin, 0.0, elements[0] + 2, {"k+": "lower", "k-": "base"}),
            slab(0.0, length, 1e-3 + APART, elements[0], {"k-": "upper", "k+": "top"}),
        ]
    )
    return discretise(mesh.with_boundaries(named, boundaries_only=False))


def whole(d, interface, x, memory):
    residual, _ = interface.evaluate(x, memory)
    total = np.zeros(d.size)
    np.add.at(total, interface.dofs, residual)
    return total.reshape(-1, 3)


@pytest.fixture(scope="module")
def slabs():
    return stacked()


@pytest.fixture
def crumpled(slabs):
    """Displacements that press the slabs into each other by 20 um, unevenly, and drag them."""
    rng = np.random.default_rng(5)
    x = 2e-6 * rng.normal(size=slabs.size)
    above = np.flatnonzero(slabs.nodes[:, 2] > 1e-3 + APART / 2)
    x[3 * above + 2] -= 2e-5
    x[3 * above] += 3e-6
    return x


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_the_tangent_is_the_derivative_of_the_residual(slabs, crumpled, friction):
    interface = sliding(slabs, friction=friction)
    memory = interface.settled(crumpled, interface.virgin(slabs.size))
    x = crumpled + 1e-7 * np.random.default_rng(1).normal(size=slabs.size)
    way = np.random.default_rng(2).normal(size=slabs.size)
    step = 1e-11
    high, low = (interface.evaluate(x + s * step * way, memory)[0] for s in (1, -1))
    _, tangent = interface.evaluate(x, memory)
    exact = np.einsum("pij,pj->pi", tangent, way[interface.dofs])
    numeric = (high - low) / (2 * step)
    # friction leaves out how its direction turns with the crumpled surface
    most = 1e-5 if friction == 0 else 5e-2
    assert np.abs(numeric - exact).max() < most * np.abs(exact).max()
    assert np.abs(tangent - tangent.swapaxes(1, 2)).max() < 1e-12 * np.abs(tangent).max()


def test_forces_and_moments_balance(slabs, crumpled):
    interface = sliding(slabs)
    force = whole(slabs, interface, crumpled, interface.virgin(slabs.size))
    place = slabs.nodes + crumpled.reshape(-1, 3)
    size = np.abs(force).sum()
    assert size > 1e-3
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * size
    assert np.abs(np.cross(place, force).sum(axis=0)).max() < 1e-12 * size * np.ptp(place)


def test_turning_together_turns_the_forces(slabs, crumpled):
    interface = sliding(slabs, friction=0.4)
    memory = interface.settled(crumpled, interface.virgin(slabs.size))
    turn = rotation_matrix(np.array([0.4, -0.9, 0.3]))
    place = slabs.nodes + crumpled.reshape(-1, 3)
    turned = (place @ turn.T - slabs.nodes).reshape(-1)
    before = whole(slabs, interface, crumpled, memory)
    after = whole(slabs, interface, turned, memory)
    assert np.abs(after - before @ turn.T).max() < 1e-9 * np.abs(before).max()


def pressed(d, interface, load):
    """Slabs that cannot widen, the upper one pressed down by `load` in Pa and moved along x."""
    sides = np.flatnonzero((d.nodes[:, 1] < 1e-9) | (d.nodes[:, 1] > 1e-3 - 1e-9))
    return Model(
        d,
        [Solid(d, *material(YOUNG, POISSON))],
        supports=[
            Support.of(d, sides, (1,)),
            Support.of(d, d.nodes_on("top"), (0,), 1.0),
            Support.of(d, d.nodes_on("base"), (0, 1, 2)),
        ],
        dead_load=traction(d, d.facets_on("top"), np.array([0.0, 0.0, -load])),
        interfaces=[interface],
    )


def test_a_block_sticks_and_then_slides_with_mu_times_its_load(slabs):
    load, friction = 2e3, 0.3
    interface = sliding(slabs, friction=friction)
    model = pressed(slabs, interface, load)
    ways = [0.0, 0.0, 1e-6, 2e-6, 4e-5, 5e-5, 6e-5, 7e-5]
    result = follow(model, [Point(0.0, motion=w) for w in ways])
    assert result.failure is None
    top = 3 * slabs.nodes_on("top")
    pull = np.array([s.residual[top].sum() for s in result.solutions])
    limit = friction * load * 2e-3 * 1e-3
    # pressure moves towards the leading edge, where points creep anew before they slide
    assert pull[-1] == pytest.approx(0.975 * limit, rel=0.025)
    assert np.all(pull <= limit * (1 + 1e-3))
    assert 0.01 * limit < pull[2] < 0.3 * limit
    assert pull[3] == pytest.approx(2 * pull[2], rel=0.05)
    last, before = (s.state for s in result.solutions[:-3:-1])
    felt = interface.grip(last.x, before.memories[0])
    late = interface.grip(before.x, before.memories[0])
    assert np.all(felt.drag <= friction * late.pressure * (1 + 1e-2) + 1e-3)
    assert np.mean(felt.drag > 0.99 * friction * late.pressure) > 0.5, "most of it slides"
    assert felt.pressure @ felt.area == pytest.approx(load * 2e-6, rel=5e-3)


def test_what_slides_off_the_rim_is_let_go():
    """Half of the slab hangs over: nothing presses there, all presses on the rest."""
    d = stacked()
    interface = sliding(d, reach=2.5e-3)
    x = np.zeros(d.size)
    above = np.flatnonzero(d.nodes[:, 2] > 1e-3 + APART / 2)
    x[3 * above] += 2e-3
    x[3 * above + 2] -= 1e-6
    memory = interface.settled(x, interface.virgin(d.size))
    felt = interface.grip(x, memory)
    beyond = felt.places[:, 0] + 2e-3 > 3e-3 + 1e-4
    on = felt.places[:, 0] + 2e-3 < 3e-3
    assert beyond.any()
    assert on.any()
    assert np.all(felt.pressure[beyond] == 0)
    assert np.all(np.isnan(felt.gap[beyond]))
    assert felt.pressure[on] == pytest.approx(PENALTY * (1e-6 - APART), rel=1e-6)


def lined_tube(around=4):
    """A quarter of a core, 2 to 4 mm, in a stiff lining of 0.1 mm, a short piece along x."""

    def tube(low, high, count, names, gap):
        r, a, x = (
            np.linspace(low, high, 2 * count + 1),
            np.linspace(0.0, np.pi / 2, 2 * around + 1),
            np.linspace(0.0, 1e-3, 3),
        )
        r, a, x = np.meshgrid(r + gap, a, x, indexing="ij")
        return Block(np.stack((x, r * np.sin(a), r * np.cos(a)), axis=-1), names)

    mesh, named = join(
        [
            tube(2e-3, 4e-3, 2, {"i-": "cavity", "i+": "upper"}, 0.0),
            tube(4e-3, 4.1e-3, 1, {"i-": "lower"}, APART),
        ]
    )
    return discretise(mesh.with_boundaries(named, boundaries_only=False))


def test_a_thin_curved_facet_knows_its_outside():
    """Its nodes' mean lies beyond it: the arc rises higher than the lining is thick."""
    d = lined_tube(around=2)
    facets = Facets.of(d, d.facets_on("lower"))
    places, normals = facets.at(np.zeros(d.size), np.array([[0.5, 0.5]]))
    assert np.all(np.einsum("fqi,fqi->f", places * [0, 1, 1], normals) < 0)


def test_pressure_goes_through_a_lined_tube_as_lame_says():
    """Plane strain: the core's outside moves as the lining's inside and what the contact yields.

    u_core = (1 + nu)/E / (b^2 - a^2) ((1 - 2 nu) b (a^2 p - b^2 q) + a^2 b (p - q)), and likewise
    the lining under q within (Lame); q yields q / e beyond the clearance.
    """
    a, b, c, p = 2e-3, 4e-3, 4.1e-3, 500.0
    soft, stiff = (10 * YOUNG, 0.49), (3e7, 0.38)
    d = lined_tube()
    middle = np.hypot(*d.nodes[d.connectivity].mean(axis=1)[:, 1:].T)
    core, lining = np.flatnonzero(middle < b * 0.99), np.flatnonzero(middle >= b * 0.99)
    interface = sliding(d, softness=APART)
    every = np.arange(len(d.nodes))
    model = Model(
        d,
        [
            Solid(d, *material(*soft), elements=core),
            Solid(d, *material(*stiff), elements=lining),
        ],
        supports=[
            Support.of(d, every, (0,)),
            Support.of(d, d.nodes_at(y=0.0), (1,)),
            Support.of(d, np.flatnonzero(np.abs(d.nodes[:, 2]) < 1e-12), (2,)),
        ],
        surface=PressureSurface(d, d.facets_on("cavity")),
        interfaces=[interface],
    )
    result = follow(model, [Point(p)])
    assert result.failure is None
    state = result.solutions[0].state
    felt = interface.grip(state.x, state.memories[0])

    def outside(inner, outer, young, poisson, at, within, beyond):
        """Radial displacement at `at` of a tube under pressures within and beyond."""
        factor = (1 + poisson) / young / (outer**2 - inner**2)
        even = (1 - 2 * poisson) * at * (inner**2 * within - outer**2 * beyond)
        return factor * (even + inner**2 * outer**2 / at * (within - beyond))

    def overlap(q):
        core_out = outside(a, b, *soft, b, p, q)
        return core_out - outside(b, c, *stiff, b, q, 0.0) - APART - q / PENALTY

    # linear in q
    q = overlap(0.0) / (overlap(0.0) - overlap(1.0))
    assert q > p / 10
    assert np.all(felt.gap < -APART), "beyond where the onset is rounded off"
    assert felt.pressure @ felt.area / felt.area.sum() == pytest.approx(q, rel=5e-3)
    assert felt.pressure == pytest.approx(q, rel=2e-2)


def test_parts_that_are_nowhere_near_are_refused(slabs):
    with pytest.raises(MeshError, match="no point of the sliding part"):
        Sliding(
            slabs,
            slabs.facets_on("top"),
            slabs.facets_on("base"),
            penalty=PENALTY,
            direction=(1.0, 0.0, 0.0),
            reach=1e-4,
            rim=1e-4,
            softness=SOFTNESS,
            slip=SLIP,
        )
