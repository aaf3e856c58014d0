"""Bending angle of an actuator that hangs in front of a dark background.

The angle is the turn from the long edges of the rigid connector to the long edges of the rigid
end cap, in the plane of the picture: 0 when straight, growing as the tip curls to the side of the
flat layer. A frame that cannot be trusted is rejected with a reason, never guessed.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import cv2
import numpy as np

from rig.spec.calibration import CameraCalibration, RulerCalibration
from rig.vision.edges import LONG_SHARE, Edge, edges_along, long_edges
from rig.vision.errors import UnsharpFrameError, UntrustedFrameError
from rig.vision.lines import FloatArray
from rig.vision.plane import PicturePlane, rectify, require_picture
from rig.vision.ruler import find_ruler
from rig.vision.segment import (
    BluePart,
    Image,
    find_blue_parts,
    find_blue_parts_within,
    pyramid,
)

Side = Literal["left", "right"]

FULL_CONTRAST = 40.0
"""Contrast of an edge, in linear light of 255, from which more does not make it better."""
BLEEDING_FACTOR = 1.4
"""An edge this much wider than the best one of its part is no blurred step: the part's colour
bleeds into the translucent body there. The edges of the rigid front face do not bleed."""
CROOKED_FACTOR, STRAIGHT_PX = 3.0, 0.5
"""An edge whose points scatter more than both this multiple of the best one's and this many pixels
is not straight: something is mounted on it or before it."""
BLEEDING_DRIFT = 0.4
"""Drift from end to end of an edge within its extra width, as a share of it: the standard
deviation of the difference of two uniform deviates."""


@dataclass(frozen=True)
class Limits:
    """When a frame is trusted. Lengths in pixels, angles in degrees."""

    dark_level: float = 40.0
    """Grey level that the brightest hundredth of the frame must exceed."""
    saturated_share: float = 0.5
    """Share of white pixels (250 and more) from which the exposure is wrong."""
    same_blue_share: float = 0.4
    """Blueness relative to the bluest part from which a part may be of the same material."""
    same_hue_deg: float = 15.0
    """Largest difference in hue to the connector of a part of the same material."""
    max_cap_stoutness: float = 0.6
    """Width of the cap relative to its length; more is no plate seen from its edge."""
    mounting_gap: float = 0.5
    """Gap to the connector, relative to its thickness, below which a part belongs to it."""
    mounting_share: float = 0.5
    """Area relative to the connector's from which a part that close may be the connector."""
    speck_share: float = 0.15
    """Blue parts smaller than this share of the cap are specks."""
    min_cap_px: float = 16.0
    """Length of the cap's edge below which no direction is worth giving."""
    min_cap_share: float = 0.25
    """Length of the cap's edge relative to the connector's; less means a hidden cap."""
    clipped_share: float = 0.5
    """Share of a rigid part's pixels with blue at the white level from which it is overexposed."""
    max_edge_width: float = 5.0
    """10 % to 90 % width of the frame's sharpest edge; more is a blurred frame. Profiles reach
    4 px into a part, so wider transitions have no plateau to be measured against."""
    max_blur_share: float = 0.6
    """Width of the cap's sharpest edge relative to the cap's thickness: the two edges of a thin
    cap run together."""
    parallel_deg: float = 12.0
    """Edges within this of the best one are long edges of the same part."""
    max_disagreement_deg: float = 4.0
    """Two good long edges of one part further apart than this, and three times their uncertainty,
    contradict each other."""
    max_u_deg: float = 3.0
    """Standard uncertainty above which an angle is no measurement."""
    max_rectified_u_deg: float = 1.0
    """The same where a ruler gives the plane of the picture: more can be asked there."""
    max_position_gap_deg: float = 65.0
    """Largest gap between the angle and twice the swing of the cap: an arc's chord turns by half
    the arc's angle; 90 deg would be as near to the opposite reading."""
    lowest_deg: float = -30.0
    highest_deg: float = 200.0


@dataclass(frozen=True)
class PartGeometry:
    """What was used of a rigid part, distorted pixels."""

    outline: FloatArray  # (n, 2)
    edges: tuple[FloatArray, ...]  # fitted long edges, each (2, 2) from end to end


@dataclass(frozen=True)
class FrameGeometry:
    """What was found in the frame, for overlays; empty where the search stopped."""

    connector: PartGeometry | None = None
    cap: PartGeometry | None = None
    candidates: tuple[FloatArray, ...] = ()  # outlines of all blue parts
    ruler_marks: FloatArray = field(default_factory=lambda: np.empty((0, 2)))


@dataclass(frozen=True)
class AngleMeasurement:
    """One frame's bending angle, or why there is none."""

    angle_deg: float | None
    u_deg: float
    """Standard uncertainty, deg: edges, ruler, and the type B part of camera and ruler; 0 when
    rejected."""
    quality: float
    """0 to 1, from contrast, sharpness, agreement of the edges and uncertainty; 0 if rejected."""
    accepted: bool
    reason: str
    """Why the frame was rejected; empty when accepted."""
    scale_mm_per_px: float | None
    """At the actuator; None without a ruler."""
    geometry: FrameGeometry
    sighting: Sighting | None = None
    """For the next frame of a film; None if it was rejected, or measured in a halved frame."""


@dataclass(frozen=True)
class RulerCheck:
    """What the marks of the ruler say about the lens."""

    residual_px: float | None
    """RMS distance of the marks from a flat grid; None if they were not found."""
    reason: str
    """Why not."""


@dataclass(frozen=True)
class Sighting:
    """What a frame tells about where to look in the next one."""

    plane: PicturePlane
    connector: BluePart
    cap: BluePart
    connector_runs: tuple[FloatArray, ...]
    """Outline pixels (n, 2) of its long edges."""


@dataclass(frozen=True)
class AngleMeter:
    """Measures bending angles; one set-up, any number of frames, no memory between them.

    With a `camera` calibration the lens is taken out, with a `ruler` calibration the plane of the
    picture is taken from the ruler, which must then be in every frame unless `ruler_required` is
    off. `bends` is the side to which the actuator curls in the picture. `unrectified_u_deg` is
    the standard uncertainty that an unknown tilt of the picture plane adds where no ruler is
    used (10 deg of tilt shifts angles by up to 0.4 deg, perspective by as much again).
    """

    camera: CameraCalibration | None = None
    ruler: RulerCalibration | None = None
    bends: Side = "left"
    ruler_required: bool = True
    unrectified_u_deg: float = 1.0
    limits: Limits = Limits()

    def measure(self, image_bgr: Image) -> AngleMeasurement:
        """Bending angle in `image_bgr` (h, w, 3) uint8.

        Raises VisionError for an array that is no such image, or whose size is not that of the
        camera calibration; whatever is wrong with the picture itself is a rejection.
        """
        require_picture(image_bgr, self.camera)
        return self._measure(pyramid(image_bgr))

    def check_ruler(self, image_bgr: Image) -> RulerCheck:
        """How flat a grid the ruler's marks are through the lens that is assumed.

        They are not where the camera's calibration is of another lens. Needs a ruler. Raises
        VisionError as `measure`.
        """
        assert self.ruler is not None
        require_picture(image_bgr, self.camera)
        try:
            marks = find_ruler(pyramid(image_bgr), self.ruler.marks)
            plane = rectify(self.camera, self.ruler, marks)
        except UntrustedFrameError as why:
            return RulerCheck(None, str(why))
        assert plane.rectification is not None
        return RulerCheck(plane.rectification.residual_px, "")

    def measure_again(
        self, image_bgr: Image, last: Sighting, move: FloatArray, margin: float
    ) -> AngleMeasurement:
        """Bending angle in a later frame of a film, without searching all of it.

        The connector is taken to stand where `last` saw it, give or take the reach of an edge
        profile, and the plane of the picture to be the same. The cap is sought `move` (2,) px from
        where `last` saw it, give or take `margin`. Raises VisionError as `measure` does.
        """
        require_picture(image_bgr, self.camera)
        frame = _Frame()
        try:
            box = np.reshape(last.cap.box, (2, 2)) + move
            seen = find_blue_parts_within(image_bgr, np.stack([box[0] - margin, box[1] + margin]))
            others = [part for part in seen if _gap(part, last.connector) > 0]
            frame.parts = [last.connector, *others]
            connector, cap = frame.chosen = self._choose(frame.parts)
            edges = edges_along(image_bgr, connector, last.connector_runs, last.plane.undistort)
            angle, u = self._turn(image_bgr, connector, cap, edges, last.plane, frame)
        except UntrustedFrameError as why:
            return frame.rejected(str(why))
        return frame.accepted(self.limits, angle, u)

    def _measure(self, levels: list[Image]) -> AngleMeasurement:
        """The measurement in the finest level of a pyramid in which edges are sharp.

        Large frames are often unsharp in single pixels, by focus, motion or enlargement, but
        sharp at half their size; the same limits hold there. What is said is about the frame
        as it came.
        """
        frame = _Frame()
        try:
            angle, u = self._angle(levels, frame)
        except UnsharpFrameError as why:
            if len(levels) > 1:
                coarse = self._halved()._measure(levels[1:])
                if coarse.accepted:
                    return _doubled(coarse)
            return frame.rejected(str(why))
        except UntrustedFrameError as why:
            return frame.rejected(str(why))
        return frame.accepted(self.limits, angle, u)

    def _halved(self) -> AngleMeter:
        """The same meter for frames of half the size."""
        if self.camera is None:
            return self
        half = {
            "width": self.camera.width // 2,
            "height": self.camera.height // 2,
            "focal_x": 0.5 * self.camera.focal_x,
            "focal_y": 0.5 * self.camera.focal_y,
            "centre_x": 0.5 * self.camera.centre_x - 0.25,
            "centre_y": 0.5 * self.camera.centre_y - 0.25,
        }
        return replace(self, camera=self.camera.model_copy(update=half))

    def _angle(self, levels: list[Image], frame: _Frame) -> tuple[float, float]:
        """Angle and standard uncertainty in deg; notes in `frame` what it finds on the way."""
        self._check_exposure(levels[-1])
        parts = find_blue_parts(levels)
        frame.parts = parts
        frame.chosen = connector, cap = self._choose(parts)
        plane = self._plane(levels, frame)
        edges = long_edges(levels[0], connector, plane.undistort)
        return self._turn(levels[0], connector, cap, edges, plane, frame)

    def _turn(
        self,
        image: Image,
        connector: BluePart,
        cap: BluePart,
        connector_edges: list[Edge],
        plane: PicturePlane,
        frame: _Frame,
    ) -> tuple[float, float]:
        """Angle and standard uncertainty in deg between the edges of two parts."""
        frame.plane = plane
        frame.scale_mm_per_px = plane.scale_mm_per_px(0.5 * (connector.centroid + cap.centroid))
        cap_edges = long_edges(image, cap, plane.undistort)
        sharpest = self._sharpest(connector_edges, cap_edges, cap)
        base = self._part_direction(connector_edges, sharpest, "connector")
        tip = self._part_direction(cap_edges, sharpest, "end cap")
        frame.connector, frame.cap = base, tip
        self._check_cap_length(base, tip)

        turn = np.degrees(plane.turn(base.ideal, tip.ideal))
        swing = self._swing(base, tip)
        angle = swing + (turn * self._sign - swing + 90.0) % 180.0 - 90.0
        self._check_range(angle, swing)
        u = float(
            np.sqrt(
                np.degrees(base.u_rad) ** 2
                + np.degrees(tip.u_rad) ** 2
                + np.degrees(plane.u_turn(base.ideal, tip.ideal)) ** 2
                + (self.camera.angle_u_deg if self.camera else 0.0) ** 2
                + (self.unrectified_u_deg if plane.rectification is None else 0.0) ** 2
            )
        )
        limits, ruled = self.limits, plane.rectification is not None
        if u > (limits.max_rectified_u_deg if ruled else limits.max_u_deg):
            raise UnsharpFrameError(f"the angle would be uncertain by {u:.1f} deg")
        return float(angle), u

    @property
    def _sign(self) -> float:
        # Curling left turns the cap clockwise to the eye, which is positive in pixel axes.
        return 1.0 if self.bends == "left" else -1.0

    def _check_exposure(self, small: Image) -> None:
        blue, green, red = cv2.split(small)
        brightest, dimmest = cv2.max(cv2.max(blue, green), red), cv2.min(cv2.min(blue, green), red)
        if (brightest >= self.limits.dark_level).mean() < 0.01:
            raise UntrustedFrameError("the frame is too dark: no light, or the lens is covered")
        if (dimmest >= 250).mean() > self.limits.saturated_share:
            raise UntrustedFrameError("the frame is overexposed: most of it is white")

    def _choose(self, parts: list[BluePart]) -> tuple[BluePart, BluePart]:
        """The fixed connector, the largest part, and the only other one, the end cap."""
        if not parts:
            raise UntrustedFrameError("no actuator: no blue rigid part in the frame")
        faintest = self.limits.same_blue_share * max(part.blueness for part in parts)
        connector, *others = [part for part in parts if part.blueness > faintest]
        others = [
            part
            for part in others
            if not self._is_mounting(part, connector) and self._may_be_cap(part, connector)
        ]
        others = [p for p in others if p.area_px > self.limits.speck_share * others[0].area_px]
        if not others:
            raise UntrustedFrameError(
                "only one blue part: connector or end cap is missing or hidden"
            )
        if len(others) > 1:
            raise UntrustedFrameError(
                f"{len(others)} blue parts could be the end cap; it is broken up by something in "
                "front, or another blue thing is in the frame"
            )
        cap = others[0]
        if cap.centroid[1] <= connector.centroid[1]:
            raise UntrustedFrameError(
                "the smaller blue part is above the larger one: the connector must be on top"
            )
        for part, name in ((connector, "connector"), (cap, "end cap")):
            if part.clipped_share > self.limits.clipped_share:
                raise UntrustedFrameError(f"the {name} is overexposed: shorten the exposure")
        if cap.touches_border:
            raise UntrustedFrameError("the end cap is cut by the border of the frame")
        return connector, cap

    def _may_be_cap(self, part: BluePart, connector: BluePart) -> bool:
        """Whether a part has the hue of the connector and the shape of a plate."""
        apart = abs((part.hue_deg - connector.hue_deg + 180.0) % 360.0 - 180.0)
        length, width = part.size
        return apart < self.limits.same_hue_deg and width < self.limits.max_cap_stoutness * length

    def _is_mounting(self, part: BluePart, connector: BluePart) -> bool:
        """Whether a part is so close to the connector that it is what holds it.

        Raises UntrustedFrameError for one that close which could be the connector itself.
        """
        near = connector.box
        thickness = min(near[2] - near[0], near[3] - near[1])
        if _gap(part, connector) >= self.limits.mounting_gap * thickness:
            return False
        if part.area_px > self.limits.mounting_share * connector.area_px:
            raise UntrustedFrameError(
                "two blue parts could be the connector; is another blue thing in the frame?"
            )
        return True

    def _plane(self, levels: list[Image], frame: _Frame) -> PicturePlane:
        if self.ruler is None:
            return PicturePlane(self.camera)
        try:
            marks = find_ruler(levels, self.ruler.marks)
            frame.ruler_marks = marks.pixels
            return rectify(self.camera, self.ruler, marks)
        except UntrustedFrameError:
            if self.ruler_required:
                raise
            return PicturePlane(self.camera)

    def _sharpest(self, base: list[Edge], tip: list[Edge], cap: BluePart) -> float:
        """Width in px of the frame's sharpest edge, which is the lens blur at most."""
        if not base:
            raise UnsharpFrameError("the connector has no straight edge: blurred or hidden")
        if not tip:
            raise UnsharpFrameError("the end cap has no straight edge: blurred or hidden")
        width = min(edge.width_px for edge in [*base, *tip])
        at_cap = min(edge.width_px for edge in tip)
        thickness = cap.area_px / max(edge.length_px for edge in tip)
        if width > self.limits.max_edge_width or at_cap > self.limits.max_blur_share * thickness:
            raise UnsharpFrameError(
                f"too blurred: the edges of the end cap are {at_cap:.1f} px wide; focus the "
                "camera or shorten its exposure"
            )
        return width

    def _part_direction(self, edges: list[Edge], sharpest: float, name: str) -> _PartDirection:
        """Direction of a part from its long edges, weighted by their uncertainty."""
        u = np.array([_edge_u(edge, sharpest) for edge in edges])
        lengths = np.array([edge.length_px for edge in edges])
        best = int(np.argmin(u))
        lead = edges[best].direction
        apart = np.array([_signed_turn(lead, edge.direction) for edge in edges])
        limit = np.radians(self.limits.parallel_deg)
        across = (np.abs(apart) > limit) & (lengths > 1.25 * lengths[best]) & (u < 3.0 * u[best])
        if across.any():
            raise UntrustedFrameError(
                f"the outline of the {name} is no rectangle: something is in front of it"
            )
        widths = np.array([edge.width_px for edge in edges])
        sharp = widths <= max(BLEEDING_FACTOR * widths[best], widths[best] + 1.0)
        long = lengths >= LONG_SHARE * lengths[best]  # the best need not be the longest
        scatter = np.array([edge.rms_px for edge in edges])
        straight = scatter <= max(CROOKED_FACTOR * scatter[best], STRAIGHT_PX)
        chosen = np.flatnonzero((np.abs(apart) <= limit) & sharp & long & straight)
        weight = 1.0 / u[chosen] ** 2
        mean = float(weight @ apart[chosen] / weight.sum())
        u_mean = float(1.0 / np.sqrt(weight.sum()))
        gaps = np.abs(apart[chosen] - apart[best])
        allowed = 3.0 * np.hypot(u[chosen], u[best])
        if (gaps > np.maximum(allowed, np.radians(self.limits.max_disagreement_deg))).any():
            raise UnsharpFrameError(
                f"the long edges of the {name} disagree by {np.degrees(gaps.max()):.1f} deg"
            )
        if len(chosen) > 1:  # Birge: edges that scatter more than they claim widen the result
            chi2 = float(weight @ (apart[chosen] - mean) ** 2) / (len(chosen) - 1)
            u_mean *= max(1.0, np.sqrt(chi2))
        used = [edges[i] for i in chosen]
        centre = np.mean([edge.ideal.mean(axis=0) for edge in used], axis=0)
        turned = np.array([[np.cos(mean), -np.sin(mean)], [np.sin(mean), np.cos(mean)]]) @ lead
        half = 0.5 * float(lengths[best])
        return _PartDirection(
            ideal=np.array([centre - half * turned, centre + half * turned]),
            u_rad=u_mean,
            edges=used,
            spread_rad=float(gaps.max()),
        )

    def _check_cap_length(self, base: _PartDirection, tip: _PartDirection) -> None:
        length, reference = tip.length_px, base.length_px
        if length < self.limits.min_cap_px or length < self.limits.min_cap_share * reference:
            raise UntrustedFrameError(
                f"the end cap is too short to trust ({length:.0f} px): partly hidden?"
            )

    def _swing(self, base: _PartDirection, tip: _PartDirection) -> float:
        """Twice the angle in deg between the hanging axis and the chord to the cap.

        An arc of angle a has a chord turned by a / 2, so this is the bending angle as the cap's
        position tells it: crude, but enough to know on which half turn the cap's edge is.
        """
        axis = np.array([-(base.ideal[1] - base.ideal[0])[1], (base.ideal[1] - base.ideal[0])[0]])
        if axis[1] < 0.0:  # the actuator hangs: its axis points down the picture
            axis = -axis
        chord = tip.ideal.mean(axis=0) - base.ideal.mean(axis=0)
        half = np.arctan2(axis[0] * chord[1] - axis[1] * chord[0], float(axis @ chord))
        return self._sign * 2.0 * float(np.degrees(half))

    def _check_range(self, angle: float, swing: float) -> None:
        if abs(angle - swing) > self.limits.max_position_gap_deg:
            raise UntrustedFrameError(
                f"the cap's edge tells {angle:.0f} deg, but its position about {swing:.0f} deg"
            )
        if angle < self.limits.lowest_deg:
            other = "right" if self.bends == "left" else "left"
            raise UntrustedFrameError(
                f"the tip curls to the {other} by {-angle:.0f} deg, but is expected to curl to "
                f"the {self.bends}"
            )
        if angle > self.limits.highest_deg:
            raise UntrustedFrameError(f"a bending angle of {angle:.0f} deg is not plausible")


@dataclass(frozen=True)
class _PartDirection:
    """A rigid part's direction as a segment (2, 2) in ideal pixels, and how well it is known."""

    ideal: FloatArray
    u_rad: float
    edges: list[Edge]
    spread_rad: float

    @property
    def length_px(self) -> float:
        return max(edge.length_px for edge in self.edges)


@dataclass
class _Frame:
    """What has been found so far; becomes part of the measurement wherever the search ends."""

    parts: list[BluePart] = field(default_factory=list)
    chosen: tuple[BluePart, ...] = ()  # connector and cap
    connector: _PartDirection | None = None
    cap: _PartDirection | None = None
    ruler_marks: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    scale_mm_per_px: float | None = None
    plane: PicturePlane | None = None

    def accepted(self, limits: Limits, angle: float, u: float) -> AngleMeasurement:
        assert self.plane is not None
        assert self.connector is not None
        runs = tuple(edge.run for edge in self.connector.edges)
        connector, cap = self.chosen
        return AngleMeasurement(
            angle,
            u,
            self.quality(limits, u),
            True,
            "",
            self.scale_mm_per_px,
            self.geometry(),
            Sighting(self.plane, connector, cap, runs),
        )

    def rejected(self, reason: str) -> AngleMeasurement:
        return AngleMeasurement(
            None, 0.0, 0.0, False, reason, self.scale_mm_per_px, self.geometry()
        )

    def geometry(self) -> FrameGeometry:
        outlines = tuple(part.outline for part in self.parts)
        connector = cap = None
        if self.connector and self.cap:
            base, tip = (part.outline for part in self.chosen)
            connector = PartGeometry(base, _segments(self.connector))
            cap = PartGeometry(tip, _segments(self.cap))
        return FrameGeometry(connector, cap, outlines, self.ruler_marks)

    def quality(self, limits: Limits, u_deg: float) -> float:
        """Geometric mean of four scores, so that one bad score is not averaged away."""
        assert self.connector is not None
        assert self.cap is not None
        edges = [*self.connector.edges, *self.cap.edges]
        scores = np.array(
            [
                min(edge.contrast for edge in edges) / FULL_CONTRAST,
                1.0 - min(edge.width_px for edge in edges) / (2.0 * limits.max_edge_width),
                1.0 - np.degrees(self.cap.spread_rad) / (2.0 * limits.parallel_deg),
                1.0 - u_deg / limits.max_u_deg,
            ]
        )
        return float(np.prod(np.clip(scores, 0.01, 1.0)) ** 0.25)


def _gap(one: BluePart, other: BluePart) -> int:
    """Pixels between the boxes around two parts; negative if they overlap."""
    near, far = one.box, other.box
    return max(near[0] - far[2], far[0] - near[2], near[1] - far[3], far[1] - near[3])


def _doubled(half: AngleMeasurement) -> AngleMeasurement:
    """A measurement of a halved frame in the pixels of the whole one."""

    def part(found: PartGeometry | None) -> PartGeometry | None:
        if found is None:
            return None
        return PartGeometry(_up(found.outline), tuple(_up(edge) for edge in found.edges))

    geometry = FrameGeometry(
        part(half.geometry.connector),
        part(half.geometry.cap),
        tuple(_up(outline) for outline in half.geometry.candidates),
        _up(half.geometry.ruler_marks),
    )
    scale = None if half.scale_mm_per_px is None else 0.5 * half.scale_mm_per_px
    return replace(half, geometry=geometry, scale_mm_per_px=scale, sighting=None)


def _up(points: FloatArray) -> FloatArray:
    """Pixels of a frame of pixels of its half; a pixel's centre is its whole number."""
    return 2.0 * points + 0.5


def _segments(part: _PartDirection) -> tuple[FloatArray, ...]:
    return tuple(np.array([edge.start, edge.end]) for edge in part.edges)


def _edge_u(edge: Edge, sharpest: float) -> float:
    """Standard uncertainty of an edge's direction, rad, with what its width adds.

    Where the edge is within a transition much wider than the frame's sharpest one may drift from
    one end to the other.
    """
    bleeding = max(0.0, edge.width_px - BLEEDING_FACTOR * sharpest - 1.0)
    return float(np.hypot(edge.u_rad, BLEEDING_DRIFT * bleeding / edge.length_px))


def _signed_turn(first: FloatArray, second: FloatArray) -> float:
    """Turn from one undirected line to another, rad in [-pi/2, pi/2)."""
    turn = np.arctan2(first[0] * second[1] - first[1] * second[0], float(first @ second))
    return float((turn + np.pi / 2) % np.pi - np.pi / 2)
