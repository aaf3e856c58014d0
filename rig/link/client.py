"""The host's side of the link: handshake, acknowledged commands, parameters, telemetry.

Time lives here: an experiment waits only by `receive`, in bench time, so the same code runs
against a real board and, many times faster, against a simulated one.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from rig.link import e2e
from rig.link.bus import FrameBus
from rig.link.errors import (
    BoardFaultError,
    CommandRefusedError,
    IdentityError,
    LinkError,
    LinkLostError,
    UnexpectedStateError,
)
from rig.link.faults import HINTS
from rig.link.schema import Schema, load_schema
from rig.link.slcan import RawFrame

HEARTBEAT_PERIOD_S = 0.2
POLL_S = 0.1
"""Bench time of one `receive` while nothing is urgent."""
ACKNOWLEDGE_POLL_S = 0.02
RESEND_S = 0.3
REOPEN_S = 1.0
"""After this much silence the channel is opened again: a board that restarted says why, then."""
SAVE_S = 0.5
"""The board writes a byte in 3.4 ms; it has 92."""
SILENCE_S = 2.0
"""The link counts as lost when no intact frame came for this long."""


class Message(NamedTuple):
    """A decoded message: bench time in seconds, name and values as in the schema."""

    time_s: float
    name: str
    values: dict[str, float | int]


@dataclass(frozen=True)
class Identity:
    """Who answers at the other end."""

    board: str
    protocol_version: int
    schema_crc: int
    firmware_git: str
    """First six hexadecimal digits of the firmware's commit."""


@dataclass(frozen=True)
class BoardStatus:
    """The last heartbeat in words."""

    time_s: float
    state: str
    fault: str
    homed: bool
    zeroed: bool
    tared: bool
    valve_open: bool
    home_switch: bool
    end_switch: bool
    emergency_stop: bool
    uptime_s: int
    reset_cause: str
    command_number: int
    """Of the last command that the board processed."""
    command_result: str
    """What it made of that: accepted, or why not."""


@dataclass
class LinkStatistics:
    """How well the link did."""

    frames: int = 0
    corrupt: int = 0
    unknown: int = 0
    resent_commands: int = 0
    host_stall_s: float = 0.0
    """Longest bench time between two of our heartbeats."""
    answers: int = 0
    round_trip_s: float = 0.0
    """Mean bench time from a request or command to its answer, as far as polls resolve it."""
    longest_round_trip_s: float = 0.0

    def add_round_trip(self, duration_s: float) -> None:
        """Note one answer."""
        self.answers += 1
        self.round_trip_s += (duration_s - self.round_trip_s) / self.answers
        self.longest_round_trip_s = max(self.longest_round_trip_s, duration_s)


Tap = Callable[[Sequence[RawFrame], Sequence[Message]], None]
"""Sees every batch of received frames with its decoded messages, for the record."""


class RigLink:
    """A conversation with one board.

    `interrupted` is asked in every `receive` and may raise to stop an experiment safely.
    """

    def __init__(
        self,
        bus: FrameBus,
        schema: Schema | None = None,
        *,
        interrupted: Callable[[], None] | None = None,
    ) -> None:
        self._bus = bus
        self._schema = schema or load_schema()
        self._tap: Tap | None = None
        self._interrupted = interrupted
        self._alive: dict[int, int] = {}
        self._command_number = 0
        self._posted: tuple[int, str, float] | None = None
        self._request_number = 0
        self._expected_state: str | None = None
        self._last_heartbeat_s = float("-inf")
        self._last_intact_s = bus.now_s
        self._reopened = False
        self._monitor = e2e.AliveMonitor()
        self._states = self._schema.choices("HEARTBEAT", "state")
        self._faults = self._schema.choices("HEARTBEAT", "fault_code")
        self._reset_causes = self._schema.choices("HEARTBEAT", "reset_cause")
        self._results = self._schema.choices("HEARTBEAT", "command_result")
        self._opcodes = {n: v for v, n in self._schema.choices("COMMAND", "opcode").items()}
        self.statistics = LinkStatistics()
        self.identity: Identity | None = None
        self.status: BoardStatus | None = None
        self._fault_detail: tuple[str, float, float] | None = None
        self._raise_faults = True

    @property
    def now_s(self) -> float:
        """Bench time in seconds."""
        return self._bus.now_s

    @property
    def name(self) -> str:
        """Where the board is."""
        return self._bus.name

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Parameters of the board, in the order of their indices."""
        return tuple(self._schema.parameters)

    @property
    def frames_lost(self) -> int:
        """Frames that the alive counters say were lost."""
        return self._monitor.lost

    # --- receiving -------------------------------------------------------------------------

    def receive(self, duration_s: float = POLL_S) -> list[Message]:
        """Let bench time pass and return the messages that came.

        Raises BoardFaultError when the board latched a fault, LinkLostError after two seconds
        of silence, and whatever `interrupted` raises.
        """
        if self._interrupted is not None:
            self._interrupted()
        self._send_heartbeat_if_due()
        frames = self._bus.poll(duration_s)
        messages = [m for f in frames if (m := self._accept(f)) is not None]
        if self._tap is not None and frames:
            self._tap(frames, messages)
        for message in messages:
            self._note(message)
        self._check_silence()
        if self._raise_faults:
            self._check_fault()
            self._check_state()
            self._check_posted()
        return messages

    def wait(self, duration_s: float) -> list[Message]:
        """Receive for `duration_s` of bench time; return all messages."""
        end_s = self.now_s + duration_s
        messages: list[Message] = []
        while (left_s := end_s - self.now_s) > 1e-9:
            messages += self.receive(min(POLL_S, left_s))
        return messages

    def _accept(self, frame: RawFrame) -> Message | None:
        if not e2e.is_intact(frame.frame_id, frame.payload):
            self.statistics.corrupt += 1
            return None
        if not self._monitor.observe(frame.frame_id, frame.payload):
            return None
        decoded = self._schema.decode(frame.frame_id, frame.payload)
        if decoded is None:
            self.statistics.unknown += 1
            return None
        self.statistics.frames += 1
        self._last_intact_s = self.now_s
        self._reopened = False
        return Message(frame.time_s, *decoded)

    def _note(self, message: Message) -> None:
        values = message.values
        if message.name == "HEARTBEAT":
            self.status = BoardStatus(
                time_s=message.time_s,
                state=self._state(message),
                fault=self._faults.get(int(values["fault_code"]), "unknown"),
                homed=bool(values["homed"]),
                zeroed=bool(values["zeroed"]),
                tared=bool(values["tared"]),
                valve_open=bool(values["valve_open"]),
                home_switch=bool(values["home_switch"]),
                end_switch=bool(values["end_switch"]),
                emergency_stop=bool(values["emergency_stop"]),
                uptime_s=int(values["uptime_s"]),
                reset_cause=self._reset_causes.get(int(values["reset_cause"]), "unknown"),
                command_number=int(values["command_number"]),
                command_result=self._results.get(int(values["command_result"]), "unknown"),
            )
        elif message.name == "FAULT":
            code = self._faults.get(int(values["code"]), "unknown")
            found_s = message.time_s - float(values["age_s"])
            self._fault_detail = (code, float(values["fault_value"]), found_s)

    def _state(self, heartbeat: Message) -> str:
        return self._states.get(int(heartbeat.values["state"]), "unknown")

    def _check_silence(self) -> None:
        silent_s = self.now_s - self._last_intact_s
        if silent_s > REOPEN_S and not self._reopened:
            self._reopened = True
            self._bus.reopen()
        if silent_s > SILENCE_S:
            raise LinkLostError(
                f"nothing intelligible came from the board at {self._bus.name} for "
                f"{silent_s:.1f} s (frames with a wrong checksum: {self.statistics.corrupt}). "
                "The firmware's own watchdog vents the bench. Check the cable and the board's "
                "power, then `rig resume` the run."
            )

    def _check_fault(self) -> None:
        if self.status is None or self.status.fault == "none":
            return
        code = self.status.fault
        value, time_s = None, self.status.time_s
        if self._fault_detail is not None and self._fault_detail[0] == code:
            _, value, time_s = self._fault_detail
        raise BoardFaultError(code, value, time_s, HINTS.get(code, ""))

    def expect_state(self, state: str | None) -> None:
        """From now on `receive` raises UnexpectedStateError when the board is in another state.

        A board that restarts comes back idle and without a fault; this is how it is noticed.
        """
        self._expected_state = state

    def _check_state(self) -> None:
        if self._expected_state is None or self.status is None:
            return
        if self.status.state != self._expected_state:
            raise UnexpectedStateError(
                f"the board at {self._bus.name} left the state '{self._expected_state}' without "
                f"being told to: it is in '{self.status.state}', up for {self.status.uptime_s} s"
                f"{'' if self.status.homed else ' and not homed'}. Did it lose its supply or was "
                "it reset? Check both, then `rig resume` the run."
            )

    def _check_posted(self) -> None:
        if self._posted is None or self.status is None:
            return
        number, opcode, argument = self._posted
        if self.status.command_number == number:
            self._posted = None
            if self.status.command_result != "accepted":
                raise self._refused(opcode, argument, self.status.command_result)

    def _refused(self, opcode: str, argument: float, result: str) -> CommandRefusedError:
        state = self.status.state if self.status else "unknown"
        return CommandRefusedError(
            f"the board refused '{opcode}' ({argument:g}): {result}; its state is '{state}'. "
            f"{_REFUSAL_HINTS.get(result, '')}"
        )

    # --- sending ---------------------------------------------------------------------------

    def _send(self, message: str, **values: float) -> None:
        frame_id, payload = self._schema.encode(message, values)
        alive = self._alive.get(frame_id, -1) + 1
        self._alive[frame_id] = alive % e2e.ALIVE_COUNT
        self._bus.send(frame_id, e2e.protect(frame_id, payload, alive))

    def _send_heartbeat_if_due(self) -> None:
        since_s = self.now_s - self._last_heartbeat_s
        if since_s >= HEARTBEAT_PERIOD_S - 1e-9:
            if since_s < float("inf"):
                self.statistics.host_stall_s = max(self.statistics.host_stall_s, since_s)
            self._last_heartbeat_s = self.now_s
            self._send("HOST_HEARTBEAT", protocol_version=self._schema.protocol_version)

    def open(self, timeout_s: float = 5.0) -> Identity:
        """Greet the board and check that both ends speak the same schema.

        Raises LinkLostError if nothing answers and IdentityError on a version mismatch.
        """
        self._raise_faults = False
        answer = self._ask("IDENTITY_REQUEST", "IDENTITY", {}, timeout_s, numbered=False)
        kinds = self._schema.choices("IDENTITY", "board_kind")
        identity = Identity(
            board=kinds.get(int(answer["board_kind"]), "unknown"),
            protocol_version=int(answer["protocol_version"]),
            schema_crc=int(answer["schema_crc"]),
            firmware_git=f"{int(answer['firmware_git']):06x}",
        )
        ours = (self._schema.protocol_version, self._schema.crc)
        theirs = (identity.protocol_version, identity.schema_crc)
        if theirs != ours:
            raise IdentityError(
                f"the firmware at {self._bus.name} (commit {identity.firmware_git}) speaks "
                f"protocol {theirs[0]} with schema {theirs[1]:04x}, this host speaks protocol "
                f"{ours[0]} with schema {ours[1]:04x}. Nothing was moved. Flash the firmware "
                "that belongs to this version of rig, or install the rig that belongs to it."
            )
        self.identity = identity
        # numbers of an earlier conversation must not look like repeats of ours
        self._await_heartbeat(timeout_s)
        return identity

    def _await_heartbeat(self, timeout_s: float) -> None:
        end_s = self.now_s + timeout_s
        while self.now_s < end_s:
            for message in self.receive(ACKNOWLEDGE_POLL_S):
                if message.name == "HEARTBEAT" and self._state(message) != "boot":
                    self._command_number = int(message.values["command_number"])
                    return
        raise LinkLostError(
            f"the board at {self._bus.name} answered but sends no heartbeat, or does not "
            "leave its boot state; reset the board."
        )

    def set_tap(self, tap: Tap | None) -> None:
        """Whom to show every batch of frames and messages from now on."""
        self._tap = tap

    def ignore_interruptions(self) -> None:
        """Stop asking `interrupted`: the bench is being made safe."""
        self._interrupted = None

    def raise_faults(self, enabled: bool) -> None:
        """Whether `receive` raises BoardFaultError; off while making the bench safe."""
        self._raise_faults = enabled

    @property
    def command_names(self) -> tuple[str, ...]:
        """What `command` takes."""
        return tuple(self._opcodes)

    def command(self, opcode: str, argument: float = 0.0, timeout_s: float = 2.0) -> None:
        """Send a command and wait for its acknowledgement; it is sent again until then.

        `argument` is in the unit of the command (kPa for set_pressure, mL/s for jog). Raises
        CommandRefusedError with the board's reason, LinkLostError when no answer comes.
        """
        self._posted = None
        number, values = self._numbered(opcode, argument)
        end_s = self.now_s + timeout_s
        sent_s = float("-inf")
        while self.now_s < end_s:
            if self.now_s - sent_s >= RESEND_S:
                self.statistics.resent_commands += sent_s > float("-inf")
                sent_s = self.now_s
                self._send("COMMAND", **values)
            for message in self.receive(ACKNOWLEDGE_POLL_S):
                if message.name == "HEARTBEAT" and message.values["command_number"] == number:
                    self.statistics.add_round_trip(self.now_s - sent_s)
                    result = self._results.get(int(message.values["command_result"]), "unknown")
                    if result != "accepted":
                        raise self._refused(opcode, argument, result)
                    return
        raise LinkLostError(
            f"the board at {self._bus.name} did not acknowledge '{opcode}' within {timeout_s:g} s; "
            "check the cable and the board."
        )

    def post(self, opcode: str, argument: float = 0.0) -> None:
        """Send a command once and go on; for streams in which the next replaces a lost one.

        A later `receive` raises CommandRefusedError if the board refuses it.
        """
        number, values = self._numbered(opcode, argument)
        self._posted = (number, opcode, argument)
        self._send("COMMAND", **values)

    def _numbered(self, opcode: str, argument: float) -> tuple[int, dict[str, float]]:
        # the board takes the number of its last command for a repetition: count commands apart
        number = self._command_number = self._command_number % 255 + 1
        return number, {"opcode": self._opcodes[opcode], "number": number, "argument": argument}

    def await_state(self, wanted: str, timeout_s: float) -> None:
        """Receive until the board is in the state `wanted`."""
        end_s = self.now_s + timeout_s
        while self.now_s < end_s:
            self.receive()
            if self.status is not None and self.status.state == wanted:
                return
        state = self.status.state if self.status else "unknown"
        raise LinkError(
            f"the board did not reach the state '{wanted}' within {timeout_s:g} s; it is in "
            f"'{state}'. Check the plunger, the home switch and the valve."
        )

    # --- parameters ------------------------------------------------------------------------

    def read_parameter(self, name: str) -> float:
        """Value of a parameter in the unit of its name."""
        return self._parameter("read", name, 0.0)

    def write_parameter(self, name: str, value: float) -> float:
        """Set a parameter; returns the value now in force (single precision).

        Raises CommandRefusedError when the board finds it out of range.
        """
        echoed = self._parameter("write", name, value)
        (expected,) = struct.unpack("<f", struct.pack("<f", value))
        if echoed != expected:
            raise LinkError(
                f"the board holds {echoed:g} for the parameter {name} after {value:g} was written"
            )
        return echoed

    def save_parameters(self) -> None:
        """Have the board keep its parameters; returns when they are in its memory."""
        self._parameter("save", self.parameter_names[0], 0.0)
        self.wait(SAVE_S)

    def _parameter(self, operation: str, name: str, value: float) -> float:
        operations = {
            n: v for v, n in self._schema.choices("PARAMETER_REQUEST", "operation").items()
        }
        request = {
            "operation": operations[operation],
            "parameter_index": self._schema.parameters[name].index,
            "parameter_value": value,
        }
        answer = self._ask("PARAMETER_REQUEST", "PARAMETER", request, 2.0, numbered=True)
        results = self._schema.choices("PARAMETER", "parameter_result")
        result = results.get(int(answer["parameter_result"]), "unknown")
        if result != "accepted":
            raise CommandRefusedError(
                f"the board refused to {operation} the parameter {name} = {value:g}: {result}. "
                f"{self._parameter_hint(result, name)}"
            )
        return float(answer["parameter_value"])

    def _parameter_hint(self, result: str, name: str) -> str:
        rule = self._schema.parameters[name]
        if result == "out_of_range":
            return f"It takes {rule.low:g} to {rule.high:g} {rule.unit}".rstrip() + "."
        return "It is written only while the board is idle." if result == "wrong_state" else ""

    def _ask(
        self,
        request: str,
        reply: str,
        values: dict[str, float],
        timeout_s: float,
        *,
        numbered: bool,
    ) -> dict[str, float | int]:
        """Send a request until its reply comes; return the reply's values."""
        number = self._request_number = self._request_number % 255 + 1
        end_s = self.now_s + timeout_s
        sent_s = float("-inf")
        while self.now_s < end_s:
            if self.now_s - sent_s >= RESEND_S:
                sent_s = self.now_s
                self._send(request, number=number, **values)
            for message in self.receive(ACKNOWLEDGE_POLL_S):
                if message.name == reply and (not numbered or message.values["number"] == number):
                    self.statistics.add_round_trip(self.now_s - sent_s)
                    return message.values
        raise LinkLostError(
            f"no answer from {self._bus.name} within {timeout_s:g} s: is it a rig board, is it "
            "powered, and is no other program using the port?"
        )

    def ping(self, resolution_s: float = 0.001, timeout_s: float = 1.0) -> float:
        """Bench time in seconds from a request to its answer; raises LinkLostError if none."""
        sent_s = self.now_s
        self._send("IDENTITY_REQUEST", number=1)
        while self.now_s < sent_s + timeout_s:
            if any(m.name == "IDENTITY" for m in self.receive(resolution_s)):
                return self.now_s - sent_s
        raise LinkLostError(
            f"the board at {self._bus.name} did not answer within {timeout_s:g} s; check the cable."
        )

    def close(self) -> None:
        """Release the bus."""
        self._bus.close()


_REFUSAL_HINTS = {
    "out_of_range": "Choose a value within the board's limits (safety section of the bench).",
    "wrong_state": "Wait until the board is idle, or vent first.",
    "not_homed": "Home the plunger first.",
    "not_zeroed": "Zero the pressure first, with the valve open.",
    "faulted": "Remove the cause, then clear the fault.",
    "busy": "Wait until the running action has ended.",
}
