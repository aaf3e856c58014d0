"""Bench specs: syringe, stepper, lead screw, tubing, sensors, camera, board, controller.

`virtual` holds what only a simulated bench needs: the hidden imperfections are drawn from it.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, PositiveInt

from rig.spec.base import SpecModel
from rig.spec.quantity import (
    Acceleration,
    Angle,
    Duration,
    Flow,
    FlowGain,
    FlowIntegralGain,
    Frequency,
    Length,
    Mass,
    Pressure,
    PressureRate,
    Ratio,
    Temperature,
    Voltage,
    Volume,
)


class VirtualBoard(SpecModel):
    """The firmware compiled for this machine, on the simulated bench."""

    kind: Literal["virtual"]


class SerialBoard(SpecModel):
    """An Arduino Mega on a serial port, or any pyserial URL."""

    kind: Literal["serial"]
    port: str = Field(description="as /dev/ttyACM0, COM3 or socket://host:port")
    baudrate: PositiveInt = 115200


class Syringe(SpecModel):
    volume: Volume = Field(gt=0)
    inner_diameter: Length = Field(gt=0)
    dead_volume: Volume = Field(ge=0, description="left when the plunger is fully in")


class Stepper(SpecModel):
    steps_per_revolution: PositiveInt
    microsteps: PositiveInt
    max_step_rate: Frequency = Field(gt=0)


class LeadScrew(SpecModel):
    lead: Length = Field(gt=0, description="travel per revolution")
    backlash: Length = Field(ge=0)


class Tubing(SpecModel):
    inner_diameter: Length = Field(gt=0)
    length: Length = Field(gt=0)


class Transducer(SpecModel):
    model: str
    pressure_low: Pressure
    pressure_high: Pressure
    voltage_low: Voltage
    voltage_high: Voltage
    calibration: str = Field(description="file in calibration/, or a path")


class Adc(SpecModel):
    bits: PositiveInt
    reference: Voltage = Field(gt=0)


class LoadCell(SpecModel):
    model: str
    capacity: Mass = Field(gt=0)
    sample_rate: Frequency = Field(gt=0)
    calibration: str = Field(description="file in calibration/, or a path")


class VirtualCameraDevice(SpecModel):
    """The rendered camera of the virtual bench."""

    kind: Literal["virtual"]


class OpenCvCameraDevice(SpecModel):
    """A camera, video file or stream that OpenCV opens."""

    kind: Literal["opencv"]
    source: int | str


class Camera(SpecModel):
    device: Annotated[VirtualCameraDevice | OpenCvCameraDevice, Field(discriminator="kind")]
    jpeg_quality: int = Field(92, ge=50, le=100)
    frame_rate: Frequency = Field(gt=0)
    calibration: str = Field(description="file in calibration/, or a path")
    ruler: str = Field(description="ruler calibration file in calibration/, or a path")


class Controller(SpecModel):
    """Gains of the PI pressure loop; it commands plunger velocity as volume flow."""

    proportional: FlowGain = Field(gt=0)
    integral: FlowIntegralGain = Field(ge=0)
    feed_forward: Ratio = Field(ge=0, description="share of the isothermal flow demand")
    deadband: Pressure = Field(ge=0)
    max_flow: Flow = Field(gt=0)
    max_flow_acceleration: Acceleration = Field(gt=0)
    setpoint_rate: PressureRate = Field(gt=0)


class Safety(SpecModel):
    """Limits that the firmware enforces by itself."""

    pressure: Pressure = Field(gt=0)
    communication_timeout: Duration = Field(gt=0)


class Ambient(SpecModel):
    pressure: Pressure = Field(gt=0)
    temperature: Temperature = Field(gt=0)


class SpecimenVariation(SpecModel):
    """How a printed actuator differs from its drawing; standard deviations unless said."""

    wall_thickness: Ratio = Field(ge=0, description="relative")
    young_modulus: Ratio = Field(ge=0, description="relative")
    gravity_offset: Angle = Field(description="mean angle at zero pressure")
    gravity_offset_spread: Angle = Field(ge=0)
    stiffening: Ratio = Field(ge=0, description="strength of the nonlinear stiffening, mean")
    stiffening_spread: Ratio = Field(ge=0, description="relative")
    creep: Ratio = Field(ge=0, description="share of the response that comes by creep")
    creep_time: Duration = Field(gt=0)
    hysteresis: Ratio = Field(ge=0, description="loop width relative to the response")


class VirtualPneumatics(SpecModel):
    heat_exchange_time: Duration = Field(gt=0, description="gas to wall, time constant")
    leak: Flow = Field(ge=0, description="at 10 kPa gauge, ambient conditions")


class VirtualSensors(SpecModel):
    transducer_noise: Voltage = Field(ge=0, description="standard deviation of one conversion")
    transducer_offset: Pressure = Field(ge=0, description="standard deviation before zeroing")
    load_cell_noise: Mass = Field(ge=0)
    load_cell_creep: Ratio = Field(ge=0, description="share of the load")
    load_cell_creep_time: Duration = Field(gt=0)
    bad_word_interval: Duration = Field(gt=0, description="mean time between bad HX711 words")


class VirtualOptics(SpecModel):
    distance: Length = Field(gt=0, description="camera to the plane of bending")
    tilt: Angle = Field(ge=0, description="standard deviation of pan, tilt and roll")
    blur: float = Field(ge=0, description="standard deviation of the point spread, pixels")
    noise: float = Field(ge=0, description="standard deviation, grey levels of 255")
    light_gradient: Ratio = Field(ge=0, description="brightness change across the picture")


class VirtualBench(SpecModel):
    specimen: SpecimenVariation
    pneumatics: VirtualPneumatics
    sensors: VirtualSensors
    optics: VirtualOptics


class BenchSpec(SpecModel):
    kind: Literal["bench"]
    name: str = Field(min_length=1)
    description: str = ""
    board: Annotated[VirtualBoard | SerialBoard, Field(discriminator="kind")]
    syringe: Syringe
    stepper: Stepper
    lead_screw: LeadScrew
    tubing: Tubing
    transducer: Transducer
    adc: Adc
    load_cell: LoadCell
    camera: Camera
    controller: Controller
    safety: Safety
    ambient: Ambient
    virtual: VirtualBench | None = None
