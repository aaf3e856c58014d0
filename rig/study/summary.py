"""What a recorded run measured, as its summary has it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rig.study.errors import StudyError


def read_experiments(run: Path) -> Mapping[str, Any]:
    """The experiments of a run that ended well, by name; raises StudyError."""
    path = run / "summary.json"
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
        status, experiments = summary["status"], summary["experiments"]
    except (OSError, ValueError, KeyError, TypeError):
        raise StudyError(
            f"{path} is not there, or is no summary; expected the folder of a recorded run. Take "
            f"it, as `rig characterise --actuator ACTUATOR.yaml --out {run}`, or write the summary "
            f"of one that is there again by `rig report {run}`."
        ) from None
    if status != "success":
        raise StudyError(f"{run}: the run ended with status '{status}', not 'success'.")
    return dict(experiments)
