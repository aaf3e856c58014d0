"""Exact area coverage of pixels by polygons: edges without the bias of supersampling.

Signed areas are accumulated where the outline passes and summed along the rows, the scheme of
font rasterisers (FreeType's smooth renderer). OpenCV's fillPoly paints every pixel it touches,
which moves edges outwards by half a sample.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Picture = NDArray[np.float32]


class Box(NamedTuple):
    """A rectangle of pixels, half open: columns left..right, rows top..bottom."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns to index a picture with."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.bottom - self.top, self.right - self.left

    @property
    def empty(self) -> bool:
        """True if it holds no pixel."""
        return self.right <= self.left or self.bottom <= self.top

    def grown(self, margin: int) -> Box:
        """This box with `margin` more pixels on all sides."""
        return Box(self.left - margin, self.top - margin, self.right + margin, self.bottom + margin)

    def common(self, other: Box) -> Box:
        """The pixels of both; empty boxes have no width or no height."""
        left, top = max(self.left, other.left), max(self.top, other.top)
        return Box(
            left,
            top,
            max(min(self.right, other.right), left),
            max(min(self.bottom, other.bottom), top),
        )

    def on_grid(self, pitch: int, picture: Box) -> Box:
        """This box grown to multiples of `pitch`, cut at the borders of `picture`."""
        return Box(
            self.left // pitch * pitch,
            self.top // pitch * pitch,
            -(-self.right // pitch) * pitch,
            -(-self.bottom // pitch) * pitch,
        ).common(picture)

    def within(self, outer: Box) -> Box:
        """This box in the coordinates of the top left pixel of `outer`."""
        return Box(
            self.left - outer.left,
            self.top - outer.top,
            self.right - outer.left,
            self.bottom - outer.top,
        )


def bounding_box(outlines: list[Array], margin: int, picture: Box) -> Box:
    """The pixels of `picture` that `outlines` (each (n, 2), pixels) touch, and `margin` more."""
    low = np.min([outline.min(axis=0) for outline in outlines], axis=0)
    high = np.max([outline.max(axis=0) for outline in outlines], axis=0)
    left, top = (int(v) for v in np.floor(low + 0.5))
    right, bottom = (int(v) for v in np.ceil(high + 0.5))
    return Box(left, top, right, bottom).grown(margin).common(picture)


def coverage(outline: Array, box: Box) -> Picture:
    """Share of each pixel of `box` that lies inside the closed `outline`, float32 in 0..1.

    `outline` is (n, 2) in pixels, integers at pixel centres, without a repeated last point;
    either sense of rotation. It may leave the box on any side. Pixels that it encloses more than
    once are covered once; where its own borders overlap, they are added up to one.
    """
    rows, columns = box.shape
    if box.empty:
        return np.zeros((max(rows, 0), max(columns, 0)), np.float32)
    x, y = _split_at_pixel_borders(
        outline[:, 0] + (0.5 - box.left), outline[:, 1] + (0.5 - box.top)
    )
    rise = np.diff(y)
    middle_x = 0.5 * (x[:-1] + x[1:])
    row = np.floor(0.5 * (y[:-1] + y[1:])).astype(np.intp)
    used = (row >= 0) & (row < rows) & (rise != 0)
    rise, row = rise[used], row[used]
    # Left of the box an edge counts from the first column on, right of it in the spare column.
    middle_x = np.clip(middle_x[used], 0.0, float(columns))
    column = middle_x.astype(np.intp)
    right_part = rise * (middle_x - column)
    cell = row * (columns + 1) + column
    # Coverage only changes in cells that an edge touches: sum there, then repeat over the runs.
    touched = np.concatenate(([0], cell, cell + 1))
    change = np.concatenate(([0.0], rise - right_part, right_part))
    order = np.argsort(touched, kind="stable")
    covered = np.minimum(np.abs(np.cumsum(change[order])), 1.0).astype(np.float32)
    runs = np.diff(touched[order], append=rows * (columns + 1))
    return np.repeat(covered, runs).reshape(rows, columns + 1)[:, :columns]


def _split_at_pixel_borders(x: Array, y: Array) -> tuple[Array, Array]:
    """The closed polyline with extra points wherever it crosses an integer x or y.

    Each piece between neighbouring points then lies in a single pixel.
    """
    x = np.append(x, x[0])
    y = np.append(y, y[0])
    place = np.concatenate(
        (np.arange(len(x), dtype=np.float64), _integer_crossings(x), _integer_crossings(y))
    )
    place.sort()
    segment = np.minimum(place.astype(np.intp), len(x) - 2)
    share = place - segment
    return (
        x[segment] + share * (x[segment + 1] - x[segment]),
        y[segment] + share * (y[segment + 1] - y[segment]),
    )


def _integer_crossings(values: Array) -> Array:
    """Where the polyline `values` passes an integer: index of the segment plus share of it."""
    start, stop = values[:-1], values[1:]
    first = np.floor(np.minimum(start, stop)) + 1
    last = np.ceil(np.maximum(start, stop)) - 1
    count = np.maximum(last - first + 1, 0).astype(np.intp)
    segment = np.repeat(np.arange(len(start)), count)
    number = np.arange(len(segment)) - np.repeat(np.cumsum(count) - count, count)
    integer = first[segment] + number
    share = (integer - start[segment]) / (stop[segment] - start[segment])
    place: Array = segment + np.clip(share, 0.0, 1.0)
    return place
