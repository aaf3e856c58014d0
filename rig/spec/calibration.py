"""Instrument calibrations: coefficients with standard uncertainty and provenance."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from rig.spec.base import Count, Date, Integer, Number, SpecModel
from rig.spec.quantity import Length, Mass, Pressure, Ratio, TransducerGain, Voltage


class Provenance(SpecModel):
    """Who calibrated what, when and how."""

    date: Date
    method: str
    instrument: str
    operator: str = ""
    simulated: bool = Field(
        False, strict=True, description="defines a virtual bench; never valid on a real one"
    )


class TransducerCalibration(SpecModel):
    """Gauge pressure = gain (voltage - offset_voltage)."""

    kind: Literal["calibration"]
    instrument: Literal["transducer"]
    gain: TransducerGain
    gain_u: Ratio = Field(ge=0, description="relative standard uncertainty of the gain")
    offset_voltage: Voltage
    zero_u: Pressure = Field(ge=0, description="standard uncertainty of the zero after zeroing")
    linearity_u: Pressure = Field(ge=0, description="standard uncertainty from non-linearity")
    provenance: Provenance


class LoadCellCalibration(SpecModel):
    """Force in grams-force = counts / counts_per_gram, after tare."""

    kind: Literal["calibration"]
    instrument: Literal["load-cell"]
    counts_per_gram: Number = Field(gt=0)
    counts_per_gram_u: Ratio = Field(ge=0, description="relative standard uncertainty")
    creep_u: Mass = Field(ge=0, description="standard uncertainty from creep and drift")
    provenance: Provenance


class CameraCalibration(SpecModel):
    """Pinhole and Brown-Conrady lens of the camera, pixels."""

    kind: Literal["calibration"]
    instrument: Literal["camera"]
    width: Count = Field(le=20_000)
    height: Count = Field(le=20_000)
    focal_x: Number = Field(gt=0)
    focal_y: Number = Field(gt=0)
    centre_x: Number
    centre_y: Number
    distortion: tuple[Number, Number, Number, Number, Number] = (0.0, 0.0, 0.0, 0.0, 0.0)
    angle_u_deg: Number = Field(ge=0, description="standard uncertainty of in-plane angles, deg")
    provenance: Provenance


class RulerCalibration(SpecModel):
    """The right-angle reference ruler in the picture.

    A white L with round black marks: one in the corner, then one every `pitch` on both legs.
    """

    kind: Literal["calibration"]
    instrument: Literal["ruler"]
    pitch: Length = Field(gt=0, description="distance between neighbouring marks")
    marks: Integer = Field(
        ge=3, le=1000, description="marks on each leg, the corner mark not counted"
    )
    pitch_u: Length = Field(ge=0, description="standard uncertainty of the pitch")
    squareness_u_deg: Number = Field(ge=0, description="standard uncertainty of the right angle")
    provenance: Provenance
