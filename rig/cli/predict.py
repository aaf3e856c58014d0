"""`rig predict`: what the models say about an actuator, as a table and as CSV."""

from __future__ import annotations

from collections.abc import Iterator
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rig.mechanics.job import Job
    from rig.mechanics.response import Array, Response
    from rig.mechanics.table import Row
    from rig.spec.actuator import ActuatorSpec
    from rig.spec.material import MaterialSpec

MAX_ROWS = 100_000
FINITE_ELEMENTS = "fe"

_UNITS = {"kpa": "kPa", "ml": "mL"}


class Control(StrEnum):
    """The quantity that is prescribed."""

    PRESSURE = "pressure"
    ANGLE = "angle"
    RADIUS = "radius"
    VOLUME = "volume"


_TARGET_UNITS = {
    Control.ANGLE: ("rad", "deg"),
    Control.RADIUS: ("m", "mm"),
    Control.VOLUME: ("m**3", "mL"),
}


@app.command()
def predict(
    actuator: Annotated[
        Path, typer.Option(help="actuator spec, as models/actuators/bellow-bending.yaml")
    ],
    model: Annotated[
        str | None,
        typer.Option(help="models, separated by commas; default: the spec's predictions"),
    ] = None,
    pressures: Annotated[
        str | None,
        typer.Option(
            help="START:STOP:STEP in kPa; default: ten round steps up to the actuator's limit"
        ),
    ] = None,
    control: Annotated[
        Control, typer.Option(help="what is prescribed; all but pressure search `--pressures`")
    ] = Control.PRESSURE,
    targets: Annotated[
        str | None,
        typer.Option(
            help="START:STOP:STEP of the prescribed angle in deg, inner bend radius in mm or "
            "volume in mL"
        ),
    ] = None,
    csv: Annotated[Path | None, typer.Option(help="write the table to this file, too")] = None,
    vtu: Annotated[
        Path | None,
        typer.Option(help="write the finite elements' fields to this folder, for ParaView"),
    ] = None,
    view: Annotated[
        Path | None,
        typer.Option(help="write a page with a 3D view of stress and strain to this HTML file"),
    ] = None,
) -> None:
    """Predict angle or elongation, blocked force and cavity volume of an actuator.

    Nothing moves: this only computes.

    Finite elements take a while the first time; their results are kept and found again. Where a
    model got no further than some pressure, cells are empty and a line says why; exits 1 if that
    is so with the tip free.

    Example: `rig predict --actuator models/actuators/bellow-bending.yaml --csv both.csv`

    Which pressures bend it by 0 to 90 degrees:
    `rig predict --actuator SPEC --control angle --targets 0:90:10`

    Which pressure, and how much volume, bend it around a tube of 60 mm:
    `rig predict --actuator SPEC --control radius --targets 30`

    Stress and strain at the pressures that were solved for, up to the highest asked for, as
    files to open in ParaView and as a page to turn in a browser:
    `rig predict --actuator SPEC --model fe --vtu fields --view fields.html`
    """
    import numpy as np
    from rich.console import Console

    from rig.cli._calculation import calculating
    from rig.cli._tables import write_csv
    from rig.mechanics.errors import MechanicsError
    from rig.mechanics.model import predict as predict_response
    from rig.mechanics.table import COLUMNS, rows
    from rig.spec.loading import load_actuator
    from rig.spec.workspace import Workspace

    spec = load_actuator(actuator)
    material = Workspace.find(actuator).material(spec.material)
    grid = _pressure_grid(spec, pressures)
    wanted = _wanted(spec, control, targets)
    models = _models(spec, model)
    if (vtu is not None or view is not None) and FINITE_ELEMENTS not in models:
        raise typer.BadParameter(
            "--vtu and --view show the fields of finite elements: add --model fe."
        )
    table, cautions, shortfalls, unreached = [], [], [], False
    with calculating(Console(stderr=True)) as job:
        for name in models:
            response = predict_response(spec, material, name, grid, job)
            table += rows(response if wanted is None else _controlled(response, control, wanted))
            cautions += [f"Warning: the model {name}: {why}" for why in response.cautions]
            unreached |= bool(np.isnan(response.displacement).any())
            shortfalls += [f"The model {name} is incomplete: {why}" for why in response.shortfalls]
        if vtu is not None:
            _write_fields(vtu, spec, material, float(grid[-1]), job)
        if view is not None:
            _write_view(view, spec, material, float(grid[-1]), job)
        margins = []
        if FINITE_ELEMENTS in models:
            margins = [
                *_margins(spec, material, float(grid[-1]), job),
                *_flank_gaps(spec, material, float(grid[-1]), job),
            ]
    _show(spec.name, material.name, table)
    for line in margins:
        typer.echo(line)
    for line in cautions:
        typer.echo(line, err=True)
    if csv is not None:
        write_csv(csv, COLUMNS, _lines(table))
    if unreached:
        raise MechanicsError("\n".join(shortfalls))
    for line in shortfalls:
        typer.echo(line, err=True)


def _models(spec: ActuatorSpec, model: str | None) -> list[str]:
    """Names in the order given, each once; an empty text is an unknown model."""
    names = spec.predictions if model is None else [name.strip() for name in model.split(",")]
    return list(dict.fromkeys(names))


def _pressure_grid(spec: ActuatorSpec, text: str | None) -> Array:
    from rig.mechanics.table import round_pressures

    if text is not None:
        return _grid(text, "Pa", "kPa", "--pressures")
    return round_pressures(spec.limits.pressure)


def _wanted(spec: ActuatorSpec, control: Control, text: str | None) -> Array | None:
    """Values of the response's own quantity that the targets ask for, SI; None for pressures.

    An actuator that bends to an arc keeps the length of its inner side, which is the angle times
    the inner bend radius (Yin et al., eqs. 4 and 5).
    """
    if (control is Control.PRESSURE) != (text is None):
        raise typer.BadParameter(
            "give --targets START:STOP:STEP together with --control angle, radius or volume; "
            "with --control pressure the pressures come from --pressures."
        )
    if text is None:
        return None
    targets = _grid(text, *_TARGET_UNITS[control], "--targets")
    if control is not Control.RADIUS:
        return targets
    from rig.mechanics.outline import body_of

    if not (targets > 0).all():
        raise typer.BadParameter("--targets: an inner bend radius must be above zero.")
    return body_of(spec.geometry).effective_length / targets


def _controlled(response: Response, control: Control, values: Array) -> Response:
    if control is Control.VOLUME:
        return response.at(response.pressure_for("volume", values))
    return response.at(response.pressure_for("angle", values))


def _grid(text: str, si: str, lab: str, option: str) -> Array:
    """`0:10:1`, `0:10:1 kPa` or a single value as an array in SI units, both ends included."""
    import numpy as np

    from rig.spec.quantity import to_si

    parts = [part.strip() for part in text.split(":")]
    unit = parts[-1].lstrip("+-.0123456789eE/").strip() or lab
    try:
        values = [to_si(_with_unit(part, unit), si) for part in parts]
    except ValueError as error:
        raise typer.BadParameter(
            f"{error}; {option} wants START:STOP:STEP in {lab}, as '0:10:1 {lab}'."
        ) from None
    if len(values) == 1:
        return np.array(values)
    count = (values[1] - values[0]) / values[2] if len(values) == 3 and values[2] > 0 else -1
    if not 0 < count < MAX_ROWS or abs(count - round(count)) > 1e-6:
        raise typer.BadParameter(
            f"'{text}' is no range; {option} wants START:STOP:STEP in {lab} with a whole number "
            f"of steps below {MAX_ROWS}, as '0:10:1'."
        )
    return np.asarray(values[0] + values[2] * np.arange(round(count) + 1), dtype=float)


def _with_unit(part: str, unit: str) -> str:
    bare = not part.lstrip("+-.0123456789eE/").strip()
    return f"{part} {unit}" if bare else part


def _show(actuator: str, material: str, table: list[Row]) -> None:
    from itertools import compress

    from rich.console import Console
    from rich.table import Table

    from rig.mechanics.table import COLUMNS

    shown = Table(title=f"{actuator}, {material}")
    given = [any(row[i] is not None for row in table) for i in range(len(COLUMNS))]
    for name in compress(COLUMNS, given):
        quantity, _, unit = name.rpartition("_")
        heading = f"{quantity.replace('_', ' ')}\n{_UNITS.get(unit, unit)}" if quantity else name
        shown.add_column(heading, justify="right" if quantity else "left")
    for model, *values in table:
        cells = (model, *("" if value is None else f"{value:.3f}" for value in values))
        shown.add_row(*compress(cells, given))
    Console().print(shown)


def _lines(table: list[Row]) -> Iterator[tuple[str, ...]]:
    for model, *values in table:
        yield model, *("" if v is None else f"{v:.10g}" for v in values)


def _margins(spec: ActuatorSpec, material: MaterialSpec, top: float, job: Job) -> list[str]:
    """How far the material is from tearing at the highest pressure that was solved for."""
    from rig.mechanics.simulate.prediction import free_inflation
    from rig.mechanics.strength import safety

    extremes = free_inflation(spec, material).curves(top, job).extremes
    if not extremes:
        return []
    found = safety(extremes[-1], material)
    governing = found.governing
    if governing is None:
        return [
            f"{material.name} tells neither strength nor elongation at break: no safety factor."
        ]
    return [
        f"Tip free at {found.pressure / 1e3:.4g} kPa: safety {governing.factor:.2g} to "
        f"{governing.factor_high:.2g}, {governing.bulk_factor:.2g} for 99.5 % of the volume, of "
        f"{governing.criterion}."
    ]


def _flank_gaps(spec: ActuatorSpec, material: MaterialSpec, top: float, job: Job) -> Iterator[str]:
    """How close flanks come up to the highest pressure, where the model watches them."""
    import numpy as np

    from rig.mechanics.simulate.prediction import blocked_inflation, free_inflation

    for question in (free_inflation(spec, material), blocked_inflation(spec, material)):
        if question is None:
            continue
        curves = question.curves(top, job)
        if "flank_gap" not in curves.measured:
            continue
        gaps, name = curves.measured["flank_gap"], question.name.capitalize()
        least = int(np.argmin(gaps))
        pressure = f"{curves.pressure[least] / 1e3:.4g} kPa"
        if not np.isfinite(gaps[least]):
            yield f"{name}: flanks stay far apart."
        elif gaps[least] > 0:
            yield f"{name}: flanks come as close as {1e3 * gaps[least]:.2g} mm, at {pressure}."
        else:
            first = curves.pressure[int(np.argmax(gaps <= 0))] / 1e3
            yield (
                f"Warning: {name.lower()}, flanks touch at {first:.4g} kPa and overlap by up to "
                f"{-1e3 * gaps[least]:.2g} mm, at {pressure}. The model lets them pass through "
                "each other: take results from there on as those of an actuator that is too soft."
            )


def _write_fields(
    folder: Path, spec: ActuatorSpec, material: MaterialSpec, top: float, job: Job
) -> None:
    from rig.mechanics.fe.vtu import write_vtu
    from rig.mechanics.simulate.prediction import free_inflation

    actuator, solutions = free_inflation(spec, material).solutions(top, job)
    write_vtu(folder, actuator.model, solutions, mirror=actuator.mirror)


def _write_view(
    path: Path, spec: ActuatorSpec, material: MaterialSpec, top: float, job: Job
) -> None:
    from rig.report.build import write_text
    from rig.report.errors import ReportError
    from rig.report.page import render_strength
    from rig.report.strength import strength_section

    page = render_strength(
        strength_section(spec, material, top, job), f"{spec.name}, {material.name}"
    )
    try:
        write_text(path, page)
    except OSError as error:
        raise ReportError(
            f"the view cannot be written to {path}: {error.strerror}. Name a file in an existing "
            f"folder that you may write to."
        ) from None
