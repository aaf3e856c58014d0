"""A bench in the lab: a Mega on a serial port, a camera, and a person who mounts the tip."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from rig.board.camera import open_camera
from rig.board.errors import BoardError
from rig.link.open import open_bus
from rig.spec.bench import BenchSpec, SerialBoard
from rig.spec.calibration import CameraCalibration

INSTRUCTIONS = {
    "free": "Take the load cell away, so that the actuator hangs free",
    "blocked": "Mount the load cell so that it just touches the bottom layer at the tip",
    "plugged": "Take the actuator off and close the end of the tube with a plug",
}


class RealBench:
    """A bench, open; `ask` shows an instruction and returns when the person has followed it.

    Bench time begins at `start_s`, which a resumed run sets to where it was.
    """

    def __init__(
        self,
        bench: BenchSpec,
        camera: CameraCalibration,
        ask: Callable[[str], None],
        *,
        start_s: float = 0.0,
    ) -> None:
        if not isinstance(bench.board, SerialBoard):
            raise BoardError(f"the bench '{bench.name}' has no serial board")
        self.bus = open_bus(bench.board.port, bench.board.baudrate, start_s=start_s)
        try:
            self.camera = open_camera(bench.camera, camera, lambda: self.bus.now_s)
        except BoardError:
            self.bus.close()
            raise
        self._ask = ask

    def mount(self, fixture: Literal["free", "blocked", "plugged"]) -> None:
        """Ask the person at the bench to arrange it so."""
        self._ask(INSTRUCTIONS[fixture])

    def close(self) -> None:
        """Release port and camera."""
        self.camera.close()
        self.bus.close()
