"""`rig calibrate pressure`: the transducer against a gauge or a dead-weight tester."""

from __future__ import annotations

from typing import Annotated

import typer

from rig.cli import _calibration_options as options
from rig.cli.calibrate import calibrate


@calibrate.command()
def pressure(
    bench: options.Bench = "virtual",
    seed: options.Seed = 1,
    steps: Annotated[int, typer.Option(min=5, max=100, help="Pressures on the way up.")] = 14,
    cycles: Annotated[int, typer.Option(min=1, max=20, help="Ways up and down.")] = 2,
    points: options.Points = None,
    out: options.Out = None,
    operator: options.Operator = "",
    serial_number: options.SerialNumber = "",
    valid_days: options.ValidDays = 365,
    reference: options.Reference = None,
    reference_u: options.ReferenceU = None,
    temperature_c: options.Temperature = None,
) -> None:
    """Compare the pressure transducer with a reference gauge on the plugged tube.

    The bench makes the pressures; on a real one a person types what the gauge shows. Points of a
    dead-weight tester, taken by hand, come as a table with the columns kind (zero, up, down),
    reference_kpa and voltage_v. Ctrl-C vents the bench and keeps the points.

    Examples:

        rig calibrate pressure

        rig calibrate pressure --bench mega --reference "Druck DPI 104, cert. 123"
        --reference-u 0.025 --serial-number ADP5-07 --operator MK

        rig calibrate pressure --bench mega --points deadweight.csv --reference "tester" --reference-u 0.01
    """  # noqa: E501 (an example is one line)
    import numpy as np

    from rig.calibrate.transducer import COLUMNS, fit_transducer
    from rig.cli._calibration import new_task, order_of
    from rig.experiment.calibration.procedures import PressurePlan, pressure_points
    from rig.experiment.calibration.references import Standard

    task = new_task(
        "pressure", order_of(locals()), lambda r: Standard("simulated gauge", r.gauge_u)
    )
    targets = np.linspace(task.top_kpa / steps, task.top_kpa, steps).round(3)
    plan = PressurePlan(tuple(targets.tolist()), cycles)
    rows = task.rows(
        lambda bench, link, taken, stage: pressure_points(bench, link, plan, taken, stage),
        COLUMNS,
    )
    fit = fit_transducer(rows)
    method = "reference gauge on the plugged tube" if points is None else f"points of {points.name}"
    made = fit.calibration(
        rows,
        task.standard.u,
        task.provenance(f"{method}; least squares, line and parabola", task.bench.transducer.model),
    )
    curve = fit.curve
    task.finish(
        made,
        (
            f"gain {made.gain / 1e3:.5g} kPa/V, u = {100 * made.gain_u:.2g} %",
            f"bow {made.bow:+.2g} Pa in the middle of {made.span / 1e3:.4g} kPa, "
            f"u = {made.linearity_u:.2g} Pa",
            f"residuals {1e3 * curve.linear.sd:.2g} Pa about the line, "
            f"{1e3 * curve.quadratic.sd:.2g} Pa about the parabola; "
            f"hysteresis {1e3 * curve.hysteresis:+.2g} Pa; zero returns within "
            f"u = {made.zero_u:.2g} Pa",
        ),
        "transducer.calibration",
    )
