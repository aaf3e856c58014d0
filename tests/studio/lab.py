"""A workspace of a test: the shipped library, an actuator of beam theory alone, tiny protocols."""

from __future__ import annotations

import shutil
from pathlib import Path

from rig.board.virtual import VirtualBench
from rig.experiment.bench import Nobody
from rig.experiment.request import make_request
from rig.experiment.run import new_run
from rig.report.build import build_report
from rig.spec.workspace import Workspace, library_root

PATIENT_S = 90.0
"""Against a test that hangs; nothing is asserted of it."""
SPECS = Path(__file__).parents[1] / "specs"
TINY = (
    "kind: protocol\nname: tiny\ndescription: two points\n"
    "deformation:\n  pressures: {start: 0 kPa, stop: 2 kPa, step: 2 kPa}\n  repeats: 1\n"
    "  descending_repeats: 0\n  conditioning: 0\n  rest: 1 s\n"
    "  settling: {tolerance: 0.05 kPa, window: 1 s, timeout: 60 s}\n  hold: 1 s\n  frames: 1\n"
)
BLOCKED = (
    "blocked_force:\n  pressures: {start: 0 kPa, stop: 2 kPa, step: 2 kPa}\n  repeats: 1\n"
    "  descending_repeats: 0\n  conditioning: 0\n  rest: 1 s\n"
    "  settling: {tolerance: 0.05 kPa, window: 1 s, timeout: 60 s}\n  hold: 1 s\n  readings: 5\n"
)


def make_lab(root: Path) -> Workspace:
    """Make the workspace in an empty folder."""
    for folder in ("models", "calibration"):
        shutil.copytree(library_root() / folder, root / folder)
    shutil.copy(SPECS / "bellow-bending.yaml", root / "models/actuators")
    (root / "models/protocols/tiny.yaml").write_text(TINY)
    (root / "models/protocols/tiny-both.yaml").write_text(
        TINY.replace("tiny", "tiny-both") + BLOCKED
    )
    (root / "logs").mkdir()
    return Workspace(root)


def record_run(workspace: Workspace, folder: Path, seed: int = 1) -> None:
    """Take a short run of both experiments, as `rig characterise` takes it, with its report."""
    setup = workspace.setup("bellow-bending", "virtual-beam", "tiny-both")
    bench = VirtualBench(setup, seed, None)
    outcome = new_run(folder, bench, make_request(setup, seed), Nobody())
    bench.close()
    assert outcome.stop.exit_status == "success"
    build_report(folder)
