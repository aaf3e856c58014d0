"""No address leads out of the workspace, and no file of a run acts on the studio."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from rig.spec.workspace import Workspace
from rig.studio.errors import StudioError
from rig.studio.files import inside
from rig.studio.routes import asset_text, routes
from rig.studio.state import MOST_VIEWS, Studio, Views


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    root = tmp_path / "lab"
    run = root / "logs" / "run-1"
    run.mkdir(parents=True)
    (run / "report.html").write_text("<p>a report</p>")
    (run / "run.mcap").write_bytes(b"log")
    (tmp_path / "secret.html").write_text("secret")
    (run / "link.html").symlink_to(tmp_path / "secret.html")
    (root / "logs" / "elsewhere").symlink_to(tmp_path)
    return root


@pytest.mark.parametrize(
    "parts",
    [
        ("..", "secret.html"),
        ("run-1", "../../../secret.html"),
        ("run-1", "link.html"),
        ("elsewhere", "secret.html"),
        ("/etc", "passwd"),
        ("run-1", "\0"),
        ("x" * 5000, "y"),
    ],
)
def test_a_path_that_leads_out_is_refused(lab: Path, parts: tuple[str, ...]) -> None:
    with pytest.raises(StudioError, match="is not there in this workspace"):
        inside(lab / "logs", *parts)


def test_a_path_inside_is_found(lab: Path) -> None:
    assert inside(lab / "logs", "run-1", "report.html").read_text() == "<p>a report</p>"


def test_files_of_runs_are_served_in_a_sandbox(lab: Path) -> None:
    app = FastAPI()
    studio = Studio(Workspace(lab))
    app.include_router(routes(studio))
    client = TestClient(app)
    report = client.get("/runs/run-1/report.html")
    assert report.text == "<p>a report</p>"
    assert report.headers["content-security-policy"].startswith("sandbox allow-scripts ")
    assert "allow-same-origin" not in report.headers["content-security-policy"]
    log = client.get("/runs/run-1/run.mcap")
    assert log.content == b"log"
    assert "attachment" in log.headers["content-disposition"]
    assert log.headers["content-security-policy"].startswith("sandbox ")
    for address in (
        "/runs/run-1/link.html",
        "/runs/elsewhere/secret.html",
        "/runs/..%2F..%2F/secret.html",
        "/runs/run-1/..%2F..%2F..%2Fsecret.html",
        "/runs/run-1/%00",
        "/runs/run-1/nothing.csv",
        "/views/unknown",
        "/assets/..%2Fstate.py",
        "/assets/__init__.py",
        "/assets/palette.css",
    ):
        answer = client.get(address)
        assert answer.status_code == 404, address
        assert answer.text != "secret"
    page = client.get(studio.views.keep("<p>computed</p>"))
    assert page.text == "<p>computed</p>"
    assert page.headers["content-security-policy"].startswith("sandbox ")


def test_old_views_go() -> None:
    views = Views()
    addresses = [views.keep(str(number)) for number in range(MOST_VIEWS + 1)]
    assert views.page(addresses[0].removeprefix("/views/")) is None
    assert views.page(addresses[1].removeprefix("/views/")) == "1"


def test_the_studio_has_the_report_s_colours_and_loads_nothing_from_elsewhere() -> None:
    style = asset_text("studio.css")
    assert "--series-1: #0067a3" in style
    for name in ("studio.css", "studio.js"):
        assert not re.search(r"""https?://|["'(]//""", asset_text(name))
