"""What `rig update` makes of whole runs on the virtual bench, against how their specimens are made.

Five seeds: each prints another wall and modulus, and has its own noise, creep and hysteresis.
Beside the estimates stands the truth, in brackets by how many standard deviations they miss it.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from rig.board.virtual import specimen_of
from rig.mechanics.beam import published_free_parameter
from rig.record.reader import RunReader

ROOT = Path(__file__).resolve().parents[2]
RIG = [sys.executable, "-c", "from rig.cli.main import main; main()"]
SEEDS = range(5)
PROTOCOL = """\
kind: protocol
name: levels
description: Six pressures, one way, for estimates
deformation:
  pressures: {start: 0 kPa, stop: 10 kPa, step: 2 kPa}
  repeats: 2
  descending_repeats: 1
  settling: {tolerance: 0.05 kPa, window: 1 s, timeout: 60 s}
  hold: 2 s
  frames: 3
blocked_force:
  pressures: {start: 0 kPa, stop: 10 kPa, step: 2 kPa}
  repeats: 2
  descending_repeats: 1
  settling: {tolerance: 0.05 kPa, window: 1 s, timeout: 60 s}
  hold: 2 s
  readings: 20
"""
SHOWN = {"wall": (1e3, "mm"), "modulus": (1e-3, "kPa"), "effective_modulus": (1e-3, "kPa")}


def told_by(*arguments: str) -> str:
    """What a command that must succeed prints."""
    done = subprocess.run([*RIG, *arguments], cwd=ROOT, check=True, capture_output=True, text=True)
    return done.stdout


def main() -> None:
    """Print the table."""
    print("seed  " + "".join(f"{name + ' ' + unit:>42}" for name, (_, unit) in SHOWN.items()))
    inside = dict.fromkeys(SHOWN, 0)
    with tempfile.TemporaryDirectory() as scratch:
        protocol = Path(scratch) / "levels.yaml"
        protocol.write_text(PROTOCOL, encoding="utf-8")
        for seed in SEEDS:
            run = Path(scratch) / str(seed)
            told_by(
                "characterise", "--actuator", "tests/specs/bellow-bending.yaml",
                "--bench", "virtual-beam", "--protocol", str(protocol),
                "--seed", str(seed), "--out", str(run),
            )  # fmt: skip
            found = json.loads(told_by("update", str(run), "--hold-out", "4", "--json"))
            setup = RunReader(run).setup()
            printed = specimen_of(setup, seed)
            free = published_free_parameter(printed.geometry, printed.young_modulus)
            truth = {
                "wall": printed.geometry.wall_thickness,
                "modulus": printed.young_modulus,
                "effective_modulus": printed.young_modulus * free,
            }
            cells = []
            for name, (factor, _) in SHOWN.items():
                one = found["estimates"][name]
                low, high = one["interval_95"]
                inside[name] += low <= truth[name] <= high
                off = (one["value"] - truth[name]) / one["deviation"]
                cells.append(
                    f"{one['value'] * factor:.4g} ± {one['deviation'] * factor:.2g} for "
                    f"{truth[name] * factor:.4g} ({off:+.1f})"
                )
            unseen = found["foretold"]["held out"]
            print(
                f"{seed:<6}"
                + "".join(f"{cell:>42}" for cell in cells)
                + f"   held out: {np.degrees(unseen['angle_rad']['rmse']):.2f} deg, residuals "
                f"{found['chi2_reduced'] ** 0.5:.2g}",
                flush=True,
            )
    print("truth within 95 %: " + ", ".join(f"{name} {n} of 5" for name, n in inside.items()))
