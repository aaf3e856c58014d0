"""What a browser does with the studio: designs, finite elements, runs, bench, a lost network."""

from __future__ import annotations

import io
import json
import shutil
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

from rig.record.reader import RunReader
from rig.spec.loading import load_actuator
from rig.spec.workspace import Workspace
from tests.studio.lab import PATIENT_S, record_run
from tests.studio.network import Network


def _browser() -> str:
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if (path := shutil.which(name)) is not None:
            return path
    pytest.skip("no chromium on this machine: apt-get install chromium")


def _live(address: str, session: str, origin: str) -> str:
    url = address.replace("http", "ws") + f"/live?session={session}&watch=0"
    with connect(url, origin=origin) as channel:  # type: ignore[arg-type]
        return str(channel.recv())


def test_sockets_open_for_our_own_pages_only(studio: str) -> None:
    assert json.loads(_live(studio, "me", studio))["control"] == "free"
    with pytest.raises(WebSocketException):
        _live(studio, "me", "http://evil.example")
    engine = studio.replace("http", "ws") + "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
    with pytest.raises(WebSocketException), connect(engine, origin="http://evil.example"):  # type: ignore[arg-type]
        pass


Pages = Callable[..., Any]
"""Opens a page of a new browser context; arguments are those of the context."""


@pytest.fixture(scope="module")
def pages(studio: str) -> Iterator[Pages]:
    """Pages in which no script fails and which ask for nothing from elsewhere."""
    executable = _browser()
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright")
    asked: list[str] = []
    wrong: list[str] = []
    with playwright.sync_playwright() as kit:
        browser = kit.chromium.launch(executable_path=executable, args=["--no-sandbox"])

        def opened(**options: Any) -> Any:
            page = browser.new_context(**options).new_page()
            page.set_default_timeout(1e3 * PATIENT_S)
            page.on("pageerror", lambda error: wrong.append(str(error)))
            page.on("request", lambda r: r.url.startswith(("http", "ws")) and asked.append(r.url))
            return page

        yield opened
        browser.close()
    assert not wrong
    assert {url.split("/")[2] for url in asked} == {studio.split("/")[2]}


def test_the_slider_bends_the_actuator_and_moves_the_cursors(pages: Pages, studio: str) -> None:
    page = pages()
    _open(page, studio)
    _sound(page)
    figures = page.locator(".figures.said")
    before = figures.inner_text()
    page.get_by_role("slider").click(position={"x": 40, "y": 10})
    page.wait_for_function("text => document.querySelector('.said').innerText != text", arg=before)
    pressure_kpa = float(figures.inner_text().split(" kPa")[0])
    assert pressure_kpa < float(before.split(" kPa")[0])
    page.wait_for_function(
        "kpa => [...document.querySelectorAll('.chart')].every(chart => { const [line] = "
        "getElement(Number(chart.id.slice(1))).chart.getOption().series[0].markLine.data; "
        "return Math.abs(line.xAxis - kpa) < 0.01; })",
        arg=pressure_kpa,
    )
    assert page.locator(".chart").count() == 2
    page.close()


@pytest.mark.parametrize("width", [390, 820, 1440])
def test_no_page_is_wider_than_its_window(pages: Pages, studio: str, width: int) -> None:
    page = pages(viewport={"width": width, "height": 900})
    for path in ("/", "/?actuator=bellow-joint", "/bench", "/runs"):
        _open(page, studio + path)
        page.get_by_role("heading", level=2).or_(page.get_by_label("filter")).first.wait_for()
        assert page.evaluate("document.scrollingElement.scrollWidth") == width, path
    page.close()


def test_finite_elements_go_from_start_to_result(pages: Pages, studio: str) -> None:
    """In the plane, which takes a second: the solid is below."""
    page = pages()
    _open(page, f"{studio}/?actuator=bellow-axisymmetric")
    page.get_by_label("pressure limit (kPa)").fill("5")
    _sound(page)
    _press(page, "Compute")
    page.get_by_text("finite elements, tip free").wait_for()
    page.get_by_text("At 5 kPa safety").wait_for()
    view = page.frame_locator("iframe.view")
    assert "von Mises" in view.locator("table").inner_text()
    page.get_by_label("pressure limit (kPa)").fill("4")
    _sound(page)
    assert not page.get_by_text("The design has changed since").is_visible()
    page.get_by_label("wall thickness (mm)").fill("2.9")
    page.get_by_text("The design has changed since").wait_for()
    page.close()


@pytest.mark.slow  # a solid; a calculation that is cancelled is in test_calculation
def test_finite_elements_are_cancelled(pages: Pages, studio: str) -> None:
    page = pages()
    _open(page, studio)
    page.get_by_label("bellow number").fill("2")
    page.get_by_label("effective length (mm)").fill("22")
    _sound(page)
    _press(page, "Compute")
    page.get_by_text("finite elements, tip free").wait_for()
    _press(page, "Cancel")
    page.get_by_text("cancelled; what finite elements reached is kept").wait_for()
    page.close()


def test_two_designs_are_compared(pages: Pages, studio: str) -> None:
    page = pages()
    _open(page, studio)
    _sound(page)
    _press(page, "Pin for comparison")
    page.get_by_label("wall thickness (mm)").fill("1.4")
    row = page.get_by_role("row", name="wall thickness 1.5 mm 1.4")
    row.wait_for()
    angle = page.get_by_role("row", name="bending angle at").inner_text().split("\t")
    pinned, now = (float(text.removesuffix("deg")) for text in angle[1:])
    assert now > pinned > 0
    _press(page, "Unpin")
    row.wait_for(state="detached")
    page.close()


def test_two_runs_are_played_in_step(pages: Pages, studio: str, lab: Path) -> None:
    for seed in (1, 2):
        record_run(Workspace(lab), lab / f"logs/run-seed{seed}", seed)
    page = pages()
    _open(page, f"{studio}/runs")
    page.get_by_label("filter").fill("seed1")
    page.get_by_role("row", name="run-seed2").wait_for(state="detached")
    page.get_by_label("filter").fill("")
    for seed in (1, 2):
        page.get_by_role("row", name=f"run-seed{seed}").get_by_role("checkbox").click()
    _press(page, "Replay")
    page.get_by_role("heading", name="Replay").wait_for()
    for _ in range(2):  # the first one of the other run may come later
        _press(page, "Next picture")
    page.wait_for_function(
        "[...document.querySelectorAll('img.frame')].filter(i => i.naturalWidth > 0).length == 2"
    )
    slider = page.get_by_role("slider")
    first_s = float(slider.get_attribute("aria-valuenow"))
    slider.locator("[tabindex='0']").press("ArrowRight")
    page.wait_for_function(
        "time => document.querySelector('[role=slider]').getAttribute('aria-valuenow') > time",
        arg=first_s,
    )
    assert page.locator(".chart svg").count() == 5
    with page.expect_download() as got:
        page.get_by_role("link", name="run-seed2/run.mcap").click()
    log = lab / "logs/run-seed2/run.mcap"
    assert Path(got.value.path()).read_bytes() == log.read_bytes()
    _press(page, "Compare")
    compared = page.frame_locator("iframe.view")
    compared.get_by_text("run-seed2").first.wait_for()
    page.close()


@pytest.mark.slow  # a solid
def test_the_deformed_solid_is_shown_with_its_stress(pages: Pages, studio: str) -> None:
    page = pages()
    _open(page, studio)
    page.get_by_label("bellow number").fill("2")
    page.get_by_label("effective length (mm)").fill("22")
    page.get_by_label("pressure limit (kPa)").fill("1")
    _sound(page)
    _press(page, "Compute")
    view = page.frame_locator("iframe.view")
    view.locator("canvas").wait_for()
    shot = np.frombuffer(view.locator("canvas").screenshot(), np.uint8)
    painted = cv2.imdecode(shot, cv2.IMREAD_COLOR).reshape(-1, 3)
    assert len(np.unique(painted, axis=0)) > 500, "colours of the stress, shaded"
    assert "von Mises" in view.locator("body").inner_text()
    page.close()


@pytest.mark.slow  # and a browser that stalls for 3 s loses its seat: not for a loaded gate
def test_design_export_run_and_a_pulled_network(pages: Pages, studio: str, lab: Path) -> None:
    page = pages()
    _open(page, studio)
    page.get_by_label("wall thickness (mm)").fill("9")
    page.get_by_text("reduce wall_thickness below 2.75 mm").wait_for()
    page.get_by_label("wall thickness (mm)").fill("1.4")
    _sound(page)
    page.get_by_label("name", exact=True).fill("thin")
    _press(page, "Save")
    page.get_by_text("saved as").wait_for()
    assert load_actuator(lab / "models/actuators/thin.yaml").geometry.wall_thickness == 1.4e-3
    with page.expect_download() as got:
        _press(page, "export STL")
    packed = zipfile.ZipFile(io.BytesIO(Path(got.value.path()).read_bytes()))
    assert "thin.stl" in packed.namelist()
    page.close()

    watching = pages()
    _open(watching, f"{studio}/bench")
    with Network() as network:
        proxy = {"server": f"socks5://127.0.0.1:{network.port}", "bypass": "<-loopback>"}
        page = pages(proxy=proxy)
        _open(page, f"{studio}/bench")
        assert page.get_by_role("button", name="Run", exact=True).is_disabled()
        _at_the_bench(page)
        _press(page, "Run")
        _says(page, "doing", "14 points")
        _says(watching, "control", "another's")
        _says(watching, "doing", "1 of 14 points")
        network.pull()
        _says(watching, "control", "free")
        _says(watching, "said", "aborted")
        _says(watching, "flags", "valve open")
        _says(watching, "state", "idle")
        network.plug_in()
        _says(page, "control", "free")
    (folder,) = (lab / "logs").glob("bellow-bending-virtual-beam-seed1")
    stop = RunReader(folder).stop()
    assert stop is not None
    assert (stop.exit_status, stop.reason) == ("aborted", "stopped in the studio.")

    _press(watching, "Take control")
    _says(watching, "control", "yours")
    _press(watching, "Home")
    _says(watching, "flags", "homed")
    _says(watching, "state", "idle")
    _press(watching, "Zero pressure")
    _says(watching, "flags", "zeroed")
    watching.get_by_label("set-point (kPa)").fill("4")
    _press(watching, "Go")
    _says(watching, "state", "run")
    _says(watching, "pressure", "4.0")
    _press(watching, "Vent and stop")
    _says(watching, "state", "idle")
    _says(watching, "flags", "valve open")
    _press(watching, "Disconnect")
    _says(watching, "state", "no bench")
    _says(watching, "pressure", "-")
    assert watching.locator("[data-live=flags]").inner_text() == ""
    watching.close()


def _open(page: Any, address: str) -> None:
    """What is typed before the page is connected is lost."""
    page.goto(address)
    page.wait_for_function("typeof live != 'undefined' && live?.readyState == WebSocket.OPEN")


def _at_the_bench(page: Any) -> None:
    """In control of a bench that is connected."""
    _says(page, "control", "free")
    _press(page, "Take control")
    _says(page, "control", "yours")
    _press(page, "Connect")
    _says(page, "state", "idle")
    _says(page, "notes", "known within")


def _press(page: Any, name: str) -> None:
    """A button that is closed, as Run is while the bench is being opened, is waited for."""
    page.get_by_role("button", name=name, exact=True).click()


def _sound(page: Any) -> None:
    page.get_by_text("This is a sound design.").wait_for()


def _says(page: Any, name: str, text: str) -> None:
    """Waits until what is told live has these words in it."""
    page.wait_for_function(
        "([name, text]) => document.querySelector(`[data-live=${name}]`)"
        "?.textContent.includes(text)",
        arg=[name, text],
    )
