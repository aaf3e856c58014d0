"""A calibration from the command line: points from the bench or a file, the fit, the dated file."""

from __future__ import annotations

import csv
import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any, TypeVar

import typer
from rich.console import Console
from rich.markup import escape

from rig.board.real import INSTRUCTIONS
from rig.board.virtual_calibration import VirtualCalibrationBench
from rig.calibrate.dead_weight import Piston
from rig.calibrate.errors import CalibrateError
from rig.calibrate.points import Row, read_points
from rig.cli._calibration_file import finish, folder, provenance
from rig.cli._interruption import catching_signals
from rig.errors import RigError
from rig.experiment.bench import Fixture
from rig.experiment.calibration.references import (
    CalibrationBench,
    Idle,
    Stage,
    Standard,
    Taken,
)
from rig.experiment.calibration.session import calibrate_on
from rig.experiment.errors import AbortedError
from rig.experiment.prepare import bench_parameters, require_board_takes
from rig.link.client import RigLink
from rig.link.open import open_bus
from rig.spec.bench import BenchSpec, SerialBoard, VirtualReferences
from rig.spec.calibration import Environment, Provenance
from rig.spec.free_path import first_free
from rig.spec.loading import AnyCalibration
from rig.spec.quantity import CELSIUS
from rig.spec.workspace import BenchCalibrations, Workspace

T = TypeVar("T")
FAR_KPA, FAR_SHARE = 1.0, 0.1
"""What a transducer that is not calibrated yet may differ from a reference by, at most."""
Procedure = Callable[[CalibrationBench, RigLink, Taken, Stage], None]


@dataclass(frozen=True)
class Order:
    """What the person asked for, besides the plan of the points."""

    bench: str
    seed: int
    points: Path | None
    out: Path | None
    operator: str
    serial_number: str
    valid_days: int
    reference: str | None
    reference_u: float | None
    temperature_c: float | None


@dataclass(frozen=True)
class Task:
    """A calibration about to be done on a bench, or from points taken elsewhere."""

    instrument: str
    order: Order
    workspace: Workspace
    bench: BenchSpec
    calibrations: BenchCalibrations
    standard: Standard
    console: Console

    @property
    def simulated(self) -> bool:
        """Whether a simulated bench is calibrated; its points stay simulated in a file, too."""
        return self.bench.simulated

    @property
    def temperature_c(self) -> float:
        """Of the air, and of water."""
        given = self.order.temperature_c
        return self.bench.ambient.temperature - CELSIUS if given is None else given

    @property
    def parameters(self) -> dict[str, float]:
        """What the board is told; raises LimitError for what it would refuse."""
        cal = self.calibrations
        parameters = bench_parameters(self.bench, cal.transducer, cal.syringe, 0.0)
        require_board_takes(parameters)
        return parameters

    @property
    def top_kpa(self) -> float:
        """Highest pressure that the bench may be calibrated to: a little below where it trips."""
        return 0.94 * min(self.bench.safety.pressure, self.bench.transducer.pressure_high) / 1e3

    def rows(self, procedure: Procedure, columns: Sequence[str]) -> list[Row]:
        """Points from the file that was given, else from the bench."""
        if self.order.points is not None:
            return read_points(self.order.points, columns)
        return self._take(procedure, columns)

    def _take(self, procedure: Procedure, columns: Sequence[str]) -> list[Row]:
        parameters, rows = self.parameters, list[Row]()
        kept = folder(self.workspace) / "points" / f"{self.instrument}-{date.today()}"
        kept = first_free(kept, ".csv")

        def taken(row: Row) -> None:
            _append(kept, row, columns)
            rows.append(row)
            numbers = ", ".join(f"{name} {float(row[name]):.6g}" for name in columns)
            self.console.print(f"  {row['kind']}: {numbers}", highlight=False)

        def stage(text: str) -> None:
            self.console.print(escape(text), style="bold")

        _make_folder(kept.parent)
        bench = self._open()
        try:
            with catching_signals() as interruption:
                calibrate_on(
                    bench,
                    parameters,
                    lambda link: procedure(bench, link, taken, stage),
                    stage,
                    interruption.check,
                )
        except RigError:
            if rows:
                self.console.print(
                    f"{len(rows)} points are kept in {kept}: `rig calibrate {self.instrument} "
                    f"--bench {self.order.bench} --points {kept}` fits what there is.",
                    soft_wrap=True,
                    markup=False,
                )
            raise
        finally:
            bench.close()
        return rows

    def _open(self) -> CalibrationBench:
        if isinstance(self.bench.board, SerialBoard):
            return RealCalibrationBench(self.bench.board, self.console)
        return VirtualCalibrationBench(self.bench, self.order.seed)

    def provenance(
        self, method: str, instrument: str, ambient_kpa: float | None = None
    ) -> Provenance:
        """Who calibrated what, when and against what; counts from today.

        `ambient_kpa` is what was measured; else only that of a simulated bench is known.
        """
        if ambient_kpa is None and self.simulated:
            ambient_kpa = self.bench.ambient.pressure / 1e3
        return provenance(
            method=method,
            instrument=instrument,
            serial_number=self.order.serial_number,
            operator=self.order.operator,
            valid_days=self.order.valid_days,
            reference=f"{self.standard.name}, u = {100 * self.standard.u:.3g} % of reading",
            environment=Environment(
                temperature=self.temperature_c,
                pressure=ambient_kpa,
            ),
            simulated=self.simulated,
        )

    def finish(self, calibration: AnyCalibration, lines: Sequence[str], field: str) -> None:
        """Say what the calibration found and write it; `field` of the bench names such files."""
        for line in lines:
            self.console.print(escape(line), highlight=False)
        finish(self.console, self.workspace, calibration, self.order.out, field)


def new_task(
    instrument: str, order: Order, standard: Callable[[VirtualReferences], Standard]
) -> Task:
    """A task; `standard` is what a simulated bench is compared with.

    Raises SpecError for a bench that cannot be read, and BadParameter where a real reference is
    not stated.
    """
    workspace = Workspace.find()
    bench = workspace.bench(order.bench)
    calibrations = workspace.resolve_bench(bench)
    if bench.simulated and bench.virtual is not None:
        known = standard(bench.virtual.references)
    elif order.reference is None or order.reference_u is None:
        raise typer.BadParameter(
            "a real instrument needs --reference, what it is compared with, and --reference-u, "
            "the relative standard uncertainty of its scale in per cent"
        )
    else:
        known = Standard(order.reference, order.reference_u / 100)
    return Task(instrument, order, workspace, bench, calibrations, known, Console())


class RealCalibrationBench:
    """A bench in the lab and a person with references beside it."""

    def __init__(self, board: SerialBoard, console: Console) -> None:
        self.bus = open_bus(board.port, board.baudrate)
        self.references = TerminalReferences(console)

    def mount(self, fixture: Fixture, idle: Idle) -> None:
        """Ask the person to arrange it; nothing is under pressure then."""
        self.references.answer(f"{INSTRUCTIONS[fixture]}, then press Enter. ", idle)

    def close(self) -> None:
        """Release the port."""
        self.bus.close()


class TerminalReferences:
    """A person who reads and places the references, asked on the terminal."""

    def __init__(self, console: Console) -> None:
        self._console = console

    def gauge_kpa(self, about_kpa: float, idle: Idle) -> float:
        """Ask for the gauge's reading; asked again until it is a number near what it must be."""
        while True:
            shown = self._number(f"The gauge shows, in kPa (about {about_kpa:g}, as 9.998): ", idle)
            if abs(shown - about_kpa) <= FAR_KPA + FAR_SHARE * about_kpa:
                return shown
            self._console.print(
                f"{shown:g} kPa is far from {about_kpa:g} kPa. Is the gauge in kPa, and zeroed?"
            )

    def floating_g(self, piston: Piston, about_kpa: float, idle: Idle) -> float:
        """Ask for masses; asked again until they are near what must be."""
        about_g = piston.masses_g(about_kpa)
        question = (
            f"Add masses (about {about_g:.1f} g) until the turning piston neither rises nor sinks. "
            "Their sum without the piston, in g: "
        )
        while True:
            masses_g = self._number(question, idle)
            if abs(piston.pressure_kpa(masses_g) - about_kpa) <= FAR_KPA + FAR_SHARE * about_kpa:
                return masses_g
            self._console.print(
                f"{masses_g:g} g are far from {about_g:.1f} g. In grams, without the piston?"
            )

    def place(self, mass_g: float, idle: Idle) -> None:
        """Ask for a mass."""
        what = f"Place {mass_g:g} g on" if mass_g else "Take everything off"
        self.answer(f"{what} the load cell, then press Enter. ", idle)

    def fill(self, idle: Idle) -> None:
        """Ask for water."""
        self.answer(
            "Fill syringe and tube with water without bubbles, put the end of the tube over an "
            "empty vessel on the balance, tare the balance, then press Enter. ",
            idle,
        )

    def water_g(self, idle: Idle) -> float:
        """Ask for the balance's reading."""
        return self._number("The balance shows, in g (all water so far, as 7.441): ", idle)

    def _number(self, question: str, idle: Idle) -> float:
        while True:
            text = self.answer(question, idle).strip().replace(",", ".")
            try:
                return float(text)
            except ValueError:
                self._console.print(f"'{escape(text)}' is no number; expected one such as 9.998.")

    def answer(self, question: str, idle: Idle) -> str:
        """A line from the terminal; a thread waits for it while `idle` keeps the board calm."""
        answers: list[str | BaseException] = []

        def ask() -> None:
            try:
                answers.append(self._console.input(question))
            except BaseException as error:  # told to whoever waits, below
                answers.append(error)

        threading.Thread(target=ask, daemon=True).start()
        while not answers:
            idle()
        (answer,) = answers
        if isinstance(answer, EOFError):
            raise AbortedError("the input ended.")
        if isinstance(answer, BaseException):
            raise answer
        return answer


def _append(path: Path, row: Row, columns: Sequence[str]) -> None:
    """One point, on disk as soon as it is taken; raises CalibrateError if the disk refuses."""
    fresh = not path.exists()
    try:
        with path.open("a", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            if fresh:
                writer.writerow(("kind", *columns))
            writer.writerow((row["kind"], *(row[name] for name in columns)))
    except OSError as error:
        raise CalibrateError(
            f"{path}: a point cannot be written: {error.strerror}. Mend that, then calibrate again."
        ) from None


def _make_folder(folder: Path) -> None:
    """For the points, before anything moves; raises CalibrateError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CalibrateError(
            f"{folder}: points cannot be kept there: {error.strerror}. Nothing was moved."
        ) from None


def numbers(text: str, what: str) -> tuple[float, ...]:
    """`20,50,100` as numbers; raises BadParameter."""
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        raise typer.BadParameter(f"'{text}' is no list of {what} such as 20,50,100") from None
    if not all(0 < value < math.inf for value in values):
        raise typer.BadParameter(f"{what} must be finite and above zero; got {text}")
    return values


def order_of(options: dict[str, Any]) -> Order:
    """The options that all verbs share, from a verb's own arguments."""
    return Order(**{name: options[name] for name in Order.__dataclass_fields__})
