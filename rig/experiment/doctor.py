"""Looks a bench over before a run: link, board, sensors at rest, camera. Nothing is moved."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import date
from importlib import metadata
from pathlib import Path
from typing import Literal

import numpy as np

from rig.errors import RigError
from rig.experiment.bench import Bench
from rig.experiment.deformation import live_meter
from rig.experiment.setup import RunRequest, expired_calibrations
from rig.experiment.sweep import cell_readings, pressures_kpa
from rig.link.client import RigLink
from rig.link.errors import LinkLostError
from rig.link.schema import load_schema
from rig.spec.workspace import BenchCalibrations
from rig.vision.segment import decoded

Status = Literal["ok", "warning", "failed"]
Seen = dict[str, float | int | str | bool]

PACKAGES = (
    "cantools",
    "mcap",
    "numpy",
    "opencv-python-headless",
    "pyserial",
    "python-can",
    "scipy",
)
LEAST_DISK_GB, LITTLE_DISK_GB = 0.5, 5.0
PINGS = 20
SLOW_ROUND_TRIP_S = 0.1
LISTEN_S = 3.0
REST_KPA = 0.5
"""A vented transducer that is not zeroed yet may be off by its offset, not by more than this."""
NOISY_KPA = 0.1
DARK, BRIGHT = 20.0, 240.0
"""Mean grey levels, of 255, outside which a picture cannot be measured."""


@dataclass(frozen=True)
class Finding:
    """What was looked at, what was seen, and what to do if it is not as it should be."""

    what: str
    status: Status
    seen: Seen = field(default_factory=dict)
    advice: str = ""


def look_at_machine(logs: Path) -> list[Finding]:
    """The computer itself: Python packages and room for logs."""
    return [_packages(), _disk(logs)]


def look_at_bench(bench: Bench, request: RunRequest, today: date) -> list[Finding]:
    """Everything at the other end of the link; what fails leaves out what depends on it.

    `today` is for calibrations, which expire.
    """
    link = RigLink(bench.bus)
    findings = [_try("firmware", lambda: _firmware(link))]
    if findings[0].status != "failed":
        link.raise_faults(False)
        findings.append(_try("link", lambda: _latency(link)))
        findings.append(_try("parameters", lambda: _parameters(link, request)))
    findings.append(_calibrations(request.setup.calibrations, today))
    if findings[0].status != "failed":
        findings += _try_all("sensors", lambda: _at_rest(link))
    findings.append(_try("camera", lambda: _camera(bench, request)))
    return findings


def _calibrations(calibrations: BenchCalibrations, today: date) -> Finding:
    why = expired_calibrations(calibrations, today)
    days = {
        role.replace("_", " "): str(calibration.provenance.valid_until or "no end stated")
        for role, calibration in calibrations.by_role().items()
    }
    if why is None:
        return Finding("calibrations", "ok", dict(days))
    advice = f"{why[0].upper()}{why[1:]} Calibrate again; runs refuse it until then."
    return Finding("calibrations", "failed", dict(days), advice)


def _try(what: str, look: Callable[[], Finding]) -> Finding:
    return _try_all(what, lambda: [look()])[0]


def _try_all(what: str, look: Callable[[], list[Finding]]) -> list[Finding]:
    try:
        return look()
    except RigError as error:
        return [Finding(what, "failed", advice=str(error))]


def _packages() -> Finding:
    seen: Seen = {}
    missing = []
    for name in PACKAGES:
        try:
            seen[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            missing.append(name)
    if missing:
        return Finding("packages", "failed", seen, f"install {', '.join(missing)}: pip install rig")
    return Finding("packages", "ok", seen)


def _disk(logs: Path) -> Finding:
    folder = next(f for f in (logs, *logs.absolute().parents) if f.is_dir())
    free_gb = shutil.disk_usage(folder).free / 1e9
    seen: Seen = {"free_gb": round(free_gb, 1), "folder": str(folder)}
    if free_gb < LITTLE_DISK_GB:
        status: Status = "failed" if free_gb < LEAST_DISK_GB else "warning"
        return Finding("disk", status, seen, "a long run takes some gigabytes: free space first")
    return Finding("disk", "ok", seen)


def _firmware(link: RigLink) -> Finding:
    identity = link.open()
    seen: Seen = {
        "port": link.name,
        "board": identity.board,
        "firmware": identity.firmware_git,
        "protocol": identity.protocol_version,
        "schema": f"{identity.schema_crc:04x}",
    }
    return Finding("firmware", "ok", seen)


def _latency(link: RigLink) -> Finding:
    trips = []
    for _ in range(PINGS):
        with contextlib.suppress(LinkLostError):  # counted below
            trips.append(link.ping())
    if not trips:
        raise LinkLostError(f"none of {PINGS} requests was answered; try another cable.")
    seen: Seen = {
        "median_ms": round(1000 * float(np.median(trips)), 1),
        "longest_ms": round(1000 * max(trips), 1),
        "unanswered": PINGS - len(trips),
        "frames": link.statistics.frames,
        "frames_lost": link.frames_lost,
        "corrupt": link.statistics.corrupt,
    }
    if max(trips) > SLOW_ROUND_TRIP_S:
        return Finding(
            "link", "warning", seen, "the link is slow: use a port of the computer itself, no hub"
        )
    if len(trips) < PINGS or link.frames_lost or link.statistics.corrupt:
        return Finding("link", "warning", seen, "frames are lost or damaged: try another cable")
    return Finding("link", "ok", seen)


def _parameters(link: RigLink, request: RunRequest) -> Finding:
    wanted = request.board_parameters()
    differ: Seen = {}
    for name, value in wanted.items():
        held = link.read_parameter(name)
        if abs(held - value) > 1e-5 * max(1.0, abs(value)):
            differ[name] = f"{held:g}, the bench says {value:g}"
    if differ:
        return Finding("parameters", "ok", differ, "a run writes those of the bench")
    return Finding("parameters", "ok", {"like the bench": len(wanted)})


def _at_rest(link: RigLink) -> list[Finding]:
    """Switches, transducer and load cell of a bench that does nothing."""
    messages = link.wait(LISTEN_S)
    status = link.status
    assert status is not None, "a link that is open has had a heartbeat"
    board = _board(status.state, status.fault, status.reset_cause)
    switches: Seen = {
        "home_switch": status.home_switch,
        "end_switch": status.end_switch,
        "emergency_stop": status.emergency_stop,
    }
    findings = [board, _switches(switches)]
    pressure = pressures_kpa(messages)
    if len(pressure) == 0:
        findings.append(Finding("pressure", "failed", advice="no pressure telemetry comes"))
    else:
        findings.append(_pressure(float(pressure.mean()), float(pressure.std()), status.valve_open))
    readings = cell_readings(messages, load_schema())
    good = [r.counts for r in readings if r.status == "ok"]
    cell: Seen = {"words": len(readings), "ok": len(good)}
    if not good:
        advice = "no sound word comes from the HX711: check its supply, clock and data lines"
        findings.append(Finding("load cell", "failed", cell, advice))
    else:
        cell |= {"counts": round(float(np.mean(good))), "noise_counts": round(float(np.std(good)))}
        findings.append(Finding("load cell", "ok", cell))
    return findings


def _board(state: str, fault: str, reset_cause: str) -> Finding:
    seen: Seen = {"state": state, "fault": fault, "reset_cause": reset_cause}
    if fault != "none":
        return Finding("board", "warning", seen, "a run clears the fault if its cause is gone")
    return Finding("board", "ok", seen)


def _switches(seen: Seen) -> Finding:
    if seen["emergency_stop"]:
        return Finding("switches", "failed", seen, "release the emergency stop, or check its wire")
    if seen["home_switch"] and seen["end_switch"]:
        advice = "the plunger cannot be at both ends: check the wires of the limit switches"
        return Finding("switches", "failed", seen, advice)
    return Finding("switches", "ok", seen)


def _pressure(mean_kpa: float, noise_kpa: float, vented: bool) -> Finding:
    seen: Seen = {"mean_kpa": round(mean_kpa, 4), "noise_kpa": round(noise_kpa, 4)}
    if vented and abs(mean_kpa) > REST_KPA:
        advice = "the vented bench does not read zero: check the valve, supply and calibration"
        return Finding("pressure", "failed", seen, advice)
    if noise_kpa > NOISY_KPA:
        advice = "the reading is noisy: shield the transducer's wire, part it from the motor's"
        return Finding("pressure", "warning", seen, advice)
    return Finding("pressure", "ok", seen)


def _camera(bench: Bench, request: RunRequest) -> Finding:
    _, jpeg = bench.camera.grab()
    image = decoded(jpeg)
    if image is None:
        return Finding("camera", "failed", advice="it delivers no readable picture")
    level = float(np.mean(image))
    seen: Seen = {
        "width": image.shape[1],
        "height": image.shape[0],
        "mean_level": round(level, 1),
    }
    if not DARK < level < BRIGHT:
        advice = "the picture is too dark or too bright: check light and exposure"
        return Finding("camera", "failed", seen, advice)
    meter = live_meter(request.setup)
    sight = meter.see(image)
    if sight.value is None:
        advice = f"ruler or actuator cannot be measured: {sight.reason}"
        return Finding("camera", "failed", seen, advice)
    quantity, unit = meter.measurand.quantity.replace(" ", "_"), meter.measurand.unit
    seen |= {f"{quantity}_{unit}": round(sight.value, 2), f"u_{unit}": round(sight.u, 3)}
    return Finding("camera", "ok", seen)
