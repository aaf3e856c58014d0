"""`rig calibrate ruler`: how square and even the right-angle ruler is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli import _calibration_options as options
from rig.cli.calibrate import calibrate

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rig.vision.segment import Image

SHOWN = 3
"""Pictures that are held before a simulated camera for one in which all marks are seen."""


@calibrate.command()
def ruler(
    pictures: Annotated[
        list[str] | None,
        typer.Argument(help="images, videos, folders or globs; default: the bench's camera"),
    ] = None,
    bench: options.Bench = "virtual",
    seed: options.Seed = 1,
    camera: Annotated[
        Path | None, typer.Option(help="Camera calibration; default: the one that the bench names.")
    ] = None,
    views: Annotated[int, typer.Option(min=4, max=200, help="Pictures of the ruler to use.")] = 20,
    pitch_mm: Annotated[
        float | None, typer.Option(min=0.1, help="Of the marks, by a calliper; default: as known.")
    ] = None,
    pitch_u_mm: Annotated[
        float | None, typer.Option(min=0.0, help="Its standard uncertainty; needs --pitch-mm.")
    ] = None,
    out: options.Out = None,
    operator: options.Operator = "",
    serial_number: options.SerialNumber = "",
    valid_days: options.ValidDays = 365,
    reference: Annotated[str, typer.Option(help="What the pitch was measured with.")] = "",
) -> None:
    """Check the ruler that gives every frame its plane and scale.

    Tilted views through a calibrated lens tell how square its legs are and whether both have the
    same pitch. The pitch itself comes from a calliper: pictures alone have no scale.

    Example: `rig calibrate ruler tilted/*.png --bench mega --pitch-mm 10.002 --pitch-u-mm 0.005`
    """
    from contextlib import closing

    import numpy as np
    from rich.console import Console

    from rig.cli._calibration_file import finish, provenance, surroundings
    from rig.cli._pictures import frames_of_camera, frames_of_files, until_interrupted
    from rig.spec.calibration import CameraCalibration, Evidence, Fit
    from rig.spec.loading import read
    from rig.spec.workspace import Workspace
    from rig.vision.squareness import collect, fit_shape

    if (pitch_mm is None) != (pitch_u_mm is None):
        raise typer.BadParameter("--pitch-mm and --pitch-u-mm belong together")
    console = Console()
    workspace = Workspace.find()
    spec = workspace.bench(bench)
    simulated = spec.simulated and not pictures
    known = workspace.resolve_bench(spec)
    lens = known.camera if camera is None else read(camera, CameraCalibration).spec
    source: Iterable[Image]
    if pictures:
        source = frames_of_files(pictures)
    elif spec.simulated:
        from rig.board.virtual_target import ruler_views

        source = ruler_views(spec, known.ruler, seed, SHOWN * views)
    else:
        source = frames_of_camera(spec, lens)
    with closing(until_interrupted(source)) as shown:
        shape = fit_shape(lens, collect(shown, lens, known.ruler.marks, views))
    u_deg = float(np.hypot(shape.lean_u_deg, lens.angle_u_deg))
    made = known.ruler.model_copy(
        update={
            # the lean is not corrected for: what it may be is part of the uncertainty
            "squareness_u_deg": float(np.hypot(u_deg, shape.lean_deg)),
            "pitch": known.ruler.pitch if pitch_mm is None else pitch_mm / 1e3,
            "pitch_u": known.ruler.pitch_u if pitch_u_mm is None else pitch_u_mm / 1e3,
            "provenance": provenance(
                environment=surroundings(spec, simulated),
                method=f"{shape.views} tilted views through a calibrated lens",
                instrument="right-angle ruler",
                serial_number=serial_number,
                operator=operator,
                valid_days=valid_days,
                simulated=simulated,
                reference=reference,
            ),
            "evidence": Evidence(
                columns=("views", "rms_px", "camera_u_deg"),
                rows=((float(shape.views), shape.rms_px, lens.angle_u_deg),),
                fits=(
                    Fit(
                        model="lean of the second leg towards the first, deg; ratio of pitches",
                        parameters=("lean", "pitch_ratio"),
                        values=(shape.lean_deg, shape.ratio),
                        covariance=tuple(tuple(row) for row in shape.covariance.tolist()),
                        residuals=(),
                        degrees_of_freedom=shape.degrees_of_freedom,
                    ),
                ),
            ),
        }
    )
    console.print(
        f"legs {90 - shape.lean_deg:.4f} deg apart, u = {u_deg:.2g} deg; pitches of the legs as "
        f"{shape.ratio:.6f}, u = {shape.ratio_u:.2g}; {shape.views} views, {shape.rms_px:.3f} px",
        highlight=False,
    )
    finish(console, workspace, made, out, "camera.ruler")
