"""`rig calibrate loadcell`: the load cell against masses."""

from __future__ import annotations

from typing import Annotated

import typer

from rig.cli import _calibration_options as options
from rig.cli.calibrate import calibrate
from rig.spec.quantity import STANDARD_GRAVITY


@calibrate.command()
def loadcell(
    bench: options.Bench = "virtual",
    seed: options.Seed = 1,
    masses: Annotated[str, typer.Option(help="Grams, separated by commas; five or more.")] = (
        "20,50,100,150,200"
    ),
    cycles: Annotated[int, typer.Option(min=1, max=20, help="Ways up and down.")] = 2,
    creep_s: Annotated[
        float, typer.Option(min=0, help="How long creep is watched under the heaviest; 0: not.")
    ] = 180.0,
    gravity: Annotated[
        float, typer.Option(min=9.7, max=9.9, help="Of the lab, m/s2; forces are in grams-force.")
    ] = STANDARD_GRAVITY,
    points: options.Points = None,
    out: options.Out = None,
    operator: options.Operator = "",
    serial_number: options.SerialNumber = "",
    valid_days: options.ValidDays = 365,
    reference: options.Reference = None,
    reference_u: options.ReferenceU = None,
    temperature_c: options.Temperature = None,
) -> None:
    """Compare the load cell with masses: tare, sensitivity, linearity, return to zero, creep.

    On a real bench a person is asked to place each mass. Ctrl-C keeps the points; a table of them
    has the columns kind (zero, up, down, creep), mass_g, counts and time_s.

    Examples:

        rig calibrate loadcell

        rig calibrate loadcell --bench mega --masses 10,20,50,100,200 --gravity 9.8118
        --reference "F1 set, cert. 456" --reference-u 0.002
    """
    from rig.calibrate.curve import LEAST_POINTS, different_values
    from rig.calibrate.load_cell import COLUMNS, LEAST_CREEP, fit_load_cell
    from rig.cli._calibration import new_task, numbers, order_of
    from rig.experiment.calibration.procedures import LoadCellPlan, load_cell_points
    from rig.experiment.calibration.references import Standard

    task = new_task(
        "loadcell", order_of(locals()), lambda r: Standard("simulated masses", r.mass_u)
    )
    plan = LoadCellPlan(numbers(masses, "masses"), cycles, creep_s)
    capacity_g = task.bench.load_cell.capacity * 1e3
    if max(plan.masses_g) > capacity_g:
        raise typer.BadParameter(f"the load cell carries {capacity_g:g} g at most")
    different = different_values(plan.masses_g)
    if points is None and different < LEAST_POINTS:
        raise typer.BadParameter(
            f"a line and a bow need {LEAST_POINTS} different masses; {masses} are {different}"
        )
    rows = task.rows(
        lambda bench, link, taken, stage: load_cell_points(bench, link, plan, taken, stage),
        COLUMNS,
    )
    fit = fit_load_cell(rows, gravity)
    made = fit.calibration(
        rows,
        task.standard.u,
        task.provenance(
            f"masses up and down, buoyancy taken out, gravity {gravity:g} m/s2; least squares, "
            "line and parabola",
            task.bench.load_cell.model,
        ),
    )
    creep = (
        f"creep not known, as it needs {LEAST_CREEP} readings"
        if fit.creep is None
        else f"creep {100 * fit.creep.share:+.2g} % of the load"
    )
    task.finish(
        made,
        (
            f"{made.counts_per_gram:.6g} counts per gram, u = {100 * made.counts_per_gram_u:.2g} %",
            f"bow {1e6 * made.bow:+.2g} mg in the middle of {1e3 * made.span:.4g} g, "
            f"u = {1e6 * made.linearity_u:.2g} mg; hysteresis {1e3 * fit.curve.hysteresis:+.2g} mg",
            f"zero returns within u = {1e6 * made.zero_u:.2g} mg; {creep}",
        ),
        "load_cell.calibration",
    )
