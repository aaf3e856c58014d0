"""Frames from images, videos, folders and globs: the input side of `rig measure`."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2

from rig.vision.errors import VisionError
from rig.vision.segment import Image, as_image, decoded

IMAGE_SUFFIXES = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp"}
VIDEO_SUFFIXES = {".mp4", ".avi", ".mov", ".mkv", ".m4v", ".webm", ".mpg", ".mpeg", ".wmv"}
FFMPEG_LOG_LEVEL = "OPENCV_FFMPEG_LOGLEVEL"
GLOB_CHARACTERS = re.compile(r"[*?\[]")


@dataclass(frozen=True)
class Frame:
    """One picture of a file; `time_s` is the video's own clock, None for a still."""

    file: Path
    index: int
    time_s: float | None
    image: Image


def expand(arguments: Sequence[str]) -> list[Path]:
    """Files named by paths, folders (their images and videos) and globs, each once, in order.

    Folders and globs are sorted with numbers as numbers. Raises VisionError for an argument that
    names nothing.
    """
    files: list[Path] = []
    for argument in arguments:
        if not argument.strip():
            raise VisionError(
                f"An empty name was given. {_EXPECTED} Perhaps a variable of the shell is not set."
            )
        path = Path(argument).expanduser()
        if path.is_dir():
            known = IMAGE_SUFFIXES | VIDEO_SUFFIXES
            found = [p for p in path.iterdir() if p.is_file() and p.suffix.lower() in known]
            what = "has no image or video in it"
        elif path.exists():
            found, what = [path], ""
        elif GLOB_CHARACTERS.search(argument):
            found, what = _matches(path), "matches no file"
        else:
            found, what = [], "does not exist"
        if not found:
            raise VisionError(f"'{argument}' {what}. {_EXPECTED}")
        files += sorted(found, key=_natural)
    return list(dict.fromkeys(files))


def _matches(pattern: Path) -> list[Path]:
    anchor = Path(pattern.anchor)
    relative = str(pattern.relative_to(pattern.anchor))
    try:
        return [path for path in anchor.glob(relative) if path.is_file()]
    except (ValueError, NotImplementedError, re.error) as error:
        raise VisionError(f"'{pattern}' is no valid glob: {error}. {_EXPECTED}") from None


def read_frames(path: Path) -> Iterator[Frame]:
    """All frames of an image or video file, one after the other.

    Raises VisionError where the file cannot be read, is neither, is cut short, or has no frame.
    """
    _silence_decoders()
    try:
        if path.exists() and not path.is_file():  # a pipe would block, a device never end
            raise VisionError(f"{path} is no regular file; expected an image or a video.")
        with path.open("rb") as file:
            head = file.read(2048)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise VisionError(f"{path} cannot be read: {reason}.") from None
    if not head:
        raise VisionError(f"{path} is empty: it was never written, or copied incompletely.")
    if path.suffix.lower() not in VIDEO_SUFFIXES and cv2.haveImageReader(str(path)):
        yield Frame(path, 0, None, _still(path))
    elif _is_text(head):
        raise VisionError(f"{path} is a text file; expected an image or a video.")
    else:
        yield from _video(path)


def _silence_decoders() -> None:
    """Decoders would write of every damaged file to stderr; the errors raised here say it all."""
    os.environ.setdefault(FFMPEG_LOG_LEVEL, "-8")
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)


def _still(path: Path) -> Image:
    data = path.read_bytes()
    if _is_cut(data):
        raise VisionError(f"{path} is cut short: its end is missing; copy it again.")
    try:
        image = decoded(data)
    except (cv2.error, MemoryError) as error:  # such as a header that claims 100000 x 100000
        raise VisionError(f"{path} cannot be decoded: {_words(error)}.") from None
    if image is None:
        raise VisionError(f"{path} is damaged: it starts like an image but cannot be decoded.")
    return image


def _is_cut(data: bytes) -> bool:
    """Decoders fill what is missing with grey; an end marker that is missing tells."""
    if data.startswith(b"\x89PNG"):
        return b"IEND" not in data[-64:]
    if data.startswith(b"\xff\xd8"):
        return b"\xff\xd9" not in data[-4096:]
    return False


def _is_text(head: bytes) -> bool:
    """Printable throughout; FFmpeg would render it as an ANSI terminal video."""
    return not any(byte < 9 or (13 < byte < 32 and byte != 27) for byte in head)


def _video(path: Path) -> Iterator[Frame]:
    capture = cv2.VideoCapture(str(path))
    try:
        if not capture.isOpened():
            raise VisionError(
                f"{path} is neither an image nor a video that OpenCV can read; convert it, for "
                "example to PNG or to H.264 in MP4."
            )
        index = 0
        while True:
            try:
                ok, image = capture.read()
            except (cv2.error, MemoryError) as error:
                raise VisionError(
                    f"{path} cannot be decoded from frame {index} on: {_words(error)}."
                ) from None
            if not ok or image is None:
                break
            yield Frame(path, index, capture.get(cv2.CAP_PROP_POS_MSEC) / 1e3, as_image(image))
            index += 1
        if index == 0:
            raise VisionError(f"{path} has no frame: an empty or damaged video.")
    finally:
        capture.release()


def _words(error: Exception) -> str:
    """What OpenCV says, without its version and source lines."""
    what = getattr(error, "err", "") or str(error) or "not enough memory"
    return " ".join(what.split()).rstrip(".")


def _natural(path: Path) -> list[tuple[int, int, str]]:
    """Sort key in which frame_9 comes before frame_10."""
    pieces = re.split(r"(\d+)", str(path))
    return [(0, int(p), "") if p.isdecimal() else (1, 0, p) for p in pieces]


def _list(suffixes: set[str]) -> str:
    return ", ".join(sorted(suffix.lstrip(".") for suffix in suffixes))


_EXPECTED = (
    f"Give images ({_list(IMAGE_SUFFIXES)}), videos ({_list(VIDEO_SUFFIXES)}), folders of them, "
    "or a glob such as 'frames/*.png'."
)
