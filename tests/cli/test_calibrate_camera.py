"""`rig calibrate camera` and `ruler` on the virtual bench: the hidden lens is found."""

from __future__ import annotations

import re
import signal

import numpy as np
import pytest

from rig.board.virtual import Seeds
from rig.board.virtual_target import board_views, hidden_lean
from rig.plant.camera import CameraStreams
from rig.spec.calibration import CameraCalibration, RulerCalibration
from rig.spec.loading import read
from rig.spec.target import CharucoTarget
from rig.spec.workspace import Workspace
from tests.benches import BEAM_ACTUATOR
from tests.cli.conftest import rig  # noqa: F401

SEED = 3


def hidden_lens():
    optics = Workspace.find().bench("virtual").virtual.optics
    return CameraStreams.of(np.random.default_rng(Seeds.of(SEED, 0).camera)).lens(optics)


def test_the_lens_of_the_bench_is_found_within_its_uncertainty(rig, tmp_path):  # noqa: F811
    file, plot = tmp_path / "camera.yaml", tmp_path / "residuals.png"
    outcome = rig(
        *("calibrate", "camera", "--seed", SEED, "--views", 10, "--out", file, "--plot", plot)
    )
    assert outcome.code == 0, outcome.err
    assert plot.read_bytes().startswith(b"\x89PNG")
    made = read(file, CameraCalibration).spec
    assert made.provenance.simulated
    assert made.provenance.valid_until is not None
    (fit,) = made.evidence.fits
    lens = hidden_lens()
    centre = (lens.centre_x, lens.centre_y)
    true = np.array([lens.focal_x, lens.focal_y, *centre, *lens.distortion[:4]])
    scores = (np.array(fit.values) - true) / np.sqrt(np.diag(fit.covariance))
    assert np.abs(scores).max() < 3.5
    known = Workspace.find().resolve_bench(Workspace.find().bench("virtual")).camera
    assert abs(made.focal_x - lens.focal_x) < abs(known.focal_x - lens.focal_x)
    assert made.angle_u_deg < known.angle_u_deg


def test_a_ruler_is_found_as_square_as_it_is(rig, tmp_path):  # noqa: F811
    file = tmp_path / "ruler.yaml"
    outcome = rig(
        *("calibrate", "ruler", "--seed", SEED, "--views", 4, "--out", file),
        *("--pitch-mm", "10.002", "--pitch-u-mm", "0.004"),
    )
    assert outcome.code == 0, outcome.err
    made = read(file, RulerCalibration).spec
    lean_deg, _ = made.evidence.fits[0].values
    hidden = np.degrees(hidden_lean(Workspace.find().bench("virtual"), SEED))
    assert lean_deg == pytest.approx(hidden, abs=2.0 * made.squareness_u_deg)
    assert made.pitch == pytest.approx(10.002e-3)
    assert made.pitch_u == pytest.approx(0.004e-3)


def test_a_pitch_without_its_uncertainty_is_refused(rig):  # noqa: F811
    outcome = rig("calibrate", "ruler", "--pitch-mm", "10")
    assert outcome.code != 0
    assert "belong together" in outcome.err


def test_the_board_can_be_printed(rig, tmp_path):  # noqa: F811
    assert rig("calibrate", "camera", "--board", tmp_path / "board.png").code == 0
    assert (tmp_path / "board.png").read_bytes().startswith(b"\x89PNG")
    outcome = rig("calibrate", "camera", "--board", tmp_path / "no" / "board.png")
    assert outcome.code != 0
    assert "cannot be written" in " ".join(outcome.err.split())


def test_a_board_that_cannot_be_is_refused(rig):  # noqa: F811
    for wrong in (("--square-mm", "10", "--marker-mm", "12"), ("--columns", "20", "--rows", "20")):
        outcome = rig("calibrate", "camera", *wrong)
        assert outcome.code == 2
        assert "expected" in outcome.err
        assert "defect" not in outcome.err


def test_after_ctrl_c_the_lens_is_fitted_to_what_there_is(
    rig,  # noqa: F811
    tmp_path,
    monkeypatch,
):
    bench = Workspace.find().bench("virtual")

    def filmed(named):
        for number, picture in enumerate(board_views(bench, CharucoTarget(), SEED, 12)):
            assert number < 12
            if number == 10:
                signal.raise_signal(signal.SIGINT)
            yield picture

    monkeypatch.setattr("rig.cli._pictures.frames_of_files", filmed)
    file = tmp_path / "camera.yaml"
    outcome = rig("calibrate", "camera", "film.mp4", "--views", 30, "--out", file)
    assert outcome.code == 0, outcome.err
    made = read(file, CameraCalibration).spec
    assert len(made.evidence.rows) == 10


def test_the_first_calibration_of_a_camera_needs_no_other(rig, tmp_path, monkeypatch):  # noqa: F811
    def nothing_there(*_):
        raise AssertionError("the bench's calibrations were asked for")

    monkeypatch.setattr(Workspace, "resolve_bench", nothing_there)
    outcome = rig("calibrate", "camera", tmp_path / "none*.png", "--bench", "mega")
    assert "matches no file" in outcome.err


def test_pictures_without_a_board_are_refused(rig, tmp_path):  # noqa: F811
    import cv2

    cv2.imwrite(str(tmp_path / "grey.png"), np.full((720, 1280, 3), 90, np.uint8))
    outcome = rig("calibrate", "camera", tmp_path / "grey.png", "--out", tmp_path / "x.yaml")
    assert outcome.code != 0
    assert "The board was found in 0 pictures" in outcome.err
    assert not (tmp_path / "x.yaml").exists()


def test_a_latency_joins_the_calibration_of_the_camera(rig, tmp_path):  # noqa: F811
    file = tmp_path / "made.yaml"
    outcome = rig(
        *("calibrate", "latency", "--bench", "virtual-beam", "--actuator", BEAM_ACTUATOR),
        *("--cycles", 1, "--frames", 8, "--lag-ms", 21, "--lag-u-ms", 4, "--out", file),
    )
    assert outcome.code == 0, outcome.err
    made = read(file, CameraCalibration).spec
    space = Workspace.find()
    known = space.resolve_bench(space.bench("virtual-beam")).camera
    assert made.model_copy(update={"latency": None}) == known.model_copy(update={"latency": None})
    latency = made.latency
    assert latency.provenance.simulated
    delay_s = latency.fit.values[latency.fit.parameters.index("delay")]
    lags = dict(re.findall(r"^  (\w+).* (-?\d+\.\d) ms, u = ", outcome.out, re.MULTILINE))
    assert float(lags["damping"]) == 21.0
    assert len(lags) == 4
    off = sum(1e-3 * float(lag) for lag in lags.values())
    assert latency.value == pytest.approx(delay_s - off, abs=3e-4)  # they are told to 0.1 ms
    assert 0.004 < latency.u < 0.008
    assert f"latency {1e3 * latency.value:.1f} ms" in outcome.out
