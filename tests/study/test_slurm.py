"""A Box-Behnken study on a real single-node SLURM, of which a worker is killed on the way."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import doubles
import slurm_cluster
from test_run import STUDY, plan_of

from rig.study.executor import slurm
from rig.study.results import Folder
from rig.study.run import Standing, run_study


@pytest.mark.slow
@pytest.mark.skipif(slurm_cluster.missing() is not None, reason=str(slurm_cluster.missing()))
def test_a_study_on_slurm_survives_a_killed_worker(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("dask_jobqueue", reason="the extra 'cluster' is not installed")
    plan = plan_of(tmp_path, STUDY)
    (tmp_path / "slurm").mkdir()
    root = Path(doubles.__file__).resolve().parents[2]
    with slurm_cluster.cluster(tmp_path / "slurm") as environment:
        monkeypatch.setenv("SLURM_CONF", environment["SLURM_CONF"])
        executor = slurm(
            2,
            queue="rig",
            memory="1GB",
            interface="lo",
            scheduler_options={"host": "127.0.0.1"},
            job_script_prologue=[
                f"export PYTHONPATH={root}:{root / 'tests' / 'study'}",
                f"export RIG_CACHE_DIR={tmp_path / 'cache'}",
            ],
            local_directory=str(tmp_path),
            log_directory=str(tmp_path / "logs"),
            walltime="00:10:00",
        )
        killed: list[int] = []

        def kill_one(standing: Standing) -> bool:
            if standing.done == 3 and not killed:
                pids = _workers(environment)
                os.kill(pids[0], signal.SIGKILL)
                killed.append(pids[0])
            return True

        study = run_study(
            plan, Folder(tmp_path / "out"), executor, kill_one, function=doubles.slowly
        )
    assert killed
    assert study is not None
    assert study.failed == ()
    assert study.computed == 13
    for point, answer in study.answers:
        assert answer.values is not None
        assert answer.values["angle"] == pytest.approx((1e3 * point.values["wall"]) ** 2)


def _workers(environment: dict[str, str]) -> list[int]:
    """Process ids of the Dask workers of this cluster's jobs."""
    config = f"SLURM_CONF={environment['SLURM_CONF']}".encode()
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            command = (folder / "cmdline").read_bytes()
            variables = (folder / "environ").read_bytes()
        except OSError:
            continue
        if b"dask_worker" in command and config in variables and b"SLURM_JOB_ID=" in variables:
            found.append(int(folder.name))
    assert found
    return found
