"""A long calculation on a page: its progress, a button that cancels it, and what came of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import ui

from rig.studio.calculation import Calculation
from rig.studio.pages.frame import say
from rig.studio.state import Workshop

POLL_S = 0.25


class Progress:
    """A row that is there while something is computed; one thing at a time."""

    def __init__(self, workshop: Workshop) -> None:
        self._workshop = workshop
        self._calculation: Calculation | None = None
        self._done: Callable[[Any], None] = lambda _result: None
        with ui.row().classes("actions") as self._row:
            ui.spinner(size="1.4em")
            self._text = ui.label().props('role="status"')
            ui.button("Cancel", on_click=self._cancel, color=None).classes("plain").props(
                "unelevated"
            )
        self._row.set_visibility(False)
        self._timer = ui.timer(POLL_S, self._poll, active=False)
        ui.context.client.on_delete(self._close)

    def start(self, done: Callable[[Any], None], work: Callable[..., Any], *arguments: Any) -> None:
        """Begin; `done` gets the result. Raises StudioError if there is too much to do already."""
        if self._calculation is not None:
            say("something is being computed here already: wait for it, or cancel it.", "warning")
            return
        self._calculation = self._workshop.start(work, *arguments)
        self._done = done
        self._text.text = self._calculation.progress
        self._row.set_visibility(True)
        self._timer.active = True

    def _poll(self) -> None:
        calculation = self._calculation
        if calculation is None:
            return
        status = calculation.poll()
        self._text.text = calculation.progress
        if status == "running":
            return
        self._calculation = None
        self._timer.active = False
        self._row.set_visibility(False)
        if status == "failed":
            say(calculation.error, "negative")
        elif status == "cancelled":
            say("cancelled; what finite elements reached is kept for the next time.")
        else:
            self._done(calculation.result)

    def _cancel(self) -> None:
        if self._calculation is not None:
            self._calculation.cancel()

    def _close(self) -> None:
        if self._calculation is not None:
            self._calculation.close()
