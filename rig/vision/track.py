"""A bending angle followed through a film: search where the cap is expected, refuse what jumps.

A Kalman filter holds the angle and the place of the cap. It only predicts and gates: a measured
angle is never replaced by a filtered one, and a frame without a trusted angle has none.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rig.vision.lines import FloatArray
from rig.vision.measure import AngleMeasurement, AngleMeter
from rig.vision.motion import ConstantVelocity, require_later
from rig.vision.plane import PicturePlane
from rig.vision.segment import Image

GATE_SIGMAS = 5.0
"""An angle further than this many standard deviations from the predicted one is refused."""
START_RATE_DEG_S, START_RATE_PX_S = 300.0, 3000.0
"""Standard deviations of the rates of which a single frame tells nothing."""
PLACE_U_PX = 1.0
CAP_REACH_PX = 12.0
"""Searched around the cap in any case, as the window must not touch it."""
RELOOK_S = 1.0
"""Time between looks at the whole frame."""
CONNECTOR_MOVE_PX = 1.0
"""The connector stands still; if an end of its edges has moved by more, so has the camera."""


@dataclass(frozen=True)
class Motion:
    """How fast an actuator may change its motion: standard deviations of its acceleration."""

    angle_deg_s2: float = 3000.0
    place_px_s2: float = 30_000.0


@dataclass(frozen=True)
class TrackedAngle:
    """A frame's measurement, and what the frames before it made of it."""

    measurement: AngleMeasurement
    predicted_deg: float | None
    """From the frames before; None at the start of a track."""
    u_predicted_deg: float
    rate_deg_s: float | None
    """After this frame; None unless there is a track."""


class AngleTracker:
    """Measures the frames of one film in order; `lost_after_s` without an angle starts anew.

    Camera and ruler should stand still: where they are is looked at anew once the connector is
    seen to have moved, and every `RELOOK_S` in any case.
    """

    def __init__(
        self, meter: AngleMeter, motion: Motion | None = None, lost_after_s: float = 0.5
    ) -> None:
        self._meter = meter
        self._motion = motion or Motion()
        self._lost_after_s = lost_after_s
        self._track: _Track | None = None

    def measure(self, image_bgr: Image, time_s: float) -> TrackedAngle:
        """Bending angle at `time_s`, which must grow from frame to frame.

        Raises VisionError for times that do not, and for what `AngleMeter.measure` refuses.
        """
        track = self._track
        if track is not None:
            require_later(time_s, track.time_s)
        if track is not None and time_s - track.seen_s > self._lost_after_s:
            track = None
        if track is None:
            result = self._meter.measure(image_bgr)
            self._track = _Track.begun(result, time_s) if result.accepted else None
            return TrackedAngle(result, None, 0.0, None if self._track is None else 0.0)
        self._track = track = track.predicted(time_s, self._motion)
        predicted, u = track.angle_deg, track.u_angle_deg
        result = track.gated(self._look(image_bgr, track))
        if result.accepted:
            self._track = track = track.updated(result)
        return TrackedAngle(result, predicted, u, track.rate_deg_s)

    def _look(self, image: Image, track: _Track) -> AngleMeasurement:
        """Where the cap is expected first, then in the whole frame."""
        sighting = track.last.sighting
        if sighting is not None and track.time_s - track.relooked_s < RELOOK_S:
            result = self._meter.measure_again(image, sighting, *track.reach())
            if result.accepted and _shift(result, track.last) < CONNECTOR_MOVE_PX:
                return result
        return self._meter.measure(image)


def _shift(now: AngleMeasurement, before: AngleMeasurement) -> float:
    """How far the connector's edges have moved across, px; without limit if they are others."""
    assert now.geometry.connector is not None
    assert before.geometry.connector is not None
    edges = (now.geometry.connector.edges, before.geometry.connector.edges)
    if len(edges[0]) != len(edges[1]):
        return np.inf
    moved = []
    for new, (start, end) in zip(*edges, strict=True):
        along = (end - start) / np.hypot(*(end - start))
        moved.append(np.abs((new - start) @ [-along[1], along[0]]).max())
    return float(max(moved))


def _plane(result: AngleMeasurement) -> PicturePlane | None:
    return None if result.sighting is None else result.sighting.plane


def _place(result: AngleMeasurement) -> FloatArray:
    """Middle (2,) of the cap's outline, px."""
    assert result.geometry.cap is not None
    outline = result.geometry.cap.outline
    middle: FloatArray = 0.5 * (outline.min(axis=0) + outline.max(axis=0))
    return middle


@dataclass(frozen=True)
class _Track:
    """What is expected at `time_s`: the angle, and the cap's x and y."""

    state: ConstantVelocity
    time_s: float
    seen_s: float  # when the last accepted frame was taken
    last: AngleMeasurement  # the last accepted one
    relooked_s: float  # when the whole frame was last looked at

    @classmethod
    def begun(cls, result: AngleMeasurement, time_s: float) -> _Track:
        """A track of one accepted frame."""
        rates = np.array([START_RATE_DEG_S, START_RATE_PX_S, START_RATE_PX_S])
        state = ConstantVelocity.begun(_values(result), _u(result), rates)
        return cls(state, time_s, time_s, result, time_s)

    @property
    def angle_deg(self) -> float:
        return float(self.state.values[0])

    @property
    def rate_deg_s(self) -> float:
        return float(self.state.rates[0])

    @property
    def u_angle_deg(self) -> float:
        return float(self.state.u[0])

    def predicted(self, time_s: float, motion: Motion) -> _Track:
        """The track at a later time."""
        acceleration = np.array([motion.angle_deg_s2, motion.place_px_s2, motion.place_px_s2])
        state = self.state.predicted(time_s - self.time_s, acceleration)
        return replace(self, state=state, time_s=time_s)

    def updated(self, result: AngleMeasurement) -> _Track:
        """The track with an accepted frame of its time."""
        state = self.state.updated(_values(result), _u(result))
        same = _plane(result) is _plane(self.last)
        relooked_s = self.relooked_s if same else self.time_s
        return _Track(state, self.time_s, self.time_s, result, relooked_s)

    def gated(self, result: AngleMeasurement) -> AngleMeasurement:
        """The same measurement, rejected if the angle is not where it can have come to."""
        if result.angle_deg is None:
            return result
        apart = abs(result.angle_deg - self.angle_deg)
        if apart <= GATE_SIGMAS * np.hypot(self.u_angle_deg, result.u_deg):
            return result
        reason = (
            f"the angle jumps to {result.angle_deg:.1f} deg where {self.angle_deg:.1f} +- "
            f"{GATE_SIGMAS * self.u_angle_deg:.1f} deg is expected from the frames before"
        )
        return replace(
            result,
            angle_deg=None,
            u_deg=0.0,
            quality=0.0,
            accepted=False,
            reason=reason,
            sighting=None,
        )

    def reach(self) -> tuple[FloatArray, float]:
        """How far the cap should have moved since the last accepted frame, give or take, px."""
        margin = CAP_REACH_PX + GATE_SIGMAS * float(self.state.u[1:].max())
        return self.state.values[1:] - _place(self.last), margin


def _values(result: AngleMeasurement) -> FloatArray:
    """Angle and place (3,) of an accepted measurement."""
    assert result.angle_deg is not None
    return np.array([result.angle_deg, *_place(result)])


def _u(result: AngleMeasurement) -> FloatArray:
    """Their standard uncertainties (3,)."""
    return np.array([result.u_deg, PLACE_U_PX, PLACE_U_PX])
