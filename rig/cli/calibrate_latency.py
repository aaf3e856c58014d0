"""`rig calibrate latency`: how long a frame is under way, from an actuator that swings."""

from __future__ import annotations

from typing import Annotated

import typer

from rig.cli import _calibration_options as options
from rig.cli.calibrate import calibrate


@calibrate.command()
def latency(
    bench: options.Bench = "virtual",
    actuator: Annotated[str, typer.Option(help="What hangs there: a name or a file.")] = (
        "bellow-bending"
    ),
    seed: options.Seed = 1,
    cycles: Annotated[int, typer.Option(min=1, help="Swings at each of both rates.")] = 3,
    frames: Annotated[int, typer.Option(min=6, help="On each way of a swing.")] = 20,
    lag_ms: Annotated[
        float, typer.Option(min=0, help="By which damping lets the actuator follow late.")
    ] = 20.0,
    lag_u_ms: Annotated[
        float, typer.Option(min=0, help="Its standard uncertainty; as it stands: 0 to 40 ms.")
    ] = 12.0,
    out: options.Out = None,
    operator: options.Operator = "",
) -> None:
    """Find how long after its exposure a frame of the bench's camera arrives.

    The actuator swings slowly and fast; angles are laid over pressures. How late the tube lets it
    follow is worked out from what the plunger pushes. How late its damping does looks like latency
    and is not measured: 2 zeta / omega, say it if you know it better, as from a film of it swinging
    out. The result is the bench's camera calibration with the latency in it;
    a new lens calibration needs its latency anew.

    Examples:

        rig calibrate latency --bench virtual-beam

        rig calibrate latency --bench mega --lag-ms 12 --lag-u-ms 3 --operator MK
    """
    from pathlib import Path

    from rich.console import Console

    from rig.calibrate.latency import CREEP, TRANSDUCER, Lag, Swing, fit_latency, tube_lag
    from rig.cli._calibration_file import finish, provenance, surroundings
    from rig.cli._interruption import catching_signals
    from rig.cli._session import new_session
    from rig.experiment.calibration.latency import SwingPlan, swing_actuator, swing_meter
    from rig.experiment.calibration.session import calibrate_on
    from rig.spec.workspace import Workspace

    console = Console()

    def stage(text: str) -> None:
        console.print(text, markup=False, style="bold")

    session = new_session(Path(actuator), bench, "default", seed, expired=True)
    request, setup = session.request, session.request.setup
    spec, known = setup.bench, setup.calibrations
    plan = SwingPlan.below(
        min(setup.actuator.limits.pressure, spec.safety.pressure) / 1e3, cycles, frames
    )
    meter = swing_meter(setup)
    known_s = known.camera.latency_s(spec.camera.latency)
    swings: list[Swing] = []
    opened = session.open_without_log()
    try:
        with catching_signals() as interruption:
            calibrate_on(
                opened,
                request.board_parameters(),
                lambda link: swings.append(
                    swing_actuator(opened, link, meter, plan, known_s, stage)
                ),
                stage,
                interruption.check,
            )
    finally:
        opened.close()
    drive = known.syringe
    dead_volume = spec.syringe.dead_volume if drive is None else drive.dead_volume
    damping = Lag("damping", lag_ms / 1e3, lag_u_ms / 1e3)
    lags = (damping, tube_lag(swings[0], spec, dead_volume), TRANSDUCER, CREEP)
    fit = fit_latency(swings[0], lags)
    budget = [f"{lag.cause} {1e3 * lag.value_s:.1f} ms, u = {1e3 * lag.u_s:.1f} ms" for lag in lags]
    found = fit.latency(
        provenance(
            method=f"actuator {setup.actuator.name} swung between {plan.low_kpa:.3g} and "
            f"{plan.high_kpa:.3g} kPa, {len(swings[0].frame_s)} frames over pressure",
            instrument=known.camera.provenance.instrument,
            serial_number=known.camera.provenance.serial_number,
            operator=operator,
            valid_days=None,
            environment=surroundings(spec, spec.simulated),
            reference=f"pressure transducer of the bench; angles follow it by: {'; '.join(budget)}",
            simulated=spec.simulated,
        )
    )
    console.print(
        f"delay of angle behind pressure {1e3 * fit.fit['delay']:.1f} ms, "
        f"u = {1e3 * fit.fit.u({'delay': 1.0}):.1f} ms; less",
        *(f"  {line}" for line in budget),
        f"latency {1e3 * found.value:.1f} ms, u = {1e3 * found.u:.1f} ms",
        sep="\n",
        highlight=False,
    )
    made = known.camera.model_copy(update={"latency": found})
    finish(console, Workspace.find(), made, out, "camera.calibration")
