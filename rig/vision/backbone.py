"""The backbone of a bent actuator from its silhouette: radius, angle, and how round it is.

The backbone is the free edge of the flat layer, which keeps its length: the smooth one of the two
long sides of the soft body between connector and cap. A circle is fitted to it in the plane of the
ruler, in the parameters of Pratt (SIGGRAPH 1987): curvature, direction and distance, so that a
straight actuator is no special case.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import least_squares

from rig.vision.errors import UntrustedFrameError, VisionError
from rig.vision.lines import FloatArray
from rig.vision.measure import Sighting
from rig.vision.segment import Image

MIN_YELLOWNESS = 8.0  # grey levels: the print against neutral surroundings
KEPT_SHARE = 0.5  # of the body's own yellowness: the middle of its edges
MAX_GAP_PX = 12.0  # a soft body whose nearest pixel is further from a rigid part is another thing
NEAR_PX = 4.0  # contour so much further from a rigid part than its nearest pixel is at the joint
LOOSE_MM = 0.2  # beyond which points pull less: a dent, a thread
END_SHARE = 0.12  # of the chain at each end: end walls are rigid, and blue shines into them
MIN_POINTS = 30


@dataclass(frozen=True)
class Backbone:
    """A circle through the free edge of the flat layer."""

    points_mm: FloatArray
    """(n, 2) of the edge, in the plane of the ruler, from connector to cap."""
    curvature_per_mm: float
    """Unsigned; zero for a straight actuator."""
    angle_deg: float
    """Turn of the circle from the middle of the connector to that of the cap."""
    residual_mm: float
    """RMS distance of the edge from the circle: what is not constant curvature, and noise."""

    @property
    def radius_mm(self) -> float:
        """Without limit for a straight actuator."""
        return np.inf if self.curvature_per_mm == 0.0 else 1.0 / self.curvature_per_mm


def fit_backbone(image_bgr: Image, seen: Sighting) -> Backbone:
    """The backbone in a frame in which connector, cap and ruler were found.

    Raises UntrustedFrameError where no soft body is seen between connector and cap, and VisionError
    where it was measured without a ruler.
    """
    if seen.plane.rectification is None:
        raise VisionError("A backbone needs the ruler in the frame: without it there is no scale.")
    chain = _free_edge(_body(image_bgr, seen), seen)
    trim = round(END_SHARE * len(chain))
    pixels = chain[trim : len(chain) - trim]
    if len(pixels) < MIN_POINTS:
        raise UntrustedFrameError("no long side of a soft body between connector and end cap")
    points = seen.plane.places_mm(pixels)
    ends = seen.plane.places_mm(np.stack([seen.connector.centroid, seen.cap.centroid]))
    circle = _circle(points)
    return Backbone(
        points_mm=points,
        curvature_per_mm=abs(circle.curvature),
        angle_deg=float(np.degrees(circle.turn(*ends))),
        residual_mm=float(np.sqrt((circle.off**2).mean())),
    )


def _body(image: Image, seen: Sighting) -> FloatArray:
    """Contour (n, 2) px, closed, of the soft body: the yellowish region that joins the parts."""
    blue, green, red = cv2.split(image)
    yellow = cv2.subtract(cv2.addWeighted(green, 0.5, red, 0.5, 0.0), blue)
    yellow = cv2.GaussianBlur(yellow, (0, 0), 1.0)
    rough = (yellow > MIN_YELLOWNESS).astype(np.uint8)
    level = KEPT_SHARE * float(np.median(yellow[rough > 0])) if rough.any() else MIN_YELLOWNESS
    mask = (yellow > max(level, MIN_YELLOWNESS)).astype(np.uint8)
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    body = max(contours, key=cv2.contourArea, default=None)
    if body is None or cv2.contourArea(body) < seen.connector.area_px:
        raise UntrustedFrameError("no soft body between connector and end cap: another colour?")
    return body[:, 0, :].astype(np.float64)


def _free_edge(contour: FloatArray, seen: Sighting) -> FloatArray:
    """The shorter way (n, 2) around the body from connector to cap; the corrugated one is longer.

    Ways lie between what of the contour is next to one part and what is next to the other.
    """
    gaps = [_gaps(contour, part.outline) for part in (seen.connector, seen.cap)]
    if any(gap.min() > MAX_GAP_PX for gap in gaps):
        raise UntrustedFrameError("the soft body does not reach from connector to end cap")
    near = [gap < NEAR_PX + gap.min() for gap in gaps]
    turned = np.roll(np.arange(len(contour)), -int(np.flatnonzero(near[0])[0]))
    at_connector, at_cap = near[0][turned], near[1][turned]
    if not at_cap.any() or (at_connector & at_cap).any():
        raise UntrustedFrameError("the soft body does not reach from connector to end cap")
    cap = np.flatnonzero(at_cap)
    before = np.flatnonzero(at_connector & (np.arange(len(turned)) < cap[0]))[-1]
    after = np.flatnonzero(at_connector & (np.arange(len(turned)) > cap[-1]))
    end = after[0] if len(after) else len(turned)
    ways = [turned[before + 1 : cap[0]], turned[cap[-1] + 1 : end][::-1]]
    lengths = [np.hypot(*np.diff(contour[way], axis=0).T).sum() for way in ways]
    return contour[ways[int(np.argmin(lengths))]]


def _gaps(points: FloatArray, outline: FloatArray) -> FloatArray:
    """Distance (n,) of points to the nearest of an outline's pixels."""
    apart = points[:, None, :] - outline[None, ::2, :]
    gaps: FloatArray = np.sqrt((apart**2).sum(axis=2).min(axis=1))
    return gaps


@dataclass(frozen=True)
class _Circle:
    """Of one curvature; `distance` (mm) from `middle` (2,) in the direction of `normal` (2,)."""

    curvature: float
    distance: float
    normal: FloatArray
    middle: FloatArray
    off: FloatArray  # (n,) signed distances of the points

    def turn(self, first: FloatArray, second: FloatArray) -> float:
        """Angle in rad, unsigned, between the radii through two points (2,)."""
        one, other = (
            self.curvature * (point - self.middle)
            + (1.0 + self.curvature * self.distance) * self.normal
            for point in (first, second)
        )
        return abs(float(np.arctan2(one[0] * other[1] - one[1] * other[0], one @ other)))


def _circle(points: FloatArray) -> _Circle:
    """Robust least squares of the distances (n,) of `points` (n, 2)."""
    middle = points.mean(axis=0)
    local = points - middle
    across = np.linalg.svd(local, full_matrices=False)[2][1]
    start = [0.0, float(np.arctan2(across[1], across[0])), 0.0]
    found = least_squares(
        lambda values: _distances(local, values), start, loss="soft_l1", f_scale=LOOSE_MM
    )
    curvature, heading, distance = found.x.tolist()
    normal = np.array([np.cos(heading), np.sin(heading)])
    return _Circle(curvature, distance, normal, middle, _distances(local, found.x))


def _distances(points: FloatArray, values: FloatArray) -> FloatArray:
    """Signed distances (n,) of points from the circle of curvature, heading and distance."""
    curvature, heading, distance = values
    along = points @ [np.cos(heading), np.sin(heading)]
    square = (points**2).sum(axis=1) + distance**2
    excess = 0.5 * curvature * square + (1.0 + curvature * distance) * along + distance
    away: FloatArray = 2.0 * excess / (1.0 + np.sqrt(np.maximum(1.0 + 2.0 * curvature * excess, 0)))
    return away
