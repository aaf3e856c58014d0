"""`rig calibrate camera`: the lens, from pictures of a ChArUco board."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli import _calibration_options as options
from rig.cli.calibrate import calibrate

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rig.spec.bench import BenchSpec
    from rig.spec.target import CharucoTarget
    from rig.spec.workspace import Workspace
    from rig.vision.segment import Image


@calibrate.command()
def camera(
    pictures: Annotated[
        list[str] | None,
        typer.Argument(help="images, videos, folders or globs; default: the bench's camera"),
    ] = None,
    bench: options.Bench = "virtual",
    seed: options.Seed = 1,
    views: Annotated[int, typer.Option(min=10, max=200, help="Pictures of the board to use.")] = 30,
    columns: Annotated[int, typer.Option(min=4, max=20, help="Squares of the board across.")] = 9,
    rows: Annotated[int, typer.Option(min=4, max=20, help="Squares of the board down.")] = 6,
    square_mm: Annotated[float, typer.Option(min=0.1, help="Side of a square, measured.")] = 16.0,
    marker_mm: Annotated[float, typer.Option(min=0.1, help="Side of a marker (4X4_50).")] = 12.0,
    board: Annotated[
        Path | None, typer.Option(help="Only write the board to this PNG, to be printed.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Draw residuals and coverage into this PNG.")
    ] = None,
    out: options.Out = None,
    operator: options.Operator = "",
    serial_number: options.SerialNumber = "",
    valid_days: options.ValidDays = 365,
) -> None:
    """Find focal length, centre and distortion of a camera from pictures of a flat board.

    Says where to hold the board next until the picture is covered and the board was tilted both
    ways, or until Ctrl-C. Zoom, focus and resolution must be those of the runs.

    Examples:

        rig calibrate camera --board board.png

        rig calibrate camera shots/*.png --bench mega --square-mm 15.97 --plot residuals.png
    """
    from contextlib import closing

    from pydantic import ValidationError
    from rich.console import Console

    from rig.cli._calibration_file import finish, provenance, surroundings
    from rig.cli._pictures import until_interrupted
    from rig.spec.target import CharucoTarget
    from rig.spec.workspace import Workspace
    from rig.vision.charuco import collect, coverage
    from rig.vision.lens import NAMES, fit_lens

    console = Console()
    try:
        target = CharucoTarget(
            columns=columns, rows=rows, square=f"{square_mm} mm", marker=f"{marker_mm} mm"
        )
    except ValidationError as error:
        raise typer.BadParameter(f"the board: {error.errors()[0]['msg']}.") from None
    if board is not None:
        _write_board(target, board)
        console.print(f"Written: {board}. Print it flat; measure its squares.", markup=False)
        return
    workspace = Workspace.find()
    spec = workspace.bench(bench)
    simulated = spec.simulated and not pictures
    source = _pictures(pictures, workspace, spec, target, seed, views)
    with closing(until_interrupted(source)) as shown:
        taken, size = collect(shown, target, views, lambda text: console.print(text, markup=False))
    fit = fit_lens(taken, size)
    for advice in coverage(taken, size).advice:
        console.print(f"The result would be better if you could {advice}.", markup=False)
    made = fit.calibration(
        provenance(
            environment=surroundings(spec, simulated),
            method=f"ChArUco board, {columns}x{rows} squares of {square_mm:g} mm, {len(taken)} "
            "views; Zhang 2000",
            instrument=f"camera of the bench {spec.name}",
            serial_number=serial_number,
            operator=operator,
            valid_days=valid_days,
            simulated=simulated,
        )
    )
    for name, value, u in zip(NAMES, fit.values, fit.u, strict=True):
        console.print(f"{name:<9} {value:12.5f}   u = {u:.2g}", highlight=False)
    console.print(
        f"{len(taken)} views, residuals {fit.rms_px:.3f} px RMS; angles: u = "
        f"{made.angle_u_deg:.2g} deg",
        highlight=False,
    )
    if plot is not None:
        from rig.report.lens import draw_lens_fit

        draw_lens_fit(fit, plot)
        console.print(f"Drawn: {plot}", markup=False, highlight=False)
    finish(console, workspace, made, out, "camera.calibration")


def _pictures(
    named: list[str] | None,
    workspace: Workspace,
    bench: BenchSpec,
    target: CharucoTarget,
    seed: int,
    views: int,
) -> Iterator[Image]:
    """The pictures that were named, or those of the bench's camera."""
    from rig.cli._pictures import frames_of_camera, frames_of_files

    if named:
        return frames_of_files(named)
    if bench.simulated:
        from rig.board.virtual_target import board_views

        return board_views(bench, target, seed, views)
    # what the camera is known by so far tells its mode
    return frames_of_camera(bench, workspace.resolve_bench(bench).camera)


def _write_board(target: CharucoTarget, path: Path) -> None:
    """The board with ten pixels a millimetre."""
    import cv2

    from rig.vision.charuco import board_picture
    from rig.vision.errors import VisionError

    try:
        path.write_bytes(cv2.imencode(".png", board_picture(target))[1].tobytes())
    except OSError as error:
        raise VisionError(f"{path} cannot be written: {error.strerror}.") from None
