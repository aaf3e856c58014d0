"""`rig calibrate pressure`: the transducer against a gauge or a dead-weight tester."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli import _calibration_options as options
from rig.cli.calibrate import calibrate

if TYPE_CHECKING:
    from rig.spec.bench import VirtualReferences


@calibrate.command()
def pressure(
    bench: options.Bench = "virtual",
    seed: options.Seed = 1,
    steps: Annotated[int, typer.Option(min=5, max=100, help="Pressures on the way up.")] = 14,
    cycles: Annotated[int, typer.Option(min=1, max=20, help="Ways up and down.")] = 2,
    piston_area_mm2: Annotated[
        float | None,
        typer.Option(min=1, help="Of a dead-weight tester; default: a gauge is the reference."),
    ] = None,
    piston_area_u: Annotated[
        float, typer.Option(min=0, help="Its relative standard uncertainty, per cent.")
    ] = 0.01,
    piston_g: Annotated[float, typer.Option(min=0, help="Piston and carrier, grams.")] = 0.0,
    gravity: Annotated[
        float | None,
        typer.Option(min=9.7, max=9.9, help="Of the lab, m/s2; a real tester needs it."),
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
    """Compare the pressure transducer with a reference gauge on the plugged tube.

    The bench makes the pressures; on a real one a person types what the gauge shows, or, with
    --piston-area-mm2, the masses with which the piston of a dead-weight tester floats: buoyancy and
    local gravity are taken into account, and --reference is the set of masses. Points taken by hand
    come as a table with the columns kind (zero, up, down), reference_kpa and voltage_v. Ctrl-C vents
    the bench and keeps the points.

    Examples:

        rig calibrate pressure

        rig calibrate pressure --bench mega --reference "Druck DPI 104, cert. 123"
        --reference-u 0.025 --serial-number ADP5-07 --operator MK

        rig calibrate pressure --bench mega --piston-area-mm2 80.65 --piston-area-u 0.005 --piston-g 7.3
        --gravity 9.8118 --reference "M1 set, cert. 77" --reference-u 0.003

        rig calibrate pressure --bench mega --points deadweight.csv --reference "tester" --reference-u 0.01
    """  # noqa: E501 (an example is one line)
    import numpy as np

    from rig.calibrate.dead_weight import Piston
    from rig.calibrate.transducer import COLUMNS, fit_transducer
    from rig.cli._calibration import new_task, order_of
    from rig.experiment.calibration.procedures import PressurePlan, pressure_points
    from rig.experiment.calibration.references import Standard
    from rig.spec.quantity import STANDARD_GRAVITY

    def simulated(r: VirtualReferences) -> Standard:
        if piston_area_mm2 is None:
            return Standard("simulated gauge", r.gauge_u)
        return Standard("simulated masses", r.mass_u)

    task = new_task("pressure", order_of(locals()), simulated)
    targets = np.linspace(task.top_kpa / steps, task.top_kpa, steps).round(3)
    plan = PressurePlan(tuple(targets.tolist()), cycles)
    piston = None
    scale_u, method = task.standard.u, "reference gauge on the plugged tube"
    if piston_area_mm2 is not None:
        if gravity is None and not task.simulated:
            raise typer.BadParameter("a real dead-weight tester needs --gravity, that of the lab")
        local = STANDARD_GRAVITY if gravity is None else gravity
        piston = Piston(piston_area_mm2, piston_area_u / 100, piston_g, local)
        if piston.masses_g(plan.targets_kpa[0]) <= 0:
            raise typer.BadParameter(
                f"the piston alone makes {piston.pressure_kpa(0):.3g} kPa, more than the lowest "
                f"pressure, {plan.targets_kpa[0]:.3g} kPa; take fewer --steps or a larger piston"
            )
        scale_u = float(np.hypot(task.standard.u, piston.area_u))
        method = (
            f"dead-weight tester on the plugged tube, {piston.area_mm2:g} mm2 "
            f"(u = {piston_area_u:g} %), piston {piston_g:g} g, gravity {local:g} m/s2"
        )
    rows = task.rows(
        lambda bench, link, taken, stage: pressure_points(bench, link, plan, taken, stage, piston),
        COLUMNS,
    )
    fit = fit_transducer(rows)
    if points is not None:
        method = f"points of {points.name}"
    made = fit.calibration(
        rows,
        scale_u,
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
