"""Hostile footage: each bad file is one explained rejection, and nothing hangs."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import cv2
import pytest

from rig.vision.errors import VisionError
from rig.vision.footage import expand, read_frames
from tests.cli.conftest import rig  # noqa: F401
from tests.vision.synthetic import Scene, render


def _chunk(name: bytes, data: bytes) -> bytes:
    body = name + data
    return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))


@pytest.fixture
def boundless(tmp_path: Path) -> Path:
    """A PNG whose header claims 100000 x 100000 pixels."""
    header = struct.pack(">IIBBBBB", 100_000, 100_000, 8, 2, 0, 0, 0)
    pixels = zlib.compress(b"\0" * 100)
    path = tmp_path / "boundless.png"
    chunks = _chunk(b"IHDR", header) + _chunk(b"IDAT", pixels) + _chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunks)
    return path


def test_a_picture_that_claims_too_many_pixels_is_refused(boundless: Path) -> None:
    with pytest.raises(VisionError, match=r"boundless\.png (cannot be decoded|is damaged)"):
        list(read_frames(boundless))


def test_one_bad_picture_leaves_the_others_measured(rig, boundless, tmp_path):  # noqa: F811
    cv2.imwrite(str(tmp_path / "good.png"), render(Scene(angle=30.0)))
    outcome = rig("measure", tmp_path)
    assert outcome.code == 5  # the exit code of footage without an angle
    assert "1 of 2 frames accepted" in outcome.out
    assert "boundless.png" in outcome.err
    assert "defect in rig" not in outcome.err


@pytest.mark.parametrize("pattern", ["***/[", "a/b**c/***/*[.png"])
def test_a_glob_that_matches_nothing_or_is_none_is_refused_by_name(pattern: str) -> None:
    with pytest.raises(VisionError, match="glob") as caught:
        expand([pattern])
    assert f"'{pattern}'" in str(caught.value)


@pytest.mark.parametrize("empty", ["", "  "])
def test_an_empty_name_is_refused(empty: str) -> None:
    with pytest.raises(VisionError, match="An empty name was given"):
        expand([empty])


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_refused_without_waiting_for_it(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.png"
    os.mkfifo(pipe)
    with pytest.raises(VisionError, match="is no regular file"):
        list(read_frames(pipe))


def test_decoders_write_nothing_about_a_broken_video(tmp_path: Path) -> None:
    path = tmp_path / "broken.mp4"
    path.write_bytes(b"\0\0\0\x18ftypmp42" + bytes(range(256)) * 40)
    # decoders decide how much they tell when a process first uses them: it takes a fresh one
    told = subprocess.run(
        [sys.executable, "-m", "rig", "measure", path], capture_output=True, text=True, check=False
    )
    assert told.returncode == 5
    assert "moov" not in told.stderr
    assert told.stderr.startswith("rig: ")
