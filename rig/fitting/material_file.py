"""A fitted energy as a material file that is ready to use, every number with where it came from."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import ValidationError

from rig import __version__
from rig.fitting.errors import FittingError
from rig.fitting.fit import EnergyFit
from rig.fitting.prony import PronyFit
from rig.fitting.specimen import Specimen
from rig.mechanics.hyperelastic import Mode, shear_modulus_at_rest
from rig.spec.explain import first_problem
from rig.spec.material import MaterialSpec

_DIGITS = 6
"""Of coefficients; far more than any test determines."""


@dataclass(frozen=True)
class Provenance:
    """What the test data do not tell."""

    name: str
    poisson_ratio: float
    poisson_source: str
    density: float
    """In kg/m3."""
    density_source: str
    relaxation: PronyFit | None = None
    relaxation_source: str = ""


def material_text(
    found: EnergyFit, tested: Sequence[Specimen], fitted: Sequence[Specimen], about: Provenance
) -> str:
    """YAML of kind `material`; `tested` are whole specimens, `fitted` what was left for the fit.

    Validated before it is returned. Strength and elongation at break are the range of the
    specimens' largest stress and strain in uniaxial tension. Raises FittingError where the numbers
    make no material.
    """
    data = _content(found, tested, fitted, about)
    try:
        MaterialSpec.model_validate(data)
    except ValidationError as error:
        raise FittingError(
            f"the fit makes no material file: {first_problem(error)}. Correct what it is made of, "
            f"or choose another energy."
        ) from None
    from ruamel.yaml import YAML

    yaml = YAML()
    yaml.width = 10_000
    yaml.indent(mapping=2, sequence=4, offset=2)
    text = io.StringIO()
    yaml.dump(data, text)
    return "# yaml-language-server: $schema=../schemas/material.json\n" + text.getvalue()


def _content(
    found: EnergyFit, tested: Sequence[Specimen], fitted: Sequence[Specimen], about: Provenance
) -> dict[str, Any]:
    files = ", ".join(dict.fromkeys(s.source for s in tested))
    low = min(float(s.stretch[0]) for s in fitted) - 1
    high = max(s.longest for s in fitted) - 1
    modes = " and ".join(dict.fromkeys(str(s.mode) for s in fitted))
    source = (
        f"rig {__version__}, least squares fit of {found.family.name} to {modes} tests at strains "
        f"from {low:.4g} to {high:.4g} ({files}; {len(fitted)} curves, {found.points} points); "
        f"RMSE {found.rmse / 1e3:.4g} kPa; {found.stability}"
    )
    young = 2 * (1 + about.poisson_ratio) * shear_modulus_at_rest(found.energy)
    content: dict[str, Any] = {
        "kind": "material",
        "name": about.name,
        "description": f"Fitted to {files}",
        "young_modulus": {
            "value": _kilopascals(young),
            "source": f"at rest, of the energy below and the Poisson's ratio; {source}",
        },
        "poisson_ratio": {"value": about.poisson_ratio, "source": about.poisson_source},
        "density": {"value": f"{about.density:g} kg/m**3", "source": about.density_source},
    }
    pulled = [
        s for s in tested if s.mode is Mode.UNIAXIAL and s.longest > 1 and np.max(s.stress) > 0
    ]
    if pulled:
        strengths = [float(np.max(s.stress)) for s in pulled]
        breaks = [s.longest - 1 for s in pulled]
        where = f"largest of each of {len(pulled)} uniaxial curves ({files})"
        content["tensile_strength"] = {
            "low": f"{min(strengths) / 1e6:.4g} MPa",
            "high": f"{max(strengths) / 1e6:.4g} MPa",
            "source": f"nominal stress, {where}",
        }
        content["elongation_at_break"] = {
            "low": f"{100 * min(breaks):.4g} %",
            "high": f"{100 * max(breaks):.4g} %",
            "source": f"engineering strain, {where}",
        }
    section = found.family.section(found.values, source)
    content["hyperelastic"] = _in_lab_units(section.model_dump(exclude_none=True))
    if about.relaxation is not None:
        content["relaxation"] = {
            "terms": [
                {
                    "weight": float(f"{term.weight:.{_DIGITS}g}"),
                    "time": f"{term.time:.{_DIGITS}g} s",
                }
                for term in about.relaxation.terms
            ],
            "source": f"rig {__version__}, least squares fit of {about.relaxation_source}; RMSE "
            f"{100 * about.relaxation.rmse:.3g} % of the instant stress",
        }
    return content


def _in_lab_units(section: dict[str, Any]) -> dict[str, Any]:
    """Moduli in kPa; shape parameters and words stay."""
    shapes = {"alpha", "locking_stretch"}
    result: dict[str, Any] = {}
    for name, value in section.items():
        if name == "terms":
            result[name] = [_in_lab_units(term) for term in value]
        elif isinstance(value, float):
            result[name] = float(f"{value:.{_DIGITS}g}") if name in shapes else _kilopascals(value)
        else:
            result[name] = value
    return result


def _kilopascals(value: float) -> str:
    return f"{value / 1e3:.{_DIGITS}g} kPa"
