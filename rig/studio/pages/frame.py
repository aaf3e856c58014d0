"""What every page has: navigation, style, and errors shown as sentences."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Literal

from nicegui import ui

from rig.errors import RigError

Kind = Literal["positive", "negative", "warning", "info"]
PAGES = (("Design", "/"), ("Runs", "/runs"))


@contextmanager
def frame(here: str) -> Iterator[None]:
    """Header and main part of a page."""
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


def heading(text: str) -> None:
    """Of a panel."""
    ui.html(f"<h2>{text}</h2>", sanitize=False)
