"""The gate in front of a small application: what reaches it, and what headers answers carry."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from fastapi import FastAPI, Request, WebSocket
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from rig.studio.access import Access
from rig.studio.gate import MAX_BODY, Gate

TOKEN = "a-token-of-enough-characters"
HERE = "http://127.0.0.1:8137"
LIVE = "ws://127.0.0.1:8137/live"


def application(access: Access) -> Gate:
    app = FastAPI()

    @app.get("/")
    def page() -> str:
        return "a page"

    @app.post("/spec")
    async def spec(request: Request) -> int:
        return len(await request.body())

    @app.websocket("/live")
    async def live(socket: WebSocket) -> None:
        await socket.accept()
        await socket.send_text("hello")
        await socket.close()

    return Gate(app, access)


def client(access: Access) -> TestClient:
    return TestClient(application(access), base_url=HERE, follow_redirects=False)


LOCAL = Access.checked("127.0.0.1", 8137, None)
GUARDED = Access.checked("127.0.0.1", 8137, TOKEN)


def test_a_page_comes_with_a_policy_that_lets_nothing_in_from_elsewhere() -> None:
    answer = client(LOCAL).get("/")
    assert answer.status_code == 200
    policy = answer.headers["content-security-policy"]
    assert "default-src 'self'" in policy
    assert "http:" not in policy
    assert "https:" not in policy
    assert answer.headers["x-content-type-options"] == "nosniff"


def test_a_foreign_page_can_post_nothing() -> None:
    answer = client(LOCAL).post("/spec", content=b"x", headers={"origin": "http://evil.example"})
    assert answer.status_code == 403
    assert client(LOCAL).post("/spec", content=b"x", headers={"origin": HERE}).json() == 1


def test_what_the_browser_says_of_a_request_reaches_the_decision() -> None:
    foreign = {"sec-fetch-site": "cross-site"}
    assert client(LOCAL).post("/spec", content=b"x", headers=foreign).status_code == 403
    assert client(LOCAL).get("/", headers=foreign).status_code == 403
    link = {**foreign, "sec-fetch-mode": "navigate"}
    assert client(LOCAL).get("/", headers=link).status_code == 200
    assert client(LOCAL).get("/", headers={"host": "evil.example:8137"}).status_code == 421


def test_a_foreign_page_opens_no_websocket() -> None:
    for headers in ({"origin": "http://evil.example"}, {}):
        with (
            pytest.raises(WebSocketDisconnect),
            client(LOCAL).websocket_connect(LIVE, headers=headers),
        ):
            pass
    with client(LOCAL).websocket_connect(LIVE, headers={"origin": HERE}) as socket:
        assert socket.receive_text() == "hello"


def test_more_than_the_limit_is_not_taken() -> None:
    assert client(LOCAL).post("/spec", content=b"x" * MAX_BODY).json() == MAX_BODY
    assert client(LOCAL).post("/spec", content=b"x" * (MAX_BODY + 1)).status_code == 413

    def endless() -> Iterator[bytes]:
        for _ in range(MAX_BODY // 1000 + 2):
            yield b"x" * 1000

    assert client(LOCAL).post("/spec", content=endless()).status_code == 413
    lying = {"content-length": "-1"}
    assert client(LOCAL).post("/spec", content=b"x", headers=lying).status_code == 413


def test_the_token_is_traded_for_a_cookie_once_and_leaves_the_address() -> None:
    browser = client(GUARDED)
    assert browser.get("/").status_code == 401
    assert browser.get("/?token=wrong-token-of-some-length").status_code == 401
    entry = browser.get(f"/?token={TOKEN}&actuator=mine")
    assert entry.status_code == 303
    assert entry.headers["location"] == "/?actuator=mine"
    cookie = entry.headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=strict" in cookie
    assert TOKEN not in cookie
    assert browser.get("/").status_code == 200


def test_the_redirect_leads_nowhere_else() -> None:
    entry = client(GUARDED).get(f"{HERE}//evil.example/?token={TOKEN}")
    assert entry.headers["location"] == "/evil.example/"


def test_a_websocket_without_the_cookie_is_not_opened() -> None:
    with (
        pytest.raises(WebSocketDisconnect),
        client(GUARDED).websocket_connect(LIVE, headers={"origin": HERE}),
    ):
        pass
