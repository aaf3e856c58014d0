"""The backbone of a bent actuator from its silhouette: radius, angle, and how round it is.

The backbone is the free edge of the flat layer, which keeps its length: the smooth one of the two
long sides of the soft body between connector and cap. A circle through the pixels of its rim gives
the normals along which the edge is then found to a fraction of a pixel; the backbone is the circle
through those places, in the plane of the ruler.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from rig.vision.circle import fit_circle
from rig.vision.edges import crossings
from rig.vision.errors import UntrustedFrameError, VisionError
from rig.vision.lines import FloatArray
from rig.vision.measure import Sighting
from rig.vision.parts import SMALL_RAD, SeenParts, sheared
from rig.vision.plane import PicturePlane
from rig.vision.segment import Image

MIN_YELLOWNESS = 8.0  # grey levels: the print against neutral surroundings
KEPT_SHARE = 0.5  # of the body's own yellowness: the middle of its edges
MAX_GAP_PX = 12.0  # a soft body whose nearest pixel is further from a rigid part is another thing
NEAR_PX = 4.0  # contour so much further from a rigid part than its nearest pixel is at the joint
LOOSE_PX = 2.0  # the rim of a silhouette is jagged by whole pixels
END_SHARE = 0.12  # of the chain at each end: end walls are rigid, and blue shines into them
MIN_POINTS = 30
RIM_U_PX = 0.3
"""Standard uncertainty of where the edge of a translucent body is across, alike all along it, seen
on rendered pictures."""
MIDDLE_U_PX = 0.15
"""Standard uncertainty of the middle of a rigid part, as its blue pixels tell it; likewise."""


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
    residual_dof: float
    """Degrees of freedom of that, of the points that count as independent."""
    curvature_parts: SeenParts
    """What the picture tells of the curvature's uncertainty, per mm."""
    angle_parts: SeenParts
    """The same of the angle, in deg."""

    @property
    def radius_mm(self) -> float:
        """Without limit for a straight actuator."""
        return np.inf if self.curvature_per_mm == 0.0 else 1.0 / self.curvature_per_mm

    @property
    def residual_u_mm(self) -> float:
        """Standard uncertainty of the residual: that of a standard deviation (GUM E.4.3)."""
        return self.residual_mm / float(np.sqrt(2.0 * self.residual_dof))


def fit_backbone(image_bgr: Image, seen: Sighting) -> Backbone:
    """The backbone in a frame in which connector, cap and ruler were found.

    Raises UntrustedFrameError where no soft body is seen between connector and cap, and VisionError
    where it was measured without a ruler.
    """
    if seen.plane.rectification is None:
        raise VisionError("A backbone needs the ruler in the frame: without it there is no scale.")
    body = _body(image_bgr, seen)
    chain = _free_edge(body, seen)
    trim = round(END_SHARE * len(chain))
    rim = chain[trim : len(chain) - trim]
    if len(rim) < MIN_POINTS:
        raise UntrustedFrameError("no long side of a soft body between connector and end cap")
    outwards = fit_circle(rim, LOOSE_PX).outwards(rim, body.mean(axis=0))
    edge = crossings(image_bgr, rim, outwards)
    if len(edge) < MIN_POINTS:
        raise UntrustedFrameError("the edge of the soft body is too faint")
    return _measured(seen.plane, edge, np.stack([seen.connector.centroid, seen.cap.centroid]))


def _measured(plane: PicturePlane, edge: FloatArray, middles: FloatArray) -> Backbone:
    """The circle through `edge` (n, 2) px and its turn from one of the `middles` (2, 2) px on."""
    rectification = plane.rectification
    assert rectification is not None
    points, ends = plane.places_mm(edge), plane.places_mm(middles)
    circle = fit_circle(points)

    def elsewhere(points_there: FloatArray, ends_there: FloatArray) -> tuple[float, float]:
        """Curvature per mm and turn in rad, unsigned, of points that are a little elsewhere."""
        moved = circle.moved(points, points_there)
        return _sign(circle.curvature) * moved.curvature, _sign(turn) * moved.turn(ends_there)

    covariance, dof = circle.covariance(points)
    turn, by_values = circle.turn(ends), circle.turn_gradient(ends)
    planes = zip(plane.varied_places_mm(edge), plane.varied_places_mm(middles), strict=True)
    varied = np.array([elsewhere(*places) for places in planes])
    by_marks = varied[1:] - varied[0]
    by_lean = np.subtract(
        elsewhere(sheared(points, SMALL_RAD), sheared(ends, SMALL_RAD)), varied[0]
    )
    across = plane.scale_mm_per_px(edge[len(edge) // 2])
    assert across is not None
    length = float(np.hypot(*np.diff(points, axis=0).T).sum())
    curvature, distance = abs(circle.curvature), plane.distance_mm(edge[len(edge) // 2])
    return Backbone(
        points_mm=points,
        curvature_per_mm=curvature,
        angle_deg=float(np.degrees(abs(turn))),
        residual_mm=float(np.sqrt((circle.off(points) ** 2).mean())),
        residual_dof=dof,
        curvature_parts=SeenParts(
            scatter_u=float(np.sqrt(covariance[0, 0])),
            scatter_dof=dof,
            marks_u=rectification.u_of(by_marks[:, 0]),
            marks_dof=rectification.degrees_of_freedom,
            pixel_u=curvature**2 * RIM_U_PX * across,  # d(1/R) = dR / R^2
            scale=-curvature,
            shear=float(by_lean[0]) / SMALL_RAD,
            lens=float(np.hypot(curvature, 1.0 / length)),  # strained, and bent from end to end
            distance_mm=distance,
        ),
        angle_parts=SeenParts(
            scatter_u=float(np.degrees(np.sqrt(by_values @ covariance @ by_values))),
            scatter_dof=dof,
            marks_u=float(np.degrees(rectification.u_of(by_marks[:, 1]))),
            marks_dof=rectification.degrees_of_freedom,
            pixel_u=float(np.degrees(np.sqrt(2.0) * MIDDLE_U_PX * across * curvature)),
            scale=0.0,
            shear=float(np.degrees(by_lean[1])) / SMALL_RAD,
            lens=float(np.degrees(1.0)),
            distance_mm=distance,
        ),
    )


def _sign(value: float) -> float:
    return -1.0 if value < 0.0 else 1.0


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
