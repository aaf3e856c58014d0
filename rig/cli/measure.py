"""`rig measure`: bending angles from any images and videos."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rig.vision.footage import Frame
    from rig.vision.measure import AngleMeasurement, AngleMeter
    from rig.vision.segment import Image
    from rig.vision.table import Row

MAX_SHOWN = 60
"""Frames that are listed one by one; of longer footage the table shows one line a file."""


class Bends(StrEnum):
    """The side to which the actuator curls in the picture."""

    LEFT = "left"
    RIGHT = "right"


@app.command()
def measure(
    footage: Annotated[list[str], typer.Argument(help="images, videos, folders or globs")],
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
) -> None:
    """Measure the bending angle in images and videos.

    The actuator hangs from a blue connector and ends in a blue cap. The angle is 0 for a straight
    actuator and grows with bending; u95 is its expanded uncertainty. A frame that cannot be
    trusted is listed as rejected, with the reason.

    Exits with 0 only if every file gave at least one accepted frame.

    Example: `rig measure frames/*.png --csv angles.csv --overlay overlays`

    With lens and plane taken out:
    `rig measure run.mp4 --camera calibration/camera.yaml --ruler calibration/ruler.yaml`
    """
    from rig.vision.errors import VisionError
    from rig.vision.footage import expand

    files = expand(footage)
    meter = _meter(camera, ruler, bends)
    if overlay is not None:
        _make_folder(overlay)
    rows = list(_progress(_measure(files, meter, overlay, track), len(files)))
    _show(rows)
    if csv is not None:
        _write(csv, rows)
    good = {row.file for row in rows if row.accepted}
    bad = [file for file in files if file not in good]
    if bad:
        why = next(row.reason for row in rows if row.file == bad[0])
        more = f" and {len(bad) - 1} more" if len(bad) > 1 else ""
        raise VisionError(
            f"No angle in {len(bad)} of {len(files)} files: {bad[0]}{more}. "
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


def _measure(
    files: list[Path], meter: AngleMeter, overlay: Path | None, track: bool
) -> Iterator[Row]:
    """Rows of all frames; overlays are written on the way."""
    from rig.vision.overlay import draw_overlay
    from rig.vision.table import row_of, unreadable_row

    names = _overlay_names(files)
    for file in files:
        for outcome in _outcomes(file, meter, track):
            if isinstance(outcome, str):
                yield unreadable_row(file, outcome)
                continue
            frame, result = outcome
            if overlay is not None:
                name = names[file] + ("" if frame.time_s is None else f"_{frame.index:06d}")
                _save(overlay / f"{name}.png", draw_overlay(frame.image, result))
            yield row_of(file, frame.index, frame.time_s, result)


def _outcomes(
    file: Path, meter: AngleMeter, track: bool
) -> Iterator[tuple[Frame, AngleMeasurement] | str]:
    """Measured frames; why the file cannot be read (further), where it cannot."""
    from rig.vision.errors import VisionError
    from rig.vision.footage import read_frames

    tracker = None
    if track:
        from rig.vision.track import AngleTracker  # imports slowly

        tracker = AngleTracker(meter)
    try:
        for frame in read_frames(file):
            if tracker is None or frame.time_s is None:
                yield frame, meter.measure(frame.image)
            else:
                yield frame, tracker.measure(frame.image, frame.time_s).measurement
    except VisionError as error:
        yield str(error)


def _overlay_names(files: list[Path]) -> dict[Path, str]:
    """A file name for each overlay: the stem, numbered where several files share it."""
    names: dict[Path, str] = {}
    for file in files:
        name, number = file.stem, 2
        while name in names.values():
            name, number = f"{file.stem}-{number}", number + 1
        names[file] = name
    return names


def _progress(rows: Iterator[Row], files: int) -> Iterator[Row]:
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
        for row in rows:
            seen.add(row.file)
            count += 1
            bar.update(task, description=f"frame {count}, file {len(seen)} of {files}")
            yield row


def _show(rows: list[Row]) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table()
    if len(rows) <= MAX_SHOWN:
        headings = ("file", "frame", "time\ns", "angle\ndeg", "u95\ndeg", "quality", "")
        lines = [_line(row) for row in rows]
    else:
        headings = ("file", "frames", "accepted", "lowest\ndeg", "highest\ndeg", "u95\ndeg", "")
        lines = [_summary(file, rows) for file in dict.fromkeys(row.file for row in rows)]
    for index, heading in enumerate(headings):
        table.add_column(heading, justify="left" if index in (0, 6) else "right")
    for line in lines:
        table.add_row(*(Text(cell) for cell in line))  # names may hold what rich calls markup
    Console().print(table)
    accepted = sum(row.accepted for row in rows)
    typer.echo(f"{accepted} of {len(rows)} frames accepted")


def _line(row: Row) -> tuple[str, ...]:
    return (
        row.file.name,
        "" if row.frame is None else str(row.frame),
        "" if row.time_s is None else f"{row.time_s:.3f}",
        "" if row.angle_deg is None else f"{row.angle_deg:.2f}",
        "" if row.u95_deg is None else f"{row.u95_deg:.2f}",
        f"{row.quality:.2f}" if row.accepted else "",
        row.reason,
    )


def _summary(file: Path, rows: list[Row]) -> tuple[str, ...]:
    from statistics import median

    own = [row for row in rows if row.file == file]
    angles = [row.angle_deg for row in own if row.angle_deg is not None]
    spreads = [row.u95_deg for row in own if row.u95_deg is not None]
    reasons = [row.reason for row in own if row.reason]
    frequent = max(dict.fromkeys(reasons), key=reasons.count, default="")
    return (
        file.name,
        str(len(own)),
        str(len(angles)),
        f"{min(angles):.2f}" if angles else "",
        f"{max(angles):.2f}" if angles else "",
        f"{median(spreads):.2f}" if spreads else "",
        f"{len(reasons)} rejected, mostly: {frequent}" if frequent else "",
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


def _write(path: Path, rows: list[Row]) -> None:
    import csv

    from rig.vision.errors import VisionError
    from rig.vision.table import COLUMNS

    try:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(COLUMNS)
            writer.writerows(row.cells() for row in rows)
    except OSError as error:
        raise VisionError(
            f"The table cannot be written to {path}: {error.strerror}. Name a file in an existing "
            "folder that you may write to."
        ) from None
