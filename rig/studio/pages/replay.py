"""Runs played again: pictures and traces of one run or of several in step, under one slider."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any
from urllib.parse import quote

from nicegui import ui

from rig.record.documents import ExperimentName
from rig.report.summary import RunSummary
from rig.studio.charts import Options, Trace, moved, traces_options
from rig.studio.pages.frame import heading, number_of, show_at_once
from rig.studio.replay import Replay
from rig.studio.runs import levels_of, short_names

STEP_S = 0.1
"""Of the slider, and so of the arrow keys on it."""
PLAY_S = 0.1
SPEEDS = {1.0: "real time", 5.0: "5 x", 20.0: "20 x"}
RESPONSES: tuple[ExperimentName, ...] = ("deformation", "blocked_force")


@dataclass(frozen=True)
class Played:
    """A run that is shown, and what its report found."""

    replay: Replay
    summary: RunSummary | None


class ReplayPanel:
    """Empty until something is played."""

    def __init__(self) -> None:
        self._played: Sequence[Played] = ()
        self._pictures: list[ui.element] = []
        self._captions: list[ui.label] = []
        self._timed: list[ui.echart] = []
        self._panel = ui.column().classes("panel")
        self._panel.set_visibility(False)
        self._timer = ui.timer(PLAY_S, self._tick, active=False)

    def play(self, played: Sequence[Played]) -> None:
        """Show runs from their beginning."""
        self._played = played
        self._timer.active = False
        self._pictures, self._captions, self._timed = [], [], []
        self._panel.clear()
        self._panel.set_visibility(True)
        with self._panel:
            heading("Replay")
            self._controls(max(p.replay.end_s for p in played))
            with ui.element("div").classes("side-by-side"):
                for one in played:
                    self._picture(one.replay)
            with ui.element("div").classes("side-by-side"):
                self._over_time()
                self._over_pressure()
        self._show()
        show_at_once(self._panel)

    # --- what is there ---------------------------------------------------------------------

    def _controls(self, end_s: float) -> None:
        self._slider = ui.slider(
            min=0, max=round(end_s, 1), step=STEP_S, value=0, on_change=self._show
        ).props('aria-label="time of the run in seconds"')
        with ui.row().classes("actions"):
            self._play = ui.button("Play", on_click=self._play_or_pause, color=None)
            self._play.classes("main").props("unelevated")
            for label, step in (("Picture before", -1), ("Next picture", 1)):
                ui.button(label, on_click=partial(self._go_beside, step), color=None).classes(
                    "plain"
                ).props("unelevated")
            self._speed = ui.select(SPEEDS, value=5.0, label="speed").props("outlined dense")
            self._overlay = ui.checkbox("measured edges", value=True, on_change=self._show)

    def _picture(self, replay: Replay) -> None:
        with ui.column().classes("shot"):
            ui.label(replay.name).classes("strong")
            shown = ui.element("img").props(f'alt="side view in {replay.name}"').classes("frame")
            self._pictures.append(shown)
            self._captions.append(ui.label().classes("figures said"))

    def _over_time(self) -> None:
        names = short_names([p.replay.name for p in self._played])
        replays = list(zip(names, (p.replay for p in self._played), strict=True))
        pressures = [Trace(name, r.trace.time_s, r.trace.pressure_kpa) for name, r in replays]
        deformed = [
            Trace(name, r.deformation.time_s, r.deformation.value, marks=True)
            for name, r in replays
        ]
        forces = [Trace(name, r.force.time_s, r.force.value) for name, r in replays]
        for traces, quantity in (
            (pressures, "pressure (kPa)"),
            (deformed, _deformation_axis(r for _, r in replays)),
            (forces, "force (g)"),
        ):
            if any(trace.x.size for trace in traces):
                end_s = float(self._slider.props["max"])
                self._timed.append(_chart(traces_options(traces, "time (s)", quantity, end_s)))

    def _over_pressure(self) -> None:
        names = short_names([p.replay.name for p in self._played])
        for experiment in RESPONSES:
            quantity = "blocked force (g)"
            if experiment == "deformation":
                quantity = _deformation_axis(p.replay for p in self._played)
            levels = [
                level
                for name, p in zip(names, self._played, strict=True)
                if p.summary is not None
                for level in levels_of(p.summary, experiment, name)
            ]
            if levels:
                traces = [Trace(x.label, x.pressure_kpa, x.value, not x.is_model) for x in levels]
                highest = math.ceil(max(x.pressure_kpa.max() for x in levels) + 0.5)
                _chart(traces_options(traces, "pressure (kPa)", quantity, highest))

    # --- what happens ----------------------------------------------------------------------

    def _show(self) -> None:
        """Everything at the slider's time."""
        time_s = number_of(self._slider.value, 0.0)
        for one, picture, caption in zip(self._played, self._pictures, self._captions, strict=True):
            moment = one.replay.at(time_s)
            caption.text = moment.words
            picture.set_visibility(moment.frame is not None)
            if moment.frame is not None:
                overlay = "true" if self._overlay.value else "false"
                run = quote(one.replay.name, safe="")
                picture.props(f'src="/pictures/{run}/{moment.frame}?overlay={overlay}"')
        for chart in self._timed:
            chart.run_chart_method("setOption", moved(time_s))

    def _play_or_pause(self) -> None:
        self._timer.active = not self._timer.active
        self._play.text = "Pause" if self._timer.active else "Play"
        if self._timer.active and number_of(self._slider.value, 0.0) >= self._slider.props["max"]:
            self._slider.value = 0

    def _tick(self) -> None:
        end_s = float(self._slider.props["max"])
        step_s = PLAY_S * number_of(self._speed.value, 1.0)
        self._slider.value = min(end_s, number_of(self._slider.value, 0.0) + step_s)
        if self._slider.value >= end_s:
            self._play_or_pause()

    def _go_beside(self, step: int) -> None:
        self._slider.value = self._played[0].replay.beside(number_of(self._slider.value, 0.0), step)


def _deformation_axis(replays: Iterable[Replay]) -> str:
    """Words for an axis; of both, where one run bends and another lengthens."""
    measurands = dict.fromkeys(replay.measurand for replay in replays)
    return " or ".join(f"{m.quantity} ({m.unit})" for m in measurands)


def _chart(options: Options) -> Any:
    return ui.echart(options, renderer="svg").classes("chart")
