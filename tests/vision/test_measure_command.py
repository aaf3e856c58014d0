"""`rig measure` on good and bad files, and the readers beneath it."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import pytest

from rig.spec.calibration_file import calibration_text
from rig.vision.errors import VisionError
from rig.vision.footage import expand, read_frames
from rig.vision.table import ANGLE, header
from tests.cli.conftest import rig  # noqa: F401
from tests.vision.synthetic import Scene, render
from tests.vision.test_displacement import CAMERA, film_of, still_outlines, stroke_mm
from tests.vision.test_marker_angle import picture as markers_at
from tests.vision.test_track import camera, frame

CALIBRATIONS = (
    "kind: calibration\ninstrument: {instrument}\n{fields}\nprovenance:\n"
    "  date: 2025-01-01\n  method: synthetic\n  instrument: test\n"
)
CAMERA_FIELDS = (
    "width: 1280\nheight: 720\nfocal_x: 2100\nfocal_y: 2104\ncentre_x: 644\ncentre_y: 352\n"
    "distortion: [-0.11, 0.06, 0.0004, -0.0003, 0.0]\nangle_u_deg: 0.02"
)
RULER_FIELDS = "pitch: 10 mm\nmarks: 7\npitch_u: 0.02 mm\nsquareness_u_deg: 0.0"


@pytest.fixture(scope="module")
def pictures() -> dict[float, np.ndarray]:
    return {angle: render(Scene(angle=angle)) for angle in (10.0, 60.0)}


@pytest.fixture
def folder(tmp_path: Path, pictures: dict[float, np.ndarray]) -> Path:
    place = tmp_path / "frames"
    place.mkdir()
    cv2.imwrite(str(place / "frame_10.png"), pictures[60.0])
    cv2.imwrite(str(place / "frame_9.png"), pictures[10.0])
    (place / "notes.txt").write_text("not a picture")
    return place


def film(path: Path, pictures: Sequence[np.ndarray]) -> Path:
    """A video of 25 frames a second."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 25.0, (1280, 720))
    for picture in pictures:
        writer.write(picture)
    writer.release()
    return path


@pytest.fixture
def video(tmp_path: Path, pictures: dict[float, np.ndarray]) -> Path:
    black = np.zeros_like(pictures[10.0])
    return film(tmp_path / "run.avi", (pictures[10.0], black, pictures[60.0]))


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_images_of_a_folder_become_rows_in_natural_order(rig, folder, tmp_path):  # noqa: F811
    table = tmp_path / "angles.csv"
    outcome = rig("measure", folder, "--csv", table)
    assert outcome.code == 0, outcome.err
    assert table.read_text().splitlines()[0] == ",".join(header(ANGLE))
    rows = rows_of(table)
    assert [Path(row["file"]).name for row in rows] == ["frame_9.png", "frame_10.png"]
    assert [float(row["angle_deg"]) for row in rows] == pytest.approx([10.0, 60.0], abs=1.0)
    assert all(row["time_s"] == "" and row["accepted"] == "true" for row in rows)
    assert "2 of 2 frames accepted" in outcome.out


def test_calibrations_take_lens_and_plane_out(rig, folder, tmp_path):  # noqa: F811
    for name, fields in (("camera", CAMERA_FIELDS), ("ruler", RULER_FIELDS)):
        text = CALIBRATIONS.format(instrument=name, fields=fields)
        (tmp_path / f"{name}.yaml").write_text(text)
    table = tmp_path / "angles.csv"
    outcome = rig(
        "measure",
        folder,
        "--csv",
        table,
        "--camera",
        tmp_path / "camera.yaml",
        "--ruler",
        tmp_path / "ruler.yaml",
    )
    assert outcome.code == 0, outcome.err
    rows = rows_of(table)
    assert [float(row["angle_deg"]) for row in rows] == pytest.approx([10.0, 60.0], abs=0.2)
    assert all(float(row["u95_deg"]) < 0.5 for row in rows)


def test_swapped_calibrations_are_named(rig, folder, tmp_path):  # noqa: F811
    path = tmp_path / "ruler.yaml"
    path.write_text(CALIBRATIONS.format(instrument="ruler", fields=RULER_FIELDS))
    outcome = rig("measure", folder, "--camera", path)
    assert outcome.code != 0
    assert "'ruler'; expected 'camera'" in outcome.err


def test_a_video_keeps_its_clock_and_its_rejected_frames(rig, video, tmp_path):  # noqa: F811
    table, overlays = tmp_path / "angles.csv", tmp_path / "overlays"
    outcome = rig("measure", video, "--csv", table, "--overlay", overlays)
    assert outcome.code == 0, outcome.err
    rows = rows_of(table)
    assert [row["frame"] for row in rows] == ["0", "1", "2"]
    assert [float(row["time_s"]) for row in rows] == pytest.approx([0.0, 0.04, 0.08], abs=1e-6)
    assert [row["accepted"] for row in rows] == ["true", "false", "true"]
    assert rows[1]["angle_deg"] == rows[1]["u95_deg"] == ""
    assert "too dark" in rows[1]["reason"]
    assert sorted(p.name for p in overlays.iterdir()) == [f"run_{k:06d}.png" for k in range(3)]
    assert cv2.imread(str(overlays / "run_000001.png")).shape == (720, 1280, 3)


def test_a_followed_video_rejects_an_angle_that_jumps(rig, tmp_path, pictures):  # noqa: F811
    jumping = film(tmp_path / "jump.avi", [*3 * [pictures[10.0]], pictures[60.0]])
    table = tmp_path / "angles.csv"
    assert rig("measure", jumping, "--track", "--csv", table).code == 0
    *steady, jumped = rows_of(table)
    assert [float(row["angle_deg"]) for row in steady] == pytest.approx(3 * [10.0], abs=1.0)
    assert jumped["accepted"] == "false"
    assert "the angle jumps to" in jumped["reason"]


@pytest.fixture
def lab(tmp_path: Path) -> tuple[str | Path, ...]:
    """Options that name the calibrations of the virtual bench's lens and ruler."""
    folder = Path(__file__).parents[2] / "calibration"
    return (
        *("--camera", folder / "camera-virtual.yaml"),
        *("--ruler", folder / "ruler-virtual.yaml"),
    )


def test_a_backbone_comes_with_its_budget(rig, lab, tmp_path):  # noqa: F811
    cv2.imwrite(str(tmp_path / "bent.png"), frame(camera(4), 60.0))
    table, budget = tmp_path / "backbone.csv", tmp_path / "budget.csv"
    command = ("measure", tmp_path / "bent.png", "--quantity", "backbone", *lab)
    outcome = rig(*command, "--csv", table, "--budget", budget)
    assert outcome.code == 0, outcome.err
    (row,) = rows_of(table)
    radius, u95 = float(row["radius_mm"]), float(row["u95_radius_mm"])
    assert abs(radius - 66.0 / np.radians(60.0)) < u95 < 0.02 * radius
    assert float(row["curvature_per_m"]) == pytest.approx(1e3 / radius, rel=1e-4)
    assert 60.0 < float(row["bend_angle_deg"]) < 70.0
    assert 0.0 < float(row["u95_residual_mm"]) < float(row["residual_mm"]) < 0.05
    lines = rows_of(budget)
    assert {line["quantity"] for line in lines} == {"bend_angle_deg", "curvature_per_mm"}
    angle = [float(x["contribution"]) for x in lines if x["quantity"] == "bend_angle_deg"]
    assert float(row["u95_bend_angle_deg"]) == pytest.approx(2.0 * np.linalg.norm(angle), rel=0.05)
    assert "ruler pitch" in outcome.out


def test_the_radius_of_a_straight_actuator_is_not_told(rig, lab, tmp_path):  # noqa: F811
    cv2.imwrite(str(tmp_path / "straight.png"), frame(camera(4), 0.0))
    table = tmp_path / "backbone.csv"
    outcome = rig(
        *("measure", tmp_path / "straight.png", "--quantity", "backbone", *lab, "--csv", table)
    )
    assert outcome.code == 0, outcome.err
    (row,) = rows_of(table)
    assert row["radius_mm"] == row["u95_radius_mm"] == ""
    assert float(row["curvature_per_m"]) < float(row["u95_curvature_per_m"])


def test_displacement_counts_from_the_first_of_the_images(rig, lab, tmp_path):  # noqa: F811
    taken = film_of(still_outlines())
    for number, time_s in enumerate((0.0, 0.2)):
        cv2.imwrite(str(tmp_path / f"take-{number}.png"), taken(time_s))
    calibrated = tmp_path / "lens.yaml"
    calibrated.write_text(calibration_text(CAMERA))
    table = tmp_path / "displacement.csv"
    command = ("measure", tmp_path / "*.png", "--quantity", "displacement", "--csv", table)
    outcome = rig(*command, "--camera", calibrated, *lab[2:], "--out-of-plane-u-mm", "0.2")
    assert outcome.code == 0, outcome.err
    first, second = rows_of(table)
    assert float(first["displacement_mm"]) == pytest.approx(0.0, abs=1e-9)
    off = float(second["displacement_mm"]) - stroke_mm(0.2)
    assert abs(off) < float(second["u95_mm"]) < 0.2
    vague = rig(*command, "--camera", calibrated, *lab[2:], "--out-of-plane-u-mm", "5")
    assert vague.code == 0
    assert float(rows_of(table)[1]["u95_mm"]) > 0.3


def test_lengths_need_lens_and_ruler_and_two_markers(rig, lab, folder):  # noqa: F811
    for wrong in (
        ("--quantity", "backbone"),
        ("--quantity", "displacement", *lab[:2]),
        ("--quantity", "displacement", *lab, "--markers", "3", "3"),
        ("--quantity", "backbone", *lab, "--track"),
        ("--budget", "b.csv"),
    ):
        assert rig("measure", folder, *wrong).code == 2, wrong


def test_an_image_without_actuator_exits_non_zero_with_the_reason(rig, tmp_path):  # noqa: F811
    path = tmp_path / "wall.png"
    cv2.imwrite(str(path), np.full((300, 400, 3), 120, np.uint8))
    outcome = rig("measure", path)
    assert outcome.code == VisionError.exit_code
    assert "no actuator" in " ".join(outcome.err.split())
    assert "Traceback" not in outcome.err


def test_one_bad_file_does_not_cost_the_others(rig, folder, tmp_path):  # noqa: F811
    (folder / "broken.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    table = tmp_path / "angles.csv"
    outcome = rig("measure", folder, "--csv", table)
    assert outcome.code == VisionError.exit_code
    rows = rows_of(table)
    assert len(rows) == 3
    assert sum(row["accepted"] == "true" for row in rows) == 2
    assert "No angle in 1 of 3 files" in " ".join(outcome.err.split())


def test_an_image_of_another_size_than_the_calibration_is_a_row(rig, tmp_path):  # noqa: F811
    (tmp_path / "c.yaml").write_text(CALIBRATIONS.format(instrument="camera", fields=CAMERA_FIELDS))
    path = tmp_path / "small.png"
    cv2.imwrite(str(path), np.full((300, 400, 3), 120, np.uint8))
    outcome = rig("measure", path, "--camera", tmp_path / "c.yaml")
    assert outcome.code == VisionError.exit_code
    assert "400x300" in " ".join(outcome.err.split())


def test_files_of_the_same_name_get_overlays_of_their_own(rig, tmp_path, pictures):  # noqa: F811
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        cv2.imwrite(str(tmp_path / name / "f.png"), pictures[10.0])
    outcome = rig("measure", tmp_path / "a", tmp_path / "b", "--overlay", tmp_path / "o")
    assert outcome.code == 0, outcome.err
    assert sorted(p.name for p in (tmp_path / "o").iterdir()) == ["f-2.png", "f.png"]


def test_a_table_that_cannot_be_written_is_said(rig, folder, tmp_path):  # noqa: F811
    outcome = rig("measure", folder, "--csv", tmp_path / "missing" / "a.csv")
    assert outcome.code != 0
    assert "cannot be written" in outcome.err


def bad_file(tmp_path: Path, kind: str, picture: np.ndarray) -> Path:
    png = cv2.imencode(".png", picture)[1].tobytes()
    jpeg = cv2.imencode(".jpg", picture)[1].tobytes()
    contents = {
        "empty.png": b"",
        "text.png": b"angle,pressure\n1,2\n",
        "text.txt": b"hello\n",
        "text.mp4": b"this is a text file\n",
        "cut.png": png[: len(png) // 2],
        "cut.jpg": jpeg[: len(jpeg) // 2],
        "noise.mp4": bytes(range(256)) * 40,
        "header.avi": b"RIFF\x00\x00\x00\x00AVI LIST" + bytes(64),
    }
    path = tmp_path / kind
    path.write_bytes(contents[kind])
    return path


@pytest.mark.parametrize(
    ("kind", "why"),
    [
        ("empty.png", "is empty"),
        ("text.png", "text file"),
        ("text.txt", "text file"),
        ("text.mp4", "text file"),
        ("cut.png", "cut short"),
        ("cut.jpg", "cut short"),
        ("noise.mp4", "neither an image nor a video"),
        ("header.avi", "no frame|neither"),
    ],
)
def test_an_unreadable_file_says_what_is_wrong(tmp_path, pictures, kind, why):
    path = bad_file(tmp_path, kind, pictures[10.0])
    with pytest.raises(VisionError, match=why) as error:
        list(read_frames(path))
    assert path.name in str(error.value)


def test_a_video_without_frames_says_so(tmp_path):
    path = tmp_path / "nothing.avi"
    cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 25.0, (64, 48)).release()
    with pytest.raises(VisionError, match=r"no frame|neither"):
        list(read_frames(path))


@pytest.mark.parametrize("argument", ["missing.png", "missing/*.png", "no*such"])
def test_an_argument_that_names_nothing_is_refused(tmp_path, monkeypatch, argument):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(VisionError, match=r"does not exist|matches no file"):
        expand([argument])


def test_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(VisionError, match="no image or video"):
        expand([str(tmp_path)])


def test_a_file_named_twice_is_measured_once(folder):
    names = [path.name for path in expand([str(folder), str(folder / "*.png")])]
    assert names == ["frame_9.png", "frame_10.png"]


def test_a_file_whose_name_looks_like_a_glob_is_found(tmp_path, pictures):
    path = tmp_path / "take[1].png"
    cv2.imwrite(str(path), pictures[10.0])
    assert expand([str(path)]) == [path]


def test_the_angle_between_markers_is_a_row_and_an_overlay(rig, tmp_path):  # noqa: F811
    cv2.imwrite(str(tmp_path / "m.png"), markers_at(50.0))
    table, drawn = tmp_path / "m.csv", tmp_path / "o"
    wanted = ("--quantity", "marker-angle", "--csv", table, "--overlay", drawn)
    outcome = rig("measure", tmp_path / "m.png", *wanted)
    assert outcome.code == 0, outcome.err
    (row,) = csv.DictReader(table.open(newline=""))
    assert abs(float(row["angle_deg"]) - 50.0) < float(row["u95_deg"])
    assert (drawn / "m.png").exists()
    assert rig("measure", tmp_path / "m.png", *wanted, "--markers", 1, 1).code != 0
    assert rig("measure", tmp_path / "m.png", *wanted, "--track").code != 0
