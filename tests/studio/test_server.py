"""However the studio is ended, it leaves nothing running and nothing under pressure."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

from tests.studio.conftest import ROOT
from tests.studio.lab import PATIENT_S, make_lab

SERVED = """
from rig.cli.main import main
from rig.studio.state import Studio
from tests.studio.works import until_told

begin, close, work = Studio.__post_init__, Studio.close, []

def begun(studio):
    begin(studio)
    work.append(studio.workshop.start(until_told))

def closed(studio):
    close(studio)
    print("closed, work goes on:", work[0]._process.is_alive(), flush=True)

Studio.__post_init__, Studio.close = begun, closed
main()
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_every_signal_that_ends_it_closes_the_bench_and_the_work(
    number: signal.Signals, tmp_path: Path
) -> None:
    make_lab(tmp_path)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    process = subprocess.Popen(
        [sys.executable, "-c", SERVED, "studio", "--port", str(port)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        text=True,
    )
    end_s = time.monotonic() + PATIENT_S
    while True:
        try:
            urllib.request.urlopen(f"http://127.0.0.1:{port}/assets/studio.css").close()
            break
        except OSError:
            assert process.poll() is None
            assert time.monotonic() < end_s
            time.sleep(0.1)
    process.send_signal(number)
    said, _ = process.communicate(timeout=PATIENT_S)
    assert "closed, work goes on: False" in said
