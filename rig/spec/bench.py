"""Bench specs: syringe, stepper, lead screw, tubing, sensors, camera, board, controller.

`virtual` holds what only a simulated bench needs: the hidden imperfections are drawn from it.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from rig.spec.base import Count, Integer, Name, Number, SpecModel, require
from rig.spec.physics import Air, CreepTerm, Liquid, MotorTorque, Mullins, PlungerFriction
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

    kind: Literal["virtual"] = Field(description="which board this is")


class EmulatedBoard(SpecModel):
    """The image of the Mega, emulated, on the simulated bench; needs some Debian packages."""

    kind: Literal["emulated"] = Field(description="which board this is")


class SerialBoard(SpecModel):
    """An Arduino Mega on a serial port, any pyserial URL, or behind a CAN adapter."""

    kind: Literal["serial"] = Field(description="which board this is")
    port: str = Field(
        min_length=1,
        description="auto, or as /dev/ttyACM0, COM3, socket://host:port, can:socketcan:can0",
    )
    baudrate: Count = Field(115200, le=20_000_000, description="bits per second of the serial line")


class Syringe(SpecModel):
    """The syringe whose plunger sets the pressure."""

    volume: Volume = Field(gt=0, description="swept from stop to stop")
    inner_diameter: Length = Field(gt=0, description="of the barrel")
    dead_volume: Volume = Field(ge=0, description="left when the plunger is fully in")
    calibration: str | None = Field(
        None, description="file in calibration/, or a path; replaces what the drawing says"
    )

    @property
    def area(self) -> float:
        """Cross-section of the plunger in m2."""
        return math.pi * self.inner_diameter**2 / 4


class Stepper(SpecModel):
    """The motor that turns the lead screw, and how finely it is driven."""

    steps_per_revolution: Count = Field(
        le=100_000, description="full steps of the motor for one turn"
    )
    microsteps: Count = Field(le=1024, description="steps that the driver makes of a full one")
    max_step_rate: Frequency = Field(
        gt=0, description="microsteps per second that the motor follows under load"
    )


class LeadScrew(SpecModel):
    """What turns revolutions of the motor into travel of the plunger."""

    lead: Length = Field(gt=0, description="travel per revolution")
    backlash: Length = Field(ge=0, description="play of the nut when the direction turns")


class Tubing(SpecModel):
    """The tube between syringe and actuator."""

    inner_diameter: Length = Field(gt=0, description="of the tube")
    length: Length = Field(gt=0, description="from syringe to actuator")

    @property
    def volume(self) -> float:
        """Volume of gas in the tube in m3."""
        return math.pi * self.inner_diameter**2 / 4 * self.length

    def resistance(self, viscosity: float) -> float:
        """Pressure over flow, Pa s/m3, of a fluid that flows slowly (Hagen and Poiseuille)."""
        return 128 * viscosity * self.length / (math.pi * self.inner_diameter**4)


class Transducer(SpecModel):
    """The pressure sensor as its data sheet describes it."""

    model: str = Field(description="maker's name of the sensor")
    pressure_low: Pressure = Field(description="gauge pressure at `voltage_low`")
    pressure_high: Pressure = Field(description="gauge pressure at `voltage_high`")
    voltage_low: Voltage = Field(description="output at `pressure_low`")
    voltage_high: Voltage = Field(description="output at `pressure_high`")
    calibration: str = Field(description="file in calibration/, or a path")

    @model_validator(mode="after")
    def _rising(self) -> Transducer:
        require(
            self.pressure_low < self.pressure_high and self.voltage_low < self.voltage_high,
            "expected pressure_low below pressure_high and voltage_low below voltage_high",
        )
        return self


class Adc(SpecModel):
    """The converter that reads the transducer."""

    bits: Count = Field(ge=8, le=16, description="of the board's converter")
    reference: Voltage = Field(gt=0, description="voltage of a full count")


class LoadCell(SpecModel):
    """The load cell with its amplifier (HX711)."""

    model: str = Field(description="maker's name of the cell")
    capacity: Mass = Field(gt=0, description="load that it may bear")
    sample_rate: Frequency = Field(gt=0, description="conversions per second of the HX711")
    calibration: str = Field(description="file in calibration/, or a path")


class VirtualCameraDevice(SpecModel):
    """The rendered camera of the virtual bench."""

    kind: Literal["virtual"] = Field(description="which camera this is")


class OpenCvCameraDevice(SpecModel):
    """A camera, video file, stream or sequence of images that OpenCV opens."""

    kind: Literal["opencv"] = Field(description="which camera this is")
    source: Integer | str = Field(
        description="device number, file, URL, or images numbered as in frames/%04d.png"
    )


class RealSenseCameraDevice(SpecModel):
    """The colour camera of an Intel RealSense; needs the extra `realsense`."""

    kind: Literal["realsense"] = Field(description="which camera this is")
    serial_number: str = Field("", description="of the one to use; empty: the only one")


class Camera(SpecModel):
    """The camera beside the actuator, and the ruler in its picture."""

    device: Annotated[
        VirtualCameraDevice | OpenCvCameraDevice | RealSenseCameraDevice,
        Field(discriminator="kind"),
    ] = Field(description="what takes the pictures")
    latency: Duration = Field(
        0.0,
        ge=0,
        le=2,
        description="from exposure to arrival, taken off a frame's time; what the camera's "
        "calibration has measured goes before it",
    )
    jpeg_quality: Integer = Field(
        92, ge=50, le=100, description="of the pictures in the log, 1 to 100"
    )
    frame_rate: Frequency = Field(ge=0.1, le=1000, description="pictures per second at most")
    calibration: str = Field(description="file in calibration/, or a path")
    ruler: str = Field(description="ruler calibration file in calibration/, or a path")


class Controller(SpecModel):
    """Gains of the PI pressure loop; it commands plunger velocity as volume flow."""

    proportional: FlowGain = Field(gt=0, description="plunger flow per pressure error")
    integral: FlowIntegralGain = Field(
        ge=0, description="plunger flow per pressure error and second"
    )
    feed_forward: Ratio = Field(ge=0, description="share of the isothermal flow demand")
    deadband: Pressure = Field(ge=0, description="errors below this move nothing")
    max_flow: Flow = Field(gt=0, description="of the plunger")
    max_flow_acceleration: Acceleration = Field(gt=0, description="how fast the flow may change")
    setpoint_rate: PressureRate = Field(
        gt=0, description="how fast the set-point follows what was asked"
    )


class Safety(SpecModel):
    """Limits that the firmware enforces by itself."""

    pressure: Pressure = Field(
        gt=0, description="gauge pressure at which the board vents by itself"
    )
    communication_timeout: Duration = Field(
        gt=0, description="silence of the host after which the board vents"
    )


class Ambient(SpecModel):
    """The air around the bench."""

    pressure: Pressure = Field(gt=0, description="absolute pressure of the room")
    temperature: Temperature = Field(gt=0, description="of the room")


class SpecimenVariation(SpecModel):
    """How a printed actuator differs from its drawing; standard deviations unless said."""

    wall_thickness: Ratio = Field(ge=0, description="relative")
    young_modulus: Ratio = Field(ge=0, description="relative, of all stiffness")
    creep: Ratio = Field(ge=0, description="share of the response that comes by creep")
    creep_time: Duration = Field(gt=0, description="after which creep has gone 63 % of its way")
    more_creep: tuple[CreepTerm, ...] = Field(
        (), max_length=3, description="terms of the Prony series besides that one"
    )
    hysteresis: Ratio = Field(ge=0, description="loop width relative to the response")
    response_time: Duration = Field(
        0.02, ge=0, description="by which damping lets the shape lag the pressure"
    )  # a guess: damping ratio of about 0.7 with the mass of the shipped actuators
    inertia: bool = Field(False, description="the actuator's mass counts")
    mullins: Mullins | None = Field(
        None, description="softening by the highest pressure so far; none if it is left out"
    )
    ageing: Ratio = Field(0.0, ge=0, description="growth of the response per decade of load cycles")

    @model_validator(mode="after")
    def _something_is_elastic(self) -> SpecimenVariation:
        total = self.creep + sum(term.share for term in self.more_creep)
        require(
            total < 1,
            f"creep takes {total:.3g} of the response; expected creep and more_creep together "
            "below 1",
        )
        return self


class FiniteElementSpecimen(SpecimenVariation):
    """A specimen that obeys finite elements, on a mesh of its own: gravity and stiffening come
    by themselves."""

    response: Literal["fe"] = Field(description="where the specimen's response comes from")


class BeamSpecimen(SpecimenVariation):
    """A specimen that obeys beam theory, bent away from it as said here: ready at once."""

    response: Literal["beam"] = Field(description="where the specimen's response comes from")
    gravity_offset: Angle = Field(description="mean angle at zero pressure")
    gravity_offset_spread: Angle = Field(
        ge=0, description="standard deviation of `gravity_offset` between specimens"
    )
    stiffening: Ratio = Field(ge=0, description="strength of the nonlinear stiffening, mean")
    stiffening_spread: Ratio = Field(ge=0, description="relative")


class VirtualPneumatics(SpecModel):
    """How what fills the simulated bench differs from an isothermal gas in a tight system."""

    heat_exchange_time: Duration = Field(gt=0, description="gas to wall, time constant")
    leak: Flow = Field(ge=0, description="at 10 kPa gauge, ambient conditions")
    turbulence: bool = Field(False, description="fast flow in the tube may be turbulent")
    minor_loss: Number = Field(
        0.0, ge=0, description="of ends, bends and fittings of the tube, per dynamic pressure"
    )
    inertia: bool = Field(False, description="what flows in the tube has a mass")
    valve_conductance: FlowGain = Field(
        2e-9, gt=0, description="sonic conductance of the open valve, ISO 6358"
    )  # a guess: 0.2 dm3/(s bar), an orifice of about 1 mm
    valve_critical_ratio: Ratio = Field(
        0.3, ge=0, lt=1, description="of pressures at which its flow is sonic, ISO 6358"
    )  # a guess: typical of small solenoid valves


class VirtualSensors(SpecModel):
    """How simulated sensors differ from their data sheets; standard deviations unless said.

    What a bench has hidden is drawn from here, not from the calibrations that it is used with: a
    better calibration finds the same instrument again.
    """

    transducer_noise: Voltage = Field(ge=0, description="of one conversion")
    transducer_offset: Pressure = Field(ge=0, description="before zeroing")
    transducer_gain: Ratio = Field(ge=0, description="relative, about the data sheet's")
    transducer_bow: Pressure = Field(
        ge=0, description="departure from a straight line in the middle of the range"
    )
    transducer_drift: Pressure = Field(ge=0, description="change of the zero over a long time")
    load_cell_sensitivity: Number = Field(gt=0, description="counts per gram, nominal")
    load_cell_gain: Ratio = Field(ge=0, description="relative, of the sensitivity")
    load_cell_bow: Mass = Field(ge=0, description="departure from a straight line at half capacity")
    load_cell_noise: Mass = Field(ge=0, description="of one conversion")
    load_cell_creep: Ratio = Field(ge=0, description="of the share of the load that creeps")
    load_cell_creep_time: Duration = Field(
        gt=0, description="after which the cell's creep has gone 63 % of its way"
    )
    load_cell_drift: Mass = Field(ge=0, description="change of the zero over a long time")
    drift_time: Duration = Field(gt=0, description="correlation time of both zeros")
    bad_word_interval: Duration = Field(gt=0, description="mean time between bad HX711 words")


class VirtualDrive(SpecModel):
    """How the simulated plunger's drive differs from its drawing; plain numbers are relative
    standard deviations."""

    volume_per_step: Ratio = Field(
        ge=0, description="relative standard deviation of the volume of a step"
    )
    dead_volume: Ratio = Field(
        ge=0, description="relative standard deviation of the syringe's dead volume"
    )
    backlash: Ratio = Field(ge=0, description="relative standard deviation of the backlash")
    friction: PlungerFriction | None = Field(
        None, description="none: the seal goes where the nut takes it"
    )
    torque: MotorTorque | None = Field(None, description="none: the motor follows every pulse")


class VirtualReferences(SpecModel):
    """What simulated instruments are calibrated against, and how well that is known."""

    gauge_u: Ratio = Field(ge=0, description="standard deviation of the gauge's scale, relative")
    gauge_resolution: Pressure = Field(ge=0, description="last digit of the gauge")
    mass_u: Ratio = Field(ge=0, description="standard deviation of the set of masses, relative")
    balance_u: Ratio = Field(ge=0, description="standard deviation of the balance's scale")
    balance_resolution: Mass = Field(ge=0, description="last digit of the balance")


class VirtualLens(SpecModel):
    """The simulated lens as its data sheet has it, and how far a specimen may be from that.

    Spreads are standard deviations. The hidden lens is drawn from here, never from a calibration.
    """

    width: Count = Field(le=20_000, description="of the picture, pixels")
    height: Count = Field(le=20_000, description="of the picture in pixels")
    focal: Number = Field(gt=0, description="pixels")
    focal_spread: Ratio = Field(ge=0, description="relative")
    centre_spread: Number = Field(ge=0, description="about the middle of the picture, pixels")
    distortion: tuple[Number, Number, Number, Number, Number] = Field(
        description="k1, k2, p1, p2, k3 of Brown and Conrady"
    )
    distortion_spread: tuple[Number, Number, Number, Number, Number] = Field(
        description="standard deviations of k1, k2, p1, p2 and k3 between cameras"
    )


class VirtualOptics(SpecModel):
    """The simulated camera: its lens, where it stands, and what spoils its picture."""

    lens: VirtualLens = Field(description="the lens that cameras are drawn from")
    distance: Length = Field(gt=0, description="camera to the plane of bending")
    ruler_squareness: Angle = Field(
        ge=0, le=math.radians(2), description="standard deviation of the ruler's right angle"
    )
    tilt: Angle = Field(
        ge=0, le=math.radians(20), description="standard deviation of pan, tilt and roll"
    )
    blur: Number = Field(ge=0, le=20, description="standard deviation of the point spread, pixels")
    noise: Number = Field(ge=0, le=100, description="standard deviation, grey levels of 255")
    light_gradient: Ratio = Field(ge=0, le=1, description="brightness change across the picture")
    latency: Duration = Field(
        0.06, ge=0, le=1, description="mean time from exposure to arrival of a frame"
    )  # a guess: two frames at 30 a second, for reading out, USB and the driver's queue
    latency_spread: Duration = Field(
        0.01, ge=0, le=0.2, description="its standard deviation from camera to camera"
    )  # a guess


class VirtualBench(SpecModel):
    """All that a simulated bench hides from the experiment."""

    specimen: Annotated[FiniteElementSpecimen | BeamSpecimen, Field(discriminator="response")] = (
        Field(description="the printed actuator that is drawn")
    )
    pneumatics: VirtualPneumatics = Field(description="gas, tube and valve")
    drive: VirtualDrive = Field(description="how the real drive differs from the drawing")
    sensors: VirtualSensors = Field(description="noise and drift of transducer and load cell")
    references: VirtualReferences = Field(description="how wrong the reference instruments are")
    optics: VirtualOptics = Field(description="camera, light and ruler")
    substeps: Count = Field(1, le=100, description="of the physics in a millisecond")


class BenchSpec(SpecModel):
    """One bench: hardware, controller gains, safety limits, and for a virtual one its secrets."""

    kind: Literal["bench"] = Field(description="tells that this is a file of this kind")
    name: Name
    description: str = Field("", description="one line for people: what it is and what it is for")
    board: Annotated[VirtualBoard | EmulatedBoard | SerialBoard, Field(discriminator="kind")] = (
        Field(description="what the host talks to")
    )
    syringe: Syringe = Field(description="what displaces the fluid")
    stepper: Stepper = Field(description="what turns the lead screw")
    lead_screw: LeadScrew = Field(description="what pushes the plunger")
    tubing: Tubing = Field(description="between syringe and actuator")
    transducer: Transducer = Field(description="measures the pressure")
    adc: Adc = Field(description="reads the transducer")
    load_cell: LoadCell = Field(description="measures the blocked force")
    camera: Camera = Field(description="looks at the side of the actuator")
    controller: Controller = Field(description="of the pressure, on the board")
    safety: Safety = Field(description="what the board does by itself")
    ambient: Ambient = Field(description="of the room")
    fluid: Annotated[Air | Liquid, Field(discriminator="kind")] = Field(
        Air(), description="what fills the bench"
    )
    virtual: VirtualBench | None = Field(
        None, description="what only a simulated bench needs; none on a real one"
    )

    @property
    def simulated(self) -> bool:
        """Whether board, plant and camera are simulated."""
        return not isinstance(self.board, SerialBoard)

    @property
    def volume_per_step(self) -> float:
        """Volume in m3 that one step pulse sweeps."""
        pulses = self.stepper.steps_per_revolution * self.stepper.microsteps
        return self.syringe.area * self.lead_screw.lead / pulses

    @model_validator(mode="after")
    def _parts_fit_together(self) -> BenchSpec:
        problems = []
        if self.safety.pressure > self.transducer.pressure_high:
            problems.append(
                f"safety.pressure is {self.safety.pressure / 1e3:g} kPa, beyond what the "
                f"transducer can see; expected at most transducer.pressure_high, "
                f"{self.transducer.pressure_high / 1e3:g} kPa"
            )
        if self.transducer.voltage_high > self.adc.reference:
            problems.append(
                f"transducer.voltage_high is {self.transducer.voltage_high:g} V, beyond what the "
                f"converter can see; expected at most adc.reference, {self.adc.reference:g} V"
            )
        if self.simulated and self.virtual is None:
            problems.append(
                f"a board of kind '{self.board.kind}' needs the section 'virtual'; see "
                "models/benches"
            )
        if self.simulated != isinstance(self.camera.device, VirtualCameraDevice):
            problems.append(
                f"board.kind is '{self.board.kind}' but camera.device.kind is "
                f"'{self.camera.device.kind}'; expected both simulated or both real"
            )
        if isinstance(self.fluid, Liquid) and self.controller.feed_forward > 0:
            problems.append(
                "the fluid is a liquid, but controller.feed_forward is the flow that compresses a "
                "gas; expected 0"
            )
        require(not problems, "; ".join(problems))
        return self
