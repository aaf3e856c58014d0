"""The parts that every step of a run uses, and what they do together."""

from __future__ import annotations

from dataclasses import dataclass

from rig.experiment.bench import Bench, Fixture, Observer
from rig.experiment.prepare import tare
from rig.experiment.recheck import recheck_camera
from rig.experiment.setup import RunRequest
from rig.link.client import RigLink
from rig.record.writer import RunWriter
from rig.vision.measure import AngleMeter


@dataclass(frozen=True)
class RunContext:
    """A bench that is open, what is asked of it, and who watches."""

    bench: Bench
    link: RigLink
    request: RunRequest
    observer: Observer

    @property
    def meter(self) -> AngleMeter:
        """Measures angles with the run's calibrations."""
        calibrations = self.request.setup.calibrations
        return AngleMeter(calibrations.camera, calibrations.ruler)

    def mount(self, fixture: Fixture) -> None:
        """Hold the tip as `fixture` says.

        The load cell is tared while nothing touches it: tared against the vented actuator it would
        hide what the actuator's hysteresis leaves behind at zero pressure.
        """
        self.observer.stage(f"mounting the tip {fixture}")
        self.bench.mount("free")
        if fixture == "blocked":
            tare(self.link)
            self.bench.mount("blocked")

    def check_camera(self, record: RunWriter) -> None:
        """Whether the camera's calibration holds; raises ExperimentError if not."""
        self.observer.stage("checking the calibration of the camera")
        residual = recheck_camera(self.bench.camera, self.meter)
        found = {"ruler_residual_px": f"{residual:.4f}"}
        record.event(self.link.now_s, "camera checked", found)
