"""`rig latitudes`: where a joint bellow is weak when it is inflated and compressed."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rig.mechanics.simulate.latitudes import LatitudeRun
    from rig.spec.actuator import ActuatorSpec, BellowJointGeometry
    from rig.spec.material import MaterialSpec

CSV_COLUMNS = ("stroke", "drive", "face", "bellow", "latitude", "von_mises_kpa", "rate_kpa_per_s")

FOLD_STEPS = 12


class StrokeName(StrEnum):
    """Which way the bellow goes."""

    INFLATION = "inflation"
    COMPRESSION = "compression"


@app.command()
def latitudes(
    actuator: Annotated[
        Path, typer.Option(help="actuator spec, as models/actuators/bellow-joint.yaml")
    ],
    stroke: Annotated[
        list[StrokeName] | None, typer.Option(help="inflation or compression; default: both")
    ] = None,
    fold: Annotated[
        str | None,
        typer.Option(help="also press one of many bellows by this much, its flanks in contact"),
    ] = None,
    csv: Annotated[
        Path | None,
        typer.Option(help="write every point's greatest stress and rate to this file"),
    ] = None,
) -> None:
    """Tell the stress at ten latitudes of a joint bellow, pumped and deformed at constant rates.

    Mean over the bellows of the largest von Mises stress at points A (trough) over F (crest) to J,
    on both faces of the wall, and how well the bellows agree (intraclass correlation).

    Flanks that touch are told, not resisted, but for `--fold`: there one bellow of a long row is
    pressed together, and its flanks push each other.

    Example: `rig latitudes --actuator models/actuators/bellow-joint.yaml --csv weak.csv`
    """
    from rich.console import Console

    from rig.cli._tables import write_csv
    from rig.mechanics.simulate.latitudes import COMPRESSION, INFLATION, Drive, drive
    from rig.spec.loading import load_actuator
    from rig.spec.workspace import Workspace
    from rig.validate.agreement import pingouin

    spec = load_actuator(actuator)
    material = Workspace.find(actuator).material(spec.material)
    geometry = _joint(spec)
    most = None if fold is None else _fold_length(fold, geometry)
    pingouin()  # missing, it is told before minutes of finite elements
    strokes = {StrokeName.INFLATION: INFLATION, StrokeName.COMPRESSION: COMPRESSION}
    lines: list[tuple[str, ...]] = []
    for name in dict.fromkeys(stroke or tuple(StrokeName)):
        runs = {}
        for how in Drive:
            with Console(stderr=True).status(f"finite elements, {name}, {how}"):
                runs[how.value] = drive(geometry, material, strokes[name], how)
            lines += _rows(name, how, runs[how.value])
        _show(f"{spec.name}, {material.name}: {name}, von Mises stress in MPa", runs)
    # before the fold, which may not get there
    if csv is not None:
        write_csv(csv, CSV_COLUMNS, lines)
    if most is not None:
        _show_fold(f"one of many bellows, {material.name}, pressed", geometry, material, most)


def _fold_length(text: str, geometry: BellowJointGeometry) -> float:
    from rig.spec.quantity import to_si

    try:
        most = float(to_si(text, "m"))
    except ValueError as error:
        raise typer.BadParameter(f"--fold {text}: {error}; it wants '2.1 mm'.") from None
    if not 0 < most < geometry.pitch:
        raise typer.BadParameter(
            f"--fold {text} must be above zero and below the pitch, {1e3 * geometry.pitch:.4g} mm."
        )
    return most


def _show_fold(
    title: str, geometry: BellowJointGeometry, material: MaterialSpec, most: float
) -> None:
    import numpy as np
    from rich.console import Console
    from rich.table import Table

    from rig.mechanics.simulate.folding import fold

    found = fold(geometry, material, np.linspace(0.0, most, FOLD_STEPS + 1))
    shown = Table(title=title)
    for heading in ("by\nmm", "force\nN", "outer flanks\nN", "inner flanks\nN"):
        shown.add_column(heading, justify="right")
    shown.add_column("von Mises\nMPa", justify="right")
    shown.add_column("plastic\n%", justify="right")
    columns = (
        found.shortening * 1e3,
        found.force,
        *found.pushed.T,
        found.von_mises / 1e6,
        found.plastic * 100,
    )
    for row in zip(*columns, strict=True):
        shown.add_row(*(f"{value:.2f}" for value in row))
    Console().print(shown)


def _joint(spec: ActuatorSpec) -> BellowJointGeometry:
    from rig.mechanics.errors import MechanicsError
    from rig.spec.actuator import BellowJointGeometry

    if isinstance(spec.geometry, BellowJointGeometry):
        return spec.geometry
    raise MechanicsError(
        f"latitudes are those of the family 'bellow-joint'; '{spec.name}' is of the family "
        f"'{spec.geometry.family}'. Ask `rig predict --view` for its stresses."
    )


def _show(title: str, runs: dict[str, LatitudeRun]) -> None:
    import numpy as np
    from rich.console import Console
    from rich.table import Table

    from rig.mechanics.simulate.latitudes import FACES, LETTERS
    from rig.validate.agreement import intraclass_correlation

    shown = Table(title=title)
    shown.add_column("latitude")
    columns = []
    for how, run in runs.items():
        for face, greatest in zip(FACES, run.greatest, strict=True):
            shown.add_column(f"{how}\n{face}", justify="right")
            agreement = intraclass_correlation(greatest.T).coefficient
            columns.append([*(greatest.mean(axis=0) / 1e6), agreement])
    *stresses, agreements = np.transpose(columns)
    for letter, row in zip(LETTERS, stresses, strict=True):
        shown.add_row(letter, *(f"{value:.2f}" for value in row))
    shown.add_section()
    shown.add_row("agreement of bellows, ICC", *(f"{value:.3f}" for value in agreements))
    console = Console()
    console.print(shown)
    for how, run in runs.items():
        console.print(f"{how.capitalize()}: {_end_of(run)}", soft_wrap=True)


def _end_of(run: LatitudeRun) -> str:
    told = (
        f"{1e3 * run.elongation[-1]:+.1f} mm at {run.pressure[-1] / 1e3:.2f} kPa after "
        f"{run.time[-1]:.2g} s; plastic strain up to {100 * run.plastic[-1]:.2g} %."
    )
    touching = run.gap <= 0
    if touching.any():
        first = 1e3 * float(run.elongation[touching.argmax()])
        told += f" Warning: flanks touch from {first:+.1f} mm on, which the model does not resist."
    return told


def _rows(name: str, how: str, run: LatitudeRun) -> list[tuple[str, ...]]:
    from rig.mechanics.simulate.latitudes import FACES, LETTERS

    greatest, rate = run.greatest / 1e3, run.rate.max(axis=0) / 1e3
    return [
        (name, how, face, str(b + 1), letter, f"{greatest[f, b, k]:.6g}", f"{rate[f, b, k]:.6g}")
        for f, face in enumerate(FACES)
        for b in range(greatest.shape[1])
        for k, letter in enumerate(LETTERS)
    ]
