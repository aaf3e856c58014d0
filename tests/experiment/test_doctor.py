"""What the doctor sees of a sound bench, and of benches with one thing broken each."""

from __future__ import annotations

from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path
from typing import Any

import pytest

from rig.board.virtual import VirtualBench
from rig.experiment.doctor import Finding, look_at_bench, look_at_machine
from rig.plant.camera import CameraFault
from rig.spec.faults import Expectation, FaultScript

from .conftest import make_request

TODAY = date(2026, 1, 31)


def examined(
    *faults: dict[str, Any],
    camera: CameraFault | None = None,
    valid_until: date | None = None,
    today: date = TODAY,
) -> dict[str, Finding]:
    request = make_request()
    if valid_until is not None:
        cell = request.setup.calibrations.load_cell
        provenance = cell.provenance.model_copy(update={"valid_until": valid_until})
        cell = cell.model_copy(update={"provenance": provenance})
        calibrations = replace(request.setup.calibrations, load_cell=cell)
        request = replace(request, setup=replace(request.setup, calibrations=calibrations))
    script = FaultScript.model_validate(
        {
            "kind": "faults",
            "name": "sick",
            "description": "one thing broken",
            "faults": faults,
            "expect": Expectation(run="failed").model_dump(),
        }
    )
    bench = VirtualBench(request.setup, 1, faults=script)
    if camera is not None:
        bench.camera.fault = camera
    try:
        return {finding.what: finding for finding in look_at_bench(bench, request, today)}
    finally:
        bench.close()


def test_a_sound_bench_is_found_sound_and_still() -> None:
    findings = examined()
    assert {what: f.status for what, f in findings.items()} == dict.fromkeys(findings, "ok")
    assert list(findings) == [
        "firmware",
        "link",
        "parameters",
        "calibrations",
        "board",
        "switches",
        "pressure",
        "load cell",
        "camera",
    ]
    assert findings["board"].seen["state"] == "idle"
    assert 0 < float(findings["pressure"].seen["noise_kpa"]) < 0.02


@pytest.mark.parametrize(
    ("fault", "what", "status"),
    [
        ({"kind": "emergency_stop"}, "switches", "failed"),
        ({"kind": "sensor_short"}, "pressure", "failed"),
        ({"kind": "sensor_spike", "voltage": 0.2}, "pressure", "failed"),
        ({"kind": "hx711_silent"}, "load cell", "failed"),
        ({"kind": "parameters_corrupt"}, "board", "warning"),
        ({"kind": "host_silent"}, "firmware", "failed"),
        ({"kind": "bit_errors", "share": 0.002}, "link", "warning"),
    ],
)
def test_what_is_broken_is_found(fault: dict[str, Any], what: str, status: str) -> None:
    finding = examined(fault)[what]
    assert finding.status == status
    assert finding.advice


def test_an_expired_calibration_is_found() -> None:
    yesterday = TODAY - timedelta(days=1)
    finding = examined(valid_until=yesterday)["calibrations"]
    assert finding.status == "failed"
    assert finding.seen["load cell"] == str(yesterday)
    assert "load cell" in finding.advice
    assert examined(valid_until=TODAY)["calibrations"].status == "ok"


def test_both_switches_at_once_are_a_broken_wire() -> None:
    switches = [
        {"kind": "home_switch_stuck", "shows": "closed"},
        {"kind": "end_switch_stuck", "shows": "closed"},
    ]
    assert "both ends" in examined(*switches)["switches"].advice


def test_a_dark_picture_is_found() -> None:
    assert examined(camera=CameraFault.DARK)["camera"].status == "failed"


def test_a_full_disk_is_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    usage = type("Usage", (), {"free": 1e8})
    monkeypatch.setattr("shutil.disk_usage", lambda _: usage)
    packages, disk = look_at_machine(tmp_path / "logs" / "deeper")
    assert packages.status == "ok"
    assert disk.status == "failed"
