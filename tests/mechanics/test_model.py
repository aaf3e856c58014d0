"""Prediction by name, responses between their points, and the table of `rig predict`."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.cli.main import main
from rig.mechanics.beam import BeamTheory
from rig.mechanics.cad.parts import parts_of
from rig.mechanics.errors import MechanicsError
from rig.mechanics.model import available_models, predict
from rig.mechanics.response import Response
from rig.mechanics.simulate.families import FAMILIES
from rig.mechanics.table import COLUMNS, round_pressures, rows
from rig.spec.actuator import Geometry
from rig.spec.workspace import Workspace, library_root

REPOSITORY = Path(__file__).resolve().parents[2]
DEFAULT = Path(__file__).parents[1] / "specs/bellow-bending.yaml"  # beam theory alone
CONTRACT = (
    "model,pressure_kpa,angle_deg,displacement_mm,blocked_force_g,volume_ml,max_von_mises_kpa"
)


@pytest.fixture(scope="module")
def response(default_actuator, agilus30):
    return predict(default_actuator, agilus30, "beam", np.arange(0, 11) * 1e3)


def test_beam_response_agrees_with_the_theory(response, default_geometry, agilus30):
    theory = BeamTheory.of(default_geometry, agilus30)
    np.testing.assert_allclose(response.angle, theory.angle(response.pressure))
    np.testing.assert_allclose(response.displacement, theory.length_difference(response.pressure))
    assert response.model == "beam"
    assert response.max_von_mises is None
    assert np.all(np.diff(response.volume) > 0)
    assert np.all(np.diff(response.blocked_force) > 0)


def test_an_unknown_model_is_told_which_there_are(default_actuator, agilus30):
    assert available_models("bellow-bending") == ("beam", "fe")
    with pytest.raises(MechanicsError, match=r"no model 'shell'.*has: beam, fe\."):
        predict(default_actuator, agilus30, "shell", [0.0, 1e3])


def test_every_family_has_all_that_a_family_needs():
    """A registry that a new family was left out of answers with a KeyError, not with a sentence."""
    tags = {
        get_args(g.model_fields["family"].annotation)[0] for g in get_args(get_args(Geometry)[0])
    }
    assert {f for f in tags if "fe" in available_models(f)} == tags == set(FAMILIES)
    library = Workspace(library_root(), is_library=True)
    shipped = [library.actuator(p.stem) for p in (library_root() / "models/actuators").glob("*")]
    assert {spec.geometry.family for spec in shipped} == tags
    for spec in shipped:
        assert any(part.is_soft for part in parts_of(spec.geometry))


@pytest.mark.parametrize(
    ("pressures", "complaint"),
    [
        ([], "non-empty"),
        ([0.0, np.nan], "finite"),
        ([0.0, np.inf], "finite"),
        ([[0.0, 1e3]], "row"),
        ([1e3, 0.0], "ascend"),
        ([0.0, 1e3, 1e3], "ascend"),
        ([-1e3, 1e3], "from 0 up"),
        ([0.0, 12.1e3], r"limit of 12 kPa of actuator 'default'"),
    ],
)
def test_pressures_that_make_no_sense_are_refused(default_actuator, agilus30, pressures, complaint):
    with pytest.raises(MechanicsError, match=complaint):
        predict(default_actuator, agilus30, "beam", pressures)


def test_pressures_beyond_unfolding_are_refused(default_actuator, agilus30):
    strong = default_actuator.model_copy(
        update={"limits": default_actuator.limits.model_copy(update={"pressure": 40e3})}
    )
    predict(strong, agilus30, "beam", [14.6e3])
    with pytest.raises(MechanicsError, match=r"ends at 14\.64 kPa.*unfolded"):
        predict(strong, agilus30, "beam", [0.0, 14.7e3])


def test_a_bend_beyond_a_half_turn_is_refused(default_actuator, agilus30):
    geometry = default_actuator.geometry.model_copy(update={"bellow_number": 7})
    many = default_actuator.model_copy(
        update={
            "geometry": geometry,
            "limits": default_actuator.limits.model_copy(update={"pressure": 40e3}),
        }
    )
    with pytest.raises(MechanicsError, match=r"12\.31 kPa.*half turn"):
        predict(many, agilus30, "beam", [13e3])


def test_interpolation_passes_through_its_points_and_is_monotone_between(response):
    again = response.at(response.pressure)
    for name in ("angle", "displacement", "blocked_force", "volume"):
        np.testing.assert_allclose(getattr(again, name), getattr(response, name), rtol=1e-12)
    fine = response.at(np.linspace(0, 10e3, 997))
    assert np.all(np.diff(fine.volume) > 0)
    assert fine.max_von_mises is None


def test_interpolation_agrees_with_the_model_between_the_points(
    response, default_actuator, agilus30
):
    between = np.arange(0.5, 10) * 1e3
    exact = predict(default_actuator, agilus30, "beam", between)
    guess = response.at(between)
    np.testing.assert_allclose(guess.angle, exact.angle, rtol=1e-12)
    growth = response.volume[-1] - response.volume[0]
    np.testing.assert_allclose(guess.volume, exact.volume, atol=1e-4 * growth)


@pytest.mark.parametrize("pressure", [-1.0, 10.001e3, np.nan])
def test_interpolation_does_not_extrapolate(response, pressure):
    with pytest.raises(MechanicsError, match="covers 0 to 10 kPa"):
        response.at(pressure)


def test_a_response_of_one_point_answers_for_that_point(default_actuator, agilus30):
    single = predict(default_actuator, agilus30, "beam", [5e3])
    assert single.at(5e3).angle == pytest.approx(single.angle)
    with pytest.raises(MechanicsError):
        single.at(5.1e3)


@given(share=st.floats(0, 1), quantity=st.sampled_from(["angle", "volume"]))
def test_control_of_a_quantity_inverts_the_response(response, share, quantity):
    known = getattr(response, quantity)
    value = known[0] + share * (known[-1] - known[0])
    pressure = response.pressure_for(quantity, value)
    assert getattr(response.at(pressure), quantity)[0] == pytest.approx(value, rel=1e-9, abs=1e-15)


def test_a_quantity_that_is_never_reached_is_refused(response):
    with pytest.raises(MechanicsError, match=r"reaches 0 to 114\.6 deg .* 120 deg"):
        response.pressure_for("angle", np.radians([60, 120]))
    with pytest.raises(MechanicsError, match=r"12\.8 to 16\.5 mL"):
        response.pressure_for("volume", 17e-6)


def test_a_quantity_that_falls_cannot_be_controlled():
    pressure = np.array([0.0, 1e3, 2e3])
    folding = Response("odd", pressure, pressure * 1e-4, pressure, None, 2e-5 - pressure * 1e-9)
    with pytest.raises(MechanicsError, match="cannot be controlled"):
        folding.pressure_for("volume", 1.9e-5)


def test_table_is_in_field_units_with_the_columns_of_the_contract(response):
    assert ",".join(COLUMNS) == CONTRACT
    row = dict(zip(COLUMNS, rows(response)[5], strict=True))
    assert row["model"] == "beam"
    assert row["pressure_kpa"] == 5.0
    assert row["angle_deg"] == pytest.approx(np.degrees(response.angle[5]))
    assert row["displacement_mm"] == pytest.approx(response.displacement[5] * 1e3)
    assert row["blocked_force_g"] == pytest.approx(response.blocked_force[5] / 9.80665e-3)
    assert row["volume_ml"] == pytest.approx(response.volume[5] * 1e6)
    assert row["max_von_mises_kpa"] is None


def _rig(*arguments):
    with pytest.raises(SystemExit) as exit_:
        main([str(argument) for argument in arguments])
    return exit_.value.code


def _read(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_predict_writes_the_contracts_csv(tmp_path, capsys):
    path = tmp_path / "beam.csv"
    assert _rig("predict", "--actuator", DEFAULT, "--model", "beam", "--csv", path) == 0
    assert path.read_text(encoding="utf-8").splitlines()[0] == CONTRACT
    table = _read(path)
    assert [float(row["pressure_kpa"]) for row in table] == list(range(11))
    assert float(table[10]["angle_deg"]) == pytest.approx(114.633, abs=1e-3)
    assert {row["max_von_mises_kpa"] for row in table} == {""}
    assert "114.633" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("limit", "last"), [(12, 10), (40, 40), (54, 50), (200, 200), (9.5, 8), (1, 1)]
)
def test_default_pressures_are_ten_round_steps_up_to_the_limit(limit, last):
    np.testing.assert_allclose(round_pressures(1e3 * limit), np.linspace(0, 1e3 * last, 11))


def test_predict_takes_ranges_with_units(tmp_path):
    path = tmp_path / "table.csv"
    assert (
        _rig("predict", "--actuator", DEFAULT, "--pressures", "0:5000:2500 Pa", "--csv", path) == 0
    )
    assert [float(row["pressure_kpa"]) for row in _read(path)] == [0, 2.5, 5]


@pytest.mark.parametrize(
    ("control", "targets", "column", "expected"),
    [
        ("angle", "0:90:45", "angle_deg", [0, 45, 90]),
        ("volume", "13:15:1", "volume_ml", [13, 14, 15]),
        # 66 mm of bellows bent by a quarter turn are an arc of 42 mm
        ("radius", f"{66 / (np.pi / 2)!r} mm", "angle_deg", [90]),
    ],
)
def test_predict_inverts_for_a_controlled_quantity(tmp_path, control, targets, column, expected):
    path = tmp_path / "table.csv"
    arguments = ("--control", control, "--targets", targets, "--csv", path)
    assert _rig("predict", "--actuator", DEFAULT, *arguments) == 0
    assert [float(row[column]) for row in _read(path)] == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("--model", "shell"), "this version has: beam, fe"),
        (("--model", ""), "this version has: beam, fe"),
        (("--pressures", "0:20:1"), "limit of 12 kPa"),
        (("--pressures", "0:10:3"), "whole number"),
        (("--pressures", "0:10"), "START:STOP:STEP"),
        (("--pressures", "0:10:0"), "START:STOP:STEP"),
        (("--pressures", "0:1e9:0.001"), "below 100000"),
        (("--pressures", "0:10:1 mm"), "pressure"),
        (("--pressures", "ten"), "START:STOP:STEP"),
        (("--control", "angle"), "--targets"),
        (("--control", "radius", "--targets", "0"), "above zero"),
        (("--targets", "0:90:10"), "--control"),
        (("--control", "angle", "--targets", "0:150:50"), "reaches 0 to 114.6 deg"),
        (("--csv", "no-such-folder/x.csv"), "existing folder"),
    ],
)
def test_predict_explains_what_it_cannot_do(arguments, complaint, capsys):
    assert _rig("predict", "--actuator", DEFAULT, *arguments) != 0
    said = " ".join(capsys.readouterr().err.replace("│", " ").split())
    assert complaint in said
    assert "Traceback" not in said


def test_a_response_that_ended_early_is_not_a_number_from_there_on(default_actuator, agilus30):
    whole = predict(default_actuator, agilus30, "beam", np.arange(0.0, 5e3, 1e3))
    cut = replace(whole, angle=np.where(whole.pressure > 2e3, np.nan, whole.angle))
    there = cut.at([0.0, 1.5e3, 2e3, 2.5e3, 4e3])
    known = np.interp([0.0, 1.5e3, 2e3], whole.pressure, whole.angle)  # beam theory is linear
    np.testing.assert_allclose(there.angle[:3], known, rtol=1e-12)
    assert np.all(np.isnan(there.angle[3:]))
    assert np.all(np.isfinite(there.volume))
    assert cut.pressure_for("angle", [known[1]]) == pytest.approx([1.5e3])
    with pytest.raises(MechanicsError, match=r"between 0 and 2 kPa"):
        cut.pressure_for("angle", [whole.angle[3]])
