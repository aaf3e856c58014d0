"""`rig tune`: gains of the pressure loop from an identification, with margins."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rich.console import Console

    from rig.control.tune import Tuning

STEP_KPA = 8.0
"""The step whose motor limit is told."""
DRAWS = 30


@app.command()
def tune(
    identification: Annotated[
        Path, typer.Argument(help="Folder or `identification.json` of `rig identify`.")
    ],
    bandwidth: Annotated[
        float | None, typer.Option(help="Crossover of the slowest plant in Hz; default: the most.")
    ] = None,
    gain_margin: Annotated[float, typer.Option(help="At least, in dB.")] = 8.0,
    phase_margin: Annotated[float, typer.Option(help="At least, in deg.")] = 60.0,
    volume: Annotated[float, typer.Option(help="Gas volume may differ by this, in %.")] = 30.0,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results. Default: the identification's.")
    ] = None,
    write: Annotated[
        bool, typer.Option("--write", help="Write the gains to the board and have it keep them.")
    ] = False,
    port: Annotated[
        str | None, typer.Option(help="Of the board for --write; default: its bench's.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print machine-readable JSON.")] = False,
) -> None:
    """Find PI gains that keep their margins at every level and volume, and plot the loop.

    Writes `tuning.json`, `tuning.html`, and `gains.yaml` with its provenance, which `rig firmware
    parameters load` takes. A characterisation tells the board the gains of its bench file: copy
    them into its section `controller`.

    Example: `rig tune logs/identification --bandwidth 3`
    """
    import json

    import numpy as np
    from rich.console import Console

    from rig.board.parameter_file import format_parameters
    from rig.control.family import read_family
    from rig.control.loop import Gains
    from rig.control.tune import Wanted, margins_of_draws
    from rig.control.tune import tune as find_gains
    from rig.control.tuning_file import (
        GAINS_FILE,
        TUNING_FILE,
        board_gains,
        provenance,
        tuning_document,
    )
    from rig.link.schema import load_schema
    from rig.report.errors import ReportError
    from rig.report.tuning import write_tuning

    console = Console(stderr=as_json)
    family = read_family(identification)
    rules = load_schema().parameters
    wanted = Wanted(
        gain_margin,
        phase_margin,
        volume_share=volume / 100,
        bandwidth_hz=bandwidth,
        most=Gains(rules["proportional_ml_s_kpa"].high, rules["integral_ml_s2_kpa"].high),
    )
    tuning = find_gains(family, wanted)
    worst = tuning.single.worst
    level = next(one for one in family.levels if one.setpoint_kpa == worst.setpoint_kpa)
    drawn = margins_of_draws(level, worst, tuning.single.gains, DRAWS, family.seed)
    kept = (
        float(np.percentile([m.gain_db for m in drawn], 5)),
        float(np.percentile([m.phase_deg for m in drawn], 5)),
    )
    slow = float(np.mean([one.model.static_gain for one in family.levels]))
    document = tuning_document(family, tuning, STEP_KPA / slow)
    document["margins_kept_by_95_percent"] = {"gain_db": kept[0], "phase_deg": kept[1]}

    folder = out or (identification if identification.is_dir() else identification.parent)
    text = json.dumps(document, indent=2)
    gains = board_gains(tuning.single)
    commented = provenance(family, tuning) + format_parameters(gains, rules.values())
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / TUNING_FILE).write_text(text + "\n", encoding="utf-8")
        (folder / GAINS_FILE).write_text(commented, encoding="utf-8")
    except OSError as error:
        raise ReportError(
            f"{folder}: the gains cannot be written there: {error.strerror}. Choose another folder "
            "with --out."
        ) from error
    page = write_tuning(folder, family, tuning, kept)
    if write:
        _write(gains, family.bench, port, console)
    if as_json:
        typer.echo(text)
        return
    _show(console, tuning)
    motor = document["motor"]
    console.print(
        f"0 to {STEP_KPA:g} kPa takes about {motor['step_ml']:.1f} mL, and the motor at least "
        f"{motor['limit_s']:.2f} s.",
        soft_wrap=True,
    )
    console.print(f"tuning: {page}; gains: {folder / GAINS_FILE}", soft_wrap=True, markup=False)


def _write(gains: dict[str, float], bench: str, port: str | None, console: Console) -> None:
    from rig.cli._board import is_simulated, talking

    with talking(bench, port) as link:
        for name, value in gains.items():
            link.write_parameter(name, value)
        link.save_parameters()
    kept = "took" if is_simulated(bench, port) else "keeps"
    console.print(f"the board {kept} the gains", soft_wrap=True)


def _show(console: Console, tuning: Tuning) -> None:
    from rich.table import Table

    table = Table(
        "gains for",
        "kp\nmL/s/kPa",
        "ki\nmL/s²/kPa",
        "feed-\nforward",
        "gain\nmargin dB",
        "phase\nmargin deg",
        "delay\nmargin ms",
        "crossover\nHz",
    )
    rows = {"all levels": tuning.single} | {f"{p:g} kPa": d for p, d in tuning.schedule.items()}
    for name, design in rows.items():
        table.add_row(
            name,
            f"{design.gains.proportional:.3g}",
            f"{design.gains.integral:.3g}",
            f"{design.feed_forward:.3g}",
            f"{design.gain_db:.1f}",
            f"{design.phase_deg:.0f}",
            f"{1e3 * design.delay_s:.1f}",
            f"{design.bandwidth_hz:.2f}",
        )
    console.print(table)
    verdict = "pays" if tuning.schedule_pays else "does not pay"
    console.print(
        f"The design is bound by {tuning.single.bound_by}. A gain schedule {verdict}: it would "
        f"make the slowest crossover {tuning.schedule_gain:.2f} times as fast.",
        soft_wrap=True,
    )
