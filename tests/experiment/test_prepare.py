"""Taking over a bench in whatever state an earlier session left it."""

from __future__ import annotations

from dataclasses import replace
from datetime import date

import pytest

from rig.board.virtual import VirtualBench
from rig.experiment.errors import LimitError
from rig.experiment.prepare import (
    BENCH_FIELDS,
    board_parameters,
    make_ready,
    take_over,
    write_parameters,
)
from rig.experiment.sweep import go_to, settle
from rig.link.client import RigLink
from rig.link.errors import CommandRefusedError
from rig.spec.calibration import Provenance, SyringeCalibration
from rig.spec.protocol import Settling

from .conftest import make_request

WATCHDOG_AND_VENT_S = 20.0


def under_pressure() -> tuple[VirtualBench, dict[str, float]]:
    """A bench at 5 kPa, as a host leaves it that goes away."""
    setup = make_request().setup
    bench = VirtualBench(setup, seed=1)
    parameters = board_parameters(setup.bench, setup.actuator, setup.calibrations.transducer, 13e-6)
    link = RigLink(bench.bus)
    link.open()
    write_parameters(link, parameters)
    make_ready(link)
    go_to(link, 5.0)
    settle(link, 5.0, Settling())
    return bench, parameters


def test_a_board_that_still_regulates_is_vented_before_parameters_are_written() -> None:
    bench, parameters = under_pressure()
    link = RigLink(bench.bus)
    link.open()
    take_over(link)
    assert abs(bench.plant.truth().gauge_pressure) < 50.0
    assert link.status is not None
    assert link.status.state == "idle"
    write_parameters(link, parameters)


def test_a_board_that_lost_its_host_is_cleared_of_that_fault() -> None:
    bench, parameters = under_pressure()
    bench.bus.poll(WATCHDOG_AND_VENT_S)
    link = RigLink(bench.bus)
    link.open()
    assert link.status is not None
    assert link.status.fault == "communication_lost"
    take_over(link)
    assert link.status.fault == "none"
    write_parameters(link, parameters)


def test_a_fault_is_cleared_even_while_the_plunger_is_still_coming_home() -> None:
    bench, parameters = under_pressure()
    bench.bus.poll(1.3)  # the watchdog waits a second: the plunger has just begun to retract
    link = RigLink(bench.bus)
    link.open()
    take_over(link)
    assert link.status is not None
    assert link.status.fault == "none"
    write_parameters(link, parameters)


def test_every_parameter_that_is_written_comes_from_fields_of_the_bench() -> None:
    request = make_request()
    assert set(BENCH_FIELDS) == set(request.board_parameters())
    for fields in BENCH_FIELDS.values():
        for field in fields.replace(" and ", ", ").split(", "):
            value: object = request.setup.bench
            for part in field.split("."):
                value = getattr(value, part)


def test_what_the_board_would_refuse_is_refused_before_it_is_asked() -> None:
    request = make_request()
    bench = request.setup.bench
    controller = bench.controller.model_copy(update={"deadband": 5e3})
    safety = bench.safety.model_copy(update={"communication_timeout": 0.1})
    wrong = bench.model_copy(update={"controller": controller, "safety": safety})
    with pytest.raises(LimitError) as caught:
        replace(request, setup=replace(request.setup, bench=wrong)).board_parameters()
    said = str(caught.value)
    assert (
        "controller.deadband: it makes the board's deadband_kpa 5; the board takes 0 to 1" in said
    )
    assert "safety.communication_timeout" in said


def test_a_calibrated_drive_replaces_the_drawing() -> None:
    request = make_request()
    drawn = request.board_parameters()
    syringe = SyringeCalibration(  # bare numbers are in mL
        kind="calibration",
        instrument="syringe",
        steps_per_ml=3000.0,
        steps_per_ml_u=0.0,
        backlash=0.01,
        backlash_u=0.0,
        dead_volume=2.5,
        dead_volume_u=0.0,
        provenance=Provenance(date=date(2026, 1, 1), method="test", instrument="none"),
    )
    calibrations = replace(request.setup.calibrations, syringe=syringe)
    known = replace(request, setup=replace(request.setup, calibrations=calibrations))
    parameters = known.board_parameters()
    assert parameters["volume_per_step_ul"] == pytest.approx(1 / 3)
    assert parameters["system_volume_ml"] - drawn["system_volume_ml"] == pytest.approx(0.5)


def test_a_refusal_of_the_board_names_the_field_of_the_bench() -> None:
    bench, _ = under_pressure()
    link = RigLink(bench.bus)
    link.open()
    with pytest.raises(CommandRefusedError, match=r"syringe_volume_ml.*idle.*syringe\.volume"):
        write_parameters(link, {"syringe_volume_ml": 50.0})
    with pytest.raises(CommandRefusedError, match=r"takes 0 to 1 kPa.*controller\.deadband"):
        write_parameters(link, {"deadband_kpa": 2.0})
