"""The Foxglove layout that ships beside a run: pressure, deformation, load, camera, log in step."""

from __future__ import annotations

import json
from typing import Any

from rig.record.channels import CAMERA_TOPIC, DEFORMATION_TOPIC, LOG_TOPIC, telemetry_topic

LAYOUT_FILE = "foxglove-layout.json"


def foxglove_layout() -> str:
    """JSON text of the layout; import it in Foxglove with Layout > Import from file."""
    pressure = telemetry_topic("PRESSURE")
    load_cell = telemetry_topic("LOAD_CELL")
    panels: dict[str, Any] = {
        "Plot!pressure": _plot(
            "Pressure (kPa)",
            {
                f"{pressure}.pressure_kpa": "measured",
                f"{pressure}.setpoint_kpa": "set-point",
            },
        ),
        "Plot!deformation": _plot(
            "Bending angle (deg) or elongation (mm)", {f"{DEFORMATION_TOPIC}.value": "deformation"}
        ),
        "Plot!load": _plot("Load cell (counts)", {f"{load_cell}.load_cell_counts": "counts"}),
        "Image!camera": {"imageMode": {"imageTopic": CAMERA_TOPIC}},
        "Log!events": {"topicToRender": LOG_TOPIC, "searchTerms": [], "minLogLevel": 1},
    }
    layout = {
        "direction": "row",
        "first": {
            "direction": "column",
            "first": "Plot!pressure",
            "second": {"direction": "column", "first": "Plot!deformation", "second": "Plot!load"},
            "splitPercentage": 34,
        },
        "second": {
            "direction": "column",
            "first": "Image!camera",
            "second": "Log!events",
            "splitPercentage": 65,
        },
        "splitPercentage": 55,
    }
    document = {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 5.0},
        "layout": layout,
    }
    return json.dumps(document, indent=2) + "\n"


def _plot(title: str, paths: dict[str, str]) -> dict[str, Any]:
    return {
        "foxglovePanelTitle": title,
        "paths": [
            {"value": path, "label": label, "enabled": True, "timestampMethod": "receiveTime"}
            for path, label in paths.items()
        ],
        "showLegend": True,
        "isSynced": True,
        "xAxisVal": "timestamp",
    }
