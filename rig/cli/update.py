"""`rig update`: what a recorded run says of the actuator's modulus, wall and free parameter."""

from __future__ import annotations

from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rig.study.updating import Measured, Prediction, Update

_DEGREES = degrees(1)
"""Degrees a radian."""
_SHOWN = {
    "modulus": (1e-3, "kPa"),
    "wall": (1e3, "mm"),
    "free_parameter": (1.0, ""),
    "stiffening": (1.0, ""),
    "offset": (_DEGREES, "deg"),
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
    hold_out: Annotated[
        str | None, typer.Option(help="Pressures in kPa to keep from the fit, as 3,7.")
    ] = None,
    predict: Annotated[
        Path | None, typer.Option(help="Another run of the same actuator, to be foretold.")
    ] = None,
    mcmc: Annotated[
        int, typer.Option(min=0, help="Steps of a Markov chain (emcee) instead of a normal law.")
    ] = 0,
    seed: Annotated[int, typer.Option(help="Of the draws.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print machine-readable JSON.")] = False,
) -> None:
    """Estimate modulus, wall thickness and b of the actuator that a run measured.

    The beam model with an offset and softening is fitted to angles and forces of the run, with what
    material and printer promise as priors; what was held out, or another run, is foretold.

    Example: `rig update logs/first --hold-out 3,7`
    """
    import json

    import numpy as np

    from rig.record.reader import RunReader
    from rig.study.updating import (
        Priors,
        read_measured,
        require_same_actuator,
        update_model,
        without_pressures,
    )

    setup = RunReader(run).setup()
    measured = read_measured(run)
    unseen: dict[str, Measured] = {}
    if hold_out is not None:
        measured, unseen["held out"] = without_pressures(measured, np.array(_pressures(hold_out)))
    if predict is not None:
        require_same_actuator(setup, RunReader(predict).setup())
        unseen[str(predict)] = read_measured(predict)
    priors = Priors(modulus / 100, wall / 100, free_parameter / 100)
    found = update_model(setup.actuator, setup.material, measured, priors, mcmc=mcmc, seed=seed)
    foretold = {name: found.predict(levels) for name, levels in unseen.items()}
    if as_json:
        typer.echo(json.dumps(_plain(found, foretold), indent=2))
    else:
        _show(found, foretold)


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
