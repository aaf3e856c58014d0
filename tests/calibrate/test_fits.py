"""Fits against the GUM's worked example, made-up instruments, and bad points."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from rig.calibrate.air import BUOYANCY
from rig.calibrate.curve import fit_curve
from rig.calibrate.dead_weight import Piston
from rig.calibrate.errors import CalibrateError
from rig.calibrate.least_squares import least_squares
from rig.calibrate.load_cell import fit_creep, fit_load_cell, grams_force
from rig.calibrate.points import Row, above_zero, read_points
from rig.calibrate.syringe import Surroundings, fit_syringe, shown_density, water_density
from rig.calibrate.transducer import fit_transducer
from rig.spec.calibration import Provenance, TransducerCalibration
from rig.spec.calibration_file import calibration_text, free_path, write_calibration
from rig.spec.errors import SpecError
from rig.spec.loading import parse_calibration
from rig.spec.student import widening

# GUM (JCGM 100:2008) Table H.6: thermometer readings and corrections, degrees Celsius.
GUM_READINGS = [
    21.521, 22.012, 22.512, 23.003, 23.507, 23.999, 24.513, 25.002, 25.503, 26.010, 26.511,
]  # fmt: skip
GUM_CORRECTIONS = [
    -0.171, -0.169, -0.166, -0.159, -0.164, -0.165, -0.156, -0.157, -0.159, -0.161, -0.160,
]  # fmt: skip
PROVENANCE = Provenance(date=date(2026, 1, 31), method="test", instrument="none")
KPA = [1.0, 3.0, 5.0, 7.0, 9.0, 11.0, 13.0]


def test_the_gums_thermometer_is_calibrated_as_the_gum_does() -> None:
    t = np.array(GUM_READINGS) - 20
    fit = least_squares(
        {"offset": np.ones_like(t), "slope": t}, np.array(GUM_CORRECTIONS), in_time=False
    )
    assert fit["offset"] == pytest.approx(-0.1712, abs=5e-5)
    assert fit["slope"] == pytest.approx(0.00218, abs=5e-6)
    assert fit.sd == pytest.approx(0.0035, abs=5e-5)
    u = np.sqrt(np.diag(fit.covariance))
    assert u == pytest.approx([0.0029, 0.00067], rel=0.02)
    assert fit.covariance[0, 1] / np.prod(u) == pytest.approx(-0.930, abs=5e-4)
    # the correction at 30 degrees: -0.1494 with 0.0041, 9 degrees of freedom (H.3.4)
    at_30 = fit["offset"] + 10 * fit["slope"]
    assert at_30 == pytest.approx(-0.1494, abs=5e-5)
    assert fit.u({"offset": 1, "slope": 10}) / widening(9) == pytest.approx(0.0041, abs=5e-5)


def test_neighbours_that_resemble_each_other_count_for_less() -> None:
    rng = np.random.default_rng(3)
    x = np.linspace(0, 1, 60)
    columns = {"offset": np.ones_like(x), "slope": x}
    errors, claimed = [], []
    for _ in range(300):
        noise = np.empty(60)
        noise[0] = rng.normal()
        for i in range(1, 60):
            noise[i] = 0.6 * noise[i - 1] + 0.8 * rng.normal()
        fit = least_squares(columns, 2 + 3 * x + noise)
        errors.append(fit["slope"] - 3)
        claimed.append(np.sqrt(fit.covariance[1, 1]))
    # taken for independent they would claim half of the true scatter
    assert np.mean(claimed) == pytest.approx(np.std(errors), rel=0.2)


def test_points_that_cannot_tell_parameters_apart_are_refused() -> None:
    one = np.ones(5)
    with pytest.raises(CalibrateError, match="apart"):
        least_squares({"offset": one, "slope": 2 * one}, one)
    with pytest.raises(CalibrateError, match="at least 3"):
        least_squares({"offset": one[:2], "slope": np.arange(2.0)}, one[:2])


def sweep(shown: dict[float, float], zero: float, name: str, reference: str) -> list[Row]:
    up: list[Row] = [{"kind": "up", reference: r, name: v} for r, v in shown.items()]
    down: list[Row] = [{"kind": "down", reference: r, name: v} for r, v in shown.items()]
    empty: Row = {"kind": "zero", reference: 0.0, name: zero}
    rows = [empty, *up, *reversed(down), empty]
    return [{"time_s": 0.0, **row} for row in rows]


def test_a_transducer_with_a_bow_is_found_exactly() -> None:
    span, bow, gain = 13.0, 0.03, 10.02
    # the straight line that gives the pressure p once the bow is added
    line = {p: np.roots([-4 * bow / span**2, 1 + 4 * bow / span, -p])[-1] for p in KPA}
    rows = sweep({p: 0.51 + s / gain for p, s in line.items()}, 0.51, "voltage_v", "reference_kpa")
    made = fit_transducer(rows).calibration(rows, 2e-4, PROVENANCE)
    assert made.gain == pytest.approx(gain * 1e3)
    assert made.bow == pytest.approx(bow * 1e3)
    assert made.span == pytest.approx(span * 1e3)
    assert made.offset_voltage == pytest.approx(0.51)
    assert made.gain_u == pytest.approx(2e-4)  # nothing but the reference
    for p, s in line.items():
        assert made.corrected(s * 1e3) == pytest.approx(p * 1e3)


def test_hysteresis_is_told_and_widens_the_linearity() -> None:
    rows = sweep({p: p / 10 for p in KPA}, 0.0, "voltage_v", "reference_kpa")
    for row in rows:
        if row["kind"] == "down":
            row["voltage_v"] = float(row["voltage_v"]) + 0.002
    curve = fit_transducer(rows).curve
    assert curve.hysteresis == pytest.approx(-0.02, rel=1e-3)
    scatter = curve.quadratic.u({"curvature": curve.top_reading**2 / 4})
    assert curve.bow_u == pytest.approx(np.hypot(scatter, curve.hysteresis / np.sqrt(12)))


def test_a_reversed_transducer_is_refused() -> None:
    rows = sweep({p: 5 - p / 10 for p in KPA}, 5.0, "voltage_v", "reference_kpa")
    with pytest.raises(CalibrateError, match="polarity"):
        fit_transducer(rows)
    with pytest.raises(CalibrateError, match="unloaded"):
        fit_transducer([row for row in rows if row["kind"] != "zero"])
    with pytest.raises(CalibrateError, match="5 different references"):
        fit_curve(np.arange(4.0), np.arange(4.0), [False] * 4)


def test_the_zero_is_interpolated_between_zeros() -> None:
    kinds = ["zero", "up", "up", "up", "zero"]
    rows: list[Row] = [{"kind": k, "counts": 10.0 * i} for i, k in enumerate(kinds)]
    readings, drift = above_zero(rows, "counts")
    assert readings == pytest.approx([0.0, 0.0, 0.0])
    assert drift == pytest.approx(40 * widening(1))


def test_masses_press_less_in_air_and_more_where_gravity_is_stronger() -> None:
    assert grams_force(np.array([100.0]))[0] == pytest.approx(100 * (1 - 1.5e-4))
    assert grams_force(np.array([100.0]), 9.832)[0] / grams_force(np.array([100.0]))[
        0
    ] == pytest.approx(9.832 / 9.80665)


def test_a_piston_floats_where_its_weight_in_air_is_the_pressure_on_its_area() -> None:
    piston = Piston(area_mm2=80.65, area_u=5e-5, mass_g=7.3, gravity=9.8118)
    # 0.1073 kg less 0.0161 g of air, times 9.8118 m/s2: 1.052648 N on 80.65 mm2
    assert piston.pressure_kpa(100.0) == pytest.approx(13.05205, abs=2e-5)
    assert piston.masses_g(piston.pressure_kpa(42.0)) == pytest.approx(42.0)
    assert piston.masses_g(0.5 * piston.pressure_kpa(0.0)) < 0


def test_a_load_cell_is_found_with_its_creep() -> None:
    grams = [10.0, 20.0, 50.0, 100.0, 200.0]
    shown = {m: 100 + 2003 * m * (1 - BUOYANCY) for m in grams}
    rows = sweep(shown, 100.0, "counts", "mass_g")
    time_s = np.arange(0, 180, 3.0)
    crept = 100 + 400_000 * (1 + 5e-4 * -np.expm1(-time_s / 20))
    rows += [
        {"kind": "creep", "mass_g": 200.0, "counts": c, "time_s": t}
        for t, c in zip(time_s, crept, strict=True)
    ]
    fit = fit_load_cell(rows)
    made = fit.calibration(rows, 2e-5, PROVENANCE)
    assert made.counts_per_gram == pytest.approx(2003)
    assert made.counts_per_gram_u == pytest.approx(2e-5)
    assert fit.creep is not None
    assert fit.creep.share == pytest.approx(5e-4, rel=0.01)
    assert made.creep_u == pytest.approx(5e-4 / np.sqrt(3), rel=0.02)


def test_creep_counts_from_the_zero_and_is_as_unsure_as_that() -> None:
    grams = [10.0, 20.0, 50.0, 100.0, 200.0]
    zero, drifted = 300_000.0, 300_040.0  # a zero as large as the load must not halve the creep
    rows = sweep({m: zero + 2000 * m for m in grams}, zero, "counts", "mass_g")
    rows[-1]["counts"] = drifted
    time_s = np.arange(0, 60, 3.0)
    rows += [
        {"kind": "creep", "mass_g": 200.0, "time_s": t}
        | {"counts": drifted + 400_000.0 * (1 if t < 1 else 1.001)}
        for t in time_s
    ]
    creep = fit_load_cell(rows).creep
    assert creep is not None
    assert creep.share == pytest.approx(1e-3)
    # the readings do not scatter: all that is unsure is the zero
    assert creep.share_u == pytest.approx(40 * widening(1) / 400_000)


def test_little_creep_is_none_and_the_rest_is_fitted_all_the_same() -> None:
    rows = sweep({m: 2000 * m for m in [10.0, 20.0, 50.0, 100.0, 200.0]}, 0.0, "counts", "mass_g")
    nine: list[Row] = [
        {"kind": "creep", "mass_g": 200.0, "counts": 4e5, "time_s": 3.0 * i} for i in range(9)
    ]
    fit = fit_load_cell(rows + nine)
    assert fit.creep is None
    assert fit.creep_u == 0.0
    assert fit_load_cell([*rows, *nine, nine[-1]]).creep is not None
    with pytest.raises(CalibrateError, match="10 readings"):
        fit_creep(np.arange(5.0), np.ones(5))


def test_a_load_cell_found_where_gravity_is_stronger_is_less_sensitive_per_gram_force() -> None:
    rows = sweep({m: 2000 * m for m in [10.0, 20.0, 50.0, 100.0, 200.0]}, 0.0, "counts", "mass_g")
    here, there = (
        fit.calibration(rows, 0.0, PROVENANCE).counts_per_gram
        for fit in (fit_load_cell(rows), fit_load_cell(rows, 9.832))
    )
    assert there / here == pytest.approx(9.80665 / 9.832, rel=1e-9)


def test_references_that_differ_by_rounding_count_once() -> None:
    reference = np.array([1.0, 1.0 + 1e-12, 2.0, 3.0, 4.0])
    with pytest.raises(CalibrateError, match="there are 4"):
        fit_curve(np.arange(5.0), reference, [False] * 5)


def test_water_has_the_density_of_the_table() -> None:
    # Tanaka et al. 2001, Table 3, kg/m3
    for celsius, density in ((5, 999.9668), (20, 998.2067), (25, 997.0470), (40, 992.2152)):
        assert water_density(celsius) * 1e3 == pytest.approx(density, abs=1e-4)


def test_a_balance_in_air_shows_less_than_the_mass_of_water() -> None:
    assert shown_density(20) == pytest.approx(0.9972, abs=5e-5)
    # ISO 8655-6:2002, Table A.1: 1.0032 uL/mg at 23.0 deg C (997.538 kg/m3) and 100 kPa
    assert 1 / shown_density(23) == pytest.approx(1.0035, abs=5e-5)


def transducer(bow: float = 0.0, linearity_u: float = 0.0) -> TransducerCalibration:
    return TransducerCalibration.model_validate(
        {
            "kind": "calibration",
            "instrument": "transducer",
            "gain": 10,
            "gain_u": 1e-3,
            "offset_voltage": 0.5,
            "span": 40,
            "bow": bow,
            "linearity_u": linearity_u,
            "zero_u": 0.005,
            "provenance": PROVENANCE,
        }
    )


def test_a_syringe_is_found_from_water_and_gas() -> None:
    scale, dead, backlash, tube, ambient = 1.002, 2.1, 0.01, 1.5, 101.325
    rows: list[Row] = [
        {"kind": "dispense", "plunger_ml": x, "pressure_kpa": 0.0}
        | {"water_g": scale * x * (water_density(23) - 0.0012) / (1 - 1.5e-4)}
        for x in (8.0, 16.0, 24.0, 32.0)
    ]
    at_home = 60 + dead + tube
    for way, pushed in (("up", (2.0, 4.0, 6.0, 8.0)), ("down", (7.0, 5.0, 3.0))):
        for p in pushed:  # closed at 1 mL pushed
            enclosed = at_home - 1
            pressure = ambient * (enclosed / (at_home - p) - 1)
            counted = (p + (backlash if way == "up" else 0)) / scale
            rows.append(
                {"kind": way, "plunger_ml": counted, "pressure_kpa": pressure, "water_g": 0.0}
            )
    around = Surroundings(ambient, 0.0, 23, 0.0, 0.35, 60, tube, 0.02, 1e-4, transducer())
    fit = fit_syringe(rows, around)
    made = fit.calibration(rows, PROVENANCE)
    assert made.steps_per_ml == pytest.approx(1e3 / (0.35 * scale), rel=1e-9)
    assert made.backlash * 1e6 == pytest.approx(backlash, rel=1e-6)
    assert made.dead_volume * 1e6 == pytest.approx(dead, rel=1e-6)
    assert made.dead_volume_u * 1e6 == pytest.approx(np.hypot(0.02, 62.6e-3), rel=0.02)
    zero_ml = 62.6 * 0.005 / ambient
    assert made.backlash_u * 1e6 == pytest.approx(zero_ml, rel=0.01)

    weather = replace(around, ambient_u_kpa=1.0, temperature_u_c=1.0)
    unsure = fit_syringe(rows, weather).calibration(rows, PROVENANCE)
    # water expands by 2.38e-4 per kelvin at 23 deg C
    assert unsure.steps_per_ml_u == pytest.approx(np.hypot(1e-4, 2.38e-4), rel=0.01)
    parts = [0.02, 62.6e-3, 62.6 / ambient, 62.6 * 2.58e-4, zero_ml]
    assert unsure.dead_volume_u * 1e6 == pytest.approx(np.linalg.norm(parts), rel=0.005)


def test_the_bow_of_the_transducer_is_taken_out_before_gas_is_fitted() -> None:
    ambient, enclosed, curved = 101.325, 62.0, transducer(bow=0.1)
    rows: list[Row] = [
        {"kind": "dispense", "plunger_ml": x, "pressure_kpa": 0.0}
        | {"water_g": x * shown_density(23)}
        for x in (8.0, 16.0, 24.0, 32.0)
    ]
    for way, indicated in [("up", (1.0, 4.0, 8.0, 13.0)), ("down", (11.0, 6.0, 2.0))]:
        for shown_kpa in indicated:
            p = shown_kpa + 0.1 * 4 * shown_kpa / 40 * (1 - shown_kpa / 40)
            counted = 1 + enclosed * p / (ambient + p)
            rows.append(
                {"kind": way, "plunger_ml": counted, "pressure_kpa": shown_kpa, "water_g": 0.0}
            )
    around = Surroundings(ambient, 0.0, 23, 0.0, 0.35, 60, 1.5, 0.0, 0.0, curved)
    fit = fit_syringe(rows, around)
    assert fit.dead_ml == pytest.approx(enclosed + 1 - 61.5, abs=1e-6)
    unsure = fit_syringe(rows, replace(around, transducer=transducer(0.1, linearity_u=0.05)))
    assert unsure.dead_u_ml == pytest.approx(
        np.hypot(fit.dead_u_ml, enclosed * 0.05 / ambient), rel=1e-6
    )


def test_a_calibration_survives_its_file(tmp_path: Path) -> None:
    rows = sweep({p: 0.5 + p / 10 for p in KPA}, 0.5, "voltage_v", "reference_kpa")
    made = fit_transducer(rows).calibration(rows, 2e-4, PROVENANCE)
    assert parse_calibration(calibration_text(made), Path("c")).spec == made
    path = free_path(tmp_path, made, "transducer")
    assert path.name == "transducer-2026-01-31.yaml"
    write_calibration(made, path)
    assert free_path(tmp_path, made, "transducer").name == "transducer-2026-01-31-2.yaml"
    with pytest.raises(SpecError, match="never overwritten"):
        write_calibration(made, path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("kind,counts\nup,1\n", "mass_g"),
        ("kind,mass_g,counts\nup,ten,1\n", "line 2: mass_g is 'ten'"),
        ("kind,mass_g,counts\nup,10,nan\n", "line 2: counts"),
    ],
)
def test_a_table_that_is_none_is_refused_with_its_line(
    tmp_path: Path, text: str, message: str
) -> None:
    path = tmp_path / "points.csv"
    path.write_text(text)
    with pytest.raises(CalibrateError, match=message):
        read_points(path, ("mass_g", "counts"))
