"""Bench: what the board says, live; the camera; orders of whoever has control."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from nicegui import ui

from rig.errors import RigError
from rig.studio.desk import JOG_ML_S, Ask, Choice, Opcode
from rig.studio.pages.frame import BENCH, frame, heading, number_of, say, text_of
from rig.studio.state import Studio

ORDERS: tuple[tuple[str, Opcode, float], ...] = (
    ("Home", "home", 0.0),
    ("Zero pressure", "zero_pressure", 0.0),
    ("Tare", "tare", 0.0),
    ("Jog in", "jog", JOG_ML_S),
    ("Jog out", "jog", -JOG_ML_S),
    ("Hold", "hold", 0.0),
    ("Clear fault", "clear_fault", 0.0),
)
FIGURES = (
    ("pressure", "pressure", "kPa"),
    ("set-point", "setpoint", "kPa"),
    ("deformation", "deformation", ""),  # its unit is the actuator's
    ("force", "force", "g"),
    ("plunger", "plunger", "mL"),
    ("state", "state", ""),
    ("time", "time", "s"),
)
"""What is told live: its name, its key, its unit. All of it comes through the sensors."""
SPEEDS = {1.0: "real time", 4.0: "4 x", 20.0: "20 x", 0.0: "as fast as it can"}
FIRST = {"actuator": "bellow-bending", "bench": "virtual-beam", "protocol": "quick"}


def register(studio: Studio) -> None:
    """Serve the page."""

    @ui.page("/bench", title="Bench - rig studio")
    def _page() -> None:
        with frame(studio, BENCH):
            BenchPage(studio)


class BenchPage:
    """One browser at the bench."""

    def __init__(self, studio: Studio) -> None:
        self._studio = studio
        self._desk = studio.desk
        self._client = ui.context.client
        with ui.element("div").classes("two"):
            with ui.column().classes("stack"):
                self._connection()
                self._orders()
                self._protocol()
            with ui.column().classes("stack"):
                self._board()
                self._trace()
                self._camera()

    # --- what is there ---------------------------------------------------------------------

    def _connection(self) -> None:
        with ui.column().classes("panel"):
            heading("Control")
            ui.html('<p>Control is <b data-live="control">unknown</b>.</p>', sanitize=False)
            with ui.row().classes("actions"):
                self._button("Take control", "take", self._desk.take_control, "main")
                self._button("Give back", "give", self._desk.release)
            self._actuator = self._names("actuator")
            self._bench = self._names("bench")
            with ui.row().classes("actions"):
                self._seed = ui.number("seed", value=1, min=0, precision=0).props("outlined dense")
                self._speed = ui.select(SPEEDS, value=1.0, label="speed")
                self._speed.props("outlined dense")
            with ui.row().classes("actions"):
                self._button("Connect", "connect", self._connect, "main")
                self._button("Disconnect", "disconnect", self._desk.disconnect)

    def _orders(self) -> None:
        with ui.column().classes("panel"):
            heading("By hand")
            with ui.row().classes("actions"):
                for label, opcode, argument in ORDERS:
                    ask = partial(self._desk.order, opcode=opcode, argument=argument)
                    self._button(label, "order", ask)
            with ui.row().classes("actions"):
                self._target = ui.number("set-point (kPa)", value=5, min=0, step=0.5)
                self._target.props("outlined dense")
                self._button("Go", "order", self._go, "main")

    def _protocol(self) -> None:
        with ui.column().classes("panel"):
            heading("Protocol")
            self._protocols = self._names("protocol")
            self._button("Run", "order", self._run, "main")
            ui.html(
                '<progress data-live="progress" max="1" value="0" style="width:100%"></progress>'
                '<p data-live="doing" role="status"></p>'
                '<p class="caution" data-live="question" hidden></p>',
                sanitize=False,
            )
            self._button("Done as asked", "answer", self._desk.answer)

    def _board(self) -> None:
        with ui.column().classes("panel"):
            heading("Board")
            cells = "".join(
                f'<div><span class="muted">{name}</span><b data-live="{key}">-</b> {unit}</div>'
                for name, key, unit in FIGURES
            )
            ui.html(
                f'<div class="meters figures">{cells}</div><p class="muted" data-live="flags"></p>'
                '<p class="muted" data-live="notes"></p>'
                '<p class="problem" data-live="fault" role="alert" hidden></p>'
                '<p class="caution" data-live="said" role="status" hidden></p>',
                sanitize=False,
            )

    def _trace(self) -> None:
        with ui.column().classes("panel"):
            heading("Pressure")
            ui.html(
                '<canvas data-live="trace" role="img" aria-label="pressure and set-point over the '
                'last 30 s" width="900" height="260"></canvas><p class="muted">Solid: pressure; '
                "dashed: set-point; the last 30 s of bench time.</p>",
                sanitize=False,
            )

    def _camera(self) -> None:
        with ui.column().classes("panel"):
            heading("Camera")
            ui.html(
                '<img data-live="camera" alt="side view of the actuator" hidden>'
                '<p class="muted">Cyan and orange: the edges or markers that are measured; '
                "green: the marks of the ruler.</p>",
                sanitize=False,
            )

    def _names(self, kind: str) -> ui.select:
        names = self._studio.workspace.names(kind)
        first = FIRST[kind] if FIRST[kind] in names else None
        return ui.select(names, value=first, label=kind).props("outlined dense")

    def _button(
        self, label: str, needs: Ask, ask: Callable[[str], None], kind: str = "plain"
    ) -> None:
        """A button that the live connection opens while the desk is open to what it needs."""

        def pressed() -> None:
            try:
                ask(self._client.tab_id or "")
            except RigError as error:
                say(str(error), "negative")

        ui.button(label, on_click=pressed, color=None).classes(kind).props(
            f'unelevated data-needs="{needs}"'
        )

    # --- what happens ----------------------------------------------------------------------

    def _connect(self, session: str) -> None:
        self._desk.connect(
            session,
            Choice(
                actuator=text_of(self._actuator.value),
                bench=text_of(self._bench.value),
                seed=int(number_of(self._seed.value, 0.0)),
                speed=number_of(self._speed.value, 1.0),
            ),
        )

    def _go(self, session: str) -> None:
        self._desk.order(session, "set_pressure", number_of(self._target.value, 0.0))

    def _run(self, session: str) -> None:
        self._desk.take(session, text_of(self._protocols.value))
