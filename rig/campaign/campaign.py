"""All scenarios of a campaign, one after the other, each beside the same bench unbroken."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from rig.board.virtual import require_simulated
from rig.campaign.judge import Verdict, judge
from rig.campaign.scenario import Outcome, run_scenario
from rig.mechanics.job import Job
from rig.spec.faults import Expectation, FaultScript
from rig.spec.workspace import Workspace


class Campaign:
    """Runs fault scripts on a bench of the workspace; the same seed gives the same verdicts.

    `job` is how the specimen's response is computed, if it was not before. Raises BoardError for a
    real bench.
    """

    def __init__(
        self,
        workspace: Workspace,
        actuator: str,
        bench: str,
        seed: int,
        job: Job | None = None,
    ) -> None:
        require_simulated(workspace.bench(bench))
        self._workspace = workspace
        self._actuator = actuator
        self._bench = bench
        self._seed = seed
        self._job = job
        self._healthy: dict[str, Outcome] = {}

    def run(self, scripts: Sequence[FaultScript]) -> Iterator[Verdict]:
        """Run and judge each; the logs are read and thrown away."""
        with tempfile.TemporaryDirectory(prefix="rig-faults-") as folder:
            for script in scripts:
                yield self.judged(script, Path(folder))

    def judged(self, script: FaultScript, folder: Path) -> Verdict:
        """Run one scenario in a subfolder of `folder`, and the unbroken bench before the first."""
        if script.protocol not in self._healthy:
            sound = unbroken(f"unbroken-{script.protocol}", script.protocol)
            self._healthy[script.protocol] = self._take(sound, folder)
        return judge(self._take(script, folder), self.healthy(script.protocol))

    def healthy(self, protocol: str) -> Outcome:
        """What the unbroken bench did, once a script with this protocol was run."""
        return self._healthy[protocol]

    def _take(self, script: FaultScript, folder: Path) -> Outcome:
        setup = self._workspace.setup(self._actuator, self._bench, script.protocol)
        return run_scenario(script, setup, self._seed, folder / script.name, self._job)


def unbroken(name: str, protocol: str) -> FaultScript:
    """A script in which nothing breaks."""
    return FaultScript(
        kind="faults",
        name=name,
        description="Nothing breaks",
        protocol=protocol,
        expect=Expectation(run="success"),
    )
