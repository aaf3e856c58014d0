"""PI gains for an identified family of plants, with margins that hold for its worst member.

The family is every identified level with the nominal gas volume and with a share more and less; to
first order the volume scales the gain. The proportional gain is the largest that gain margin and
drive noise allow, or that of a wanted bandwidth. The integral gain makes the slowest member
critically damped, ki = kp wc / 4 (double root of s^2 + wc s + wc ki/kp), unless phase margin or
sensitivity ask for less.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.control.errors import ControlError
from rig.control.family import Family, IdentifiedLevel
from rig.control.identify import LevelModel, Mode, Shape
from rig.control.loop import Gains, Margins, margins

CRITICAL_DAMPING = 4.0
STEPS_DOWN = 0.9
LEAST_SHARE = 0.05
"""Of the first guess, below which a design counts as impossible."""
SCHEDULE_PAYS = 1.2
"""Ratio of slowest bandwidths from which a gain schedule is worth its complication."""
UNLIMITED = Gains(math.inf, math.inf)
WARM_RAD_S = 1.0
"""Frequency of the gain that the feed-forward inverts: that of a set-point's ramp."""


@dataclass(frozen=True)
class Wanted:
    """What a design must keep for every member of the family."""

    gain_db: float = 8.0
    phase_deg: float = 60.0
    peak_sensitivity: float = 1.7
    volume_share: float = 0.3
    noise_flow_ml_s: float = 0.15
    """Standard deviation of the flow that sensor noise may cause."""
    bandwidth_hz: float | None = None
    """Crossover of the slowest member; None: as fast as the rest allows."""
    most: Gains = UNLIMITED
    """What the board's parameters can hold."""


@dataclass(frozen=True)
class Member:
    """One plant of the family."""

    setpoint_kpa: float
    volume: float
    """Gas volume relative to the nominal one."""
    model: LevelModel


@dataclass(frozen=True)
class MemberMargins:
    """A member with its margins."""

    member: Member
    margins: Margins


@dataclass(frozen=True)
class Design:
    """Gains with what they amount to."""

    gains: Gains
    feed_forward: float
    members: tuple[MemberMargins, ...]
    bound_by: str
    """What keeps it from being faster."""

    @property
    def gain_db(self) -> float:
        """Worst gain margin."""
        return min(m.margins.gain_db for m in self.members)

    @property
    def phase_deg(self) -> float:
        """Worst phase margin."""
        return min(m.margins.phase_deg for m in self.members)

    @property
    def delay_s(self) -> float:
        """Worst delay margin."""
        return min(m.margins.delay_s for m in self.members)

    @property
    def peak_sensitivity(self) -> float:
        """Worst peak."""
        return max(m.margins.peak_sensitivity for m in self.members)

    @property
    def bandwidth_hz(self) -> float:
        """Crossover of the slowest member."""
        return min(m.margins.crossover for m in self.members) / (2 * math.pi)

    @property
    def worst(self) -> Member:
        """The member with the least gain margin."""
        return min(self.members, key=lambda m: m.margins.gain_db).member


@dataclass(frozen=True)
class Tuning:
    """One design for all levels, one for each, and whether the latter pays."""

    wanted: Wanted
    single: Design
    schedule: dict[float, Design]
    """By set-point in kPa."""

    @property
    def schedule_gain(self) -> float:
        """Slowest bandwidth of the schedule over that of the single design."""
        return min(d.bandwidth_hz for d in self.schedule.values()) / self.single.bandwidth_hz

    @property
    def schedule_pays(self) -> bool:
        """Whether a gain schedule is worth it."""
        return self.schedule_gain > SCHEDULE_PAYS


def members_of(levels: Sequence[IdentifiedLevel], volume_share: float) -> tuple[Member, ...]:
    """Every level with each of three volumes."""
    return tuple(
        Member(level.setpoint_kpa, volume, level.model.scaled(1 / volume))
        for level in levels
        for volume in (1 - volume_share, 1.0, 1 + volume_share)
    )


def tune(family: Family, wanted: Wanted) -> Tuning:
    """Gains for the whole family and for each level; raises ControlError for impossible wishes."""
    if not 0 <= wanted.volume_share < 1:
        raise ControlError(
            f"volumes of ±{100 * wanted.volume_share:g} % were asked for; expected 0 to below 100."
        )
    _require_positive("gain margin", wanted.gain_db, "dB")
    _require_positive("phase margin", wanted.phase_deg, "deg")
    if wanted.bandwidth_hz is not None:
        _require_positive("bandwidth", wanted.bandwidth_hz, "Hz")
    single = design(family, family.levels, wanted)
    schedule = {level.setpoint_kpa: design(family, (level,), wanted) for level in family.levels}
    return Tuning(wanted, single, schedule)


def _require_positive(what: str, value: float, unit: str) -> None:
    if not 0 < value < math.inf:
        raise ControlError(f"a {what} of {value:g} {unit} was asked for; expected more than 0.")


def design(family: Family, levels: Sequence[IdentifiedLevel], wanted: Wanted) -> Design:
    """Gains that keep all margins for these levels.

    Raises ControlError if a wanted bandwidth is too much; it says how much is possible.
    """
    members = members_of(levels, wanted.volume_share)
    unit = {member: margins(member.model, Gains(1.0, 0.0)) for member in members}
    limits = {
        "gain margin": min(m.gain for m in unit.values()) / 10 ** (wanted.gain_db / 20),
        "noise of the drive": wanted.noise_flow_ml_s / family.noise_kpa,
        "range of the board's parameter": wanted.most.proportional,
    }
    bound_by = min(limits, key=lambda name: limits[name])
    proportional = limits[bound_by]
    if wanted.bandwidth_hz is not None:
        needed = max(_gain_for(member.model, wanted.bandwidth_hz) for member in members)
        if needed > proportional:
            reach = replace(wanted, bandwidth_hz=None)
            raise ControlError(
                f"a bandwidth of {wanted.bandwidth_hz:g} Hz asks for a proportional gain of "
                f"{needed:.3g} mL/s/kPa; {bound_by} allows {proportional:.3g}. At most "
                f"{design(family, levels, reach).bandwidth_hz:.2g} Hz is possible."
            )
        proportional, bound_by = needed, "wanted bandwidth"
    fixed = bound_by == "wanted bandwidth"
    for gains, reduced in _candidates(proportional, members, wanted.most, fixed=fixed):
        found = tuple(MemberMargins(m, margins(m.model, gains)) for m in members)
        made = Design(gains, _feed_forward(family, levels), found, reduced or bound_by)
        if (
            made.gain_db >= wanted.gain_db - 1e-6
            and made.phase_deg >= wanted.phase_deg
            and made.peak_sensitivity <= wanted.peak_sensitivity
        ):
            return made
    raise ControlError(
        f"no gains keep {wanted.gain_db:g} dB, {wanted.phase_deg:g} deg and a sensitivity of "
        f"{wanted.peak_sensitivity:g} for all members. Ask for less, or for a lower bandwidth."
    )


def _candidates(
    proportional: float, members: Sequence[Member], most: Gains, *, fixed: bool
) -> Iterator[tuple[Gains, str]]:
    """Gains from the fastest down; with a fixed proportional gain only the integral one falls."""
    slowest = min(members, key=lambda m: m.model.static_gain).model
    share = 1.0
    while share > LEAST_SHARE:
        kp = proportional if fixed else share * proportional
        crossover = margins(slowest, Gains(kp, 0.0)).crossover
        ki = kp * crossover / CRITICAL_DAMPING * (share if fixed else 1.0)
        yield (
            Gains(kp, min(ki, most.integral)),
            "" if share == 1.0 else "phase margin or sensitivity",
        )
        share *= STEPS_DOWN


def _gain_for(model: LevelModel, bandwidth_hz: float) -> float:
    """Proportional gain whose loop crosses one at this frequency."""
    omega = 2 * math.pi * bandwidth_hz
    return float(omega / np.abs(model.response(np.array([omega])))[0])


def _feed_forward(family: Family, levels: Sequence[IdentifiedLevel]) -> float:
    """Share of Boyle's flow that the plant asks for: the growth of the cavity makes it more.

    A liquid does not obey Boyle: none."""
    if family.fluid == "liquid":
        return 0.0
    shares = [
        (family.parameters["ambient_pressure_kpa"] + level.level_kpa)
        / level.physics.gas_volume_ml
        / float(np.abs(level.model.response(np.array([WARM_RAD_S])))[0])
        for level in levels
    ]
    return float(np.mean(shares))


def margins_of_draws(
    level: IdentifiedLevel, member: Member, gains: Gains, draws: int, seed: int
) -> tuple[Margins, ...]:
    """Margins of plants that the estimates' covariance makes as likely as `member`.

    Draws that are no plant (a negative time constant) are drawn again.
    """
    rng = np.random.default_rng(seed)
    shape = Shape(len(level.gains), len(level.modes))
    mean = np.array([one.value for one in level.estimates.values()])
    covariance = np.array(level.covariance)
    found: list[Margins] = []
    while len(found) < draws:
        values = rng.multivariate_normal(mean, covariance, method="svd")
        poles, delay_s = values[shape.linear : -2], float(values[-2])
        if np.any(poles <= 0) or delay_s < 0:
            continue
        gains_of_lags, gains_of_modes = np.split(values[3 : shape.linear], [shape.lags])
        swings = poles[shape.lags :].reshape(shape.modes, 2)
        drawn = replace(
            level.model,
            direct=float(values[2]),
            gains=tuple(gains_of_lags.tolist()),
            times_s=tuple(poles[: shape.lags].tolist()),
            delay_s=delay_s,
            modes=tuple(
                Mode(gain, *swing)
                for gain, swing in zip(gains_of_modes.tolist(), swings.tolist(), strict=True)
            ),
        )
        found.append(margins(drawn.scaled(1 / member.volume), gains))
    return tuple(found)
