"""A studio in a process of its own, for the tests that come to it as browsers and others do."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.studio.lab import PATIENT_S, make_lab

ROOT = Path(__file__).resolve().parents[2]
START = "from rig.cli.main import main; main()"


@pytest.fixture(scope="session")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("around") / "lab"
    root.mkdir()
    make_lab(root)
    return root


@pytest.fixture(scope="session")
def studio(lab: Path) -> Iterator[str]:
    """Address of a studio in a process of its own."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    cache = lab.with_name("cache")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "RIG_CACHE_DIR": str(cache)}
    command = [sys.executable, "-c", START, "studio", "--port", str(port)]
    log = lab.with_name("said.txt")
    with log.open("w") as said:
        process = subprocess.Popen(command, cwd=lab, env=environment, stdout=said, stderr=said)
    address = f"http://127.0.0.1:{port}"
    end_s = time.monotonic() + PATIENT_S
    while True:
        try:
            urllib.request.urlopen(address).close()
            break
        except OSError:
            assert process.poll() is None, log.read_text()
            assert time.monotonic() < end_s
            time.sleep(0.2)
    yield address
    process.terminate()
    process.wait(PATIENT_S)
    complaints = log.read_text(errors="replace")
    assert "Traceback" not in complaints, complaints
    ours = [line for line in complaints.splitlines() if "; studio/" in line or "rig/" in line]
    assert not ours[1:], "our own code failed at what was sent; the first line is the greeting"
