"""The image that is flashed onto a Mega, emulated on the virtual bench.

What the same core does on this machine is tested elsewhere; here it is what only the Mega has:
timers, pins, converter, UART, EEPROM, watchdog, and that the whole gives the same measurement.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rig.board import emulator_build
from rig.board.emulated import PARAMETERS_AT, PARAMETERS_SIZE, EmulatedBoard
from rig.board.errors import BoardError
from rig.board.virtual import VirtualBench, virtual_board
from rig.link.bus import SlcanBus
from rig.link.client import RigLink
from rig.link.schema import load_schema
from rig.plant.plant import Faults
from rig.spec.workspace import Setup, Workspace
from tests.benches import with_beam_specimen
from tests.boards import seen_by_stock_slcan, served

ROOT = Path(__file__).resolve().parents[2]
OPENING = b"C\rS6\r\rO\rO\r"
MISSING = emulator_build.missing_packages()
needs_packages = pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")


@pytest.fixture(scope="module")
def setup() -> Setup:
    return with_beam_specimen(Workspace(ROOT).setup("bellow-bending", "emulated"))


class Emulated:
    """An emulated bench with the host's link, opened."""

    def __init__(self, setup: Setup, seed: int = 1) -> None:
        self.bench = VirtualBench(setup, seed)
        board = self.bench.board
        assert isinstance(board, EmulatedBoard)
        self.board = board
        self.link = RigLink(self.bench.bus)
        self.identity = self.link.open()

    @property
    def state(self) -> str:
        assert self.link.status is not None
        return self.link.status.state

    def home_and_zero(self) -> None:
        self.link.command("home")
        self.link.await_state("idle", 30.0)
        self.link.command("zero_pressure")
        self.link.wait(1.5)

    def await_restart(self) -> None:
        """The channel is closed after a restart: open it again, and hear the board."""
        self.board.read(0.3)
        self.board.write(OPENING)
        self.link.wait(0.5)


@needs_packages
def test_the_image_homes_and_regulates_within_the_drivers_limits(setup: Setup) -> None:
    rig = Emulated(setup)
    assert rig.identity.board == "mega"
    rig.home_and_zero()
    assert rig.link.status is not None
    assert rig.link.status.homed
    assert rig.link.status.home_switch
    rig.link.command("set_pressure", 6.0)
    rig.link.wait(6.0)
    true_kpa = rig.bench.plant.truth().gauge_pressure / 1e3
    assert true_kpa == pytest.approx(6.0, abs=0.15)  # the transducer's hidden gain and noise
    pulses = rig.board.stepper_figures()
    assert pulses.pulses > 20_000
    assert pulses.without_current == 0
    violations = (pulses.short_pulses, pulses.short_pauses, pulses.early_pulses, pulses.late_turns)
    assert violations == (0, 0, 0, 0)
    cell = rig.board.load_cell_figures()
    assert cell.words == pytest.approx(10 * rig.board.now_s, abs=6)  # less the first, unsettled
    assert (cell.power_downs, cell.other_gains) == (0, 0)
    assert rig.link.statistics.corrupt == 0


@needs_packages
def test_over_pressure_opens_the_valve_of_the_image_in_time(setup: Setup) -> None:
    rig = Emulated(setup)
    rig.home_and_zero()
    rig.link.write_parameter("pressure_limit_kpa", 5.0)
    rig.link.command("set_pressure", 4.9)
    rig.link.wait(5.0)
    assert rig.state == "run"
    rig.link.raise_faults(False)
    rig.bench.plant.set_faults(Faults(sensor_short=True))
    began_s = rig.board.now_s
    while rig.link.status is not None and rig.link.status.fault == "none":
        rig.link.receive(0.002)
    assert rig.board.now_s - began_s < 0.03  # 16 ms, and the frame's way to the host
    assert rig.link.status is not None
    assert rig.link.status.fault == "sensor_short"
    rig.link.wait(0.5)
    assert rig.link.status.valve_open
    assert rig.bench.plant.truth().gauge_pressure < 500


@needs_packages
def test_two_runs_of_the_image_are_the_same_to_the_bit(setup: Setup) -> None:
    def bytes_of_a_run() -> bytes:
        board = virtual_board(setup, 3)
        board.write(OPENING)
        said = board.read(1.0)
        board.write(b"t2018" + b"0" * 16 + b"\r")  # a frame that fails its CRC
        return said + board.read(0.7) + board.read(0.3)

    first = bytes_of_a_run()
    assert len(first) > 1000
    assert first == bytes_of_a_run()


@needs_packages
def test_instructions_do_what_they_do_in_libsimavr_to_the_cycle(setup: Setup) -> None:
    def seen(image: Path | None, plainly: bool = False) -> tuple[object, ...]:
        board = EmulatedBoard(VirtualBench(setup, 2).plant, image=image)
        if plainly:
            board.run_plainly()
        link = RigLink(SlcanBus(board))
        link.open()
        link.command("home")
        board.log_steps(100_000)
        messages = link.wait(2.0)
        steps = board.logged_steps()
        figures = (board.load_figures(), board.stepper_figures())
        return messages, steps.due.tobytes(), steps.rose.tobytes(), figures

    translated, interpreted = seen(None), seen(emulator_build.firmware_image())
    assert len(translated[1]) > 8 * 5000  # bytes: it stepped
    assert translated == interpreted == seen(None, plainly=True)


@needs_packages
def test_the_translation_of_another_image_is_refused(setup: Setup, tmp_path: Path) -> None:
    image = bytearray(emulator_build.firmware_image().read_bytes())
    image[image.index(b"V1013")] ^= 1  # a text in its flash
    other = tmp_path / "other.elf"
    other.write_bytes(image)
    board = EmulatedBoard(VirtualBench(setup, 1).plant, image=other)
    with pytest.raises(BoardError, match="translation of another image"):
        board._use(emulator_build.translated_image())
    with pytest.raises(BoardError, match="cannot be run"):
        board._use(other)


@needs_packages
def test_step_pulses_are_evenly_spaced_at_10_khz_and_no_tick_is_late(setup: Setup) -> None:
    rig = Emulated(setup)
    rig.home_and_zero()
    flow_ml_s = setup.bench.volume_per_step * 1e6 * 10e3
    rig.link.command("jog", flow_ml_s)
    rig.link.wait(0.2)  # up to speed
    rig.board.log_steps(100_000)
    rig.board.restart_load_figures()
    rig.link.wait(0.2)
    intervals = np.diff(rig.board.logged_steps().rose)
    assert len(intervals) > 1900
    assert intervals.mean() == pytest.approx(100e-6, rel=2e-3)
    assert np.abs(intervals - np.median(intervals)).max() < 10e-6
    load = rig.board.load_figures()
    assert load.most_response < 32_000  # 2 ms
    assert 0.3 < load.busy < 0.6


@needs_packages
def test_a_hang_ends_in_a_watchdog_reset_with_the_valve_open(setup: Setup) -> None:
    rig = Emulated(setup)
    rig.home_and_zero()
    rig.link.command("set_pressure", 5.0)
    rig.link.wait(4.0)
    pulses = rig.board.stepper_figures().pulses
    rig.link.raise_faults(False)
    rig.board.hang()
    rig.board.read(0.3)
    assert rig.board.stepper_figures().pulses - pulses < 100
    assert rig.bench.plant.truth().gauge_pressure < 1000
    rig.await_restart()
    assert rig.state == "fault"
    assert rig.link.status is not None
    assert rig.link.status.fault == "watchdog_reset"


@needs_packages
def test_a_brown_out_lets_go_of_motor_and_valve_and_is_reported(setup: Setup) -> None:
    rig = Emulated(setup)
    rig.home_and_zero()
    rig.link.command("set_pressure", 5.0)
    rig.link.wait(4.0)
    rig.link.raise_faults(False)
    rig.board.brown_out(0.2)
    assert rig.board.read(0.2) == b""
    assert rig.bench.plant.truth().gauge_pressure < 1000
    rig.await_restart()
    assert rig.link.status is not None
    assert rig.link.status.fault == "brown_out"


@needs_packages
def test_saved_parameters_outlive_a_restart_and_damage_is_noticed(setup: Setup) -> None:
    rig = Emulated(setup)
    blank = rig.board.eeprom
    assert blank == b"\xff" * len(blank)
    rig.link.write_parameter("deadband_kpa", 0.125)
    rig.link._parameter("save", "deadband_kpa", 0.0)
    rig.link.wait(1.0)  # a byte in 3.4 ms
    written = rig.board.eeprom
    end = PARAMETERS_AT + PARAMETERS_SIZE
    assert written[:PARAMETERS_AT] + written[end:] == blank[:PARAMETERS_AT] + blank[end:]
    assert written[PARAMETERS_AT] != 0xFF
    rig.link.raise_faults(False)
    rig.board.brown_out(0.01)
    rig.await_restart()
    assert rig.link.read_parameter("deadband_kpa") == 0.125
    rig.board.corrupt_parameters()
    rig.board.hang()
    rig.await_restart()
    assert rig.link.read_parameter("deadband_kpa") == pytest.approx(0.008)


@needs_packages
def test_what_is_wrong_at_the_start_is_heard_though_the_opening_came_too_early(
    setup: Setup,
) -> None:
    bench = VirtualBench(setup, 1)
    assert isinstance(bench.board, EmulatedBoard)
    bench.board.corrupt_parameters()
    link = RigLink(bench.bus)
    link.raise_faults(False)
    heard = link.wait(0.2)
    names = load_schema().choices("FAULT", "code")
    codes = [names[int(m.values["code"])] for m in heard if m.name == "FAULT"]
    assert codes == ["parameters_corrupt"]


@needs_packages
@pytest.mark.parametrize(("level", "fault"), [(True, "hx711_timeout"), (False, "hx711_timeout")])
def test_a_held_data_line_of_the_load_cell_is_noticed(
    setup: Setup, level: bool, fault: str
) -> None:
    rig = Emulated(setup)
    rig.link.wait(1.0)
    rig.link.raise_faults(False)
    rig.board.hold_load_cell_line(level)
    rig.link.wait(2.5)
    assert rig.link.status is not None
    assert rig.link.status.fault == fault


@needs_packages
def test_a_trace_into_no_folder_is_refused(setup: Setup, tmp_path: Path) -> None:
    with pytest.raises(BoardError, match="trace"):
        Emulated(setup).board.trace(tmp_path / "none" / "board.vcd")


@needs_packages
def test_a_file_that_is_no_image_is_refused(setup: Setup, tmp_path: Path) -> None:
    path = tmp_path / "image.elf"
    path.write_text("no ELF")
    with pytest.raises(BoardError, match="image of the Mega"):
        EmulatedBoard(VirtualBench(setup, 1).plant, image=path)


def test_missing_packages_are_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(emulator_build, "missing_packages", lambda: ["gcc-avr", "libsimavr-dev"])
    monkeypatch.setattr(emulator_build, "_kept_in", lambda: tmp_path)
    emulator_build.firmware_image.cache_clear()
    try:
        with pytest.raises(BoardError, match="apt-get install gcc-avr libsimavr-dev"):
            emulator_build.firmware_image()
    finally:
        emulator_build.firmware_image.cache_clear()


def test_the_emulated_bench_is_the_virtual_one_with_another_board() -> None:
    workspace = Workspace(ROOT)
    virtual, emulated = workspace.bench("virtual"), workspace.bench("emulated")
    same = {"name": virtual.name, "description": virtual.description, "board": virtual.board}
    assert emulated.model_copy(update=same) == virtual


@needs_packages
def test_python_cans_slcan_talks_to_the_emulated_mega(setup: Setup) -> None:
    with served(virtual_board(setup, 1)) as port:
        names = seen_by_stock_slcan(port)
    assert names.count("PRESSURE") > 25
    assert names.count("HEARTBEAT") > 5
