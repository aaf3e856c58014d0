"""Long straight edges of a rigid part, to a fraction of a pixel.

First the outline is split into straight runs, then each run is refined on the image itself:
colour profiles across it are projected on the local difference between part and surroundings,
and the half-way crossing is the edge. Half-way crossings are unbiased by symmetric blur, and the
local projection follows a light gradient and a change of surroundings along the edge.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from rig.vision.lines import FloatArray, fit_line, median, plain_line
from rig.vision.segment import BluePart, Image
from rig.vision.tone import to_light

RUN_TOLERANCE_PX = 2.0  # outline pixels are quantised, jagged by noise, bent by the lens
MIN_RUN_PX = 8.0
MAX_RUNS = 3  # both long sides of a rectangle, and what may contradict them
LONG_SHARE = 0.4  # of the first run: shorter ones are ends and fragments, not long edges
MAX_GAP_PX = 6.0
MAX_OUTLINE_POINTS = 160
CHORD_STARTS = 32
CONTESTANTS = 8
CHORD_SPANS = (0.1, 0.2, 0.35)  # of the outline; a thin rectangle's long side is almost half
END_TRIM = 0.06  # of the run at each end: corners are rounded by blur
MIN_TRIM_PX = 2.0
REACH_OUT_PX = 6.0  # outer half of a profile: beyond the blur of a usable frame
REACH_IN_PX = 4.0  # inner half: the part's colour next to the edge, not of its next face
STEP_PX = 0.5
PLATEAU_PX = 1.5  # length of the profile ends that define the two colours
COLOUR_WINDOW = 9  # edge points over which those colours are averaged
MIN_CONTRAST = 8.0  # linear light between part and surroundings, of 255
MIN_POINTS = 8
MASK_SAMPLES = 15  # points of an edge at which the part's mask is looked at
PIXEL_FLOOR_PX = 0.03  # end-to-end error left by sampling and JPEG, seen on synthetic edges
LEAST_CORRELATION = 0.6  # of points a pixel apart, which blur and colour at half resolution join
END_WIDTHS = 0.8
"""At its ends an edge is rounded and has other surroundings: an error that does not grow with its
length. A stretch as long as the edge is wide, displaced at one end, turns it by so many widths over
the square of its length; seen on rendered edges of 20 to 60 px."""
SHARP_WIDTH_PX = 3.0  # of an edge in focus; the error grows with the blur
WIDTH_10_90 = 2.563  # sigmas of a blurred step between 10 % and 90 %


@dataclass(frozen=True)
class Edge:
    """One straight edge of a part."""

    run: FloatArray  # (n, 2) outline pixels, px in the distorted image
    start: FloatArray  # (2,) px in the distorted image, the end of the fitted stretch
    end: FloatArray
    ideal: FloatArray  # (2, 2) the same ends in undistorted pixels
    u_rad: float  # standard uncertainty of the direction: scatter and pixel floor
    rms_px: float
    width_px: float  # 10 % to 90 % width of the transition
    contrast: float  # linear light between part and surroundings, of 255
    length_px: float

    @property
    def direction(self) -> FloatArray:
        """Unit vector along the edge in undistorted pixels."""
        along: FloatArray = self.ideal[1] - self.ideal[0]
        return along / float(np.hypot(*along))


def long_edges(
    image: Image, part: BluePart, undistort: Callable[[FloatArray], FloatArray]
) -> list[Edge]:
    """Refined straight edges of `part`, longest run first.

    `undistort` maps distorted to ideal pixels (n, 2); lines are fitted in ideal pixels, where
    straight edges are straight.
    """
    runs = straight_runs(part.outline, image.shape[1], image.shape[0])
    return edges_along(image, part, runs, undistort)


def edges_along(
    image: Image,
    part: BluePart,
    runs: Sequence[FloatArray],
    undistort: Callable[[FloatArray], FloatArray],
) -> list[Edge]:
    """Refined edges of `part` along straight runs (n, 2) of its outline, as in `long_edges`."""
    edges = (_refine(image, part, run, undistort) for run in runs)
    return [edge for edge in edges if edge is not None]


def straight_runs(outline: FloatArray, width: int, height: int) -> list[FloatArray]:
    """Long straight stretches of a closed pixel outline (n, 2), at most `MAX_RUNS`.

    Consensus in the manner of RANSAC, but with every chord of a few spans as hypothesis instead
    of random ones, so that the same frame always gives the same lines: the stretch with most
    pixels near its line wins, is refitted, and leaves the rest to the next. Short gaps
    (highlights, dents) are bridged. Runs on the frame's border are cuts, not edges.
    """
    stride = max(1, -(-len(outline) // MAX_OUTLINE_POINTS))
    thin = outline[::stride]
    free = (
        (thin[:, 0] > 1) & (thin[:, 1] > 1) & (thin[:, 0] < width - 2) & (thin[:, 1] < height - 2)
    )
    gap = max(1, round(MAX_GAP_PX * len(thin) / len(outline)))
    centres, normals = _chords(thin)
    runs: list[FloatArray] = []
    while len(runs) < MAX_RUNS and len(centres):
        run = _longest(thin, free, centres, normals, gap)
        if len(run) >= 3:
            centre, direction, _ = plain_line(thin[run], np.ones(len(run)))
            run = _longest(thin, free, centre[None], _normal(direction)[None], gap)
        points = thin[run]
        length = _extent(points)
        if length < max(MIN_RUN_PX, LONG_SHARE * _extent(runs[0]) if runs else 0.0):
            break
        runs.append(points)
        free = free.copy()
        free[run] = False
        if np.sqrt(2.0) * stride * free.sum() < LONG_SHARE * _extent(runs[0]):
            break  # what is left of the outline is too short
    return runs


def _extent(run: FloatArray) -> float:
    """Length of a run from end to end; zero for less than three points."""
    return float(np.hypot(*(run[-1] - run[0]))) if len(run) >= 3 else 0.0


def _chords(outline: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Middle points (m, 2) and unit normals (m, 2) of chords of the outline."""
    count = len(outline)
    first = np.arange(0, count, max(1, count // CHORD_STARTS))
    pairs = [(first, (first + max(2, round(count * span))) % count) for span in CHORD_SPANS]
    start = np.concatenate([outline[a] for a, _ in pairs])
    end = np.concatenate([outline[b] for _, b in pairs])
    along = end - start
    length = np.hypot(along[:, 0], along[:, 1])
    keep = length >= 0.5 * MIN_RUN_PX
    normals = np.stack([-along[keep, 1], along[keep, 0]], axis=1) / length[keep, None]
    return 0.5 * (start + end)[keep], normals


def _longest(
    outline: FloatArray,
    free: NDArray[np.bool_],
    centres: FloatArray,
    normals: FloatArray,
    gap: int,
) -> NDArray[np.intp]:
    """Outline indices near one of the lines, in the stretch with most of them, in order.

    A stretch may have gaps of at most `gap` points; lines are (m, 2) centres and normals.
    """
    distance = np.abs(normals @ outline.T - (centres * normals).sum(axis=1)[:, None])
    close = (distance < RUN_TOLERANCE_PX) & free
    counts = close.sum(axis=1)
    best = np.empty(0, dtype=np.intp)
    for row in np.argsort(-counts, kind="stable")[:CONTESTANTS]:
        if counts[row] <= len(best):
            break  # gaps can only lower the count
        stretch = _longest_stretch(close[row], gap)
        if len(stretch) > len(best):
            best = stretch
    return best


def _longest_stretch(close: NDArray[np.bool_], gap: int) -> NDArray[np.intp]:
    """Positions of True on a closed outline, in the stretch with most of them, in order."""
    hits = np.flatnonzero(close)
    if len(hits) == 0:
        return hits
    steps = np.diff(hits, append=hits[0] + len(close))
    cuts = np.flatnonzero(steps > gap + 1)
    if len(cuts) == 0:
        return hits
    sizes = np.diff(cuts, prepend=cuts[-1] - len(hits))
    longest = int(np.argmax(sizes))
    members: NDArray[np.intp] = hits[
        np.arange(cuts[longest] - sizes[longest] + 1, cuts[longest] + 1) % len(hits)
    ]
    return members


def _refine(
    image: Image, part: BluePart, run: FloatArray, undistort: Callable[[FloatArray], FloatArray]
) -> Edge | None:
    centre, direction, _ = plain_line(run, np.ones(len(run)))
    along = (run - centre) @ direction
    low, high = float(along.min()), float(along.max())
    trim = max(END_TRIM * (high - low), MIN_TRIM_PX)
    stations = np.arange(low + trim, high - trim, 1.0)
    if len(stations) < MIN_POINTS:
        return None
    base = centre + stations[:, None] * direction
    outward = _normal(direction)
    some = base[:: max(1, len(base) // MASK_SAMPLES)]
    if part.contains(some + 2.0 * outward).sum() > part.contains(some - 2.0 * outward).sum():
        outward = -outward
    reach_in = _inner_reach(part, some, outward)
    depths = np.arange(-reach_in, REACH_OUT_PX + 0.5 * STEP_PX, STEP_PX)
    profile, contrast = _profiles(image, base, outward, depths)
    crossing, found = _half_way(profile, depths)
    good = found & (contrast > MIN_CONTRAST)
    if int(good.sum()) < max(MIN_POINTS, len(stations) // 3):
        return None
    pixels = base[good] + crossing[good, None] * outward
    fit = fit_line(undistort(pixels), contrast[good] ** 2, LEAST_CORRELATION)
    reach = (undistort(pixels[[0, -1]]) - fit.centre) @ fit.direction
    ideal = fit.centre + reach[:, None] * fit.direction
    length = float(np.ptp(stations[good]))
    width = _width(profile[good], depths, crossing[good])
    floor = PIXEL_FLOOR_PX * max(1.0, width / SHARP_WIDTH_PX)
    at_ends = END_WIDTHS * width / length
    return Edge(
        run=run,
        start=pixels[0] - fit.offsets_px[0] * _normal(fit.direction),
        end=pixels[-1] - fit.offsets_px[-1] * _normal(fit.direction),
        ideal=ideal,
        u_rad=float(np.hypot(fit.u_direction_rad, np.hypot(floor, at_ends) / length)),
        rms_px=fit.rms_px,
        width_px=width,
        contrast=median(contrast[good]),
        length_px=length,
    )


def crossings(image: Image, base: FloatArray, outward: FloatArray) -> FloatArray:
    """Where a silhouette ends along normals `outward` (n, 2) from near its rim, `base` (n, 2) px.

    Places (m, 2) px half-way between the colours of both sides; normals without enough contrast
    are left out.
    """
    depths = np.arange(-REACH_OUT_PX, REACH_OUT_PX + 0.5 * STEP_PX, STEP_PX)
    profile, contrast = _profiles(image, base, outward, depths)
    crossing, found = _half_way(profile, depths)
    good = found & (contrast > MIN_CONTRAST)
    places: FloatArray = base[good] + crossing[good, None] * outward[good]
    return places


def _normal(direction: FloatArray) -> FloatArray:
    return np.array([-direction[1], direction[0]])


def _inner_reach(part: BluePart, base: FloatArray, outward: FloatArray) -> float:
    """How far profiles may go into the part: half of its local thickness, 2 to 4 px."""
    depths = np.arange(1.0, 2.0 * REACH_IN_PX + 1.0)
    grid = (base[:, None, :] - depths[None, :, None] * outward).reshape(-1, 2)
    inside = part.contains(grid).reshape(len(base), len(depths))
    thickness = median(np.minimum.accumulate(inside, axis=1).sum(axis=1))
    return float(np.clip(round(thickness) / 2.0, 2.0, REACH_IN_PX))


def _profiles(
    image: Image, base: FloatArray, outward: FloatArray, depths: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Share of the part's colour along normals (n, depths): one inside, zero outside.

    `outward` is (2,) for all points of `base` (n, 2), or (n, 2). Also the contrast (n,) between the
    two ends, in linear light.
    """
    grid = (base[:, None, :] + depths[None, :, None] * np.reshape(outward, (-1, 1, 2))).astype(
        np.float32
    )
    colour = cv2.remap(
        image,
        np.ascontiguousarray(grid[..., 0]),
        np.ascontiguousarray(grid[..., 1]),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    light = to_light(colour.astype(np.float64))
    ends = round(PLATEAU_PX / STEP_PX) + 1
    inside = _smooth(light[:, :ends].mean(axis=1))
    outside = _smooth(light[:, -ends:].mean(axis=1))
    axis = inside - outside
    energy = np.maximum((axis**2).sum(axis=1), 1e-9)
    profile = np.einsum("nkc,nc->nk", light - outside[:, None, :], axis) / energy[:, None]
    return profile, np.sqrt(energy)


def _smooth(colours: FloatArray) -> FloatArray:
    """Running mean along the edge (n, 3)."""
    column = np.ascontiguousarray(colours)[:, None, :]
    mean = cv2.blur(column, (1, COLOUR_WINDOW), borderType=cv2.BORDER_REPLICATE)
    return np.asarray(mean, dtype=np.float64).reshape(-1, 3)


def _half_way(profile: FloatArray, depths: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Depth (n,) of the half-way crossing closest to the run, and where there is one."""
    level = profile - 0.5
    falls = (level[:, :-1] >= 0.0) & (level[:, 1:] < 0.0)
    distance = np.where(falls, np.abs(depths[:-1] + 0.5 * STEP_PX), np.inf)
    index = np.argmin(distance, axis=1)
    rows = np.arange(len(profile))
    before, after = level[rows, index], level[rows, index + 1]
    found: NDArray[np.bool_] = np.any(falls, axis=1).astype(np.bool_)
    share = np.where(found, before / np.where(found, before - after, 1.0), 0.0)
    return depths[index] + share * STEP_PX, found


def _width(profile: FloatArray, depths: FloatArray, crossing: FloatArray) -> float:
    """10 % to 90 % width of the mean transition, from its 25 % to 75 % slope.

    The quartiles are used because the plateaus of a thin part are short.
    """
    shift = median(crossing)
    mean = profile.mean(axis=0)
    centre = int(np.argmin(np.abs(depths - shift)))
    upper = _level_depth(mean, depths, centre, 0.75, -1)
    lower = _level_depth(mean, depths, centre, 0.25, +1)
    return WIDTH_10_90 * (lower - upper) / 1.349


def _level_depth(
    mean: FloatArray, depths: FloatArray, centre: int, level: float, step: int
) -> float:
    index = centre
    while 0 < index < len(depths) - 1 and (mean[index] - level) * step > 0.0:
        index += step
    other = index - step
    if not 0 <= other < len(depths) or mean[index] == mean[other]:
        return float(depths[index])
    share = (level - mean[index]) / (mean[other] - mean[index])
    return float(depths[index] + np.clip(share, 0.0, 1.0) * (depths[other] - depths[index]))
