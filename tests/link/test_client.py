"""The host's conversation, against a board that is a small script in this file."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import pytest

from rig.link import e2e
from rig.link.client import RigLink
from rig.link.errors import (
    BoardFaultError,
    CommandRefusedError,
    IdentityError,
    LinkLostError,
    UnexpectedStateError,
)
from rig.link.faults import HINTS, VALUE_UNITS
from rig.link.schema import load_schema
from rig.link.slcan import RawFrame

SCHEMA = load_schema()


class ScriptedBoard:
    """A FrameBus with a board behind it that answers as told."""

    name = "scripted"

    def __init__(self) -> None:
        self.now_s = 0.0
        self.received: list[tuple[str, dict[str, float | int]]] = []
        self.drop_commands = 0
        self.result = 0
        self.silent = False
        self.reopened = 0
        self.answers_when_reopened = False
        self.fault = 0
        self.state = 1
        self.schema_crc = SCHEMA.crc
        self.corrupt: Callable[[bytes], bytes] = lambda payload: payload
        self._outbox: list[RawFrame] = []
        self._alive: dict[int, int] = {}
        self._command_number = 41
        self._next_heartbeat_s = 0.0
        self.parameters: dict[int, float] = {}

    def _reply(self, message: str, **values: float) -> None:
        frame_id, payload = SCHEMA.encode(message, values)
        alive = self._alive.get(frame_id, -1) + 1
        self._alive[frame_id] = alive
        payload = self.corrupt(e2e.protect(frame_id, payload, alive))
        self._outbox.append(RawFrame(self.now_s, frame_id, payload))

    def send(self, frame_id: int, payload: bytes) -> None:
        assert e2e.is_intact(frame_id, payload)
        decoded = SCHEMA.decode(frame_id, payload)
        assert decoded is not None
        self.received.append(decoded)
        name, values = decoded
        if name == "IDENTITY_REQUEST":
            self._reply(
                "IDENTITY",
                protocol_version=SCHEMA.protocol_version,
                schema_crc=self.schema_crc,
                firmware_git=0xABCDEF,
            )
        elif name == "COMMAND":
            if self.drop_commands:
                self.drop_commands -= 1
            else:
                self._command_number = int(values["number"])
        elif name == "PARAMETER_REQUEST":
            index = int(values["parameter_index"])
            if values["operation"] == 1:
                self.parameters[index] = values["parameter_value"]
            self._reply(
                "PARAMETER",
                number=values["number"],
                parameter_index=index,
                parameter_value=self.parameters.get(index, 0.0),
                parameter_result=self.result,
            )

    def poll(self, duration_s: float) -> list[RawFrame]:
        self.now_s += duration_s
        if self.now_s >= self._next_heartbeat_s:
            self._next_heartbeat_s = self.now_s + 0.1
            self._reply(
                "HEARTBEAT",
                state=self.state,
                fault_code=self.fault,
                command_number=self._command_number,
                command_result=self.result,
            )
        out, self._outbox = self._outbox, []
        return [] if self.silent else out

    def reopen(self) -> None:
        self.reopened += 1
        if self.answers_when_reopened:
            self.silent = False

    def close(self) -> None:
        self.silent = True


@pytest.fixture
def board() -> ScriptedBoard:
    return ScriptedBoard()


@pytest.fixture
def link(board: ScriptedBoard) -> RigLink:
    link = RigLink(board, SCHEMA)
    link.open()
    link.raise_faults(True)
    return link


def commands(board: ScriptedBoard) -> list[dict[str, float | int]]:
    return [values for name, values in board.received if name == "COMMAND"]


def test_the_greeting_tells_who_answers(board: ScriptedBoard) -> None:
    identity = RigLink(board, SCHEMA).open()
    assert identity.firmware_git == "abcdef"
    assert identity.board == "host"


def test_another_schema_stops_before_any_command(board: ScriptedBoard) -> None:
    board.schema_crc ^= 1
    with pytest.raises(IdentityError, match="Nothing was moved"):
        RigLink(board, SCHEMA).open()
    assert commands(board) == []


def test_a_silent_port_is_no_board(board: ScriptedBoard) -> None:
    board.silent = True
    with pytest.raises(LinkLostError):
        RigLink(board, SCHEMA).open()


def test_a_lost_command_is_sent_again_under_the_same_number(
    board: ScriptedBoard, link: RigLink
) -> None:
    board.drop_commands = 2
    link.command("set_pressure", 5.0)
    numbers = [values["number"] for values in commands(board)]
    assert len(numbers) == 3
    assert len(set(numbers)) == 1
    assert link.statistics.resent_commands == 2


def test_a_board_that_leaves_its_state_by_itself_is_noticed(
    board: ScriptedBoard, link: RigLink
) -> None:
    board.state = 4
    link.command("set_pressure", 5.0)
    link.expect_state("run")
    link.wait(1.0)
    board.state = 1  # it was reset: idle, and no fault
    with pytest.raises(UnexpectedStateError, match="reset"):
        link.wait(1.0)


def test_requests_never_use_up_the_numbers_of_commands(board: ScriptedBoard, link: RigLink) -> None:
    link.command("vent")
    for _ in range(254):  # one counter for both would come round to the same number
        link.read_parameter("deadband_kpa")
    link.command("vent")
    numbers = [values["number"] for values in commands(board)]
    assert len(set(numbers)) == 2


def test_command_numbers_wrap_past_zero(board: ScriptedBoard, link: RigLink) -> None:
    for _ in range(300):
        link.command("vent")
    numbers = [values["number"] for values in commands(board)]
    assert min(numbers) == 1
    assert max(numbers) == 255
    assert all(a != b for a, b in itertools.pairwise(numbers))


def test_commands_continue_the_boards_numbering(board: ScriptedBoard, link: RigLink) -> None:
    link.command("vent")
    link.command("vent")
    assert [values["number"] for values in commands(board)] == [42, 43]


def test_a_refusal_names_the_reason(board: ScriptedBoard, link: RigLink) -> None:
    board.result = 2
    with pytest.raises(CommandRefusedError, match="out_of_range"):
        link.command("set_pressure", 99.0)


def test_a_board_that_never_acknowledges_is_lost(board: ScriptedBoard, link: RigLink) -> None:
    board.drop_commands = 1000
    with pytest.raises(LinkLostError, match="did not acknowledge"):
        link.command("vent")


def test_parameters_are_written_in_single_precision_and_read_back(
    board: ScriptedBoard, link: RigLink
) -> None:
    assert link.write_parameter("deadband_kpa", 0.1) == pytest.approx(0.1, rel=1e-7)
    assert link.read_parameter("deadband_kpa") == pytest.approx(0.1, rel=1e-7)


def test_silence_is_noticed_within_the_stated_time(board: ScriptedBoard, link: RigLink) -> None:
    board.silent = True
    start_s = board.now_s
    with pytest.raises(LinkLostError):
        link.wait(60.0)
    assert board.now_s - start_s < 2.5


def test_a_board_that_restarted_is_asked_once_why_it_fell_silent(
    board: ScriptedBoard, link: RigLink
) -> None:
    board.silent = board.answers_when_reopened = True
    board.fault = 13
    with pytest.raises(BoardFaultError) as raised:
        link.wait(60.0)
    assert raised.value.code == "brown_out"
    assert board.reopened == 1


def test_the_channel_is_opened_once_in_each_silence(board: ScriptedBoard, link: RigLink) -> None:
    board.silent = True
    with pytest.raises(LinkLostError):
        link.wait(60.0)
    assert board.reopened == 1


def test_corrupt_frames_are_dropped_and_counted(board: ScriptedBoard, link: RigLink) -> None:
    before = link.statistics.frames
    board.corrupt = lambda payload: bytes([payload[0] ^ 0xFF]) + payload[1:]
    link.wait(1.0)
    assert link.statistics.frames == before
    assert link.statistics.corrupt >= 9


def test_a_latched_fault_raises_with_its_hint(board: ScriptedBoard, link: RigLink) -> None:
    board.fault, board.state = 6, 6
    board._reply("FAULT", code=6, fault_value=3.5, age_s=0.1)
    with pytest.raises(BoardFaultError, match="leak") as caught:
        link.wait(1.0)
    assert caught.value.value == pytest.approx(3.5)
    assert HINTS["leak"] in str(caught.value)
    assert "(3.5 mL)" in str(caught.value)


def test_the_host_heartbeats_at_least_every_300_ms_of_bench_time(
    board: ScriptedBoard, link: RigLink
) -> None:
    link.wait(10.0)
    beats = [name for name, _ in board.received if name == "HOST_HEARTBEAT"]
    assert len(beats) >= 10 / 0.3
    assert link.statistics.host_stall_s <= 0.3


def test_an_interruption_is_asked_in_every_receive(board: ScriptedBoard) -> None:
    class StopError(Exception):
        pass

    def interrupted() -> None:
        raise StopError

    with pytest.raises(StopError):
        RigLink(board, SCHEMA, interrupted=interrupted).receive()


def test_every_fault_of_the_schema_has_a_hint() -> None:
    names = set(SCHEMA.choices("HEARTBEAT", "fault_code").values()) - {"none"}
    assert names == set(HINTS)
    assert set(VALUE_UNITS) <= names
    assert SCHEMA.choices("FAULT", "code") == SCHEMA.choices("HEARTBEAT", "fault_code")
