"""What every page has: navigation, style, and errors shown as sentences."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Literal

from nicegui import ui

from rig.errors import RigError
from rig.studio.state import Studio

Kind = Literal["positive", "negative", "warning", "info"]
BENCH = "Bench"
PAGES = (("Design", "/"), ("Bench", "/bench"), ("Runs", "/runs"))


@contextmanager
def frame(studio: Studio, here: str) -> Iterator[None]:
    """Header and main part of a page; its pulse keeps the seat at the bench."""
    client = ui.context.client
    watch = json.dumps(here == BENCH)
    client.on_connect(
        lambda: client.run_javascript(f"studioLive({json.dumps(client.tab_id)}, {watch})")
    )
    ui.add_head_html(
        '<link rel="stylesheet" href="/assets/studio.css"><script src="/assets/studio.js"></script>'
    )
    with ui.header():
        ui.html('<a class="skip" href="#main">to the content</a>', sanitize=False)
        ui.label("rig studio").classes("brand")
        for name, address in PAGES:
            link = ui.link(name, address).classes("nav")
            if name == here:
                link.classes("here").props('aria-current="page"')
        ui.element("div").classes("spacer")
        ui.html('<span class="muted" data-live="summary"></span>', sanitize=False)
        # anybody may make the bench safe, from every page
        ui.button("Vent and stop", on_click=studio.desk.vent, color=None).classes("stop").props(
            "unelevated"
        )
    with ui.element("main").props("id=main").classes("stack column"):
        ui.html(f"<h1>{here}</h1>", sanitize=False)
        yield


def telling(action: Callable[[], None]) -> Callable[[], None]:
    """The action; what it cannot do is said to whoever asked."""

    def told() -> None:
        try:
            action()
        except RigError as error:
            say(str(error), "negative")

    return told


def say(text: str, kind: Kind = "info") -> None:
    """A sentence that goes away by itself, but for what went wrong."""
    ui.notify(
        text,
        type=kind,
        multi_line=True,
        close_button="close",
        timeout=0 if kind == "negative" else 5000,
    )


def text_of(value: object) -> str:
    """What a text field holds; anything but text, which no page of ours sends, is none."""
    return value if isinstance(value, str) else ""


def number_of(value: object, otherwise: float) -> float:
    """What a number field or a slider holds; `otherwise` where that is no finite number."""
    if isinstance(value, (int, float)) and math.isfinite(value):
        return float(value)
    return otherwise


def show_at_once(element: ui.element) -> None:
    """Scroll to what was asked for: on a small screen it is below what is seen."""
    element.client.run_javascript(f"getHtmlElement({element.id}).scrollIntoView()")


def heading(text: str) -> None:
    """Of a panel."""
    ui.html(f"<h2>{text}</h2>", sanitize=False)
