"""The page of an identification: models, how well they fit, and what physics says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.control.family import Family, IdentifiedLevel
from rig.control.identify import WHITENESS_LAGS, Fit
from rig.experiment.identification import Analysis
from rig.report.charts import (
    COLOURS,
    MODEL_LINES,
    TALL,
    Chart,
    finished,
    legend_below,
    stacked,
    styled,
)
from rig.report.sheet import Banner, Sheet, write_sheet
from rig.report.sheet_parts import Section, Table
from rig.report.words import significant

Array = NDArray[np.float64]
PAGE_FILE = "identification.html"
WHITE_P = 0.01
"""A p-value below this says that a residual is not white."""


def write_identification(folder: Path, analysis: Analysis) -> Path:
    """Write `identification.html` into `folder`; returns its path."""
    path = folder / PAGE_FILE
    write_sheet(path, _sheet(analysis))
    return path


def _sheet(analysis: Analysis) -> Sheet:
    family = analysis.family
    levels = family.levels
    worst = min(levels, key=lambda level: level.fit_percent)
    white = sum(level.whiteness_p >= WHITE_P for level in levels)
    return Sheet(
        title=f"{len(levels)} linear models of the pressure system",
        eyebrow=f"Identification of {family.actuator} on bench {family.bench}, seed {family.seed}",
        headline=(
            f"The models explain at least {worst.fit_percent:.1f} % of what the pressure did; the "
            f"residual is {1e3 * family.noise_kpa:.1f} Pa at most.",
            f"At {white} of {len(levels)} levels it is white (Ljung and Box over "
            f"{WHITENESS_LAGS} lags, 1 %).",
        ),
        banners=_banners(family),
        sections=(
            Section(
                "Models",
                (
                    "From reported plunger volume to reported pressure: direct gain, first-order "
                    "terms (gas warming, creep, shape), delay, behind a backlash. One standard "
                    "deviation after ±.",
                ),
                (_models_table(levels),),
                (
                    (
                        bode_chart("plant", family),
                        "Gain and phase of the models; crosses are what the relay measured.",
                    ),
                ),
            ),
            Section(
                "Quality",
                ("The relay's record was not fitted to: the models foretell it.",),
                (_quality_table(levels),),
                tuple(_fit_figures(fit) for fit in _lowest_and_highest(analysis)),
            ),
            Section(
                "Against physics",
                (
                    "Boyle's law with the volumes of the bench's drawing and the growth of the "
                    "cavity that beam theory predicts. The slow gain is compared with isothermal, "
                    "the gain at the relay's frequency with adiabatic gas.",
                ),
                (_physics_table(levels),),
            ),
        ),
    )


def _lowest_and_highest(analysis: Analysis) -> tuple[Fit, ...]:
    return analysis.fits if len(analysis.fits) < 2 else (analysis.fits[0], analysis.fits[-1])


def _banners(family: Family) -> tuple[Banner, ...]:
    coloured = [level for level in family.levels if level.whiteness_p < WHITE_P]
    if not coloured:
        return ()
    where = ", ".join(f"{level.setpoint_kpa:g}" for level in coloured)
    return (
        Banner(
            "note",
            "Residual not white.",
            f"At {where} kPa something small is left that a linear model with backlash does not "
            "describe, as hysteresis of the elastomer.",
        ),
    )


def _models_table(levels: tuple[IdentifiedLevel, ...]) -> Table:
    def shown(level: IdentifiedLevel, name: str, scale: float = 1.0) -> str:
        one = level.estimates.get(name)
        if one is None:
            return "-"
        return f"{scale * one.value:.3g} ± {scale * one.deviation:.1g}"

    terms = range(1, 1 + max(len(level.gains) for level in levels))
    modes = range(1, 1 + max(len(level.modes) for level in levels))
    columns = [("level", "kPa"), ("direct gain", "kPa/mL")]
    for index in terms:
        columns += [(f"gain {index}", "kPa/mL"), (f"time {index}", "s")]
    for index in modes:
        columns += [
            (f"mode gain {index}", "kPa/mL"),
            (f"mode frequency {index}", "rad/s"),
            (f"mode damping {index}", ""),
        ]
    columns += [("delay", "ms"), ("backlash", "µL")]
    rows = [
        (
            f"{level.setpoint_kpa:g}",
            shown(level, "direct gain"),
            *(shown(level, f"{what} {i}") for i in terms for what in ("gain", "time constant")),
            *(
                shown(level, f"mode {what} {j}")
                for j in modes
                for what in ("gain", "frequency", "damping")
            ),
            shown(level, "delay", 1e3),
            shown(level, "backlash", 1e3),
        )
        for level in levels
    ]
    return Table(columns, rows)


def _quality_table(levels: tuple[IdentifiedLevel, ...]) -> Table:
    columns = [
        ("level", "kPa"),
        ("fit (1 - NRMSE)", "%"),
        ("relay foretold", "%"),
        ("residual", "Pa"),
        ("whiteness p", ""),
        ("terms", ""),
    ]
    rows = [
        (
            f"{level.setpoint_kpa:g}",
            f"{level.fit_percent:.2f}",
            f"{level.relay.fit_percent:.2f}",
            f"{1e3 * level.noise_kpa:.2f}",
            significant(level.whiteness_p, 2),
            str(len(level.gains)),
        )
        for level in levels
    ]
    return Table(columns, rows)


def _physics_table(levels: tuple[IdentifiedLevel, ...]) -> Table:
    columns = [
        ("level", "kPa"),
        ("slow gain", "kPa/mL"),
        ("isothermal", "kPa/mL"),
        ("difference", "%"),
        ("quick gain", "kPa/mL"),
        ("adiabatic", "kPa/mL"),
        ("delay", "ms"),
        ("tick and filter", "ms"),
    ]
    rows = [
        (
            f"{level.setpoint_kpa:g}",
            f"{level.physics.identified_slow:.4f} ± {level.physics.identified_slow_deviation:.4f}",
            f"{level.physics.isothermal:.4f}",
            f"{100 * (level.physics.identified_slow / level.physics.isothermal - 1):+.1f}",
            f"{level.physics.identified_quick:.4f}",
            f"{level.physics.adiabatic:.4f}",
            f"{1e3 * level.delay_s:.1f}",
            f"{1e3 * level.physics.known_delay_s:.1f}",
        )
        for level in levels
    ]
    return Table(columns, rows)


@styled
def bode_chart(name: str, family: Family) -> Chart:
    """Gain and phase of every model of the family, with the relay's points."""
    figure, (gain, phase) = stacked(TALL, (1, 1))
    omega = np.geomspace(0.05, 150.0, 300)
    for number, level in enumerate(family.levels):
        colour = COLOURS[f"series-{number % 5 + 1}"]
        line = MODEL_LINES[number % 4]
        response = level.model.response(omega)
        label = f"{level.setpoint_kpa:g} kPa"
        gain.loglog(omega, np.abs(response), line, color=colour, lw=1.4, label=label)
        phase.semilogx(omega, np.angle(response, deg=True), line, color=colour, lw=1.4)
        relay = level.relay
        gain.plot(relay.omega, relay.magnitude, "x", color=colour)
        phase.plot(relay.omega, relay.phase_deg, "x", color=colour)
    gain.set_ylabel("gain (kPa/mL)")
    phase.set_ylabel("phase (deg)")
    phase.set_xlabel("frequency (rad/s)")
    legend_below(figure, columns=5)
    return finished(figure, name, "Gain and phase against frequency, one curve for each pressure.")


def _fit_figures(fit: Fit) -> tuple[Chart, str]:
    chart = _fit_chart(f"fit-{fit.model.level_kpa:.0f}", fit)
    return chart, (
        f"At {fit.model.level_kpa:.1f} kPa: what was measured, what the model makes of the same "
        "plunger movement, and the difference."
    )


@styled
def _fit_chart(name: str, fit: Fit) -> Chart:
    figure, (level, rest) = stacked(TALL, (2, 1))
    time_s = fit.time_s - fit.time_s[0]
    level.plot(time_s, fit.measured_kpa, color=COLOURS["series-1"], lw=1.0, label="measured")
    level.plot(time_s, fit.simulated_kpa, "--", color=COLOURS["series-2"], lw=1.0, label="model")
    rest.plot(time_s, 1e3 * fit.residual_kpa, color=COLOURS["muted"], lw=0.6)
    level.set_ylabel("pressure (kPa)")
    rest.set_ylabel("residual (Pa)")
    rest.set_xlabel("time (s)")
    level.legend(loc="upper right", frameon=False, ncols=2)
    return finished(figure, name, "Measured and simulated pressure, and their difference.")
