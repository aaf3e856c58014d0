"""The deformed actuator in three dimensions, coloured by stress or strain: still and interactive.

The interactive view is one canvas and a script of our own (`templates/view3d.js`): no library, no
server, nothing loaded. Positions travel as 16-bit integers over the bounding box of all steps
(micrometres), colours as 8-bit ones. The still picture stands in where scripts do not run, and on
paper. The colours are viridis, whose
lightness grows evenly with any kind of colour vision.
"""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import matplotlib as mpl
import numpy as np
from matplotlib.collections import TriMesh
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from rig.mechanics.fe import Extremes, Model, Peak, Solution
from rig.mechanics.fe.fields import displacements, nodal_fields
from rig.mechanics.fe.surface import Surface, surface_of

Array = NDArray[np.float64]
Bytes = NDArray[np.uint8]

BUDGET = 1_000_000
"""Bytes of positions and colours; of more steps than fit, evenly spread ones are shown."""
HANGING = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Right, up and towards the viewer of an actuator that hangs along x and bends in the x-z plane;
the half with y >= 0 shows its section."""
YAW, PITCH = np.radians(-32.0), np.radians(18.0)
"""Where the viewer stands at first."""
STILL_PX = 640
_COLOURS = "viridis"
_AMBIENT = 0.5
"""Share of the light that comes from everywhere."""


@dataclass(frozen=True)
class Quantity:
    """A field on the surface at every step, in the unit that people read."""

    name: str
    unit: str
    """Empty for a ratio."""
    values: Array
    """At the vertices, (steps, n)."""
    low: float
    """Value of the darkest colour."""
    high: float
    """Value of the brightest colour; larger ones have it, too."""
    peaks: tuple[str, ...]
    """Per step what to say of the largest value in the solid."""


@dataclass(frozen=True)
class Scene:
    """A deformed surface at a few pressures."""

    surface: Surface
    mirror: int | None
    pressures: Array
    """In Pa, (steps,)."""
    positions: Array
    """Of the vertices in m, (steps, n, 3)."""
    quantities: tuple[Quantity, ...]
    extremes: tuple[Extremes, ...]
    """Per step the largest values, and where."""

    @cached_property
    def box(self) -> tuple[Array, Array]:
        """Lowest corner and size in m of what the vertices ever fill."""
        low = self.positions.min(axis=(0, 1))
        return low, np.maximum(self.positions.max(axis=(0, 1)) - low, 1e-9)


def scene_of(
    model: Model,
    solutions: Sequence[Solution],
    extremes: Sequence[Extremes],
    mirror: int | None,
) -> Scene:
    """What there is to see of a model, half of a body across the plane normal to axis `mirror`.

    `extremes` are those of the solutions, in their order.
    """
    surface = surface_of(model, mirror)
    steps = _shown(len(solutions), len(surface.node))
    shown, peaks = [solutions[i] for i in steps], [extremes[i] for i in steps]
    d = model.discretisation
    rest = d.nodes[surface.node]
    fields = [nodal_fields(model, s.state) for s in shown]

    def gathered(values: list[list[Array]]) -> Array:
        return np.stack([np.concatenate(v)[surface.entry] for v in values])

    stress = [e.von_mises for e in peaks]
    stretch = [e.principal_strain for e in peaks]
    return Scene(
        surface=surface,
        mirror=mirror,
        pressures=np.array([s.pressure for s in shown]),
        positions=np.stack([rest + displacements(d, s.state)[surface.node] for s in shown]),
        quantities=(
            Quantity(
                name="von Mises stress",
                unit="kPa",
                values=1e-3 * gathered([[f.von_mises for f in step] for step in fields]),
                low=0.0,
                high=_round(1e-3 * stress[-1].bulk),
                peaks=tuple(_words(1e-3 * p.value, 1e-3 * p.bulk, " kPa", p) for p in stress),
            ),
            Quantity(
                name="largest principal stretch",
                unit="",
                values=gathered([[f.principal_stretch[0] for f in step] for step in fields]),
                low=1.0,
                high=1.0 + _round(stretch[-1].bulk),
                peaks=tuple(_words(1 + p.value, 1 + p.bulk, "", p) for p in stretch),
            ),
        ),
        extremes=tuple(peaks),
    )


def _words(value: float, bulk: float, unit: str, peak: Peak) -> str:
    place = ", ".join(f"{1e3 * c:.3g}" for c in peak.place)
    return (
        f"{value:.3g}{unit} at most, at ({place}) mm at rest"
        f"{', at a notch: more on a finer mesh' if peak.at_notch else ''}; "
        f"99.5 % of the material is below {bulk:.3g}{unit}"
    )


def _shown(steps: int, vertices: int) -> list[int]:
    """So many of the steps as the budget allows, the first and the last among them."""
    count = min(steps, max(2, BUDGET // (8 * vertices)))
    return [int(i) for i in np.linspace(0, steps - 1, count).round()]


def _round(value: float) -> float:
    """The next round number at or above a value."""
    step = 10.0 ** np.floor(np.log10(max(value, 1e-6))) / 4
    return float(step * np.ceil(value / step - 1e-9)) or step


@dataclass(frozen=True)
class View:
    """What the template shows."""

    still: str
    """Data URI of the picture at the last step."""
    alt: str
    data: str
    """JSON for the script; holds no '<'."""
    gradient: str
    """The colours as a CSS gradient."""
    quantity: Quantity
    """What the still picture shows."""
    top_kpa: float
    steps: int


def view_of(scene: Scene) -> View:
    """The scene made ready for the template; the same scene gives the same bytes."""
    quantity = scene.quantities[0]
    top = float(scene.pressures[-1]) / 1e3
    colours = _colour_table()
    stops = ", ".join("#" + bytes(c).hex() for c in colours[:: len(colours) // 15])
    return View(
        still="data:image/png;base64," + base64.b64encode(_still(scene)).decode("ascii"),
        alt=(
            f"The actuator as calculated at {top:g} kPa, coloured by {quantity.name} from "
            f"{quantity.low:g} to {quantity.high:g} {quantity.unit}; {quantity.peaks[-1]}."
        ),
        data=_data(scene, colours),
        gradient=f"linear-gradient(to right, {stops})",
        quantity=quantity,
        top_kpa=top,
        steps=len(scene.pressures),
    )


def _data(scene: Scene, colours: Bytes) -> str:
    low, size = scene.box
    surface = scene.surface
    triangles = np.concatenate((surface.outside, surface.inside))
    wide = len(surface.node) > 0xFFFF
    steps = [
        {
            "kpa": round(float(pressure) / 1e3, 6),
            "at": _packed(np.rint((positions - low) / size * 0xFFFF), "<u2"),
            "values": [
                _packed(
                    np.rint(255 * np.clip((q.values[i] - q.low) / (q.high - q.low), 0, 1)), "u1"
                )
                for q in scene.quantities
            ],
            "peaks": [q.peaks[i] for q in scene.quantities],
        }
        for i, (pressure, positions) in enumerate(
            zip(scene.pressures, scene.positions, strict=True)
        )
    ]
    content = {
        "low": [round(float(v), 9) for v in low],
        "size": [round(float(v), 9) for v in size],
        "frame": HANGING.ravel().tolist(),
        "yaw": round(float(YAW), 6),
        "pitch": round(float(PITCH), 6),
        "ambient": _AMBIENT,
        "mirror": scene.mirror,
        "wide": wide,
        "outside": int(surface.outside.size),
        "triangles": _packed(triangles, "<u4" if wide else "<u2"),
        "colours": _packed(colours, "u1"),
        "quantities": [
            {"name": q.name, "unit": q.unit, "low": q.low, "high": q.high} for q in scene.quantities
        ],
        "steps": steps,
    }
    return json.dumps(content, separators=(",", ":")).replace("<", "\\u003c")


def _packed(values: NDArray[np.generic], kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values.astype(kind)).tobytes()).decode("ascii")


def _colour_table() -> Bytes:
    """(256, 3) red, green, blue."""
    found = mpl.colormaps[_COLOURS](np.linspace(0.0, 1.0, 256))[:, :3]
    return np.asarray(np.rint(255 * found), dtype=np.uint8)


def turned(yaw: float, pitch: float) -> Array:
    """Right, up and towards the viewer after turning the actuator, (3, 3); as in the script."""
    c, s = np.cos(yaw), np.sin(yaw)
    about_up = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    c, s = np.cos(pitch), np.sin(pitch)
    about_right = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    return np.asarray(about_right @ about_up @ HANGING)


def _still(scene: Scene) -> bytes:
    """PNG of the last step from outside, on no background: painted from far to near."""
    quantity, triangles = scene.quantities[0], scene.surface.outside
    places, values = scene.positions[-1], quantity.values[-1]
    if scene.mirror is not None:
        image = places.copy()
        image[:, scene.mirror] *= -1
        triangles = np.concatenate((triangles, triangles[:, ::-1] + len(places)))
        places, values = np.concatenate((places, image)), np.concatenate((values, values))
    seen = places @ turned(YAW, PITCH).T
    a, b, c = np.moveaxis(seen[triangles], 1, 0)
    flat = np.cross(b - a, c - a)
    normal = np.zeros_like(seen)
    np.add.at(normal, triangles, flat[:, None])
    facing = normal[:, 2] / np.maximum(np.linalg.norm(normal, axis=1), 1e-30)
    share = np.clip((values - quantity.low) / (quantity.high - quantity.low), 0.0, 1.0)
    light = _AMBIENT + (1 - _AMBIENT) * np.abs(facing)
    colours = _colour_table()[np.rint(255 * share).astype(int)] / 255 * light[:, None]
    front = np.flatnonzero(flat[:, 2] > 0)
    order = front[np.argsort(seen[triangles[front], 2].mean(axis=1), kind="stable")]
    figure = Figure(figsize=(STILL_PX / 100, STILL_PX / 100), dpi=100)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    painted = TriMesh(Triangulation(seen[:, 0], seen[:, 1], triangles[order]))
    painted.set_facecolor(colours)
    axes.add_collection(painted)
    low, high = seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)
    middle, reach = (low + high) / 2, 0.52 * float((high - low).max())
    axes.set_xlim(middle[0] - reach, middle[0] + reach)
    axes.set_ylim(middle[1] - reach, middle[1] + reach)
    file = io.BytesIO()
    figure.savefig(file, format="png", transparent=True, metadata={"Software": None})
    return file.getvalue()
