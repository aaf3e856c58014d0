"""`rig measure`: bending angles from any images and videos."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rig.cli._gauges import Gauge, Reading
    from rig.vision.footage import Frame
    from rig.vision.measure import AngleMeter
    from rig.vision.segment import Image
    from rig.vision.table import Column, Row

MAX_SHOWN = 60
"""Frames that are listed one by one; of longer footage the table shows one line a file."""
BUDGET_HEADER = (
    *("file", "frame", "quantity", "source", "type", "unit"),
    *("u", "sensitivity", "contribution", "degrees_of_freedom"),
)


class Bends(StrEnum):
    """The side to which the actuator curls in the picture."""

    LEFT = "left"
    RIGHT = "right"


class Quantity(StrEnum):
    """What is measured."""

    ANGLE = "angle"
    MARKER_ANGLE = "marker-angle"
    DISPLACEMENT = "displacement"
    BACKBONE = "backbone"


@app.command()
def measure(
    footage: Annotated[list[str], typer.Argument(help="images, videos, folders or globs")],
    quantity: Annotated[
        Quantity, typer.Option(help="backbone: bend radius, bend angle and how round it is")
    ] = Quantity.ANGLE,
    csv: Annotated[Path | None, typer.Option(help="write all rows to this file, too")] = None,
    overlay: Annotated[
        Path | None, typer.Option(help="folder for pictures with the measurement drawn in")
    ] = None,
    camera: Annotated[
        Path | None, typer.Option(help="camera calibration: takes the lens out")
    ] = None,
    ruler: Annotated[
        Path | None,
        typer.Option(help="ruler calibration: every frame must then show the ruler"),
    ] = None,
    bends: Annotated[
        Bends, typer.Option(help="side to which the actuator curls in the picture")
    ] = Bends.LEFT,
    track: Annotated[
        bool,
        typer.Option(
            "--track", help="follow the cap through videos: faster, and jumps are rejected"
        ),
    ] = False,
    budget: Annotated[
        Path | None,
        typer.Option(help="file for what makes displacement or backbone uncertain, line by line"),
    ] = None,
    markers: Annotated[
        tuple[int, int],
        typer.Option(min=0, max=49, help="ArUco 4X4_50 markers: at the fixed end, at the moving"),
    ] = (0, 1),
    mounting_u_deg: Annotated[
        float, typer.Option(min=0, help="of markers from parallel when straight, u in deg")
    ] = 0.5,
    out_of_plane_u_mm: Annotated[
        float,
        typer.Option(min=0, help="of markers or backbone from the ruler's plane, u in mm"),
    ] = 1.0,
) -> None:
    """Measure the bending angle, a displacement or the backbone in images and videos.

    The actuator hangs from a blue connector and ends in a blue cap. The angle is 0 for a straight
    actuator and grows with bending; u95 is its expanded uncertainty. A frame that cannot be
    trusted is listed as rejected, with the reason.

    Where connector and cap are not blue, they can wear markers: --quantity marker-angle.

    Displacement is that of one marker from another since the first frame, of a video or of all
    images. It and the backbone need --camera and --ruler, and the ruler in the frame.

    Exits with 0 only if every file gave at least one accepted frame.

    Example: `rig measure frames/*.png --csv angles.csv --overlay overlays`

    With lens and plane taken out:
    `rig measure run.mp4 --camera calibration/camera.yaml --ruler calibration/ruler.yaml`
    """
    from rig.cli._tables import write_csv
    from rig.vision.errors import VisionError
    from rig.vision.footage import expand
    from rig.vision.table import header

    files = expand(footage)
    angle = quantity in (Quantity.ANGLE, Quantity.MARKER_ANGLE)
    if angle and budget is not None:
        raise typer.BadParameter("the report of a run has the budget of its angles")
    if quantity is Quantity.ANGLE:
        gauge = _angle(_meter(camera, ruler, bends), track, overlay is not None)
    elif track:
        raise typer.BadParameter("--track is for the angle")
    elif quantity is Quantity.MARKER_ANGLE:
        meter = _meter(camera, ruler, bends)
        gauge = _marker_angle(meter, markers, mounting_u_deg, overlay is not None)
    else:
        if overlay is not None:
            raise typer.BadParameter("--overlay is for the angle")
        gauge = _length(quantity, _meter(camera, ruler, bends), markers, out_of_plane_u_mm)
    if overlay is not None:
        _make_folder(overlay)
    rows: list[Row] = []
    readings: list[Reading] = []
    for row, reading in _progress(_measure(files, gauge, overlay), len(files)):
        rows.append(row)
        readings.append(reading)
    _show(rows, gauge.columns)
    if not angle:
        _show_budget(rows, readings)
    if csv is not None:
        write_csv(csv, header(gauge.columns), [row.cells(gauge.columns) for row in rows])
    if budget is not None:
        write_csv(budget, BUDGET_HEADER, _budget_lines(rows, readings))
    good = {row.file for row in rows if row.accepted}
    bad = [file for file in files if file not in good]
    if bad:
        why = next(row.reason for row in rows if row.file == bad[0])
        more = f" and {len(bad) - 1} more" if len(bad) > 1 else ""
        raise VisionError(
            f"No {quantity.value} in {len(bad)} of {len(files)} files: {bad[0]}{more}. "
            f"{bad[0].name}: {why.rstrip('.')}."
        )


def _meter(camera: Path | None, ruler: Path | None, bends: Bends) -> AngleMeter:
    from rig.spec.calibration import CameraCalibration, RulerCalibration
    from rig.spec.loading import read
    from rig.vision.measure import AngleMeter

    return AngleMeter(
        camera=None if camera is None else read(camera, CameraCalibration).spec,
        ruler=None if ruler is None else read(ruler, RulerCalibration).spec,
        bends="left" if bends is Bends.LEFT else "right",
    )


def _angle(meter: AngleMeter, track: bool, overlay: bool) -> Gauge:
    from rig.cli._gauges import AngleGauge

    return AngleGauge(meter, track, overlay)


def _marker_angle(
    meter: AngleMeter, markers: tuple[int, int], mounting_u_deg: float, overlay: bool
) -> Gauge:
    from rig.cli._gauges import MarkerAngleGauge
    from rig.vision.marker_angle import MarkerAngleMeter

    _require_two(markers)
    between = MarkerAngleMeter(
        meter.camera, meter.ruler, meter.bends, *markers, mounting_u_deg=mounting_u_deg
    )
    return MarkerAngleGauge(between, overlay)


def _require_two(markers: tuple[int, int]) -> None:
    if markers[0] == markers[1]:
        raise typer.BadParameter(f"--markers are two, got {markers[0]} twice")


def _length(
    quantity: Quantity, meter: AngleMeter, markers: tuple[int, int], out_of_plane_u_mm: float
) -> Gauge:
    from rig.cli._gauges import BackboneGauge, DisplacementGauge
    from rig.validate.picture_budget import Picturing

    if meter.camera is None or meter.ruler is None:
        raise typer.BadParameter(
            f"a {quantity.value} in mm needs --camera and --ruler: lens, plane and scale"
        )
    picturing = Picturing(meter.camera, meter.ruler, out_of_plane_u_mm)
    if quantity is Quantity.BACKBONE:
        return BackboneGauge(meter, picturing)
    _require_two(markers)
    return DisplacementGauge(picturing, *markers)


def _measure(
    files: list[Path], gauge: Gauge, overlay: Path | None
) -> Iterator[tuple[Row, Reading]]:
    """Rows of all frames with what they are from; overlays are written on the way."""
    from dataclasses import replace

    from rig.vision.table import Row

    names = _overlay_names(files)
    for file, frame, reading in _readings(files, gauge):
        number = time_s = None
        if frame is not None:
            number, time_s = frame.index, frame.time_s
        if overlay is not None and reading.overlay is not None:
            name = names[file] + ("" if time_s is None else f"_{number:06d}")
            _save(overlay / f"{name}.png", reading.overlay)
        row = Row(file, number, time_s, reading.values, reading.accepted, reading.reason)
        yield row, replace(reading, overlay=None)  # pictures of a film do not fit into memory


def _readings(files: list[Path], gauge: Gauge) -> Iterator[tuple[Path, Frame | None, Reading]]:
    """Frames with their readings; none where a file cannot be read (further), but the reason."""
    from rig.cli._gauges import Reading
    from rig.vision.errors import VisionError
    from rig.vision.footage import read_frames

    still = gauge.film()  # all stills are one series
    for file in files:
        film = gauge.film()
        try:
            for frame in read_frames(file):
                yield file, frame, (still if frame.time_s is None else film)(frame)
        except VisionError as error:
            yield file, None, Reading((None,) * len(gauge.columns), False, str(error))


def _overlay_names(files: list[Path]) -> dict[Path, str]:
    """A file name for each overlay: the stem, numbered where several files share it."""
    names: dict[Path, str] = {}
    for file in files:
        name, number = file.stem, 2
        while name in names.values():
            name, number = f"{file.stem}-{number}", number + 1
        names[file] = name
    return names


def _progress(rows: Iterator[tuple[Row, Reading]], files: int) -> Iterator[tuple[Row, Reading]]:
    """The same rows, with a bar on stderr where that is a terminal."""
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    seen: set[Path] = set()
    count = 0
    with Progress(
        SpinnerColumn(),
        TextColumn("{task.description}"),
        TimeElapsedColumn(),
        console=console,
        disable=not console.is_terminal,
        transient=True,
    ) as bar:
        task = bar.add_task("measuring", total=None)
        for row, reading in rows:
            seen.add(row.file)
            count += 1
            bar.update(task, description=f"frame {count}, file {len(seen)} of {files}")
            yield row, reading


def _show(rows: list[Row], columns: Sequence[Column]) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table()
    value, u95 = columns[:2]
    if len(rows) <= MAX_SHOWN:
        headings = ["file", "frame", "time\ns", *(f"{c.heading}\n{c.unit}" for c in columns), ""]
        lines = [_line(row, columns) for row in rows]
    else:
        ends = (f"{name}\n{value.unit}" for name in ("lowest", "highest"))
        headings = ["file", "frames", "accepted", *ends, f"u95\n{u95.unit}", ""]
        files = dict.fromkeys(row.file for row in rows)
        lines = [_summary(file, rows, columns) for file in files]
    for index, heading in enumerate(headings):
        justify: Literal["left", "right"] = "left" if index in (0, len(headings) - 1) else "right"
        table.add_column(heading, justify=justify)
    for line in lines:
        table.add_row(*(Text(cell) for cell in line))  # names may hold what rich calls markup
    Console().print(table)
    accepted = sum(row.accepted for row in rows)
    typer.echo(f"{accepted} of {len(rows)} frames accepted")


def _line(row: Row, columns: Sequence[Column]) -> tuple[str, ...]:
    return (
        row.file.name,
        "" if row.frame is None else str(row.frame),
        "" if row.time_s is None else f"{row.time_s:.3f}",
        *row.shown(columns),
        row.reason,
    )


def _summary(file: Path, rows: list[Row], columns: Sequence[Column]) -> tuple[str, ...]:
    from statistics import median

    own = [row for row in rows if row.file == file]
    values, spreads = ([row.values[index] for row in own if row.accepted] for index in (0, 1))
    found = [value for value in values if value is not None]
    u95 = [spread for spread in spreads if spread is not None]
    reasons = [row.reason for row in own if row.reason]
    frequent = max(dict.fromkeys(reasons), key=reasons.count, default="")
    shown = columns[0].shown
    return (
        file.name,
        str(len(own)),
        str(len(found)),
        f"{min(found):.{shown}f}" if found else "",
        f"{max(found):.{shown}f}" if found else "",
        f"{median(u95):.{shown}f}" if u95 else "",
        f"{len(reasons)} rejected, mostly: {frequent}" if frequent else "",
    )


def _show_budget(rows: list[Row], readings: list[Reading]) -> None:
    """The budget of the frame with the largest value, which is where lengths are least known."""
    from rich.console import Console
    from rich.table import Table

    accepted = [pair for pair in zip(rows, readings, strict=True) if pair[1].accepted]
    if not accepted:
        return
    row, reading = max(accepted, key=lambda pair: abs(pair[1].values[0] or 0.0))
    for name, lines in reading.budgets.items():
        table = Table(title=f"{name} in {row.file.name}, frame {row.frame}")
        for heading in ("source", "type", "u", "unit", "contribution"):
            table.add_column(heading, justify="left" if heading in ("source", "unit") else "right")
        for c in lines:
            table.add_row(c.name, c.kind, f"{c.u:.2g}", c.unit, f"{c.contribution:.2g}")
        Console().print(table)


def _budget_lines(rows: list[Row], readings: list[Reading]) -> Iterator[tuple[str, ...]]:
    for row, reading in zip(rows, readings, strict=True):
        for name, lines in reading.budgets.items():
            for c in lines:
                numbers = (c.u, c.sensitivity, c.contribution, c.dof)
                yield (
                    *(str(row.file), str(row.frame), name, c.name, c.kind, c.unit),
                    *(f"{number:.6g}" for number in numbers),
                )


def _make_folder(folder: Path) -> None:
    from rig.vision.errors import VisionError

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise VisionError(
            f"The overlays cannot go to {folder}: {error.strerror}. Name a folder that exists or "
            "can be made."
        ) from None


def _save(path: Path, image: Image) -> None:
    import cv2

    from rig.vision.errors import VisionError

    try:
        path.write_bytes(cv2.imencode(".png", image)[1].tobytes())
    except OSError as error:
        raise VisionError(f"{path} cannot be written: {error.strerror}.") from None
