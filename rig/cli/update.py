"""`rig update`: what a recorded run says of the actuator's modulus, wall and free parameter."""

from __future__ import annotations

from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rig.spec.workspace import Setup
    from rig.study.forward import Forward, Priors
    from rig.study.measured import Measured
    from rig.study.updating import Prediction, Update

_DEGREES = degrees(1)
"""Degrees a radian."""
_LOST = 5.0
"""Residuals over uncertainties above which a model may be another actuator's. Hysteresis, which no
model here knows, leaves three to five on the virtual bench: docs/theory/studies.md."""
_SHOWN = {
    "modulus": (1e-3, "kPa"),
    "wall": (1e3, "mm"),
    "free_parameter": (1.0, ""),
    "stiffening": (1.0, ""),
    "offset": (_DEGREES, "deg"),
    "creep": (100.0, "%"),
    "effective_modulus": (1e-3, "kPa"),
}


@app.command()
def update(
    run: Annotated[Path, typer.Argument(help="Folder of a recorded run.")],
    modulus: Annotated[
        float, typer.Option(help="Prior standard deviation of the modulus, in %.")
    ] = 5.0,
    wall: Annotated[
        float, typer.Option(help="Prior standard deviation of the wall thickness, in %.")
    ] = 2.0,
    free_parameter: Annotated[
        float, typer.Option(help="Prior standard deviation of b, in %.")
    ] = 5.0,
    creep: Annotated[
        float,
        typer.Option(
            help="Prior standard deviation of the share of the response still to come when levels "
            "were read, in %; of --study."
        ),
    ] = 3.0,
    hold_out: Annotated[
        str | None, typer.Option(help="Pressures in kPa to keep from the fit, as 3,7.")
    ] = None,
    predict: Annotated[
        Path | None, typer.Option(help="Another run of the same actuator, to be foretold.")
    ] = None,
    study: Annotated[
        Path | None,
        typer.Option(
            help="Study of modulus and wall whose surfaces answer instead of beam theory."
        ),
    ] = None,
    results: Annotated[
        Path | None, typer.Option(help="Folder of its results. Default: studies/NAME.")
    ] = None,
    mcmc: Annotated[
        int, typer.Option(min=0, help="Steps of a Markov chain (emcee) instead of a normal law.")
    ] = 0,
    seed: Annotated[int, typer.Option(help="Of the draws.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print machine-readable JSON.")] = False,
) -> None:
    """Estimate modulus, wall thickness and b of the actuator that a run measured.

    The beam model with an offset and softening is fitted to angles and forces of the run, with what
    material and printer promise as priors; what was held out, or another run, is foretold. With
    --study the response surfaces of a finished study, as of finite elements, take the place of beam
    theory; their error at the study's check points counts as uncertainty.

    Examples: `rig update logs/first --hold-out 3,7`;
    `rig update logs/first --study bellow-bending-fe`
    """
    import json

    import numpy as np

    from rig.record.reader import RunReader
    from rig.study.forward import BeamForward, Priors
    from rig.study.measured import read_measured, require_same_actuator, without_pressures
    from rig.study.updating import update_model

    setup = RunReader(run).setup()
    measured = read_measured(run)
    unseen: dict[str, Measured] = {}
    if hold_out is not None:
        measured, unseen["held out"] = without_pressures(measured, np.array(_pressures(hold_out)))
    if predict is not None:
        require_same_actuator(setup, RunReader(predict).setup())
        unseen[str(predict)] = read_measured(predict)
    priors = Priors(modulus / 100, wall / 100, free_parameter / 100, creep=creep / 100)
    forward: Forward = (
        BeamForward.of(setup.actuator, setup.material, priors)
        if study is None
        else _surfaces(study, results, setup, priors)
    )
    beyond = measured.count - forward.covered(measured).count
    found = update_model(forward, forward.covered(measured), mcmc=mcmc, seed=seed)
    unseen = {name: forward.covered(levels) for name, levels in unseen.items()}
    foretold = {name: found.predict(levels) for name, levels in unseen.items()}
    if as_json:
        told = {**_plain(found, foretold), "levels_left_out": beyond}
        typer.echo(json.dumps(told, indent=2))
        return
    if beyond:
        typer.echo(f"{beyond} levels are left out: the study has no answers at their pressures.")
    _show(found, foretold)


def _surfaces(file: Path, results: Path | None, setup: Setup, priors: Priors) -> Forward:
    from rig.spec.workspace import Workspace
    from rig.study.plan import make_plan
    from rig.study.results import Folder
    from rig.study.run import known_study
    from rig.study.surrogate import SurfaceForward

    workspace = Workspace.find()
    plan = make_plan(workspace.path("study", file), workspace)
    folder = Folder(results or Path("studies") / plan.spec.name)
    return SurfaceForward.of(known_study(plan, folder), setup.actuator, setup.material, priors)


def _pressures(text: str) -> list[float]:
    try:
        return [1e3 * float(part) for part in text.split(",")]
    except ValueError:
        raise typer.BadParameter(
            f"--hold-out '{text}': expected pressures in kPa, as 3,7"
        ) from None


def _plain(found: Update, foretold: dict[str, tuple[Prediction, Prediction]]) -> dict[str, Any]:
    return {
        "estimates": {
            one.name: {
                "prior": one.prior,
                "prior_deviation": one.prior_deviation,
                "value": one.value,
                "deviation": one.deviation,
                "interval_95": one.interval(),
            }
            for one in found.estimates
        },
        "correlation": found.correlation.tolist(),
        "chi2_reduced": found.chi2_reduced,
        "at_bounds": found.at_bounds,
        "foretold": {
            name: {
                kind: {"levels": p.mean.size, "rmse": p.rmse, "beyond": p.beyond}
                for kind, p in zip(("angle_rad", "force_n"), both, strict=True)
                if p.mean.size
            }
            for name, both in foretold.items()
        },
    }


def _show(found: Update, foretold: dict[str, tuple[Prediction, Prediction]]) -> None:
    from rich.console import Console
    from rich.table import Table

    from rig.mechanics.table import GRAM_FORCE

    console = Console()
    table = Table("parameter", "before", "after", "95 %", "unit")
    for one in found.estimates:
        factor, unit = _SHOWN[one.name]
        low, high = one.interval()
        table.add_row(
            one.name.replace("_", " "),
            f"{one.prior * factor:.4g} ± {one.prior_deviation * factor:.2g}",
            f"{one.value * factor:.4g} ± {one.deviation * factor:.2g}",
            f"{low * factor:.4g} to {high * factor:.4g}",
            unit,
        )
    console.print(table)
    console.print(
        f"residuals over their uncertainties: {found.chi2_reduced**0.5:.2g} RMS", soft_wrap=True
    )
    if found.chi2_reduced**0.5 > _LOST:
        console.print(
            "the model does not follow this run: its parameters stand for something else, and "
            "their intervals may not hold the truth; take a model that knows more of this actuator",
            soft_wrap=True,
        )
    for name in found.at_bounds:
        console.print(
            f"{name.replace('_', ' ')} is at the edge of what the model is good for: its interval "
            f"means nothing; widen the study's levels, or look for what else the run has",
            soft_wrap=True,
        )
    for name, (angles, forces) in foretold.items():
        for kind, p, factor, unit in (
            ("angle", angles, _DEGREES, "deg"),
            ("force", forces, 1 / GRAM_FORCE, "g"),
        ):
            if p.mean.size:
                console.print(
                    f"{name}, {kind}: {p.mean.size} levels foretold with an RMSE of "
                    f"{p.rmse * factor:.3g} {unit}; {p.beyond} beyond twice the uncertainty",
                    soft_wrap=True,
                    markup=False,
                )
