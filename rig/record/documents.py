"""What a run says about itself: start, points and stop, after the manner of Bluesky.

Times are bench times in seconds since the run began; units are those that labs speak.
"""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict

from rig.spec.measurand import DeformationUnit

ExperimentName = Literal["deformation", "blocked_force"]
Direction = Literal["up", "down"]
ExitStatus = Literal["success", "aborted", "failed"]


class Document(BaseModel):
    """A frozen record that survives a round trip through JSON, which knows no NaN."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class StartDocument(Document):
    """What the run set out to do; the specs themselves are attachments."""

    actuator: str
    bench: str
    board: str
    protocol: str
    material: str
    seed: int
    created: str | None
    """ISO date and time on a real bench; None in simulated time, where it would mean nothing."""
    versions: dict[str, str]
    """rig, firmware, protocol, python, and the libraries the numbers depend on."""
    parameters: dict[str, float]
    """Parameters in force on the board, read back; names carry their units."""


class PointKey(Document):
    """Which point of which sweep."""

    experiment: ExperimentName
    repeat: int
    """1 for the first sweep."""
    direction: Direction
    target_kpa: float


class UncertaintyPart(Document):
    """One line of an uncertainty budget; see `rig.validate.uncertainty.Component`."""

    name: str
    kind: Literal["A", "B"]
    distribution: Literal["normal", "rectangular"]
    u: float
    """Standard uncertainty of the input, in `unit`."""
    unit: str
    sensitivity: float
    dof: float | None = None
    """Degrees of freedom; None if the uncertainty counts as exactly known."""


class PointDocument(Document):
    """One measured point: when, at what pressure, and what came out."""

    key: PointKey
    started_s: float
    """Set-point sent."""
    settled_s: float | None
    """First time from which the pressure stayed within tolerance for the window."""
    measured_from_s: float
    measured_to_s: float
    pressure_kpa: float
    """Mean of the measured pressure between measured_from_s and measured_to_s, corrected as the
    transducer's calibration says."""
    pressure_sd_kpa: float
    pressure_u_kpa: float
    """Combined standard uncertainty of `pressure_kpa`: readings and calibration."""
    value: float | None
    """Angle in degrees or elongation in mm (deformation), force in grams (blocked force); None if
    all were rejected."""
    value_sd: float
    """Standard deviation of single readings."""
    value_u: float
    """Combined standard uncertainty of `value`: readings and calibration."""
    value_parts: tuple[UncertaintyPart, ...]
    """The budget of `value_u`."""
    pressure_parts: tuple[UncertaintyPart, ...]
    """The budget of `pressure_kpa`."""
    unit: Literal["deg", "mm", "g"]
    readings: int
    """Accepted readings behind `value`."""
    rejected: tuple[str, ...]
    """A reason for each reading not used."""


class DeformationReading(Document):
    """Vision result of one camera frame of a point."""

    key: PointKey
    frame: int
    value: float | None
    """Bending angle in degrees or elongation in mm."""
    unit: DeformationUnit
    u: float
    """Standard uncertainty of `value`, in its unit."""
    parts: tuple[UncertaintyPart, ...]
    """The budget of `u`."""
    quality: float
    accepted: bool
    reason: str


class PartKey(Document):
    """Which part of which repeat of a trial; what a resumed run need not do again."""

    trial: str
    kind: str
    repeat: int
    part: int
    """From 1; blocks of cycles are parts of their own."""


class PartDocument(Document):
    """A completed part of a trial; its readings are in the telemetry between its times."""

    key: PartKey
    from_s: float
    to_s: float
    plunger_from_ml: float
    """Where the plunger stood when the part began; volumes of the trial count from there."""
    looks: int
    """Frames that were accepted."""
    rejected: tuple[str, ...]
    """A reason for each of the others."""
    notes: tuple[str, ...]
    """What was not done as asked, sentences."""


class LookDocument(Document):
    """The deformation in one camera frame of a trial."""

    key: PartKey
    time_s: float
    """Since the part began."""
    value: float | None
    """Bending angle in degrees or elongation in mm."""
    unit: DeformationUnit
    u: float
    accepted: bool
    reason: str


class GasDocument(Document):
    """What a Kalman filter made of plunger and pressure between a closing of the valve and the next
    opening; uncertainties are standard. `rig.control.gas` has the model."""

    from_s: float
    to_s: float
    gas_ml: float
    """Gas in the line at the end, as its volume at ambient pressure and temperature."""
    gas_u_ml: float
    actuator_ml: float
    """Volume of the actuator at the end, with whatever the line's own volume is off by."""
    actuator_u_ml: float
    leak_ml_s: float
    """At 10 kPa gauge; since the leak began, if one was found."""
    leak_u_ml_s: float
    nis: float
    """Mean normalised innovation squared; far above 1 the uncertainties are not to be trusted."""


class ResumeDocument(Document):
    """A killed or aborted run was taken up again."""

    resumed_s: float
    points_kept: int
    seed: int
    versions: dict[str, str] = {}
    """As in the start document, of those who took it up."""


class StopDocument(Document):
    """How the run ended."""

    exit_status: ExitStatus
    reason: str
