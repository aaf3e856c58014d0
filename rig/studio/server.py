"""The studio as one ASGI application behind its gate, and the server that runs it."""

from __future__ import annotations

from fastapi import FastAPI
from nicegui import core, ui
from starlette.types import ASGIApp

from rig.studio.access import Access
from rig.studio.gate import MAX_BODY, Gate
from rig.studio.live import live_route
from rig.studio.log import configure
from rig.studio.pages import bench, design, runs
from rig.studio.routes import routes
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
    )
    return Gate(app, access)


def serve(studio: Studio, access: Access, *, verbose: bool) -> None:
    """Serve until somebody presses Ctrl-C; leaves nothing running.

    `verbose` writes tracebacks of what fails in a library.
    """
    import uvicorn

    configure(verbose=verbose)
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
