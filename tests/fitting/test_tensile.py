"""Files of test data: what is read from them, and what is said of those that cannot be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rig.errors import RigError
from rig.fitting.errors import TestDataError
from rig.fitting.tensile import Measures, read_specimens
from rig.mechanics.hyperelastic import Mode

MATERIALS = Path(__file__).resolve().parents[3] / "shared" / "data" / "materials"
STRAINS = np.linspace(0.1, 1.0, 10)


def table(folder: Path, heading: str, *columns: np.ndarray, above: str = "") -> Path:
    path = folder / "test.csv"
    rows = [",".join(f"{value:.6g}" for value in row) for row in np.column_stack(columns)]
    path.write_text("\n".join([*above.splitlines(), heading, *rows]) + "\n", encoding="utf-8")
    return path


@pytest.mark.skipif(not MATERIALS.is_dir(), reason="the shared reference data are not here")
@pytest.mark.parametrize("name", ["dragon-skin-20", "ecoflex-00-30", "sortaclear-40"])
def test_raw_files_of_the_database_are_read_in_si(name: str) -> None:
    (specimen,) = read_specimens(MATERIALS / f"{name}.csv", Mode.UNIAXIAL)
    lines = (MATERIALS / f"{name}.csv").read_text(encoding="utf-8").splitlines()
    *_, strain, stress = map(float, lines[-1].split(";"))
    assert specimen.stretch[-1] == pytest.approx(1 + strain)
    assert specimen.stress[-1] == pytest.approx(stress * 1e6)
    assert specimen.stretch.size == len(lines) - 18
    assert specimen.material


@pytest.mark.skipif(not MATERIALS.is_dir(), reason="the shared reference data are not here")
def test_true_measures_are_the_same_test() -> None:
    path = MATERIALS / "sortaclear-40.csv"
    (nominal,) = read_specimens(path, Mode.UNIAXIAL, Measures.ENGINEERING)
    (true,) = read_specimens(path, Mode.UNIAXIAL, Measures.TRUE)
    assert true.stretch == pytest.approx(nominal.stretch, rel=1e-4)
    assert true.stress == pytest.approx(nominal.stress, rel=1e-3)


@pytest.mark.skipif(not MATERIALS.is_dir(), reason="the shared reference data are not here")
def test_a_row_whose_true_stress_has_another_sign_is_told_of() -> None:
    (specimen,) = read_specimens(MATERIALS / "ecoflex-00-50.csv", Mode.UNIAXIAL)
    assert "disagree" in specimen.notes[0]
    assert "19" in specimen.notes[0]


def test_force_and_extension_become_stress_and_stretch(tmp_path: Path) -> None:
    above = "Specimen Cross-section (mm^2),18\nGauge Length (mm),33"
    path = table(tmp_path, "Force (N),Extension (mm)", 9 * STRAINS, 33 * STRAINS, above=above)
    (specimen,) = read_specimens(path, Mode.UNIAXIAL)
    assert specimen.stretch == pytest.approx(1 + STRAINS)
    assert specimen.stress == pytest.approx(0.5e6 * STRAINS)


def test_specimens_in_one_table_are_told_apart(tmp_path: Path) -> None:
    number = np.repeat([1, 2], 10)
    strain = np.tile(STRAINS, 2)
    path = table(tmp_path, "Specimen,Strain (-),Stress (kPa)", number, strain, number * strain)
    one, two = read_specimens(path, Mode.PLANAR)
    assert two.stress == pytest.approx(2 * one.stress)
    assert (one.name, one.mode) == ("test 1", Mode.PLANAR)


BAD = {
    "no headings": ("", "", ("headings", "Stress (MPa)")),
    "no stress": ("Strain (-),Colour", "", ("headings",)),
    "no unit": ("Strain (-),Stress", "", ("test.csv:1", "no unit")),
    "another dimension": ("Strain (-),Stress (mm)", "", ("test.csv:1", "length", "pressure")),
    "percent without its unit": ("PERCENT", "", ("percent",)),
    "negative stretch": ("NEGATIVE", "", ("test.csv:2", "stretch")),
    "not a number": ("NAN", "", ("test.csv:4", "finite")),
    "decimal comma": ("COMMA", "", ("test.csv:4", "decimal comma")),
    "unloading": ("UNLOADING", "", ("goes back",)),
    "too few points": ("FEW", "", ("too few",)),
    "the same twice": ("Strain (-),Stress (kPa),Stress (MPa)", "", ("same quantity",)),
    "area against sides": (
        "Strain (-),Force (N)",
        "Specimen Cross-section (cm^2),18\nThickness (mm),3\nWidth (mm),6",
        ("contradicts",),
    ),
    "no gauge length": ("Extension (mm),Stress (MPa)", "", ("Gauge Length",)),
    "no cross-section": ("Strain (-),Force (N)", "", ("Cross-section",)),
    "true and engineering mixed up": (
        "Engineering Strain (-),Engineering Stress (kPa),True Stress (MPa)",
        "",
        ("mixed up", "test.csv:2"),
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_files_are_refused_with_what_to_do(tmp_path: Path, case: str) -> None:
    heading, above, words = BAD[case]
    good = "Strain (-);Stress (kPa)"
    strain = STRAINS
    if heading == "PERCENT":
        heading, strain = good.replace(";", ","), 100 * STRAINS
    elif heading == "NEGATIVE":
        heading, strain = good.replace(";", ","), STRAINS - 1.2
    elif heading == "UNLOADING":
        heading, strain = good.replace(";", ","), np.concatenate([STRAINS[:7], STRAINS[3::-1]])[:10]
    elif heading == "FEW":
        heading, strain = good.replace(";", ","), STRAINS[:5]
    if heading in {"NAN", "COMMA"}:
        wrong = "nan" if heading == "NAN" else "0,5"
        rows = [f"{s:g};{wrong if i == 2 else s:}" for i, s in enumerate(STRAINS)]
        path = tmp_path / "test.csv"
        path.write_text("\n".join([good, *rows]), encoding="utf-8")
    else:
        count = max(heading.count(",") + 1, 2)
        path = table(tmp_path, heading, strain, *[strain] * (count - 1), above=above)
    with pytest.raises(RigError) as caught:
        read_specimens(path, Mode.UNIAXIAL)
    for word in words:
        assert word in str(caught.value)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(TestDataError, match=r"nothing\.csv"):
        read_specimens(tmp_path / "nothing.csv", Mode.UNIAXIAL)
