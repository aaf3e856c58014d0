"""The parts that every step of a run uses, and what they do together."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

from rig.experiment.bench import Bench, Fixture, Observer
from rig.experiment.deformation import DeformationMeter, needs_rest, recorded_meter
from rig.experiment.errors import ExperimentError
from rig.experiment.prepare import tare
from rig.experiment.recheck import LOOKS, recheck_camera
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
    rest_jpeg: bytes | None = None
    """The frame at rest of the run that is taken up."""

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

    def ready_meter(self, record: RunWriter) -> DeformationMeter:
        """The meter of the run, its camera checked and, if it needs that, the rest on record.

        The bench must be vented. Raises ExperimentError if the camera's calibration does not hold
        or the frame at rest cannot be trusted.
        """
        setup = self.request.setup
        self.observer.stage("checking the calibration of the camera")
        meter = AngleMeter(setup.calibrations.camera, setup.calibrations.ruler)
        residual = recheck_camera(self.bench.camera, meter)
        found = {"ruler_residual_px": f"{residual:.4f}"}
        record.event(self.link.now_s, "camera checked", found)
        if self.rest_jpeg is not None or not needs_rest(setup):
            return recorded_meter(setup, self.rest_jpeg)
        for _ in range(LOOKS - 1):
            with suppress(ExperimentError):
                return self._rested_meter(record)
        return self._rested_meter(record)

    def _rested_meter(self, record: RunWriter) -> DeformationMeter:
        """Of a frame taken now, which goes on record if it can be trusted."""
        time_s, jpeg = self.bench.camera.grab()
        meter = recorded_meter(self.request.setup, jpeg)
        record.rest(time_s, jpeg)
        return meter
