"""A source distribution is complete: its wheel runs on its own and knows its commit."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest

from rig.revision import version_line

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.slow


def pip(*arguments: str | Path) -> None:
    command = [sys.executable, "-m", "pip", "--disable-pip-version-check", "-q", *arguments]
    subprocess.run(command, check=True)


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the package of a wheel that was built from the source distribution."""
    folder = tmp_path_factory.mktemp("dist")
    build = "from setuptools.build_meta import build_sdist; import sys; build_sdist(sys.argv[1])"
    subprocess.run([sys.executable, "-c", build, folder], cwd=ROOT, check=True)
    (source,) = folder.glob("*.tar.gz")
    pip("wheel", "--no-deps", "--no-build-isolation", "-w", folder, source)
    (wheel,) = folder.glob("*.whl")
    pip("install", "--no-deps", "--target", folder / "site", wheel)
    return folder / "site"


def run(installed: Path, folder: Path, *arguments: str) -> str:
    """Output of a verb of the installed package; raises if it fails."""
    environment = {**os.environ, "PYTHONPATH": str(installed), "COLUMNS": "200"}
    command = [sys.executable, "-m", "rig", *arguments]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_it_knows_the_commit_it_was_built_from(installed: Path, tmp_path: Path) -> None:
    assert run(installed, tmp_path, "--version") == version_line() + "\n"


def test_it_makes_a_workspace_and_characterises_there(installed: Path, tmp_path: Path) -> None:
    run(installed, tmp_path, "init", "lab")
    lab = tmp_path / "lab"
    actuator = lab / "models/actuators/bellow-bending.yaml"
    text = actuator.read_text("utf-8")
    actuator.write_text(text.replace("predictions: [beam, fe]", "predictions: [beam]"), "utf-8")
    options = ("--bench", "virtual-beam", "--protocol", "quick", "--out", "run")
    said = run(installed, lab, "characterise", "--actuator", "bellow-bending", *options)
    assert "status: success" in said
    assert (lab / "run/report.html").is_file()


def test_it_carries_what_the_board_is_built_from(installed: Path) -> None:
    library = installed / "rig/_library"
    for part in ("firmware/rig_mega/rig_mega.ino", "firmware/rig.dbc", "firmware/emulator/COPYING"):
        assert (library / part).is_file(), part


def test_its_studio_serves_its_pages(installed: Path, tmp_path: Path) -> None:
    run(installed, tmp_path, "init", "lab")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    process = subprocess.Popen(
        [sys.executable, "-m", "rig", "studio", "--port", str(port)],
        cwd=tmp_path / "lab",
        env={**os.environ, "PYTHONPATH": str(installed)},
    )
    try:
        for path, content in (
            ("/", "rig studio"),
            ("/bench", "Vent and stop"),
            ("/runs", "rig characterise"),
            ("/assets/studio.js", "studioLive"),
            ("/assets/studio.css", "--accent"),
        ):
            assert content in fetched(f"http://127.0.0.1:{port}{path}", process), path
    finally:
        process.terminate()
        process.wait(30)


def fetched(address: str, process: subprocess.Popen[bytes]) -> str:
    """What is served there, once it is."""
    while process.poll() is None:
        with contextlib.suppress(urllib.error.URLError):
            return str(urllib.request.urlopen(address).read().decode())
        time.sleep(0.2)
    raise AssertionError("the studio ended")
