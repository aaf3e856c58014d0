"""What each fault code means for the person at the bench."""

from __future__ import annotations

HINTS: dict[str, str] = {
    "over_pressure": "The pressure went above the board's limit: look for a blocked tube or "
    "a limit set too low (safety.pressure of the bench), then vent and clear the fault.",
    "sensor_open": "The transducer's voltage is below its range: check its supply and wiring.",
    "sensor_short": "The transducer's voltage is above its range: check its wiring to A0.",
    "sensor_stuck": "The plunger moved but the transducer's reading did not change for this long: "
    "check that the tube is on and the transducer is not clogged.",
    "rate_implausible": "The pressure changed faster than the plunger can cause: look for "
    "a burst actuator, a tube that came off, or electrical noise.",
    "leak": "The plunger had to push this much more air to hold the pressure: look for a leak "
    "at the actuator, the tube or the valve. If there is none, the transducer does not follow the "
    "pressure, and the last points of this run are not to be trusted.",
    "travel_limit": "The plunger reached the end of its travel, or a limit switch closed "
    "where it should not: the system holds more air than the syringe can compress, or the "
    "plunger lost steps; look for a leak, a stalled motor, or use a larger syringe.",
    "hx711_timeout": "No conversion from the load cell for this long, and restarting its "
    "HX711 did not help: check its supply, clock and data lines.",
    "hx711_desync": "The load cell's words are implausible, and restarting its HX711 did not "
    "help: check its clock line.",
    "communication_lost": "The board heard nothing from the host for this long: check the USB "
    "cable and that the computer did not sleep.",
    "watchdog_reset": "The firmware hung and was restarted by its watchdog: report this as a bug.",
    "emergency_stop": "The emergency stop was pressed: release it when the bench is safe.",
    "brown_out": "The board's supply sagged: use a separate supply for the stepper.",
    "parameters_corrupt": "The stored parameters are damaged; defaults are in force: write them "
    "again.",
    "homing_failed": "The home switch was not reached within the syringe's travel: check the "
    "switch, the motor's supply and the direction of travel.",
}
"""A hint for each fault name of the schema."""

VALUE_UNITS: dict[str, str] = {
    "over_pressure": "kPa",
    "sensor_open": "V",
    "sensor_short": "V",
    "sensor_stuck": "s",
    "rate_implausible": "kPa/s",
    "leak": "mL",
    "travel_limit": "mL",
    "hx711_timeout": "s",
    "hx711_desync": "counts",
    "communication_lost": "s",
    "homing_failed": "mL",
}
"""Unit of the value that comes with a fault; the others have none."""
