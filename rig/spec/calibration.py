"""Instrument calibrations: coefficients with standard uncertainty and provenance."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from rig.spec.base import Count, Date, Integer, Number, SpecModel, require
from rig.spec.quantity import (
    Duration,
    Length,
    Mass,
    Pressure,
    Ratio,
    Temperature,
    TransducerGain,
    Voltage,
    Volume,
)


class Environment(SpecModel):
    """The air around the instrument while it was calibrated."""

    temperature: Temperature | None = Field(None, description="of the room during the calibration")
    pressure: Pressure | None = Field(None, description="absolute, of the room")
    humidity: Ratio | None = Field(None, ge=0, le=1, description="relative, of the room")


class Provenance(SpecModel):
    """Who calibrated what, when, how, against what, and until when that counts."""

    date: Date = Field(description="of the calibration")
    valid_until: Date | None = Field(None, description="last day on which runs may rely on it")
    method: str = Field(description="how it was done, in a sentence")
    instrument: str = Field(description="the reference that it was held to")
    serial_number: str = Field("", description="of what was calibrated; empty if it has none")
    reference: str = Field("", description="what it was compared with, and how well that is known")
    operator: str = Field("", description="who did it")
    environment: Environment = Field(Environment(), description="of the room, where it was noted")
    simulated: bool = Field(
        False, strict=True, description="of a virtual bench; never valid on a real one"
    )

    @model_validator(mode="after")
    def _lasting(self) -> Provenance:
        require(
            self.valid_until is None or self.valid_until >= self.date,
            "expected valid_until not before date",
        )
        return self


class Fit(SpecModel):
    """A least-squares fit; numbers in the units that `model` names."""

    model: str = Field(description="equation that was fitted")
    parameters: tuple[str, ...] = Field(description="names, in the order of `values`")
    values: tuple[Number, ...] = Field(
        description="of the parameters, in the units of the equation"
    )
    covariance: tuple[tuple[Number, ...], ...] = Field(
        description="of `values`, square and symmetric"
    )
    residuals: tuple[Number, ...] = Field(
        (), description="measured minus fitted; left out where there are thousands"
    )
    degrees_of_freedom: Number = Field(ge=0, description="of the points that count as independent")


class Evidence(SpecModel):
    """What a calibration rests on: the points as taken, and what was fitted to them."""

    columns: tuple[str, ...] = Field(description="names of the columns, with units")
    rows: tuple[tuple[Number, ...], ...] = Field(description="readings as they were taken")
    fits: tuple[Fit, ...] = Field(description="what was fitted to them")
    findings: dict[str, Number] = Field(
        default_factory=dict, description="figures by name, with the unit in the name"
    )


class Calibration(SpecModel):
    """What the calibrations of all instruments have in common."""

    kind: Literal["calibration"] = Field(description="tells that this is a file of this kind")
    provenance: Provenance = Field(description="who, when, how and by what reference")
    evidence: Evidence | None = Field(
        None, description="the readings behind it; none where it was typed from a certificate"
    )


class TransducerCalibration(Calibration):
    """Gauge pressure = gain (voltage - offset_voltage), and a little more in the middle.

    The curve is a parabola that meets the straight line at zero and at the end of the span.
    """

    instrument: Literal["transducer"] = Field(description="which instrument was calibrated")
    gain: TransducerGain = Field(description="voltage per gauge pressure")
    gain_u: Ratio = Field(ge=0, description="relative standard uncertainty of the gain")
    offset_voltage: Voltage = Field(description="at zero gauge pressure")
    span: Pressure = Field(gt=0, description="pressure up to which it was calibrated")
    bow: Pressure = Field(
        0.0, description="what is added to the straight line in the middle of the span"
    )
    linearity_u: Pressure = Field(ge=0, description="standard uncertainty of the bow")
    zero_u: Pressure = Field(
        ge=0, description="standard uncertainty of the zero after zeroing, from drift"
    )

    def bow_share(self, pressure: float) -> float:
        """Share of the bow at a gauge `pressure` in Pa: 0 at zero, 1 in the middle of the span."""
        return bow_share(pressure, self.span)

    def corrected(self, indicated: float) -> float:
        """Gauge pressure in Pa where the straight line says `indicated`."""
        return indicated + self.bow * self.bow_share(indicated)


class LoadCellCalibration(Calibration):
    """Force in grams-force = counts / counts_per_gram after tare, and a little more in the middle.

    The curve is a parabola as that of the transducer.
    """

    instrument: Literal["load-cell"] = Field(description="which instrument was calibrated")
    counts_per_gram: Number = Field(gt=0, description="counts of the HX711 per gram-force")
    counts_per_gram_u: Ratio = Field(ge=0, description="relative standard uncertainty")
    span: Mass = Field(gt=0, description="load up to which it was calibrated")
    bow: Mass = Field(
        0.0, description="what is added to the straight line in the middle of the span"
    )
    linearity_u: Mass = Field(ge=0, description="standard uncertainty of the bow")
    creep_u: Ratio = Field(
        ge=0, description="standard uncertainty from creep within minutes, relative to the load"
    )
    zero_u: Mass = Field(
        ge=0, description="standard uncertainty of the zero after tare, from drift"
    )

    def grams(self, counts: float) -> float:
        """Force in grams-force of counts, tare removed."""
        return self.corrected(counts / self.counts_per_gram / 1e3) * 1e3

    def bow_share(self, load: float) -> float:
        """Share of the bow at a `load` in kg: 0 at zero, 1 in the middle of the span."""
        return bow_share(load, self.span)

    def corrected(self, indicated: float) -> float:
        """Load in kg where the straight line says `indicated`."""
        return indicated + self.bow * self.bow_share(indicated)


def bow_share(value: float, span: float) -> float:
    """4 x (1 - x) with x = value / span: a parabola through both ends, 1 in the middle."""
    x = value / span
    return 4 * x * (1 - x)


class SyringeCalibration(Calibration):
    """What the plunger's drive really moves, and the volume that stays when it is fully in."""

    instrument: Literal["syringe"] = Field(description="which instrument was calibrated")
    steps_per_ml: Number = Field(gt=0, description="microsteps for one millilitre")
    steps_per_ml_u: Ratio = Field(ge=0, description="relative standard uncertainty")
    backlash: Volume = Field(ge=0, description="volume lost when the direction turns")
    backlash_u: Volume = Field(ge=0, description="standard uncertainty")
    dead_volume: Volume = Field(ge=0, description="without the tube")
    dead_volume_u: Volume = Field(ge=0, description="standard uncertainty")


class CameraLatency(SpecModel):
    """From exposure to arrival of a frame; counts as long as the camera's calibration does."""

    value: Duration = Field(ge=0, le=2, description="from exposure to arrival")
    u: Duration = Field(ge=0, description="standard uncertainty")
    provenance: Provenance = Field(description="who, when and how")
    fit: Fit | None = Field(None, description="behind the value; none where it was typed")


class CameraCalibration(Calibration):
    """Pinhole and Brown-Conrady lens of the camera, pixels; its latency where it was measured."""

    instrument: Literal["camera"] = Field(description="which instrument was calibrated")
    width: Count = Field(le=20_000, description="of the picture in pixels")
    height: Count = Field(le=20_000, description="of the picture in pixels")
    focal_x: Number = Field(gt=0, description="focal length in pixels, across")
    focal_y: Number = Field(gt=0, description="focal length in pixels, down")
    centre_x: Number = Field(description="of the optical axis in pixels from the left")
    centre_y: Number = Field(description="of the optical axis in pixels from the top")
    distortion: tuple[Number, Number, Number, Number, Number] = Field(
        (0.0, 0.0, 0.0, 0.0, 0.0), description="k1, k2, p1, p2 and k3 of Brown and Conrady"
    )
    angle_u_deg: Number = Field(ge=0, description="standard uncertainty of in-plane angles, deg")
    latency: CameraLatency | None = Field(
        None, description="from exposure to arrival; none where it was not measured"
    )

    def latency_s(self, assumed_s: float) -> float:
        """What a frame's time is early by, s; `assumed_s` where that was not measured."""
        return assumed_s if self.latency is None else self.latency.value


class RulerCalibration(Calibration):
    """The right-angle reference ruler in the picture.

    A white L with round black marks: one in the corner, then one every `pitch` on both legs.
    """

    instrument: Literal["ruler"] = Field(description="which instrument was calibrated")
    pitch: Length = Field(gt=0, description="distance between neighbouring marks")
    marks: Integer = Field(
        ge=3, le=1000, description="marks on each leg, the corner mark not counted"
    )
    pitch_u: Length = Field(ge=0, description="standard uncertainty of the pitch")
    squareness_u_deg: Number = Field(ge=0, description="standard uncertainty of the right angle")
