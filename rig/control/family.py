"""The identified family as a document: what `rig identify` writes and `rig tune` reads."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from rig.control.errors import ControlError
from rig.control.identify import LevelModel, Mode

FAMILY_FILE = "identification.json"
Fluid = Literal["gas", "liquid"]


class _Document(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Estimate(_Document):
    """A fitted parameter and its standard deviation."""

    value: float
    deviation: float
    unit: str


class RelayCheck(_Document):
    """The frequency response that a relay measured, beside that of the model."""

    omega: float
    """rad/s."""
    magnitude: float
    """kPa/mL."""
    deviation: float
    phase_deg: float
    model_magnitude: float
    model_phase_deg: float
    fit_percent: float
    """Of the relay's pressure as the model foretells it; it was not fitted to."""


class PhysicsCheck(_Document):
    """The physical linearisation beside the model; gains in kPa/mL."""

    gas_volume_ml: float
    """Of a liquid that of the air in it."""
    compliance_ml_kpa: float | None
    """As predicted; None if no prediction gives a volume."""
    isothermal: float
    adiabatic: float
    """Of a liquid the isothermal one: it holds the temperature of its bubbles."""
    identified_slow: float
    """The model's static gain."""
    identified_slow_deviation: float
    identified_quick: float
    """The model's gain at the relay's frequency, too quick for most of the heat."""
    known_delay_s: float
    """What the firmware's tick and filter amount to."""


class IdentifiedLevel(_Document):
    """The model at one pressure with all that speaks for and against it."""

    setpoint_kpa: float
    level_kpa: float
    plunger_ml: float
    direct: float
    gains: tuple[float, ...]
    times_s: tuple[float, ...]
    delay_s: float
    backlash_ml: float
    modes: tuple[Mode, ...] = ()
    estimates: dict[str, Estimate]
    covariance: tuple[tuple[float, ...], ...]
    """Of the estimates in their order."""
    samples: int
    noise_kpa: float
    """Standard deviation of the residual."""
    fit_percent: float
    whiteness_p: float
    criteria: dict[int, float]
    """Bayesian information criterion by number of terms."""
    relay: RelayCheck
    physics: PhysicsCheck

    @property
    def model(self) -> LevelModel:
        """The model itself."""
        return LevelModel(
            self.level_kpa,
            self.plunger_ml,
            self.direct,
            self.gains,
            self.times_s,
            self.delay_s,
            self.backlash_ml,
            self.modes,
        )


class Family(_Document):
    """Models of one bench with one actuator, by ascending pressure."""

    actuator: str
    bench: str
    board: str
    fluid: Fluid = "gas"
    seed: int
    created: str | None
    versions: dict[str, str]
    parameters: dict[str, float]
    """Of the board while it was identified."""
    levels: tuple[IdentifiedLevel, ...]

    @property
    def noise_kpa(self) -> float:
        """Of reported pressure: the largest of the levels'."""
        return max(level.noise_kpa for level in self.levels)

    @property
    def models(self) -> tuple[LevelModel, ...]:
        """One for each level."""
        return tuple(level.model for level in self.levels)


def read_family(path: Path) -> Family:
    """The family in a file, or in a run folder; raises ControlError if there is none."""
    file = path / FAMILY_FILE if path.is_dir() else path
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ControlError(
            f"{file}: no identification can be read here ({error}). Give the folder or the "
            f"{FAMILY_FILE} that `rig identify` wrote."
        ) from error
    try:
        return Family.model_validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ControlError(
            f"{file}: this is no identification: {where}: {first['msg']}. Identify again with "
            "`rig identify`."
        ) from error
