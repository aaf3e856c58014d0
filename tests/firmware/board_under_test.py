"""The native firmware on its test bench, spoken to in SLCAN and decoded by cantools.

Nothing of rig.link is used: two independent ends must agree on the schema.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cantools
from rig.board._firmware import ffi, lib

ROOT = Path(__file__).resolve().parents[2]
SCHEMA_FILE = ROOT / "firmware" / "rig.dbc"
SCHEMA = cantools.database.load_file(SCHEMA_FILE)
MESSAGES = {message.frame_id: message for message in SCHEMA.messages}
PROTOCOL_VERSION = 1
POWER_ON = 1
OPENING = b"C\rS6\r\rO\rO\r"
PARAMETERS = {
    str(name): index
    for index, name in SCHEMA.get_message_by_name("PARAMETER")
    .get_signal_by_name("parameter_index")
    .choices.items()
}
STATES = {
    value: str(name)
    for value, name in SCHEMA.get_message_by_name("HEARTBEAT")
    .get_signal_by_name("state")
    .choices.items()
}
ALIVE_COUNT = 15

Values = dict[str, Any]


def crc8(data: bytes) -> int:
    """CRC-8 SAE J1850 bit by bit, as the standard defines it."""
    crc = 0xFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0x1D if crc & 0x80 else crc << 1) & 0xFF
    return crc ^ 0xFF


def protected(name: str, alive: int, values: Values) -> bytes:
    """Payload of a message with alive counter and CRC."""
    message = SCHEMA.get_message_by_name(name)
    filled = {s.name: s.minimum or 0 for s in message.signals}
    payload = message.encode({**filled, "crc": 0, **values, "alive": alive}, strict=False)
    identifier = bytes((message.frame_id & 0xFF, message.frame_id >> 8))
    return bytes((crc8(identifier + payload[1:]),)) + payload[1:]


def line_of(frame_id: int, payload: bytes) -> bytes:
    """SLCAN line of a data frame."""
    return b"t%03X%d%s\r" % (frame_id, len(payload), payload.hex().upper().encode())


class Board:
    """A board that has been switched on, on a bench whose physics is in C.

    `bench` gives access to the bench's state and its scriptable faults, `conditions` sets it before
    the gas is filled in.
    """

    def __init__(
        self,
        seed: int = 1,
        *,
        plunger_ml: float = 5.0,
        reset_cause: int = POWER_ON,
        nonvolatile: bytes | None = None,
        opening: bytes = OPENING,
        conditions: dict[str, float] | None = None,
    ) -> None:
        self.host = ffi.gc(lib.rig_host_new(0xABC123, reset_cause), lib.rig_host_free)
        self._bench = ffi.gc(lib.rig_test_bench_new(seed), lib.rig_test_bench_free)
        self.bench = lib.rig_test_bench_access(self._bench)
        for name, value in (conditions or {}).items():
            setattr(self.bench, name, value)
        lib.rig_test_bench_place(self._bench, plunger_ml)
        if nonvolatile is not None:
            lib.rig_host_nonvolatile_load(self.host, nonvolatile)
        self.messages: list[tuple[str, Values]] = []
        self.other_lines: list[bytes] = []
        self.heartbeats_on = True
        self._alive: dict[str, int] = {}
        self._number = 0
        self._rest = b""
        self._next_heartbeat_ms = 0
        self.type(opening)

    # --- the line ---

    def type(self, data: bytes) -> None:
        """Bytes from host to board."""
        lib.rig_host_receive(self.host, data, len(data))

    def send(self, name: str, **values: float | str) -> None:
        """A protected frame with the next alive counter."""
        alive = self._alive.get(name, 0)
        self._alive[name] = (alive + 1) % ALIVE_COUNT
        frame_id = SCHEMA.get_message_by_name(name).frame_id
        self.type(line_of(frame_id, protected(name, alive, values)))

    def run(self, milliseconds: int) -> None:
        """Let time pass, with heartbeats as a host sends them, and decode what was sent."""
        while milliseconds > 0:
            if self.heartbeats_on and self.time_ms >= self._next_heartbeat_ms:
                self.send("HOST_HEARTBEAT", protocol_version=PROTOCOL_VERSION)
                self._next_heartbeat_ms = self.time_ms + 200
            step = min(milliseconds, 50)
            lib.rig_host_run(self.host, lib.rig_test_bench_step, self._bench, step, 0)
            milliseconds -= step
        self._decode()

    def _decode(self) -> None:
        count = lib.rig_host_pending(self.host)
        buffer = ffi.new("uint8_t[]", count + 1)
        lib.rig_host_transmit(self.host, buffer, count)
        *lines, self._rest = (self._rest + bytes(ffi.buffer(buffer, count))).split(b"\r")
        for line in lines:
            if not line.startswith(b"t"):
                self.other_lines.append(line)
                continue
            message = MESSAGES[int(line[1:4], 16)]
            payload = bytes.fromhex(line[5:21].decode())
            assert payload[0] == crc8(
                bytes((message.frame_id & 0xFF, message.frame_id >> 8)) + payload[1:]
            )
            self.messages.append((message.name, message.decode(payload)))

    @property
    def time_ms(self) -> int:
        """Time since switching on."""
        return int(lib.rig_host_time_ms(self.host))

    @property
    def counters(self) -> Any:
        """What the board's link counted."""
        return lib.rig_host_link_counters(self.host)

    # --- what it said ---

    def all(self, name: str) -> list[Values]:
        """Every message of a name so far."""
        return [values for n, values in self.messages if n == name]

    def last(self, name: str) -> Values:
        """The latest message of a name."""
        return self.all(name)[-1]

    @property
    def state(self) -> str:
        return str(self.last("HEARTBEAT")["state"])

    @property
    def fault(self) -> str:
        return str(self.last("HEARTBEAT")["fault_code"])

    # --- what it is told ---

    def command(self, opcode: str, argument: float = 0.0, number: int | None = None) -> str:
        """Give a command; returns its result."""
        if number is None:
            self._number = self._number % 255 + 1
            number = self._number
        self.send("COMMAND", opcode=opcode, number=number, argument=argument)
        self.run(4)
        heartbeat = self.last("HEARTBEAT")
        assert heartbeat["command_number"] == number
        return str(heartbeat["command_result"])

    def parameter(self, operation: str, index: int | str, value: float = 0.0) -> Values:
        """Ask for a parameter; returns the board's answer."""
        if isinstance(index, str):
            index = PARAMETERS[index]
        self._number = self._number % 255 + 1
        self.send(
            "PARAMETER_REQUEST",
            operation=operation,
            number=self._number,
            parameter_index=index,
            parameter_value=value,
        )
        self.run(4)
        answer = self.last("PARAMETER")
        assert answer["number"] == self._number
        return answer

    def write(self, **parameters: float) -> None:
        """Write parameters that the board must accept."""
        for name, value in parameters.items():
            assert self.parameter("write", name, value)["parameter_result"] == "accepted"

    def until(self, state: str, timeout_ms: int) -> int:
        """Run until a state is reported; returns the milliseconds it took."""
        start = self.time_ms
        while self.time_ms - start < timeout_ms:
            self.run(20)
            if self.state == state:
                return self.time_ms - start
        raise AssertionError(f"still {self.state} ({self.fault}) after {timeout_ms} ms")

    def ready(self) -> Board:
        """Home and zero, as before every experiment."""
        self.run(200)
        assert self.command("home") == "accepted"
        self.until("idle", 60_000)
        assert self.command("zero_pressure") == "accepted"
        self.run(1100)
        return self

    def at(self, pressure_kpa: float, settle_ms: int = 8000) -> Board:
        """Ready, and regulating at a pressure."""
        self.ready()
        assert self.command("set_pressure", pressure_kpa) == "accepted"
        self.run(settle_ms)
        return self

    def true_pressure(self, milliseconds: int) -> tuple[float, float, float]:
        """Mean, least and greatest pressure of the bench over a time."""
        out = ffi.new("double[3]")
        total, least, greatest, done = 0.0, float("inf"), float("-inf"), 0
        while done < milliseconds:
            self.run(1)
            step = min(100, milliseconds - done)
            lib.rig_test_run(self.host, self._bench, step, out, out + 1, out + 2)
            total += out[0] * step
            least, greatest = min(least, out[1]), max(greatest, out[2])
            done += step
        return total / milliseconds, least, greatest
