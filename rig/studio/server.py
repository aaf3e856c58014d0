"""The studio as one ASGI application behind its gate, and the server that runs it."""

from __future__ import annotations

import contextlib
import signal
from types import FrameType
from typing import NoReturn

from fastapi import FastAPI
from nicegui import core, ui
from starlette.middleware.gzip import GZipMiddleware
from starlette.types import ASGIApp

from rig.errors import RigError
from rig.spec.workspace import Workspace
from rig.studio.access import Access, is_loopback
from rig.studio.curves import Beam
from rig.studio.design import check, open_draft
from rig.studio.drawing import section_svg
from rig.studio.gate import MAX_BODY, Gate
from rig.studio.live import live_route
from rig.studio.log import configure
from rig.studio.pages import bench, design, runs
from rig.studio.pages.design import FIRST
from rig.studio.routes import routes
from rig.studio.section import section_of
from rig.studio.state import Studio

GRACE_S = 2
"""Time that open connections get when the server ends."""
KEPT_MESSAGES = 50
"""Updates that are kept for a browser that comes back: a live bench has newer ones anyway."""


def application(studio: Studio, access: Access) -> ASGIApp:
    """Everything that is served; one for each process, as the pages are registered globally."""
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    app.include_router(routes(studio))
    app.include_router(live_route(studio.desk))
    for page in (design, bench, runs):
        page.register(studio)
    core.sio.eio.max_http_buffer_size = MAX_BODY
    ui.run_with(
        app,
        title="rig studio",
        dark=None,
        tailwind=False,
        message_history_length=KEPT_MESSAGES,
        show_welcome_message=False,
        # packing costs more than the way within this computer
        gzip_middleware_factory=None if is_loopback(access.host) else GZipMiddleware,
    )
    return Gate(app, access)


def warm_up(workspace: Workspace) -> None:
    """Load what the first page needs before somebody waits for it: units, models, drawings."""
    names = workspace.names("actuator")
    if not names:
        return
    with contextlib.suppress(RigError):  # the page says it
        checked = check(open_draft(workspace, FIRST if FIRST in names else names[0]), workspace)
        if checked.spec is not None and checked.material is not None:
            section_svg(section_of(checked.spec.geometry), "")
            Beam.of(checked.spec, checked.material)


def serve(studio: Studio, access: Access, *, verbose: bool) -> None:
    """Serve until somebody presses Ctrl-C, or a signal ends it; leaves nothing running.

    `verbose` writes tracebacks of what fails in a library.
    """
    import uvicorn

    configure(verbose=verbose)
    warm_up(studio.workspace)
    # the server ends in order on SIGTERM, then lets the signal have its way with the process
    signal.signal(signal.SIGTERM, _leave)
    if hasattr(signal, "SIGHUP"):  # the terminal was closed
        signal.signal(signal.SIGHUP, lambda *_: signal.raise_signal(signal.SIGTERM))
    try:
        uvicorn.run(
            application(studio, access),
            host=access.host,
            port=access.port,
            log_config=None,
            access_log=False,
            server_header=False,
            timeout_graceful_shutdown=GRACE_S,
            ws_max_size=MAX_BODY,
        )
    finally:
        studio.close()


def _leave(number: int, _frame: FrameType | None) -> NoReturn:
    raise SystemExit(128 + number)
