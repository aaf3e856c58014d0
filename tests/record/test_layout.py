"""The layout for Foxglove: its panels know their settings, and what they show is in the log."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import cantools
import pytest
from recorded_runs import write_run

from rig.link.schema import load_schema
from rig.record.channels import TELEMETRY_PREFIX
from rig.record.follow import LogFollower
from rig.record.layout import foxglove_layout

LAYOUT = json.loads(foxglove_layout())
PANELS: dict[str, dict[str, Any]] = LAYOUT["configById"]
TITLE = "foxglovePanelTitle"


def settings_of(model: Any) -> set[str]:
    """Names of a panel's settings in files, from the SDK's own."""
    names = model.__init__.__kwdefaults__
    return {re.sub(r"_(.)", lambda found: found[1].upper(), name) for name in names}


def leaves(node: str | dict[str, Any]) -> list[str]:
    if isinstance(node, str):
        return [node]
    assert set(node) <= {"direction", "first", "second", "splitPercentage"}
    return [*leaves(node["first"]), *leaves(node["second"])]


def test_every_panel_has_its_place() -> None:
    assert sorted(leaves(LAYOUT["layout"])) == sorted(PANELS)


def test_the_sdk_knows_every_panel_and_setting() -> None:
    layouts = pytest.importorskip("foxglove.layouts", reason="the extra 'watch' is not installed")
    for name, panel in PANELS.items():
        kind = name.split("!")[0]
        assert hasattr(layouts, f"{kind}Panel")
        assert set(panel) - {TITLE} <= settings_of(getattr(layouts, f"{kind}Config"))
        for series in panel.get("paths", []):
            assert set(series) <= settings_of(layouts.PlotSeries)
    assert set(PANELS["Image!camera"]["imageMode"]) <= settings_of(layouts.ImageModeConfig)


def test_what_is_shown_is_in_the_log(tmp_path: Path) -> None:
    follower = LogFollower(write_run(tmp_path / "run", points=1))
    for chunk in follower.poll():
        list(follower.messages(chunk))
    channels = {channel.topic: channel.schema for channel in follower.channels.values()}
    assert PANELS["Image!camera"]["imageMode"]["imageTopic"] in channels
    assert PANELS["Log!events"]["topicToRender"] in channels
    paths = [series["value"] for panel in PANELS.values() for series in panel.get("paths", [])]
    assert len(paths) >= 4
    sent = cantools.database.load_string(load_schema().text)
    for path in paths:
        topic, field = path.split(".")
        if topic.startswith(TELEMETRY_PREFIX):
            message = topic.removeprefix(TELEMETRY_PREFIX).upper()
            assert field in {signal.name for signal in sent.get_message_by_name(message).signals}
        else:
            _, encoding, data = channels[topic]
            assert encoding == "jsonschema"
            assert field in json.loads(data)["properties"]
