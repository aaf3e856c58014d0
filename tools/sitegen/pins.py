"""The wiring of the Mega, read from the firmware's own pin header.

The header names bits of the processor's ports; which digital pin of the board each one is comes
from the Mega 2560's pin mapping (Arduino documentation, "ATmega2560-Arduino pin mapping").
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

HEADER = Path("firmware/rig_mega/src/hal/mega/pins.h")

_PORTS = {"A": [f"D{22 + bit}" for bit in range(8)], "C": [f"D{37 - bit}" for bit in range(8)]}
_BIT = re.compile(r"constexpr uint8_t (k\w+) = _BV\(P([A-L])([0-7])\);\s*//\s*(D\d+)(?:, (.*))?")
_CHANNEL = re.compile(r"constexpr uint8_t (k\w+)Channel = (\d+);")


@dataclass(frozen=True)
class Wire:
    """What one constant of the header is to the person who wires the bench."""

    device: str
    terminal: str
    note: str


WIRES = {
    "kPressure": Wire(
        "transducer", "signal, 0 to 5 V", "1 MOhm to ground, so that a broken wire reads 0 V"
    ),
    "kStep": Wire("stepper driver", "STEP", ""),
    "kDirection": Wire("stepper driver", "DIR", ""),
    "kMotorOff": Wire("stepper driver", "ENABLE", ""),
    "kValve": Wire(
        "valve driver", "input", "inverting driver and a valve that is open without current"
    ),
    "kHomeSwitch": Wire("home switch", "to ground", "normally closed; plunger fully out"),
    "kEndSwitch": Wire("end switch", "to ground", "normally closed; plunger fully in"),
    "kEmergencyStop": Wire(
        "emergency stop", "to ground", "normally closed; its other contact cuts the motor's supply"
    ),
    "kHx711Data": Wire("HX711", "DOUT", ""),
    "kHx711Clock": Wire("HX711", "SCK", ""),
}
"""By the header's names."""


class PinError(ValueError):
    """The header says what this module does not understand or know."""


@dataclass(frozen=True)
class Pin:
    """A pin of the Mega and what hangs on it."""

    name: str
    """As printed on the board: A0, D22."""
    port: str
    """Of the processor: PA0; empty for an analogue channel."""
    wire: Wire
    note: str
    """The header's own remark, then ours."""


def read_pins(header: str) -> list[Pin]:
    """The pins of a header's text, in its order; raises PinError for a pin that has no wire here,
    a wire without a pin, or a remark that names another pin than the port's bit is."""
    pins = [_pin(constant, f"A{channel}", "", "") for constant, channel in _CHANNEL.findall(header)]
    for constant, port, bit, said, remark in _BIT.findall(header):
        name = _PORTS.get(port, [""] * 8)[int(bit)]
        if name != said:
            raise PinError(f"{constant}: P{port}{bit} is {name or 'unknown'}, not {said}")
        pins.append(_pin(constant, name, f"P{port}{bit}", remark))
    constants = set(re.findall(r"constexpr uint8_t (k\w+?)(?:Channel)? = ", header)) - {"kSafe"}
    found = {constant for constant, wire in WIRES.items() if any(p.wire is wire for p in pins)}
    if constants != found or found != set(WIRES):
        raise PinError(f"pins of the header and wires differ: {sorted(constants ^ set(WIRES))}")
    return pins


def _pin(constant: str, name: str, port: str, remark: str) -> Pin:
    if constant not in WIRES:
        raise PinError(f"{constant}: what is it? Add it to WIRES")
    wire = WIRES[constant]
    return Pin(name, port, wire, "; ".join(filter(None, (remark, wire.note))))


def wiring_table(pins: list[Pin]) -> str:
    """Markdown table of the wiring."""
    rows = ["| Mega | port | goes to | terminal | note |", "| --- | --- | --- | --- | --- |"]
    rows += [
        f"| {pin.name} | {pin.port} | {pin.wire.device} | {pin.wire.terminal} | {pin.note} |"
        for pin in pins
    ]
    return "\n".join(rows)


def wiring_diagram(pins: list[Pin]) -> str:
    """SVG: the Mega on the left, a box for each device on the right, a line for each wire."""
    row, top, board_right, device_left, width = 26, 44, 150, 330, 560
    devices = list(dict.fromkeys(pin.wire.device for pin in pins))
    gap = 12
    lines, y = [], top
    boxes: dict[str, tuple[int, int]] = {}
    for device in devices:
        wires = [pin for pin in pins if pin.wire.device == device]
        boxes[device] = (y, row * len(wires))
        for pin in wires:
            middle = y + row // 2
            lines += [
                f'<circle cx="{board_right}" cy="{middle}" r="4"/>',
                f'<path d="M{board_right} {middle}H{device_left}"/>',
                f'<text x="{board_right - 10}" y="{middle + 5}" text-anchor="end">'
                f"{pin.name}</text>",
                f'<text x="{device_left + 10}" y="{middle + 5}">{pin.wire.terminal}</text>',
            ]
            y += row
        y += gap
    height = y + 8
    frames = [
        f'<rect x="20" y="{top - 8}" width="{board_right - 20}" height="{y - top + 4}" rx="6"/>',
        '<text x="85" y="24" text-anchor="middle" font-weight="bold">Arduino Mega 2560</text>',
    ]
    for device, (start, tall) in boxes.items():
        frames += [
            f'<rect x="{device_left}" y="{start}" width="{width - device_left - 10}" '
            f'height="{tall}" rx="4"/>',
            f'<text x="{width - 20}" y="{start + 18}" text-anchor="end" '
            f'font-weight="bold">{device}</text>',
        ]
    style = (
        ".wiring text{font:14px sans-serif;fill:currentColor;stroke:none}"
        ".wiring{fill:none;stroke:currentColor}.wiring circle{fill:currentColor}"
    )
    return (
        f'<svg class="wiring" viewBox="0 0 {width} {height}" role="img" '
        f'aria-label="Wiring of the Mega; the table holds the same">'
        f"<style>{style}</style>{''.join(frames + lines)}</svg>"
    )
