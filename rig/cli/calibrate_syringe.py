"""`rig calibrate syringe`: the plunger's drive by water, its dead volume by Boyle's law."""

from __future__ import annotations

from typing import Annotated

import typer

from rig.cli import _calibration_options as options
from rig.cli.calibrate import calibrate

UNMEASURED_U = 1.0
"""kPa that the weather, and deg C that a room, may differ by from what a bench says."""


USED_SHARE = 0.8
"""Of the stroke, for water: the rest keeps the plunger from its end."""


@calibrate.command()
def syringe(
    bench: options.Bench = "virtual",
    seed: options.Seed = 1,
    weighings: Annotated[int, typer.Option(min=4, help="Of the water so far.")] = 6,
    tube_u_ml: Annotated[
        float, typer.Option(min=0, help="Standard uncertainty of the tube's volume, mL.")
    ] = 0.05,
    ambient_kpa: Annotated[
        float | None,
        typer.Option(min=50, max=120, help="Of the lab; default: what the bench says."),
    ] = None,
    ambient_u_kpa: Annotated[
        float | None,
        typer.Option(min=0, help="Its standard uncertainty; default: 1, on a simulated bench 0."),
    ] = None,
    temperature_u_c: Annotated[
        float | None,
        typer.Option(
            min=0,
            max=5,
            help="Standard uncertainty of the water's temperature; default: 1, simulated 0.",
        ),
    ] = None,
    points: options.Points = None,
    out: options.Out = None,
    operator: options.Operator = "",
    serial_number: options.SerialNumber = "",
    valid_days: options.ValidDays = 365,
    reference: options.Reference = None,
    reference_u: options.ReferenceU = None,
    temperature_c: options.Temperature = None,
) -> None:
    """Find steps per mL by weighing water, dead volume and backlash by compressing gas.

    On a real bench a person fills the syringe with water, reads the balance, and plugs the empty
    tube afterwards. Ctrl-C vents the bench and keeps the points; a table of them has the columns
    kind (dispense, up, down), plunger_ml, pressure_kpa and water_g.

    Examples:

        rig calibrate syringe

        rig calibrate syringe --bench mega --temperature-c 22.5 --temperature-u-c 0.2
        --ambient-kpa 99.83 --ambient-u-kpa 0.05 --reference "Kern PCB 350-3" --reference-u 0.01
    """
    from rig.calibrate.syringe import COLUMNS, Surroundings, fit_syringe
    from rig.cli._calibration import new_task, order_of
    from rig.experiment.calibration.procedures import (
        DISPENSED_ML,
        SyringePlan,
        syringe_points,
    )
    from rig.experiment.calibration.references import Standard

    task = new_task(
        "syringe", order_of(locals()), lambda r: Standard("simulated balance", r.balance_u)
    )
    syringe_ml = task.bench.syringe.volume * 1e6
    jogs = int(USED_SHARE * syringe_ml / DISPENSED_ML)
    if weighings > jogs:
        raise typer.BadParameter(
            f"{weighings} weighings of at least {DISPENSED_ML:g} mL each would drive the plunger "
            f"of {syringe_ml:g} mL into its end; it allows {jogs}",
            param_hint="--weighings",
        )
    plan = SyringePlan(jogs // weighings, weighings, task.top_kpa)
    rows = task.rows(
        lambda bench, link, taken, stage: syringe_points(bench, link, plan, taken, stage),
        COLUMNS,
    )
    guess = 0.0 if task.simulated else UNMEASURED_U
    around = Surroundings(
        ambient_kpa=task.bench.ambient.pressure / 1e3 if ambient_kpa is None else ambient_kpa,
        ambient_u_kpa=guess if ambient_u_kpa is None else ambient_u_kpa,
        temperature_c=task.temperature_c,
        temperature_u_c=guess if temperature_u_c is None else temperature_u_c,
        volume_per_step_ul=task.parameters["volume_per_step_ul"],
        syringe_ml=syringe_ml,
        tube_ml=task.bench.tubing.volume * 1e6,
        tube_u_ml=tube_u_ml,
        balance_u=task.standard.u,
        transducer=task.calibrations.transducer,
    )
    fit = fit_syringe(rows, around)
    made = fit.calibration(
        rows,
        task.provenance(
            "water weighed, then gas compressed behind a plug (Boyle's law); least squares",
            f"syringe of {syringe_ml:g} mL and its drive",
            ambient_kpa,
        ),
    )
    task.finish(
        made,
        (
            f"{made.steps_per_ml:.6g} steps per mL, u = {100 * made.steps_per_ml_u:.2g} %",
            f"backlash {1e9 * made.backlash:.3g} uL, u = {1e9 * made.backlash_u:.2g} uL",
            f"dead volume {1e6 * made.dead_volume:.3f} mL, u = {1e6 * made.dead_volume_u:.2g} mL",
        ),
        "syringe.calibration",
    )
