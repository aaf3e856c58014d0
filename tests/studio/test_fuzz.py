"""Whatever is sent to the studio: an answer, no traceback, no file of elsewhere, and it lives on.

The studio is a process of its own; its fixture looks for tracebacks in what it said, at its end.
"""

from __future__ import annotations

import contextlib
import http.client
import json
import re
import socket
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect

SECRET = "what no browser may read"
PATHS = (
    "/",
    "/bench",
    "/runs",
    "/runs/{}/{}",
    "/pictures/{}/{}",
    "/views/{}",
    "/assets/{}",
    "/{}",
    "/_nicegui/{}/{}",
    "/_nicegui/3.18.0/static/{}",
    "/_nicegui/3.18.0/components/{}",
    "/_nicegui/3.18.0/resources/{}/{}",
    "/_nicegui_ws/socket.io/?EIO=4&transport=polling&sid={}",
)
PARAMETERS = ("actuator", "token", "overlay", "download", "session", "watch", "client_id", "EIO")
HEADERS = ("Host", "Origin", "Cookie", "Range", "Sec-Fetch-Site", "If-None-Match")
WORDS = (
    "..",
    "../..",
    "../../secret.txt",
    "..%2f..%2fsecret.txt",
    "%2e%2e%2fsecret.txt",
    "....//secret.txt",
    "/etc/passwd",
    "run-1",
    "run.mcap",
    "link.txt",
    "elsewhere",
    "secret.txt",
    "\0",
    "a" * 4000,
    "-1",
    "0",
    "99999999999999999999",
    "nan",
    "bellow-bending",
    "{{7*7}}",
    "<script>alert(1)</script>",
    "bytes=0-,5-1,-9",
    "chunked",
    "'; DROP TABLE runs",
)
words = st.sampled_from(WORDS) | st.text(max_size=30)
values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | words,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(words, inner, max_size=3),
    max_leaves=6,
)
often = settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.fixture(scope="module", autouse=True)
def temptations(lab: Path) -> Iterator[None]:
    """Files beside the workspace, links to them, and a run whose log is none."""
    (lab.parent / "secret.txt").write_text(SECRET)
    run = lab / "logs/run-1"
    run.mkdir()
    (run / "run.mcap").write_bytes(b"no log")
    (run / "summary.json").write_text("[" * 2000)
    (run / "link.txt").symlink_to(lab.parent / "secret.txt")
    (lab / "logs/elsewhere").symlink_to(lab.parent)
    before = outside(lab)
    assert before
    yield
    assert outside(lab) == before


def outside(lab: Path) -> set[Path]:
    """Of the workspace, and of what finite elements keep."""
    around = lab.parent
    return {p for p in around.rglob("*") if p.relative_to(around).parts[0] not in ("lab", "cache")}


def lives(studio: str) -> None:
    assert urllib.request.urlopen(f"{studio}/assets/studio.css").status == 200


def harmless(body: bytes) -> None:
    for forbidden in (SECRET.encode(), b"root:x:", b"Traceback (most", b'File "/'):
        assert forbidden not in body


@st.composite
def addresses(draw: st.DrawFn) -> str:
    path = draw(st.sampled_from(PATHS))
    parts = [draw(words) for _ in range(path.count("{}"))]
    safe = draw(st.sampled_from(["", "/%"]))
    address = path.format(*(quote(part.encode(errors="replace"), safe=safe) for part in parts))
    asked = draw(st.dictionaries(st.sampled_from(PARAMETERS), words, max_size=2))
    query = "&".join(f"{k}={quote(v.encode(errors='replace'))}" for k, v in asked.items())
    return f"{address}{'&' if '?' in address else '?'}{query}" if query else address


@often
@given(
    method=st.sampled_from(["GET", "POST", "PUT", "DELETE", "HEAD", "OPTIONS", "PATCH", "TRACE"]),
    address=addresses(),
    headers=st.dictionaries(st.sampled_from(HEADERS), words, max_size=2),
    body=st.binary(max_size=300),
)
def test_every_request_gets_an_answer_that_is_no_failure(
    studio: str, method: str, address: str, headers: dict[str, str], body: bytes
) -> None:
    where = studio.removeprefix("http://")
    channel = http.client.HTTPConnection(where, timeout=60)
    usual = {"Host": where, "Connection": "close", "Content-Length": str(len(body))}
    told = {name: re.sub("[\r\n]", " ", value) for name, value in (usual | headers).items()}
    lines = [f"{method} {address} HTTP/1.1", *(f"{name}: {told[name]}" for name in told)]
    channel.connect()
    with contextlib.closing(channel):
        channel.sock.sendall("\r\n".join(lines).encode(errors="replace") + b"\r\n\r\n" + body)
        answer = http.client.HTTPResponse(channel.sock, method=method)
        answer.begin()
        assert 200 <= answer.status < 500, (answer.status, lines)
        harmless(answer.read())


@often
@given(raw=st.binary(min_size=1, max_size=200))
def test_what_is_no_http_at_all_is_refused(studio: str, raw: bytes) -> None:
    host, port = studio.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=60) as channel:
        channel.sendall(raw + b"\r\n\r\n")
        channel.shutdown(socket.SHUT_WR)
        answer = b""
        with contextlib.suppress(ConnectionResetError):
            while data := channel.recv(65536):
                answer += data
    assert b" 200 " not in answer.split(b"\r\n")[0]
    harmless(answer)


frames = st.text(max_size=200) | st.binary(max_size=200)


@settings(often, max_examples=40)
@given(query=st.dictionaries(st.sampled_from(PARAMETERS), words), sent=st.lists(frames, max_size=4))
def test_the_live_channel_takes_anything(
    studio: str, query: dict[str, str], sent: list[str | bytes]
) -> None:
    asked = "&".join(f"{k}={quote(v.encode(errors='replace'))}" for k, v in query.items())
    with contextlib.suppress(WebSocketException), sent_to(f"{studio}/live?{asked}", studio) as live:
        for frame in sent:
            live.send(frame)
        first = live.recv(timeout=60)
        assert "control" in json.loads(first)
        harmless(first.encode() if isinstance(first, str) else first)
    lives(studio)


def sent_to(address: str, origin: str) -> ClientConnection:
    return connect(address.replace("http", "ws", 1), origin=origin, close_timeout=1)  # type: ignore[arg-type]


def engine(studio: str) -> ClientConnection:
    return sent_to(f"{studio}/_nicegui_ws/socket.io/?EIO=4&transport=websocket", studio)


@settings(often, max_examples=60)
@given(sent=st.lists(frames, min_size=1, max_size=6))
def test_the_channel_of_the_pages_takes_anything(studio: str, sent: list[str | bytes]) -> None:
    with contextlib.suppress(WebSocketException, TimeoutError), engine(studio) as channel:
        for frame in sent:
            channel.send(frame)
        harmless(str(channel.recv(timeout=60)).encode())
    lives(studio)


@settings(often, max_examples=60)
@given(
    event=st.sampled_from(["event", "handshake", "ack", "log", "javascript_response", "nothing"]),
    content=values | st.fixed_dictionaries({"client_id": values, "id": values, "args": values}),
)
def test_events_that_no_page_sends(studio: str, event: str, content: object) -> None:
    with contextlib.suppress(WebSocketException, TimeoutError), engine(studio) as channel:
        channel.recv(timeout=60)
        channel.send("40")
        channel.recv(timeout=60)
        channel.send("42" + json.dumps([event, content]))
        channel.send("420" + json.dumps(["handshake", {"client_id": "nobody", "tab_id": "fuzz"}]))
        harmless(str(channel.recv(timeout=60)).encode())
    lives(studio)


@pytest.mark.parametrize("address", ["/", "/bench", "/runs"])
def test_controls_of_a_page_take_any_value(studio: str, address: str) -> None:
    """As from a page whose script was tampered with: real controls, values of any kind."""
    page = urllib.request.urlopen(studio + address).read().decode()
    (client,) = set(re.findall(r"client_id': '([0-9a-f-]+)'", page))
    elements = json.loads(re.search(r"parseElements\(String\.raw`(.*?)`", page, re.S)[1])  # type: ignore[index]
    controls = [
        (int(number), event["listener_id"])
        for number, element in elements.items()
        for event in element.get("events", [])
        if "stop" not in element.get("class", [])
    ]
    assert len(controls) > 5
    with engine(studio) as channel:
        channel.recv(timeout=60)
        channel.send("40")
        channel.recv(timeout=60)
        hello = {"client_id": client, "tab_id": "fuzz", "document_id": "d", "next_message_id": 0}
        channel.send("420" + json.dumps(["handshake", hello]))
        while not str(said := channel.recv(timeout=60)).startswith("430"):
            pass
        assert json.loads(str(said)[3:]) == [True]

        @settings(often, max_examples=120)
        @given(
            control=st.sampled_from(controls),
            content=st.lists(values, max_size=2)
            | st.just([{"value": 3, "label": "x"}])
            | st.tuples(words),
        )
        def meddle(control: tuple[int, str], content: list[object]) -> None:
            number, listener = control
            told = {"client_id": client, "id": number, "listener_id": listener}
            told["args"] = [json.dumps(value) for value in content]
            channel.send("42" + json.dumps(["event", told]))
            with contextlib.suppress(TimeoutError):
                while True:
                    said = str(channel.recv(timeout=0.005))
                    if said == "2":
                        channel.send("3")
                    harmless(said.encode())

        meddle()
    lives(studio)
