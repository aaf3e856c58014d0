"""`rig fit-material` from raw files to a material that checks clean."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from rig.spec.check import check_file
from rig.spec.loading import load_material

from .conftest import Command
from .test_bad_input import assert_explained

MATERIALS = Path(__file__).resolve().parents[3] / "shared" / "data" / "materials"
SOME = [a for name in ("neo-hookean", "yeoh", "ogden-1", "linear") for a in ("--energy", name)]


@pytest.mark.skipif(not MATERIALS.is_dir(), reason="the shared reference data are not here")
@pytest.mark.parametrize("path", sorted(MATERIALS.glob("*.csv")), ids=lambda p: p.stem)
def test_every_material_of_the_database_becomes_a_sound_file(
    rig: Command, tmp_path: Path, path: Path
) -> None:
    out = tmp_path / "m.yaml"
    outcome = rig("fit-material", path, *SOME, "--out", out, "--json", "--choose", "ogden-1")
    assert outcome.code == 0
    told = json.loads(outcome.out)
    assert {fit["energy"] for fit in told["fits"]} == {"neo-hookean", "yeoh", "ogden-1"}
    assert "linear" in told["failures"]
    assert all(fit["stable"] for fit in told["fits"])
    by_name = {fit["energy"]: fit for fit in told["fits"]}
    assert by_name["yeoh"]["rmse_pa"] < by_name["neo-hookean"]["rmse_pa"]
    report = check_file(out)
    assert report.problems == ()
    material = load_material(out)
    assert path.name in material.young_modulus.source
    assert rig("check", out).out.startswith("OK")


def test_a_relaxation_ends_up_in_the_file_and_the_plot_is_written(
    rig: Command, tmp_path: Path
) -> None:
    strain, time = np.linspace(0.05, 2, 40), np.linspace(0, 100, 80)
    stretch = 1 + strain
    stress = 50 * (stretch - stretch**-2)
    tensile = tmp_path / "tensile.csv"
    rows = "\n".join(f"{e:g},{s:.6g}" for e, s in zip(strain, stress, strict=True))
    tensile.write_text(f"Strain (-),Stress (kPa)\n{rows}\n")
    relaxing = tmp_path / "relaxing.csv"
    fading = "\n".join(f"{t:g},{30 - 5 * (1 - np.exp(-t / 10)):.6g}" for t in time)
    relaxing.write_text(f"Time (s),Stress (kPa)\n{fading}\n")
    out, plot = tmp_path / "m.yaml", tmp_path / "m.svg"
    outcome = rig(
        "fit-material", tensile, "--energy", "neo-hookean", "--relaxation", relaxing,
        "--prony-terms", "1", "--name", "Foam 1", "--density", "900 kg/m**3",
        "--density-source", "weighed", "--out", out, "--plot", plot,
    )  # fmt: skip
    assert outcome.code == 0
    material = load_material(out)
    assert material.relaxation is not None
    assert material.relaxation.terms[0].weight == pytest.approx(5 / 30, rel=1e-3)
    assert material.relaxation.terms[0].time == pytest.approx(10, rel=1e-3)
    assert material.young_modulus.value == pytest.approx(2 * 1.499 * 50e3, rel=1e-3)
    assert material.density.source == "weighed"
    assert "<svg" in plot.read_text()


def test_compression_tells_no_strength_and_unreached_strains_are_told_of(
    rig: Command, tmp_path: Path
) -> None:
    strain = np.linspace(-0.5, 0, 40)
    stretch = 1 + strain
    rows = "\n".join(f"{e:g},{50 * (s - s**-2):.6g}" for e, s in zip(strain, stretch, strict=True))
    (tmp_path / "pressed.csv").write_text(f"Strain (-),Stress (kPa)\n{rows}\n")
    out = tmp_path / "m.yaml"
    outcome = rig(
        "fit-material", tmp_path / "pressed.csv", "--energy", "neo-hookean", "--out", out,
        "--modulus-at=-20,50",
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    assert "no uniaxial specimen has a strain of 50 %" in outcome.out
    assert "at -20 %" in outcome.out
    material = load_material(out)
    assert material.tensile_strength is None
    assert material.elongation_at_break is None
    assert "strains from -0.5 to 0" in material.young_modulus.source


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nothing.csv"], ("nothing.csv",)),
        (["--energy", "rubber", "x.csv"], ("rubber", "neo-hookean")),
        (["--density", "900 kg/m**3", "x.csv"], ("--density-source",)),
        (["--region", "much", "x.csv"], ("LOW:HIGH",)),
        ([], ("at least one file",)),
        (["--stable-to", "0", "x.csv"], ("--stable-to", "above 1")),
        (["--stable-to", "nan", "x.csv"], ("--stable-to", "above 1")),
        (["--modulus-at", "5,0", "x.csv"], ("--modulus-at", "other than 0")),
        (
            [
                "--energy",
                "neo-hookean",
                "--density",
                "-900 kg/m**3",
                "--density-source",
                "me",
                "--out",
                "m.yaml",
                "x.csv",
            ],
            ("density.value", "greater than 0"),
        ),
    ],
)
def test_bad_arguments_are_explained(
    rig: Command, tmp_path: Path, arguments: list[str], words: tuple[str, ...]
) -> None:
    strain = np.linspace(0.05, 2, 40)
    rows = "\n".join(f"{e:g},{100 * e:g}" for e in strain)
    (tmp_path / "x.csv").write_text(f"Strain (-),Stress (kPa)\n{rows}\n")
    placed = [str(tmp_path / a) if a.endswith(".csv") else a for a in arguments]
    assert_explained(rig("fit-material", *placed), *words)
