"""HX711 words: two's complement, saturation, and words that cannot be trusted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from board_under_test import Board
from hypothesis import given
from hypothesis import strategies as st
from rig.board._firmware import ffi, lib

OK, SATURATED, DESYNC = 0, 1, 2
LOAD = 40_000


def judged(counts: Sequence[int]) -> list[int]:
    """Status of each word of a sequence of counts (or raw words)."""
    words = ffi.new("uint32_t[]", [c & 0xFFFFFF for c in counts])
    status = ffi.new("uint8_t[]", len(counts))
    lib.rig_test_hx711_judge(words, len(counts), status)
    return list(status)


@pytest.mark.parametrize(
    ("word", "counts"),
    [
        (0x000000, 0),
        (0x000001, 1),
        (0xFFFFFF, -1),
        (0x7FFFFF, 8_388_607),
        (0x800000, -8_388_608),
        (0xABC123, 0xABC123 - (1 << 24)),
        (0xFF000001, 1),  # what lies above 24 bits is not the chip's
    ],
)
def test_words_are_twos_complement_of_24_bits(word: int, counts: int) -> None:
    assert lib.rig_test_hx711_counts(word) == counts


@given(st.integers(-(1 << 23), (1 << 23) - 1))
def test_every_count_survives_as_a_word(counts: int) -> None:
    assert lib.rig_test_hx711_counts(counts & 0xFFFFFF) == counts


def test_both_ends_of_the_range_are_saturated() -> None:
    assert judged([LOAD, 0x7FFFFF, 0x800000, LOAD]) == [OK, SATURATED, SATURATED, OK]


def test_a_noisy_steady_load_is_trusted() -> None:
    rng = np.random.default_rng(5)
    counts = (LOAD + rng.normal(0, 100, 2000)).round().astype(int)
    assert judged(counts.tolist()) == [OK] * 2000


def test_noise_around_zero_is_trusted() -> None:
    rng = np.random.default_rng(5)
    counts = rng.normal(0, 3, 2000).round().astype(int)
    assert judged(counts.tolist()) == [OK] * 2000


@pytest.mark.parametrize("load", [-300_000, -40_000, -3000, 3000, 40_000, 300_000])
def test_a_word_shifted_by_a_lost_clock_is_doubted_and_the_next_good_one_trusted(load: int) -> None:
    assert judged([load, load + 7, 2 * load + 1, load - 5]) == [OK, OK, DESYNC, OK]


def test_noise_hides_no_shifted_word() -> None:
    rng = np.random.default_rng(5)
    counts = (18_800 + rng.normal(0, 100, 4000)).round().astype(int)
    counts[1::2] = 2 * counts[1::2] + 1
    assert judged(counts.tolist()) == [OK, DESYNC] * 2000


@pytest.mark.parametrize("word", [0x000000, 0xFFFFFF])
def test_a_dead_data_line_is_no_reading(word: int) -> None:
    assert judged([LOAD, word, word]) == [OK, DESYNC, DESYNC]


def test_a_sudden_load_is_doubted_once_and_then_believed() -> None:
    assert judged([0, 500_000, 500_010, 500_005]) == [OK, DESYNC, OK, OK]


def test_a_single_wild_word_leaves_no_trace() -> None:
    assert judged([LOAD, 3_000_000, LOAD, LOAD]) == [OK, DESYNC, OK, OK]


def test_wild_words_that_disagree_are_all_doubted() -> None:
    assert judged([LOAD, 3_000_000, -3_000_000, 5_000_000]) == [OK, DESYNC, DESYNC, DESYNC]


@pytest.mark.parametrize("load", [12_345, -12_345])
def test_tare_takes_the_mean_of_twenty_words(load: int) -> None:
    board = Board()
    board.bench.load_cell_counts = load
    board.run(500)
    assert not board.last("HEARTBEAT")["tared"]
    board.command("tare")
    board.run(2200)
    assert board.last("HEARTBEAT")["tared"]
    board.run(5000)
    net = [m["load_cell_counts"] for m in board.all("LOAD_CELL")[-40:]]
    assert abs(np.mean(net)) < 4 * 50 * np.sqrt(1 / 20 + 1 / 40)  # 50 counts of noise
    board.bench.load_cell_counts += 1000
    board.run(5000)
    net = [m["load_cell_counts"] for m in board.all("LOAD_CELL")[-40:]]
    assert abs(np.mean(net) - 1000) < 4 * 50 * np.sqrt(1 / 20 + 1 / 40)


def test_a_bad_word_does_not_enter_the_tare() -> None:
    board = Board()
    board.run(500)
    board.command("tare")
    board.run(500)
    board.bench.hx711_stuck_word = 0xFFFFFF
    board.run(300)
    board.bench.hx711_stuck_word = 0
    board.run(3000)
    statuses = [str(m["load_cell_status"]) for m in board.all("LOAD_CELL")]
    assert statuses.count("desync") == 3
    net = [m["load_cell_counts"] for m in board.all("LOAD_CELL")[-10:]]
    assert abs(np.mean(net)) < 100


def test_samples_are_counted_one_by_one() -> None:
    board = Board()
    board.run(3000)
    samples = [m["load_cell_sample"] for m in board.all("LOAD_CELL")]
    assert samples == list(range(1, 31))


# --- restart --------------------------------------------------------------------------------------


def load_cell_statuses(board: Board) -> list[str]:
    return [str(m["load_cell_status"]) for m in board.all("LOAD_CELL")]


@pytest.mark.parametrize("timeout_s", [0.9, 1.0, 4.0])
def test_a_chip_that_fell_asleep_is_restarted_before_it_is_a_fault(timeout_s: float) -> None:
    board = Board()
    board.write(hx711_timeout_s=timeout_s)
    board.at(3.0)
    board.bench.hx711_asleep = 1
    board.messages.clear()
    board.run(int(1000 * timeout_s) + 1000)
    assert board.bench.hx711_restarts == 1
    assert load_cell_statuses(board).count("restarted") == 1
    assert load_cell_statuses(board)[-1] == "ok"
    assert (board.state, board.fault) == ("run", "none")


def test_a_chip_that_lost_its_bits_is_restarted_before_it_is_a_fault() -> None:
    board = Board().at(3.0)
    board.bench.hx711_shifted = 1
    board.messages.clear()
    board.run(2500)
    assert load_cell_statuses(board)[:6] == [*["desync"] * 4, "restarted", "ok"]
    assert board.bench.hx711_restarts == 1
    assert (board.state, board.fault) == ("run", "none")


def test_single_bad_words_restart_nothing() -> None:
    board = Board().at(3.0)
    for _ in range(5):
        board.bench.hx711_stuck_word = 0xFFFFFF
        board.run(300)
        board.bench.hx711_stuck_word = 0
        board.run(300)
    assert board.bench.hx711_restarts == 0


def test_a_lasting_silence_is_a_fault_in_time_and_restarts_slowly_enough_to_end_it() -> None:
    board = Board().at(3.0)
    board.bench.load_cell_period_ms = 0
    board.until("fault", 1200)
    assert board.fault == "hx711_timeout"
    board.run(6000)
    assert 1 + 6.0 / 0.6 - 1 <= board.bench.hx711_restarts <= 1 + 7.0 / 0.6
    board.bench.load_cell_period_ms = 100
    board.messages.clear()
    board.run(1500)
    assert load_cell_statuses(board)[-1] == "ok"


def test_a_load_cell_that_was_never_there_is_not_restarted() -> None:
    board = Board(conditions={"load_cell_period_ms": 0})
    board.run(10_000)
    assert board.bench.hx711_restarts == 0


def test_a_data_line_stuck_low_is_a_silent_chip_and_floods_nobody() -> None:
    board = Board().at(3.0)
    board.bench.hx711_line_low = 1
    board.messages.clear()
    board.run(1300)
    assert board.fault == "hx711_timeout"
    assert len(board.all("LOAD_CELL")) < 20
    assert "ok" not in load_cell_statuses(board)


def test_eighty_words_a_second_are_all_taken() -> None:
    board = Board(conditions={"load_cell_period_ms": 12})
    board.run(3000)
    assert load_cell_statuses(board) == ["ok"] * (3000 // 12)
