"""Fault scripts: what breaks on a simulated bench, when, and how rig must take it.

`rig fault-campaign` runs them all and judges; `rig characterise --faults` runs one.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rig.spec.base import Integer, Name, SpecModel, require
from rig.spec.quantity import Duration, Flow, Frequency, Pressure, PressureRate, Ratio, Voltage

BoardState = Literal["boot", "idle", "homing", "hold", "run", "vent", "fault"]
FaultCode = Literal[
    "over_pressure",
    "sensor_open",
    "sensor_short",
    "sensor_stuck",
    "rate_implausible",
    "leak",
    "travel_limit",
    "hx711_timeout",
    "hx711_desync",
    "communication_lost",
    "watchdog_reset",
    "emergency_stop",
    "brown_out",
    "parameters_corrupt",
    "homing_failed",
]


class Moment(SpecModel):
    """When something happens: as soon as all that is given holds; at power-on if nothing is."""

    time: Duration = Field(0.0, ge=0, description="bench time at the earliest")
    state: BoardState | None = Field(None, description="the board reports this state")
    above: Pressure | None = Field(None, ge=0, description="true pressure in the syringe")


class Fault(SpecModel):
    """What all faults have: when they begin, and for how long."""

    when: Moment = Field(Moment(), description="bench time at which it happens")
    delay: Duration = Field(0.0, ge=0, description="after that moment")
    lasts: Duration | None = Field(None, gt=0, description="for good if not given")


class SensorFault(Fault):
    """The transducer: wire broken, shorted to supply, frozen, or mounted the wrong way round."""

    kind: Literal["sensor_open", "sensor_short", "sensor_stuck", "sensor_reversed"] = Field(
        description="which fault this is"
    )


class SensorSpike(Fault):
    """The transducer's voltage jumps, as by electrical noise."""

    kind: Literal["sensor_spike"] = Field(description="which fault this is")
    voltage: Voltage = Field(description="on top of the transducer's")


class SensorDrift(Fault):
    """The transducer's reading runs away; a negative rate hides pressure."""

    kind: Literal["sensor_drift"] = Field(description="which fault this is")
    rate: PressureRate = Field(description="by which the reading moves away")


class TubeFault(Fault):
    """The tube between syringe and actuator comes off, or is blocked."""

    kind: Literal["tube_off", "tube_blocked"] = Field(description="which fault this is")


class Leak(Fault):
    """The actuator leaks; a flow of hundreds of mL/s is a burst."""

    kind: Literal["leak"] = Field(description="which fault this is")
    flow: Flow = Field(gt=0, description="at 10 kPa gauge, besides the bench's own leak")


class MotorFault(Fault):
    """The motor loses steps; all of them when it stalls."""

    kind: Literal["motor_loses_steps"] = Field(description="which fault this is")
    share: Ratio = Field(gt=0, le=1, description="of the steps that are lost")


class SwitchFault(Fault):
    """A limit switch shows the same whatever the plunger does."""

    kind: Literal["home_switch_stuck", "end_switch_stuck"] = Field(
        description="which fault this is"
    )
    shows: Literal["open", "closed"] = Field(description="what the switch says from then on")


class EmergencyStop(Fault):
    """Somebody presses the emergency stop."""

    kind: Literal["emergency_stop"] = Field(description="which fault this is")


class LoadCellSilent(Fault):
    """The HX711 delivers no conversions: no supply, or its data line stuck high."""

    kind: Literal["hx711_silent"] = Field(description="which fault this is")


class LoadCellReversed(Fault):
    """The load cell's signal wires are swapped: a push reads as a pull."""

    kind: Literal["load_cell_reversed"] = Field(description="which fault this is")


class LoadCellStuck(Fault):
    """Every word of the HX711 reads the same."""

    kind: Literal["hx711_stuck"] = Field(description="which fault this is")
    word: Integer = Field(ge=0, le=0xFFFFFF, description="24 bits; 0x7FFFFF is saturated high")


class LoadCellBadWords(Fault):
    """Words of the HX711 arrive shifted by a bit, as after a lost clock edge."""

    kind: Literal["hx711_bad_words"] = Field(description="which fault this is")
    share: Ratio = Field(gt=0, le=1, description="of the words that are wrong")


class LineFault(Fault):
    """The serial line: the host says nothing, the cable is pulled, frames change places.

    A pulled cable cuts the frame that is under way in two.
    """

    kind: Literal["host_silent", "cable_pulled", "frames_reordered"] = Field(
        description="which fault this is"
    )


class Garbage(Fault):
    """Random bytes among those of the serial line, in both directions."""

    kind: Literal["garbage"] = Field(description="which fault this is")
    rate: Frequency = Field(gt=0, description="bytes a second in each direction")


class BitErrors(Fault):
    """Bytes of the serial line with one bit flipped, in both directions."""

    kind: Literal["bit_errors"] = Field(description="which fault this is")
    share: Ratio = Field(gt=0, le=1, description="of the bytes")


class Replay(Fault):
    """What the host said before comes again, to the byte and all at once."""

    kind: Literal["frames_replayed"] = Field(description="which fault this is")
    history: Duration = Field(gt=0, description="how far back it begins")
    length: Duration | None = Field(None, gt=0, description="of the stretch; default: until now")


class Flood(Fault):
    """Sound frames in great number, as from a host program that loops."""

    kind: Literal["flood"] = Field(description="which fault this is")
    rate: Frequency = Field(gt=0, description="frames a second")


class BoardFault(Fault):
    """The board: its supply sags, its main loop hangs, its stored parameters are damaged.

    Damaged parameters show at the next start, so they belong to power-on.
    """

    kind: Literal["brown_out", "watchdog_reset", "parameters_corrupt"] = Field(
        description="which fault this is"
    )


class ClockAhead(Fault):
    """The board has been on for long before the host arrives; give it at power-on only."""

    kind: Literal["clock_ahead"] = Field(description="which fault this is")
    by: Duration = Field(gt=0, le=86_400, description="how far the board's clock is ahead")

    @model_validator(mode="after")
    def _at_power_on(self) -> ClockAhead:
        require(
            self.when == Moment() and self.delay == 0,
            "the clock can only be ahead from power-on; expected neither 'when' nor 'delay'",
        )
        return self


AnyFault = Annotated[
    SensorFault
    | SensorSpike
    | SensorDrift
    | TubeFault
    | Leak
    | MotorFault
    | SwitchFault
    | EmergencyStop
    | LoadCellSilent
    | LoadCellReversed
    | LoadCellStuck
    | LoadCellBadWords
    | LineFault
    | Garbage
    | BitErrors
    | Replay
    | Flood
    | BoardFault
    | ClockAhead,
    Field(discriminator="kind"),
]


class Expectation(SpecModel):
    """How rig must take the faults of a script."""

    codes: tuple[FaultCode, ...] = Field(
        (), description="fault codes any of which is right; none: the board carries on"
    )
    within: Duration | None = Field(
        None, gt=0, description="from the first fault to the open valve, or to its report"
    )
    run: Literal["success", "failed", "refused"] = Field(
        description="how the run ends; refused: before anything moved, without a log"
    )
    actuator: Literal["vented", "pressurised"] = Field(
        "vented", description="half a minute after the end"
    )
    wrong_points: bool = Field(
        False, description="points taken before the fault is found may be wrong; never of a success"
    )

    @model_validator(mode="after")
    def _reactions_are_told(self) -> Expectation:
        require(
            bool(self.codes) == (self.within is not None),
            "expected 'codes' and 'within' together: every fault code is raised within a bound",
        )
        require(
            not (self.wrong_points and self.run == "success"),
            "expected no 'wrong_points' of a run that succeeds: nobody would be told",
        )
        return self


class FaultScript(SpecModel):
    """A file of faults, with the requirements that it tests."""

    kind: Literal["faults"] = Field(description="tells that this is a file of this kind")
    name: Name
    description: str = Field(min_length=1, description="what happens, for the table")
    requirements: tuple[Name, ...] = Field(
        (), description="of docs/safety/requirements.md, as SR-01"
    )
    protocol: Name = Field("faults", description="name in models/protocols, for the campaign")
    faults: tuple[AnyFault, ...] = Field((), description="what happens, in any order")
    expect: Expectation = Field(description="what the board must do about it")
