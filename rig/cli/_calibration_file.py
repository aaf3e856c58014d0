"""The dated file that a calibration ends in."""

from __future__ import annotations

from datetime import date, timedelta
from pathlib import Path

from rich.console import Console

from rig.spec.bench import BenchSpec
from rig.spec.calibration import Environment, Provenance
from rig.spec.calibration_file import free_path, write_calibration
from rig.spec.loading import AnyCalibration
from rig.spec.quantity import CELSIUS
from rig.spec.workspace import Workspace


def provenance(
    *,
    method: str,
    instrument: str,
    serial_number: str,
    operator: str,
    valid_days: int | None,
    environment: Environment,
    simulated: bool,
    reference: str = "",
) -> Provenance:
    """Who calibrated what, when and against what; counts from today, without end where None."""
    today = date.today()
    return Provenance(
        date=today,
        valid_until=None if valid_days is None else today + timedelta(days=valid_days),
        method=method,
        instrument=instrument,
        serial_number=serial_number,
        operator=operator,
        reference=reference,
        environment=environment,
        simulated=simulated,
    )


def surroundings(bench: BenchSpec, simulated: bool) -> Environment:
    """The air that pictures were taken in: known of a simulated bench alone."""
    return Environment(temperature=bench.ambient.temperature - CELSIUS if simulated else None)


def folder(workspace: Workspace) -> Path:
    """Where calibrations are kept; the model library that came with the program is not ours."""
    root = Path.cwd() if workspace.is_library else workspace.root
    return root / "calibration"


def finish(
    console: Console,
    workspace: Workspace,
    calibration: AnyCalibration,
    out: Path | None,
    field: str,
) -> None:
    """Write the calibration and say how runs come to use it; `field` of the bench names it."""
    path = out or free_path(folder(workspace), calibration, calibration.instrument)
    write_calibration(calibration, path)
    until = calibration.provenance.valid_until
    console.print(
        f"Written: {path}{'' if until is None else f', valid until {until}'}. Runs use it once the "
        f"bench names it: {field}: {path.stem}",
        soft_wrap=True,
        highlight=False,
        markup=False,
    )
