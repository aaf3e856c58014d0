"""Plain HTTP of the studio: files of runs, computed pages, the style sheet and the script."""

from __future__ import annotations

from importlib import resources

from fastapi import APIRouter
from starlette.responses import FileResponse, HTMLResponse, PlainTextResponse, Response

from rig.errors import RigError
from rig.studio.errors import StudioError
from rig.studio.files import inside
from rig.studio.state import Studio

SANDBOXED = {
    # a report is a file that anybody may have written: it shows, but acts on nothing of ours
    "content-security-policy": (
        "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline'; "
        "style-src 'unsafe-inline'; img-src data:; frame-ancestors 'self'"
    )
}
SHOWN = {".html": "text/html; charset=utf-8", ".json": "application/json", ".csv": "text/csv"}
KEPT_FOR_A_WHILE = {"cache-control": "private, max-age=300"}
ASSETS = {"studio.css": "text/css", "studio.js": "text/javascript"}


def routes(studio: Studio) -> APIRouter:
    """The router; every answer to a bad address is a sentence with status 404."""
    router = APIRouter()

    @router.get("/runs/{run}/{name}")
    def file_of_run(run: str, name: str, download: bool = False) -> Response:
        try:
            path = inside(studio.workspace.logs, run, name)
        except StudioError as error:
            return PlainTextResponse(str(error), 404)
        if not path.is_file():
            return PlainTextResponse("there is no such file in this run.", 404)
        kind = SHOWN.get(path.suffix)
        if download or kind is None:
            return FileResponse(path, filename=f"{run}-{name}", headers=SANDBOXED)
        return FileResponse(path, media_type=kind, headers=SANDBOXED)

    @router.get("/pictures/{run}/{frame}")
    def picture(run: str, frame: int, overlay: bool = False) -> Response:
        try:
            replay = studio.replays.of(inside(studio.workspace.logs, run))
            jpeg = replay.picture(frame, overlay)
        except RigError as error:
            return PlainTextResponse(str(error), 404)
        return Response(jpeg, media_type="image/jpeg", headers=KEPT_FOR_A_WHILE)

    @router.get("/views/{key}")
    def view(key: str) -> Response:
        page = studio.views.page(key)
        if page is None:
            return PlainTextResponse("this view is gone: compute it again.", 404)
        return HTMLResponse(page, headers=SANDBOXED)

    @router.get("/assets/{name}")
    def asset(name: str) -> Response:
        if name not in ASSETS:
            return PlainTextResponse("there is no such file.", 404)
        return Response(asset_text(name), media_type=ASSETS[name])

    return router


def asset_text(name: str) -> str:
    """The studio's own file; the style sheet begins with the report's colours."""
    text = (resources.files("rig.studio") / "static" / name).read_text(encoding="utf-8")
    if name == "studio.css":
        palette = resources.files("rig.report") / "templates" / "palette.css"
        return palette.read_text(encoding="utf-8") + text
    return text
