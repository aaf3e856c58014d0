"""25 mm in 0.4 s: the marker is followed, and its displacement is right to a tenth of a mm."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.plant.camera import SensorNoise
from rig.plant.coverage import Box
from rig.plant.markers import marker_surfaces
from rig.plant.optics import Lens, aim
from rig.plant.scene import developed
from rig.plant.target import flat_light, ruler_surfaces
from rig.spec.workspace import Workspace
from rig.validate.picture_budget import Picturing
from rig.validate.uncertainty import combine
from rig.vision import displacement
from rig.vision.displacement import DisplacementTracker
from rig.vision.errors import VisionError
from tests.vision.intervals import require_coverage

LIBRARY = Workspace(Path(__file__).parents[2])
CALIBRATIONS = LIBRARY.resolve_bench(LIBRARY.bench("virtual"))
RULER = CALIBRATIONS.ruler
LENS = Lens(640, 480, 1060.0, 1060.0, 322.0, 238.0, (-0.1, 0.04, 3e-4, -2e-4, 0.0))
CAMERA = CALIBRATIONS.camera.model_copy(
    update={
        "width": 640,
        "height": 480,
        "focal_x": 1062.0,
        "focal_y": 1062.0,
        "centre_x": 321.0,
        "centre_y": 239.0,
        "distortion": (-0.105, 0.05, 3e-4, -2e-4, 0.0),
    }
)
"""Off by its uncertainty."""
STROKE_MM, DURATION_S, EXPOSURE_S = 25.0, 0.4, 1e-3
SIDE = 0.012
PROJECTION = aim(LENS, 0.35, 0.03, -0.04, 0.02)
WHOLE = Box(0, 0, LENS.width, LENS.height)
NOISE = SensorNoise(LENS.width, LENS.height, 3.0, np.random.default_rng(1))


PICTURING = Picturing(CAMERA, RULER, 0.0)


def stroke_mm(time_s: float) -> float:
    """Smoothly from rest to rest; 98 mm/s at the fastest."""
    return 0.5 * STROKE_MM * (1.0 - np.cos(np.pi * np.clip(time_s / DURATION_S, 0.0, 1.0)))


def still_outlines(ruler=RULER, lean=0.0, projection=PROJECTION):
    """Pixel outlines of what does not move."""
    shifted = [
        replace(surface, outline=surface.outline + np.array([0.03, 0.0]))
        for surface in ruler_surfaces(ruler, lean)[0]
    ]
    shifted += marker_surfaces(0, SIDE, np.array([-0.06, -0.045]))
    return [(projection.project(surface.outline), surface) for surface in shifted]


def film_of(still, projection=PROJECTION, noise=NOISE):
    """Takes the picture of a moment."""

    def taken(time_s: float, hidden: bool = False, jump_mm: float = 0.0) -> np.ndarray:
        light = np.zeros((3, *WHOLE.shape), np.float32)
        moments = time_s + EXPOSURE_S * (np.arange(3) - 1) / 3
        for moment in moments:  # light is summed while the shutter is open
            place = np.array([-0.06, -0.02 + 1e-3 * (stroke_mm(moment) + jump_mm)])
            moving = [] if hidden else marker_surfaces(1, SIDE, place)
            outlines = [(projection.project(s.outline), s) for s in moving]
            light += flat_light([*still, *outlines], WHOLE) / len(moments)
        return noise.added(developed(light, 0.7), time_s)

    return taken


@pytest.fixture(scope="module")
def picture():
    return film_of(still_outlines())


@pytest.fixture
def tracker() -> DisplacementTracker:
    return DisplacementTracker(CAMERA, RULER)


@pytest.mark.parametrize("rate_hz", [60, 240])
def test_a_stroke_is_measured_within_a_tenth_of_a_millimetre(picture, tracker, rate_hz):
    times = np.arange(0.0, DURATION_S, 1 / rate_hz)
    if rate_hz == 240:  # from rest to the fastest; `python -m tests.bench displacement` does all
        times = times[: len(times) // 3]
    found = [tracker.measure(picture(time), float(time)) for time in times]
    assert [f.reason for f in found if not f.accepted] == []
    errors = np.array([f.displacement_mm for f in found]) - [stroke_mm(t) for t in times]
    assert np.abs(errors).max() < 0.1
    u95 = [combine(0.0, PICTURING.components(f.parts, "mm")).u95 for f in found]
    assert (np.abs(errors) < 1.5 * np.array(u95)).all()


def test_a_hidden_marker_is_rejected_and_found_again(picture, tracker):
    times = np.arange(6) / 120
    found = [tracker.measure(picture(t, hidden=i in (3, 4)), t) for i, t in enumerate(times)]
    assert [f.accepted for f in found] == [True, True, True, False, False, True]
    assert "marker 1 not found" in found[3].reason
    assert found[5].displacement_mm == pytest.approx(stroke_mm(times[5]), abs=0.1)


def test_a_marker_that_jumps_is_rejected(picture, tracker):
    for number in range(4):
        tracker.measure(picture(number / 240), number / 240)
    jumped = tracker.measure(picture(4 / 240, jump_mm=15.0), 4 / 240)
    assert not jumped.accepted
    assert "jumps to" in jumped.reason


def test_after_the_first_frame_only_the_markers_surroundings_are_searched(
    picture, tracker, monkeypatch
):
    whole = []
    seek = displacement.find_markers

    def counted(image, middle, reach):
        whole.append(reach >= max(image.shape))
        return seek(image, middle, reach)

    monkeypatch.setattr(displacement, "find_markers", counted)
    for time in np.arange(6) / 120:
        assert tracker.measure(picture(time), float(time)).accepted
    assert whole[0]
    assert not any(whole[1:])


def test_a_camera_that_was_knocked_is_noticed_at_the_fixed_marker(picture, tracker):
    assert tracker.measure(picture(0.0), 0.0).accepted
    knocked = tracker.measure(np.roll(picture(1 / 120), 2, axis=1), 1 / 120)
    assert not knocked.accepted
    assert "fixed end has moved" in knocked.reason


@pytest.mark.parametrize(
    "other", [np.zeros((480, 640), np.uint8), np.zeros((720, 960, 3), np.uint8)]
)
def test_what_is_no_picture_of_the_camera_is_refused(tracker, other):
    with pytest.raises(VisionError, match=r"Expected a colour image|The image is 960x720"):
        tracker.measure(other, 0.0)


def measured_stroke(seed: int) -> tuple[float, float]:
    """Error and expanded uncertainty in mm of a displacement under a bench of this seed.

    Viewpoint, lens, ruler, noise and place in the stroke are drawn; what the lens and the ruler are
    differs from their calibrations by what those say.
    """
    rng = np.random.default_rng(seed)
    seen = aim(LENS, 0.35, *rng.normal(0.0, 0.05, 2), rng.normal(0.0, 0.02))
    focal, x, y, k1 = rng.normal(size=4) * [2e-3, 1.0, 1.0, 5e-3]
    calibrated = CAMERA.model_copy(
        update={
            "focal_x": LENS.focal_x * (1 + focal),
            "focal_y": LENS.focal_y * (1 + focal),
            "centre_x": LENS.centre_x + x,
            "centre_y": LENS.centre_y + y,
            "distortion": (LENS.distortion[0] + k1, *LENS.distortion[1:]),
        }
    )
    truly = RULER.model_copy(update={"pitch": RULER.pitch + RULER.pitch_u * rng.normal()})
    lean = float(np.radians(RULER.squareness_u_deg) * rng.normal())
    noise = SensorNoise(LENS.width, LENS.height, 3.0, rng)
    taken = film_of(still_outlines(truly, lean, seen), seen, noise)
    tracker = DisplacementTracker(calibrated, RULER)
    time_s = float(rng.uniform(0.05, DURATION_S))
    tracker.measure(taken(0.0), 0.0)
    found = tracker.measure(taken(time_s), 1.0)
    assert found.accepted, found.reason
    lines = Picturing(calibrated, RULER, 0.0).components(found.parts, "mm")
    estimate = combine(found.displacement_mm, lines)
    return estimate.value - stroke_mm(time_s), estimate.u95


def test_the_interval_of_a_displacement_holds_the_truth():
    require_coverage([measured_stroke(seed) for seed in range(16)], 0.8, 1.0)


@pytest.mark.slow
def test_of_many_displacements_as_many_as_said_are_within_their_interval():
    require_coverage([measured_stroke(seed) for seed in range(500)], 0.92, 0.98)


def test_the_budget_of_a_displacement_is_what_makes_it_wrong(picture, tracker):
    """Each line against the change that its cause really makes."""
    tracker.measure(picture(0.0), 0.0)
    found = tracker.measure(picture(0.3), 1.0)
    lines = {line.name: line for line in PICTURING.components(found.parts, "mm")}
    assert all(line.u >= 0.0 for line in lines.values())
    assert lines["scatter"].kind == lines["ruler marks"].kind == "A"

    def displacement_of(ruler):
        again = DisplacementTracker(CAMERA, ruler)
        again.measure(picture(0.0), 0.0)
        return again.measure(picture(0.3), 1.0).displacement_mm

    longer = RULER.model_copy(update={"pitch": RULER.pitch + RULER.pitch_u})
    change = displacement_of(longer) - displacement_of(RULER)
    assert lines["ruler pitch"].contribution == pytest.approx(change, rel=0.05)
    leaning = lines["ruler squareness"]
    assert leaning.u == pytest.approx(np.radians(RULER.squareness_u_deg))
    assert leaning.sensitivity == found.parts.shear
    lens = lines["lens"]
    assert lens.u == pytest.approx(np.radians(CAMERA.angle_u_deg))
    assert lens.sensitivity == found.parts.lens == found.displacement_mm
    # a thing 1 mm before the plane, at 350 mm from the camera, looks larger by 1/350
    apart = {
        line.name: line for line in Picturing(CAMERA, RULER, 1.0).components(found.parts, "mm")
    }
    before = apart["distance from the ruler's plane"].contribution
    assert before == pytest.approx(found.displacement_mm / 350.0, rel=0.02)


def test_a_noisy_film_says_that_it_is_uncertain(picture):
    def scatter_u(level):
        tracker = DisplacementTracker(CAMERA, RULER)
        for number in range(2):
            noise = np.random.default_rng(number).normal(0.0, level, (480, 640, 3))
            image = np.clip(picture(number / 240) + noise, 0, 255).astype(np.uint8)
            found = tracker.measure(image, number / 240)
        return found.parts.scatter_u

    assert scatter_u(12.0) > 1.5 * scatter_u(0.0)


def test_frames_out_of_order_are_refused(picture, tracker):
    image = picture(0.0)
    tracker.measure(image, 0.0)
    with pytest.raises(VisionError, match="in the order"):
        tracker.measure(image, 0.0)
