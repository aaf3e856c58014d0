"""The bench behind the Bench page: one thread owns its link, browsers only leave orders.

Whoever controls it is listened for in every poll: a browser that falls silent for `PATIENCE_S`
loses the seat, a run is stopped, and the bench is vented. Vent and stop are anybody's.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from rig.board.real import RealBench
from rig.board.truth import truth_path
from rig.board.virtual import VirtualBench
from rig.errors import RigError
from rig.experiment.bench import Bench
from rig.experiment.deformation import live_meter
from rig.experiment.errors import AbortedError
from rig.experiment.plan import Plan, check_pressure
from rig.experiment.prepare import make_safe, take_over, write_parameters
from rig.experiment.program import TrialPlan
from rig.experiment.request import make_request, require_measured_calibrations
from rig.experiment.run import new_run
from rig.experiment.setup import RunRequest
from rig.link.client import RigLink
from rig.record.documents import PartDocument, PointDocument, PointKey
from rig.spec.free_path import first_free
from rig.spec.measurand import MEASURANDS, Measurand
from rig.spec.workspace import Setup, Workspace
from rig.studio.errors import StudioError
from rig.studio.look import NOTHING, Look, Lookout
from rig.studio.scope import Scope
from rig.studio.seat import PATIENCE_S, Seat
from rig.studio.watched import Glances, Pace, WatchedBench
from rig.studio.works import job_of

Ask = Literal["take", "give", "connect", "disconnect", "order", "answer"]
Opcode = Literal["home", "zero_pressure", "tare", "jog", "set_pressure", "hold", "clear_fault"]

POLL_S = 0.02
"""Bench time of a poll while nobody asks for anything."""
CAMERA_PERIOD_S = 0.2
"""Time between pictures while somebody looks, besides those that a run takes."""
JOG_ML_S = 1.0
LEAVE_S = 20.0
"""A thread that does not end within this time is left alone."""
LOST = f"The controlling browser was not heard for {PATIENCE_S:g} s: the bench was told to vent."


@dataclass(frozen=True)
class Choice:
    """What to connect to, by names in the workspace."""

    actuator: str
    bench: str
    seed: int = 1
    speed: float = 1.0
    """Of a simulated bench against the clock; 0 is as fast as it can."""


@dataclass(frozen=True)
class Activity:
    """What the bench is doing for whom, beyond what the board says."""

    connected: str = ""
    """Name of the bench; empty if there is none."""
    doing: str = ""
    done: int = 0
    total: int = 0
    said: str = ""
    """What went wrong, or what came of the last run."""
    question: str = ""
    """What a person at the bench is asked to do."""


@dataclass(frozen=True)
class _Order:
    opcode: Opcode
    argument: float = 0.0


@dataclass(frozen=True)
class _Take:
    protocol: str


@dataclass
class Desk:
    """At most one bench. Methods may be called from any thread."""

    workspace: Workspace
    seat: Seat
    after_run: Callable[[Path], None] = lambda _folder: None
    scope: Scope = field(default_factory=Scope)
    activity: Activity = field(default_factory=Activity)
    look: Look = NOTHING
    """The last picture with what was measured in it, while somebody looks."""
    watchers: int = 0
    """Browsers that look at the camera."""

    def __post_init__(self) -> None:
        self._orders: queue.SimpleQueue[_Order | _Take] = queue.SimpleQueue()
        self._vent = threading.Event()
        self._leave = threading.Event()
        self._answered = threading.Event()
        self._saying = threading.Lock()
        self._thread: threading.Thread | None = None
        self._setup: Setup | None = None
        self._lookout: Lookout | None = None

    @property
    def force_g(self) -> float | None:
        """What presses on the load cell, in grams-force; None unless it is tared."""
        reading, setup = self.scope.reading(), self._setup
        if setup is None or reading.load_cell_counts is None or "tared" not in reading.flags:
            return None
        return setup.calibrations.load_cell.grams(reading.load_cell_counts)

    @property
    def measurand(self) -> Measurand:
        """What the camera measures."""
        setup = self._setup
        return MEASURANDS["bending"] if setup is None else setup.actuator.measurand

    # --- asked by browsers -----------------------------------------------------------------

    @property
    def is_open(self) -> bool:
        """Whether a bench is connected, or being so."""
        return self._thread is not None and self._thread.is_alive()

    def open_to(self, session: str) -> list[Ask]:
        """What this browser may ask for now; `order` stands for a run as well.

        Control may be asked for even while another has it: that finds out whether it is gone.
        """
        if self.seat.holder != session:
            return ["take"]
        asks: list[Ask] = ["give", "disconnect" if self.is_open else "connect"]
        if self.is_open and not self._busy_with:
            asks.append("order")
        if self.activity.question:
            asks.append("answer")
        return asks

    def take_control(self, session: str) -> None:
        """Sit down at the bench; raises StudioError while another session sits there."""
        self._miss_the_lost()  # without a bench nobody else looks who is gone
        self.seat.take(session)

    def connect(self, session: str, choice: Choice) -> None:
        """Open a bench; raises StudioError, SpecError, LimitError or ExperimentError."""
        self.seat.require(session)
        if self.is_open:
            raise StudioError("a bench is connected already: disconnect it first.")
        if choice.seed < 0:
            raise StudioError("a seed is 0 or more.")
        setup = self._setup_of(choice, "default")
        request = make_request(setup, choice.seed)
        if not setup.bench.simulated:
            require_measured_calibrations(setup)
        self._leave.clear()
        self._vent.clear()
        self._orders = queue.SimpleQueue()
        self._setup = setup
        self.scope.forget()
        self.look = NOTHING
        self._say(connected=setup.bench.name, doing="opening the bench", said="")
        self._thread = threading.Thread(
            target=self._serve, args=(choice, request), name="bench", daemon=True
        )
        self._thread.start()

    def disconnect(self, session: str) -> None:
        """Vent and let go of the bench; raises StudioError for who only watches."""
        self.seat.require(session)
        self.close()

    def order(self, session: str, opcode: Opcode, argument: float = 0.0) -> None:
        """Ask the board for something; what it refuses is said in `activity`.

        `argument` is in the command's unit. Raises StudioError for who only watches or during a
        run, LimitError for a set-point beyond what actuator, bench or transducer allow.
        """
        self.seat.require(session)
        self._require_free()
        assert self._setup is not None
        if opcode == "set_pressure":
            if not argument >= 0:
                raise StudioError("a set-point is 0 kPa or more.")
            check_pressure(
                "this set-point", argument * 1e3, self._setup.actuator, self._setup.bench
            )
        if opcode == "jog" and not abs(argument) <= JOG_ML_S:
            raise StudioError(f"jogging goes at {JOG_ML_S:g} mL/s at most.")
        self._say(said="")
        self._orders.put(_Order(opcode, argument))

    def take(self, session: str, protocol: str) -> None:
        """Take a whole run; raises StudioError for who only watches or during a run."""
        self.seat.require(session)
        self._require_free()
        if protocol not in self.workspace.names("protocol"):
            raise StudioError("choose a protocol of this workspace.")
        self._orders.put(_Take(protocol))

    def vent(self) -> None:
        """Stop whatever is done and vent: anybody may, whoever has the seat."""
        self._vent.set()
        self._answered.set()

    def release(self, session: str) -> None:
        """Give the seat away; the bench is vented."""
        if self.seat.release(session):
            self.vent()

    def answer(self, session: str) -> None:
        """The person at the bench did as asked; raises StudioError for who only watches."""
        self.seat.require(session)
        self._answered.set()

    def close(self) -> None:
        """Vent, let go of the bench, and wait for that."""
        self.vent()
        self._leave.set()
        if self._thread is not None:
            self._thread.join(LEAVE_S)

    def _require_free(self) -> None:
        if not self.is_open:
            raise StudioError("no bench is connected.")
        if self._busy_with:
            raise StudioError(
                f"the bench is busy ({self._busy_with}): wait, or press Vent and stop."
            )

    @property
    def _busy_with(self) -> str:
        """Empty while the bench waits for orders."""
        return self.activity.doing or ("a run" if self.activity.total else "")

    def _setup_of(self, choice: Choice, protocol: str) -> Setup:
        for kind, name in (("actuator", choice.actuator), ("bench", choice.bench)):
            if name not in self.workspace.names(kind):
                raise StudioError(f"choose {kind} of this workspace by its name.")
        return self.workspace.setup(choice.actuator, choice.bench, protocol)

    # --- the thread of the bench -----------------------------------------------------------

    def _serve(self, choice: Choice, request: RunRequest) -> None:
        self._lookout = Lookout(live_meter(request.setup), self._looked)
        try:
            wanted: _Take | None = None
            while not self._leave.is_set():
                if wanted is not None:
                    self._run(choice, wanted.protocol)
                wanted = self._by_hand(choice, request)
        except RigError as error:
            self._say(said=str(error))
        except Exception as error:  # the page must not show a bench that nobody serves any more
            self._say(said=f"This is a defect in rig: {type(error).__name__}: {error}")
        finally:
            self._lookout.close()
            self._say(connected="", doing="", done=0, total=0, question="")

    def _open(self, choice: Choice, request: RunRequest, folder: Path | None = None) -> Bench:
        setup = request.setup
        bench: Bench
        if setup.bench.simulated:
            truth = None if folder is None else truth_path(folder, 0)
            bench = VirtualBench(setup, choice.seed, truth, job=job_of(self._compute))
            pace, glances = Pace(choice.speed), self._glances()
        else:
            bench = RealBench(setup.bench, setup.calibrations.camera, self._ask)
            pace, glances = Pace(0.0), None
        return WatchedBench(bench, self.scope.seen, self._shown, pace, glances)

    def _compute(self, progress: str) -> bool:
        """Say how far the specimen is; it is given up when the bench is let go of."""
        self._say(doing=f"opening the bench: {progress}")
        return not self._leave.is_set()

    def _glances(self) -> Glances:
        return Glances(CAMERA_PERIOD_S, lambda: self.watchers > 0)

    def _by_hand(self, choice: Choice, request: RunRequest) -> _Take | None:
        """Serve orders until a run is asked for or the bench is let go of; it is vented then."""
        self._say(doing="opening the bench")
        bench = self._open(choice, request)
        link = RigLink(bench.bus)
        try:
            link.open()
            take_over(link)
            write_parameters(link, request.board_parameters())
            link.raise_faults(False)
            self._say(doing="")
            glances = None if request.setup.bench.simulated else self._glances()
            while not self._leave.is_set():
                if self._must_vent():
                    self._carry_out(link, "vent")
                order = self._next_order()
                if isinstance(order, _Take):
                    self._say(doing="closing the bench before the run")
                    return order
                if order is not None:
                    self._carry_out(link, order.opcode, order.argument)
                link.receive(POLL_S)
                if glances is not None and glances.due():  # a simulated bench looks by itself
                    bench.camera.grab()
            return None
        finally:
            self._let_go(link, bench)

    def _let_go(self, link: RigLink, bench: Bench) -> None:
        ending = make_safe(link)
        if "could not" in ending:
            self._say(said=ending)
        bench.close()

    def _next_order(self) -> _Order | _Take | None:
        try:
            return self._orders.get_nowait()
        except queue.Empty:
            return None

    def _must_vent(self) -> bool:
        """Whether somebody pressed Vent, or whoever controls the bench is gone."""
        self._miss_the_lost()
        if not self._vent.is_set():
            return False
        self._vent.clear()
        self._drop_orders()
        return True

    def _drop_orders(self) -> None:
        """What was asked for before is not done after it."""
        while self._next_order() is not None:
            pass

    def _miss_the_lost(self) -> None:
        """Free the seat of a browser that is gone, and see to it that its bench is vented."""
        if self.seat.lapsed():
            if self.is_open:
                self._say(said=LOST)
            self._vent.set()

    def _carry_out(self, link: RigLink, opcode: str, argument: float = 0.0) -> None:
        try:
            link.command(opcode, argument)
        except RigError as error:
            self._say(said=str(error))

    def _run(self, choice: Choice, protocol: str) -> None:
        """Take a run on a bench of its own, as `rig characterise` does."""
        try:
            self._say(doing="opening the bench for the run", said="")
            self._drop_orders()
            setup = self._setup_of(choice, protocol)
            request = make_request(setup, choice.seed)
            stem = f"{setup.actuator.name}-{setup.bench.name}-seed{choice.seed}"
            folder = first_free(self.workspace.logs / stem)
            bench = self._open(choice, request, folder)
            try:
                outcome = new_run(folder, bench, request, _Watcher(self._say), self._interrupted)
            finally:
                bench.close()
            told = f"{outcome.stop.exit_status}: {outcome.stop.reason}"
            self._say(said=f"The run {folder.name} ended: {told}")
            self._follow_up(folder)
        except RigError as error:
            self._say(said=str(error))
        finally:
            self._say(doing="", done=0, total=0, question="")

    def _follow_up(self, folder: Path) -> None:
        try:
            self.after_run(folder)
        except StudioError as error:
            self._say(said=f"{self.activity.said} Its report was not begun: {error}")

    def _interrupted(self) -> None:
        if self._must_vent() or self._leave.is_set():
            raise AbortedError("stopped in the studio.")

    def _ask(self, instruction: str) -> None:
        self._answered.clear()
        self._say(question=instruction)
        try:
            # the board hears nothing meanwhile: its own watchdog keeps the bench vented
            while not self._answered.wait(0.1):
                self._interrupted()
        finally:
            self._say(question="")

    def _shown(self, time_s: float, jpeg: bytes) -> None:
        if self.watchers and self._lookout is not None:
            self._lookout.show(time_s, jpeg)

    def _looked(self, look: Look) -> None:
        self.look = look

    def _say(self, **changes: str | int) -> None:
        with self._saying:
            self.activity = replace(self.activity, **changes)  # type: ignore[arg-type]


@dataclass
class _Watcher:
    """Puts the progress of a run into the activity."""

    say: Callable[..., None]
    done: int = 0

    def began(self, plan: Plan, trials: Sequence[TrialPlan], done: int) -> None:
        """Set the number of points."""
        self.done = done
        total = len(plan.keys) + sum(len(trial.programs) for trial in trials)
        self.say(done=done, total=total)

    def stage(self, text: str) -> None:
        """Name a step outside the points."""
        self.say(doing=text)

    def warned(self, text: str) -> None:
        """Say so at once."""
        self.say(said=text)

    def point_began(self, key: PointKey) -> None:
        """Name the point."""
        self.say(
            doing=f"{key.experiment.replace('_', ' ')}, repeat {key.repeat}: {key.target_kpa:g} kPa"
        )

    def point_done(self, _point: PointDocument) -> None:
        """One more."""
        self.done += 1
        self.say(done=self.done)

    def part_done(self, _part: PartDocument) -> None:
        """One more."""
        self.done += 1
        self.say(done=self.done)
