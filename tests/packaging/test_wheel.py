"""A source distribution is complete: its wheel runs in a clean environment and knows its commit.

What the wheel depends on is fetched from the package index.
"""

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
MOST_MIB = 650
"""Of a bench computer's environment; it has 595 with the versions of November 2026."""
OF_EXTRAS = ("dask", "nicegui", "pandas", "pyarrow", "pymoo", "pypardiso", "SALib", "statsmodels")
pytestmark = pytest.mark.slow


def pip(python: Path, *arguments: str | Path) -> None:
    command = [python, "-m", "pip", "--disable-pip-version-check", "-q", *arguments]
    subprocess.run(command, env=clean(), check=True)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """It was built from the source distribution."""
    folder = tmp_path_factory.mktemp("dist")
    build = "from setuptools.build_meta import build_sdist; import sys; build_sdist(sys.argv[1])"
    subprocess.run([sys.executable, "-c", build, folder], cwd=ROOT, check=True)
    (source,) = folder.glob("*.tar.gz")
    here = Path(sys.executable)
    pip(here, "wheel", "--no-deps", "--no-build-isolation", "-w", folder, source)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path) -> Path:
    """An environment with the wheel and what it asks for, without extras."""
    folder = wheel.with_name("environment")
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    pip(folder / "bin/python", "install", wheel)
    return folder


def packages(installed: Path) -> Path:
    (folder,) = installed.glob("lib/python*/site-packages")
    return folder


def clean(**more: str) -> dict[str, str]:
    """The environment's variables without those that lead to a checkout."""
    ours = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "RIG_"))}
    return {**ours, "COLUMNS": "200", **more}


def called(installed: Path, folder: Path, *arguments: str, **variables: str) -> tuple[int, str]:
    """Exit code and output of the installed command."""
    command = [installed / "bin/rig", *arguments]
    done = subprocess.run(
        command, cwd=folder, env=clean(**variables), capture_output=True, text=True
    )
    return done.returncode, done.stdout + done.stderr


def run(installed: Path, folder: Path, *arguments: str) -> str:
    """Output of a verb that does what it is asked for."""
    code, said = called(installed, folder, *arguments)
    assert code == 0, said
    return said


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
    library = packages(installed) / "rig/_library"
    for part in ("firmware/rig_mega/rig_mega.ino", "firmware/rig.dbc", "firmware/emulator/COPYING"):
        assert (library / part).is_file(), part


def test_it_stays_small(installed: Path) -> None:
    names = {path.name.split("-")[0].lower() for path in packages(installed).glob("*.dist-info")}
    assert names & {name.lower() for name in OF_EXTRAS} == set()
    size = sum(f.lstat().st_size for f in packages(installed).rglob("*") if f.is_file())
    assert size < MOST_MIB * 2**20


def test_what_needs_an_extra_says_so_before_it_computes(installed: Path, tmp_path: Path) -> None:
    run(installed, tmp_path, "init", "lab")
    (study, *_) = sorted((tmp_path / "lab/models/studies").glob("*.yaml"))
    code, said = called(installed, tmp_path / "lab", "study", study.stem)
    assert code == 1
    assert "pip install 'rig[study]'" in said
    assert "Traceback" not in said


def test_a_shell_completes_verbs(installed: Path, tmp_path: Path) -> None:
    asked = {"_RIG_COMPLETE": "complete_bash", "COMP_WORDS": "rig char", "COMP_CWORD": "1"}
    _, said = called(installed, tmp_path, **asked)
    assert said.split() == ["characterise"]


def test_its_studio_serves_its_pages(installed: Path, wheel: Path, tmp_path: Path) -> None:
    """The last one here: the environment has an extra from now on."""
    pip(installed / "bin/python", "install", f"{wheel}[studio]")
    run(installed, tmp_path, "init", "lab")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    process = subprocess.Popen(
        [installed / "bin/rig", "studio", "--port", str(port)],
        cwd=tmp_path / "lab",
        env=clean(),
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
