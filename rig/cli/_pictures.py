"""Where the pictures of a calibration come from."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator
from itertools import takewhile

from rig.board.camera import open_camera
from rig.cli._interruption import catching_signals
from rig.spec.bench import BenchSpec
from rig.spec.calibration import CameraCalibration
from rig.vision.footage import expand, read_frames
from rig.vision.segment import Image, decoded


def until_interrupted(pictures: Iterable[Image]) -> Generator[Image, None, None]:
    """The pictures, no further ones after Ctrl-C: what there is will be used."""
    with catching_signals("taking the pictures that there are") as interruption:
        yield from takewhile(lambda _: not interruption.requested, pictures)


def frames_of_files(named: list[str]) -> Iterator[Image]:
    """All frames of images, videos, folders and globs; raises VisionError."""
    for file in expand(named):
        for frame in read_frames(file):
            yield frame.image


def frames_of_camera(bench: BenchSpec, mode: CameraCalibration) -> Iterator[Image]:
    """What a real bench's camera sees, in the mode of its present calibration.

    Frames that are no readable pictures are passed over. Ends when nobody asks any more. Raises
    BoardError.
    """
    camera = open_camera(bench.camera, mode, lambda: 0.0)
    try:
        while True:
            image = decoded(camera.grab()[1])
            if image is not None:
                yield image
    finally:
        camera.close()
