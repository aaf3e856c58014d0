"""The virtual specimen: monotone, perturbed, seeded, stiffening as documented."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from rig.mechanics.errors import MechanicsError
from rig.mechanics.model import predict
from rig.mechanics.profile import cavity_volume
from rig.plant.beam_truth import STIFFENING_ANGLE, stiffened
from rig.plant.errors import SpecimenError
from rig.plant.specimen import draw_specimen
from rig.spec.workspace import Workspace

LIBRARY = Workspace(Path(__file__).parents[2])
ACTUATORS = [
    name
    for name in LIBRARY.names("actuator")
    if LIBRARY.actuator(name).geometry.family == "bellow-bending"
]
TABLES = ("deformation", "blocked_force", "volume_free", "volume_blocked")
NOTHING = dict.fromkeys(
    (
        "wall_thickness",
        "young_modulus",
        "gravity_offset",
        "gravity_offset_spread",
        "stiffening",
        "stiffening_spread",
    ),
    0.0,
)


@pytest.fixture(scope="module")
def variation():
    return LIBRARY.bench("virtual-beam").virtual.specimen


@pytest.fixture(scope="module")
def actuator():
    return LIBRARY.actuator("bellow-bending")


@pytest.fixture(scope="module")
def material(actuator):
    return LIBRARY.material(actuator.material)


@pytest.fixture(scope="module")
def many(actuator, material, variation):
    return [printed(actuator, material, variation, seed) for seed in range(60)]


def printed(actuator, material, variation, seed=1):
    return draw_specimen(actuator, material, variation, np.random.default_rng(seed))


@pytest.mark.parametrize("name", ACTUATORS)
def test_every_shipped_actuator_grows_strictly_with_pressure_at_several_seeds(name, variation):
    actuator = LIBRARY.actuator(name)
    material = LIBRARY.material(actuator.material)
    for seed in range(4):
        specimen = printed(actuator, material, variation, seed)
        for table in TABLES:
            assert np.all(np.diff(getattr(specimen, table)) > 0), (seed, table)


def test_an_actuator_that_does_not_bend_is_refused_by_name(variation):
    actuator = LIBRARY.actuator("bellow-axisymmetric")
    with pytest.raises(MechanicsError, match="'bellow-axisymmetric'"):
        printed(actuator, LIBRARY.material(actuator.material), variation)


def test_the_tables_reach_from_a_slight_vacuum_to_well_above_the_limit(
    actuator, material, variation
):
    pressure = printed(actuator, material, variation).pressure
    assert pressure[0] == -2e3
    assert pressure[-1] >= 1.6 * actuator.limits.pressure
    assert np.ptp(np.diff(pressure)) < 1e-6
    assert 0.0 in pressure


def test_a_strong_actuator_gets_longer_tables(actuator, material, variation):
    limits = actuator.limits.model_copy(update={"pressure": 14e3})
    strong = actuator.model_copy(update={"limits": limits})
    assert printed(strong, material, variation).pressure[-1] >= 14e3 * 5 / 3


def test_the_same_seed_prints_the_same_specimen(actuator, material, variation):
    first, second = (printed(actuator, material, variation, 7) for _ in range(2))
    for table in TABLES:
        np.testing.assert_array_equal(getattr(first, table), getattr(second, table))


def test_different_seeds_print_different_specimens(many):
    angles = np.degrees([specimen.deformation[-1] for specimen in many])
    assert len(np.unique(angles)) == len(many)
    assert np.ptp(angles) > 5.0


def test_no_specimen_is_the_model_under_validation(many, actuator, material):
    pressure = np.arange(0.0, 10.5e3, 1e3)
    nominal = predict(actuator, material, "beam", pressure).angle
    for specimen in many:
        real = np.interp(pressure, specimen.pressure, specimen.deformation)
        assert specimen.geometry != actuator.geometry
        assert specimen.young_modulus != material.young_modulus.value
        assert np.degrees(np.abs(real - nominal).max()) > 1.0


def test_a_variation_of_nothing_is_refused_because_it_would_be_the_model(
    actuator, material, variation
):
    with pytest.raises(SpecimenError, match="the very model that is to be validated"):
        printed(actuator, material, variation.model_copy(update=NOTHING))


def test_without_stiffening_and_tolerances_only_the_offset_separates_it_from_the_beam(
    actuator, material, variation
):
    only_offset = variation.model_copy(update=NOTHING | {"gravity_offset": np.deg2rad(3.0)})
    specimen = printed(actuator, material, only_offset)
    pressure = np.arange(0.0, 12.5e3, 1e3)
    nominal = predict(actuator, material, "beam", pressure)
    used = np.isin(specimen.pressure, pressure)
    np.testing.assert_allclose(
        specimen.deformation[used] - nominal.angle, np.deg2rad(3.0), atol=1e-12
    )
    np.testing.assert_allclose(specimen.blocked_force[used], nominal.blocked_force, atol=1e-12)


def test_stiffening_takes_its_share_at_the_reference_and_nothing_below_zero():
    linear = np.array([-0.3, 0.0, STIFFENING_ANGLE])
    bent = stiffened(linear, STIFFENING_ANGLE, 0.15)
    np.testing.assert_allclose(bent, [-0.3, 0.0, STIFFENING_ANGLE / 1.15])


def test_angle_and_force_stiffen_with_pressure(actuator, material, variation):
    specimen = printed(actuator, material, variation)
    above = specimen.pressure >= 0
    for table in ("deformation", "blocked_force"):
        assert np.all(np.diff(getattr(specimen, table)[above], 2) < 0)


@pytest.mark.parametrize("tolerance", ["wall_thickness", "young_modulus"])
def test_a_thin_wall_and_a_soft_print_bend_more(actuator, material, variation, tolerance):
    only = variation.model_copy(
        update=NOTHING | {"gravity_offset": np.deg2rad(1.0), tolerance: 0.05}
    )
    prints = [printed(actuator, material, only, seed) for seed in range(6)]
    stiff_first = sorted(prints, key=lambda s: (-s.geometry.wall_thickness, -s.young_modulus))
    assert np.all(np.diff([s.deformation[-1] for s in stiff_first]) > 0)


def test_tolerances_scatter_as_the_bench_says(many, actuator, material):
    walls = np.array([s.geometry.wall_thickness for s in many])
    moduli = np.array([s.young_modulus for s in many])
    assert walls.std() / actuator.geometry.wall_thickness == pytest.approx(0.02, rel=0.25)
    assert moduli.std() / material.young_modulus.value == pytest.approx(0.05, rel=0.25)


def test_the_free_volume_is_the_cavity_at_the_angle(actuator, material, variation):
    specimen = printed(actuator, material, variation)
    seen = specimen.deformation < np.deg2rad(150)
    np.testing.assert_allclose(
        specimen.volume_free[seen], cavity_volume(specimen.geometry, specimen.deformation[seen])
    )


def test_blocked_the_cavity_is_that_of_a_beam_held_at_its_tip(actuator, material, variation):
    """A uniformly loaded clamped beam whose tip rests on a stop, integrated numerically."""
    specimen = printed(actuator, material, variation)
    flexible = specimen.geometry.effective_length
    contact = flexible + 2 * specimen.geometry.wall_thickness
    x = np.linspace(0, contact, 20001)
    soft = x <= flexible

    def turn(curvature):
        return cumulative_trapezoid(np.where(soft, curvature, 0.0), x, initial=0)

    by_moment, by_force = turn(np.ones_like(x)), turn(contact - x)
    force = np.trapezoid(by_moment, x) / np.trapezoid(by_force, x)
    held = 1 - force * by_force[-1] / by_moment[-1]
    bend = specimen.deformation - np.interp(0.0, specimen.pressure, specimen.deformation)
    np.testing.assert_allclose(
        specimen.volume_blocked, cavity_volume(specimen.geometry, held * bend), rtol=1e-5
    )
    assert 0.15 < held < 0.25


def test_the_tables_cannot_be_written_to(actuator, material, variation):
    with pytest.raises(ValueError, match="read-only"):
        printed(actuator, material, variation).deformation[0] = 0.0


def test_a_wall_that_does_not_fit_is_refused_in_the_words_of_the_user(
    actuator, material, variation
):
    tight = actuator.geometry.model_copy(update={"wall_thickness": 2.74e-3})
    actuator = actuator.model_copy(update={"geometry": tight})
    wide = variation.model_copy(update={"wall_thickness": 0.5})
    with pytest.raises(SpecimenError, match="came out with a wall of"):
        printed(actuator, material, wide, seed=1)  # draws a thicker wall
