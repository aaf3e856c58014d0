"""Runs: the list, a filter, reports, files, and several runs beside each other."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any
from urllib.parse import quote

from nicegui import ui

from rig.errors import RigError
from rig.studio.errors import StudioError
from rig.studio.files import inside
from rig.studio.pages.frame import frame, say, show_at_once, telling, text_of
from rig.studio.pages.replay import Played, ReplayPanel
from rig.studio.pages.work import Progress
from rig.studio.replay import MOST_REPLAYS
from rig.studio.runs import RunRow, list_runs, matching, summary_of
from rig.studio.state import Studio
from rig.studio.works import comparison, report

COLUMNS = ("name", "status", "actuator", "bench", "protocol", "seed", "measured", "errors")


def register(studio: Studio) -> None:
    """Serve the page."""

    @ui.page("/runs", title="Runs - rig studio")
    def _page() -> None:
        with frame(studio, "Runs"):
            RunsPage(studio)


class RunsPage:
    """One browser's choice of runs."""

    def __init__(self, studio: Studio) -> None:
        self._studio = studio
        self._rows = list_runs(studio.workspace.logs)
        with ui.column().classes("panel"):
            with ui.row().classes("actions"):
                self._filter = ui.input(
                    "filter", placeholder="words, as: virtual success", on_change=self._show
                ).props("outlined dense clearable")
                ui.button("Open report", on_click=telling(self._open), color=None).classes(
                    "main"
                ).props("unelevated")
                ui.button("Replay", on_click=self._replay, color=None).classes("plain").props(
                    "unelevated"
                )
                ui.button("Compare", on_click=telling(self._compare), color=None).classes(
                    "plain"
                ).props("unelevated")
                ui.button("Write report again", on_click=telling(self._report), color=None).classes(
                    "plain"
                ).props("unelevated")
                ui.button("Reload", on_click=self._reload, color=None).classes("plain").props(
                    "unelevated"
                )
            self._progress = Progress(studio.workshop)
            self._table = ui.table(
                columns=[
                    {
                        "name": name,
                        "label": name,
                        "field": name,
                        "align": "left",
                        "sortable": True,
                    }
                    for name in COLUMNS
                ],
                rows=[],
                row_key="name",
                selection="multiple",
                pagination=20,
                on_select=self._chosen,
            ).props("flat dense wrap-cells")
            self._nothing = ui.label(
                "There is no run in this workspace yet: take one on the Bench page, or with "
                "`rig characterise`."
            ).classes("muted")
            self._files = ui.row().classes("actions")
        self._player = ReplayPanel()
        self._view = ui.element("iframe").classes("view").props('title="report"')
        self._view.set_visibility(False)
        self._show()

    def _show(self) -> None:
        rows = matching(self._rows, text_of(self._filter.value))
        self._table.rows = [{name: getattr(row, name) for name in COLUMNS} for row in rows]
        self._nothing.set_visibility(not self._rows)

    def _reload(self) -> None:
        self._rows = list_runs(self._studio.workspace.logs)
        self._show()

    def _chosen(self) -> None:
        self._files.clear()
        with self._files:
            for row in self._selected():
                for name in row.files:
                    ui.link(
                        f"{row.name}/{name}", f"{_address(row.name, name)}?download=true"
                    ).props("download")

    def _selected(self) -> list[RunRow]:
        names = [text_of(row.get("name")) for row in self._table.selected]
        return [row for row in self._rows if row.name in names]

    def _one(self) -> RunRow:
        chosen = self._selected()
        if len(chosen) != 1:
            raise StudioError("tick one run.")
        return chosen[0]

    def _open(self) -> None:
        row = self._one()
        if not row.has_report:
            raise StudioError("this run has no report: write it again.")
        self._show_page(_address(row.name, "report.html"))

    async def _replay(self) -> None:
        try:
            names = [row.name for row in self._selected()]
            if not 0 < len(names) <= MOST_REPLAYS:
                raise StudioError(f"tick one run, or up to {MOST_REPLAYS} to play in step.")
            folders = [inside(self._studio.workspace.logs, name) for name in names]
            # a log takes a second to read: pages and bench go on meanwhile
            self._player.play([await asyncio.to_thread(self._read, folder) for folder in folders])
        except RigError as error:
            say(str(error), "negative")

    def _read(self, folder: Path) -> Played:
        return Played(self._studio.replays.of(folder), summary_of(folder))

    def _report(self) -> None:
        folder = inside(self._studio.workspace.logs, self._one().name)
        self._progress.start(self._reported, report, folder)

    def _reported(self, _nothing: Any) -> None:
        say("the report is written.", "positive")
        self._reload()

    def _compare(self) -> None:
        names = [row.name for row in self._selected()]
        if len(names) < 2:
            raise StudioError(
                "tick two runs or more; the first one is what the others are held to."
            )
        folders = tuple(inside(self._studio.workspace.logs, name) for name in names)
        self._progress.start(self._compared, comparison, folders)

    def _compared(self, page: str) -> None:
        self._show_page(self._studio.views.keep(page))

    def _show_page(self, address: str) -> None:
        self._view.props(f'src="{address}"')
        self._view.set_visibility(True)
        show_at_once(self._view)


def _address(folder: str, name: str) -> str:
    return f"/runs/{quote(folder, safe='')}/{quote(name, safe='')}"
