"""`rig fit-material`: from test data to a material file."""

from __future__ import annotations

from enum import StrEnum
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.cli.app import app

if TYPE_CHECKING:
    from rich.table import Table

    from rig.fitting.fit import EnergyFit
    from rig.fitting.prony import PronyFit
    from rig.fitting.ranking import Candidate, Ranking
    from rig.fitting.specimen import Specimen

DENSITY_GAP = "gap, chosen by us; the test data do not tell it: give --density"
POISSON_GAP = "gap, chosen by us; nearly incompressible, tests of one direction do not tell it"


class MeasuresOption(StrEnum):
    """Which columns to take."""

    AUTO = "auto"
    ENGINEERING = "engineering"
    TRUE = "true"


class WeightingOption(StrEnum):
    """What a residual counts."""

    ABSOLUTE = "absolute"
    RELATIVE = "relative"


@app.command("fit-material")
def fit_material(
    data: Annotated[
        list[Path] | None,
        typer.Argument(help="Files of uniaxial tests; several are several specimens."),
    ] = None,
    biaxial: Annotated[
        list[Path] | None, typer.Option(help="File of an equibiaxial test; may be repeated.")
    ] = None,
    planar: Annotated[
        list[Path] | None,
        typer.Option(help="File of a planar (pure shear) test; may be repeated."),
    ] = None,
    relaxation: Annotated[
        Path | None, typer.Option(help="File of a relaxation test: time and stress.")
    ] = None,
    prony_terms: Annotated[
        int | None, typer.Option(help="Terms of the Prony series; chosen by BIC if left out.")
    ] = None,
    energy: Annotated[
        list[str] | None, typer.Option(help="Energy to fit; may be repeated. Default: all.")
    ] = None,
    choose: Annotated[
        str | None,
        typer.Option(help="Energy to write. Default: the stable one that predicts best."),
    ] = None,
    region: Annotated[
        str | None, typer.Option(help="Engineering strains to fit, as 0:100 (in %) or '0:1.5 -'.")
    ] = None,
    measures: Annotated[
        MeasuresOption, typer.Option(help="Columns to take where a file has both.")
    ] = MeasuresOption.AUTO,
    average: Annotated[
        bool, typer.Option("--average", help="Fit the mean curve of the specimens.")
    ] = False,
    keep_outliers: Annotated[
        bool, typer.Option("--keep-outliers", help="Leave out neither points nor specimens.")
    ] = False,
    weighting: Annotated[
        WeightingOption,
        typer.Option(help="Least squares of stress differences, absolute or relative."),
    ] = WeightingOption.ABSOLUTE,
    stable_to: Annotated[
        float | None,
        typer.Option(help="Stretch to which the energy must be stable. Default: the longest one."),
    ] = None,
    modulus_at: Annotated[
        str, typer.Option(help="Strains in % for the equivalent (secant) modulus.")
    ] = "5,50,100",
    poisson: Annotated[float, typer.Option(help="Poisson's ratio of the material file.")] = 0.499,
    density: Annotated[
        str | None, typer.Option(help="As '1080 kg/m**3'; needs --density-source.")
    ] = None,
    density_source: Annotated[str | None, typer.Option(help="Where the density is from.")] = None,
    name: Annotated[str | None, typer.Option(help="Name of the material.")] = None,
    out: Annotated[Path | None, typer.Option(help="Material file (YAML) to write.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Plot to write: .svg, .png or .pdf.")] = None,
    seed: Annotated[int, typer.Option(help="Of the starting points.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print machine-readable JSON.")] = False,
) -> None:
    """Fit hyperelastic energies to test data and write a material file.

    All energies are fitted under Drucker stability, compared by AIC, BIC and by the error on data
    that were left out (specimens, or blocks of a single one), and the best or the chosen one is
    written with its provenance. Nothing is left out in silence.

    Examples: `rig fit-material dragon-skin-20.csv --region 0:200 --out dragon-skin-20.yaml`;
    `rig fit-material uni-1.csv uni-2.csv --biaxial bi.csv --planar shear.csv --plot fits.svg`
    """
    from rich.console import Console

    from rig.fitting.errors import FittingError
    from rig.fitting.families import families
    from rig.fitting.fit import Settings, Weighting
    from rig.fitting.material_file import Provenance, material_text
    from rig.fitting.prepare import Preparation, prepare
    from rig.fitting.prony import fit_prony, read_relaxation
    from rig.fitting.ranking import fit_all
    from rig.spec.quantity import to_si

    if not (data or biaxial or planar):
        raise typer.BadParameter("expected at least one file of a uniaxial, biaxial or planar test")
    known = families(_ratio(poisson))
    chosen = [known[_known(one, known)] for one in energy or known]
    if choose is not None and _known(choose, known) not in {family.name for family in chosen}:
        raise typer.BadParameter(f"--choose {choose} is not among the energies to fit")
    if density is not None and density_source is None:
        raise typer.BadParameter("--density needs --density-source: every number has a source")
    try:
        mass_density = to_si(density or "1070 kg/m**3", "kg/m**3")
    except ValueError as error:
        raise typer.BadParameter(f"--density: {error}") from None
    if stable_to is not None and not 1 < stable_to < inf:
        raise typer.BadParameter(f"--stable-to {stable_to:g}: expected a stretch above 1")
    strains = _strains(modulus_at)
    specimens = _read(data or [], biaxial or [], planar or [], measures)
    prepared = prepare(
        specimens,
        Preparation(_region(region), keep_outliers, average),
    )
    longest = max(s.longest for s in prepared.tested) if stable_to is None else stable_to
    settings = Settings(Weighting(weighting.value), seed=seed, stable_to=longest)
    ranking = fit_all(chosen, prepared.fitted, settings)
    if not ranking.candidates:
        raise FittingError(
            "no energy could be fitted: "
            + "; ".join(f"{family}: {why}" for family, why in ranking.failures.items())
        )
    best = _chosen(ranking, choose)
    fading = None if relaxation is None else fit_prony(read_relaxation(relaxation), prony_terms)
    moduli = _moduli(prepared.tested, best.fit, strains)
    notes = [*prepared.notes, *_unreached(strains, moduli)]
    if out is not None:
        about = Provenance(
            name or next((s.material for s in specimens if s.material), specimens[0].name),
            poisson,
            POISSON_GAP,
            mass_density,
            density_source or DENSITY_GAP,
            fading,
            "" if relaxation is None else relaxation.name,
        )
        _write(out, material_text(best.fit, prepared.tested, prepared.fitted, about))
    if plot is not None:
        from rig.fitting.plot import plot_fits

        title = name or specimens[0].material or specimens[0].name
        plot_fits(plot, title, prepared.fitted, [c.fit for c in ranking.candidates[:4]])
    if as_json:
        typer.echo(_as_json(notes, ranking, best, fading, moduli))
        return
    console = Console()
    for note in notes:
        console.print(f"note: {note}", soft_wrap=True, markup=False)
    console.print(_table(ranking))
    for family, why in ranking.failures.items():
        console.print(f"not fitted: {family}: {why}", soft_wrap=True, markup=False)
    for line in (*_best_lines(best), *_modulus_lines(moduli), *_fading_lines(fading)):
        console.print(line, soft_wrap=True, markup=False)
    for path in filter(None, (out, plot)):
        console.print(f"written: {path}", soft_wrap=True, markup=False)


def _ratio(poisson: float) -> float:
    if not -1 < poisson < 0.5:
        raise typer.BadParameter(f"--poisson {poisson:g}: expected above -1 and below 0.5")
    return poisson


def _known(name: str, known: dict[str, Any]) -> str:
    if name not in known:
        raise typer.BadParameter(f"'{name}' is no energy; expected one of {', '.join(known)}")
    return name


def _region(text: str | None) -> tuple[float, float] | None:
    """`0:100` in %, or with a unit, `0:1.5 -`; strains as plain numbers."""
    if text is None:
        return None
    bare, factor = text.strip(), 0.01
    if bare.endswith(("-", "%")):
        factor = 1.0 if bare.endswith("-") else 0.01
        bare = bare[:-1].strip()
    try:
        low, high = (factor * float(part) for part in bare.split(":"))
    except ValueError:
        raise typer.BadParameter(
            f"'{text}' is no region; expected LOW:HIGH in percent, as 0:100"
        ) from None
    return low, high


def _read(
    uniaxial: list[Path], biaxial: list[Path], planar: list[Path], measures: MeasuresOption
) -> list[Specimen]:
    from rig.fitting.tensile import Measures, read_specimens
    from rig.mechanics.hyperelastic import Mode

    wanted = None if measures is MeasuresOption.AUTO else Measures(measures.value)
    by_mode = {Mode.UNIAXIAL: uniaxial, Mode.EQUIBIAXIAL: biaxial, Mode.PLANAR: planar}
    return [
        specimen
        for mode, paths in by_mode.items()
        for path in paths
        for specimen in read_specimens(path, mode, wanted)
    ]


def _chosen(ranking: Ranking, choose: str | None) -> Candidate:
    from rig.fitting.errors import FittingError

    if choose is None:
        return ranking.best
    for candidate in ranking.candidates:
        if candidate.fit.family.name == choose:
            return candidate
    raise FittingError(f"{choose} could not be fitted: {ranking.failures[choose]}")


Moduli = list[tuple[str, float, float, float]]
"""Specimen, strain, equivalent modulus in Pa of the data and of the fitted energy."""


def _strains(text: str) -> list[float]:
    """`5,50` in % as plain numbers."""
    try:
        strains = [float(part) / 100 for part in text.split(",") if part.strip()]
    except ValueError:
        strains = [0.0]
    if not all(isfinite(strain) and strain != 0 for strain in strains):
        raise typer.BadParameter(f"--modulus-at '{text}': expected percents other than 0, as 5,50")
    return strains


def _moduli(specimens: tuple[Specimen, ...], found: EnergyFit, strains: list[float]) -> Moduli:
    """At all strains that a uniaxial specimen reaches."""
    from rig.fitting.specimen import secant_modulus
    from rig.mechanics.hyperelastic import Mode

    return [
        (s.name, strain, secant_modulus(s, strain), found.secant_modulus(strain))
        for s in specimens
        for strain in strains
        if s.mode is Mode.UNIAXIAL and s.stretch[0] - 1 <= strain <= s.longest - 1
    ]


def _unreached(strains: list[float], moduli: Moduli) -> list[str]:
    reached = {strain for _, strain, _, _ in moduli}
    return [
        f"no uniaxial specimen has a strain of {100 * strain:g} %: no equivalent modulus there."
        for strain in strains
        if strain not in reached
    ]


def _write(path: Path, text: str) -> None:
    from rig.fitting.errors import FittingError

    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise FittingError(
            f"the material cannot be written to {path}: {error.strerror}. Name a file in an "
            f"existing folder that you may write to."
        ) from None


def _table(ranking: Ranking) -> Table:
    from rich.table import Table

    table = Table(
        "energy",
        "RMSE\nkPa",
        "relative\n%",
        "left out\nkPa",
        "AIC",
        "BIC",
        "stable",
        "held",
        title="fits, best prediction of what was left out first",
    )
    for candidate in ranking.candidates:
        found = candidate.fit
        table.add_row(
            found.family.name,
            f"{found.rmse / 1e3:.3g}",
            f"{100 * found.relative_rmse:.3g}",
            _left_out(candidate),
            f"{found.aic:.0f}",
            f"{found.bic:.0f}",
            "yes" if found.stable else "no",
            "yes" if found.held else "",
        )
    return table


def _left_out(candidate: Candidate) -> str:
    validation = candidate.validation
    return "none" if isinstance(validation, str) else f"{validation.rmse / 1e3:.3g}"


def _best_lines(best: Candidate) -> list[str]:
    found = best.fit
    validation = best.validation
    lines = [f"{found.family.name}, {found.stability}:"]
    for i, c in enumerate(found.coefficients):
        factor, unit = (1e-3, " kPa") if c.is_modulus else (1.0, "")
        error = "not determined" if c.standard_error is None else f"{c.standard_error * factor:.2g}"
        scatter = None if isinstance(validation, str) else validation.jackknife[i]
        told = "" if scatter is None else f"; from specimen to specimen {scatter * factor:.2g}"
        lines.append(
            f"  {c.name} = {c.value * factor:.6g}{unit}, standard error {error}{unit}{told}"
        )
    lines += _correlations(found)
    if isinstance(validation, str):
        lines.append(f"  not cross-validated: {validation}")
    else:
        lines.append(
            f"  left out one {validation.left_out} at a time: "
            + ", ".join(f"{name} {error / 1e3:.3g} kPa" for name, error in validation.folds)
        )
    return lines


def _correlations(found: EnergyFit) -> list[str]:
    if found.correlation is None:
        return ["  the data do not determine all coefficients: no correlations"]
    names = [c.name for c in found.coefficients]
    strong = [
        f"{names[i]} and {names[j]} {found.correlation[i, j]:+.3f}"
        for i in range(len(names))
        for j in range(i)
        if abs(found.correlation[i, j]) > 0.9
    ]
    return [f"  strongly correlated: {', '.join(strong)}"] if strong else []


def _modulus_lines(moduli: Moduli) -> list[str]:
    return [
        f"equivalent modulus of {name} at {100 * strain:g} %: {modulus / 1e3:.4g} kPa, of the fit "
        f"{fitted / 1e3:.4g} kPa"
        for name, strain, modulus, fitted in moduli
    ]


def _fading_lines(fading: PronyFit | None) -> list[str]:
    if fading is None:
        return []
    lines = [
        f"relaxation: {len(fading.terms)} terms, {100 * fading.long_term:.4g} % of the stress "
        f"stays, RMSE {100 * fading.rmse:.3g} % of the instant stress"
    ]
    for term in fading.terms:
        errors = [
            "not determined" if e is None else f"{e:.2g}"
            for e in (term.weight_error, term.time_error)
        ]
        lines.append(
            f"  g = {term.weight:.5g} ({errors[0]}), tau = {term.time:.5g} s ({errors[1]} s)"
        )
    return lines


def _as_json(
    notes: list[str],
    ranking: Ranking,
    best: Candidate,
    fading: PronyFit | None,
    moduli: Moduli,
) -> str:
    import json
    from dataclasses import asdict

    content = {
        "notes": notes,
        "best": best.fit.family.name,
        "fits": [_plain(candidate) for candidate in ranking.candidates],
        "failures": ranking.failures,
        "equivalent_moduli": [
            {"specimen": n, "strain": strain, "modulus_pa": m, "fitted_pa": fitted}
            for n, strain, m, fitted in moduli
        ],
        "relaxation": None if fading is None else asdict(fading),
    }
    return json.dumps(content, indent=2)


def _plain(candidate: Candidate) -> dict[str, Any]:
    from dataclasses import asdict

    found, validation = candidate.fit, candidate.validation
    return {
        "energy": found.family.name,
        "coefficients": [asdict(c) for c in found.coefficients],
        "correlation": None if found.correlation is None else found.correlation.tolist(),
        "rmse_pa": found.rmse,
        "relative_rmse": found.relative_rmse,
        "points": found.points,
        "aic": found.aic,
        "bic": found.bic,
        "stable": found.stable,
        "stable_to": found.stable_to,
        "held": found.held,
        "cross_validation": validation if isinstance(validation, str) else asdict(validation),
    }
