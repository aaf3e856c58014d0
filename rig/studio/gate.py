"""The one door: every HTTP request and WebSocket passes here before anything else sees it."""

from __future__ import annotations

import html
import logging
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlencode

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from rig.studio.access import Access, Asked, Refusal

LOG = logging.getLogger(__name__)
COOKIE = "rig_studio"
MAX_BODY = 1 << 20
"""Bytes of a request; specs are a few kilobytes."""
POLICY_VIOLATION = 1008

HEADERS = {
    # Vue compiles its templates in the browser: that takes eval. Nothing comes from elsewhere.
    "content-security-policy": (
        "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; "
        "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
        "connect-src 'self'; frame-src 'self'; frame-ancestors 'self'; base-uri 'self'; "
        "form-action 'self'; object-src 'none'"
    ),
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
}
"""Of every answer that does not set its own."""


class TooLargeError(Exception):
    """A body without a length went on for too long."""


class Gate:
    """An ASGI application around another one."""

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app = app
        self._access = access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse, trade a token for a cookie, or pass the request on."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        asked = _asked(scope, headers)
        entry = self._entry(scope, asked)
        if entry is not None:
            await entry(scope, receive, send)
            return
        refusal = self._access.refusal(asked)
        if refusal is None and _declared(headers) > MAX_BODY:
            await _too_large()(scope, receive, send)
        elif refusal is None:
            await self._pass_on(scope, receive, send)
        elif asked.is_websocket:
            await send({"type": "websocket.close", "code": POLICY_VIOLATION})
        else:
            await _refused(refusal)(scope, receive, send)

    def _entry(self, scope: Scope, asked: Asked) -> Response | None:
        """A redirect with the cookie for whoever brings the token in the address."""
        if scope["type"] != "http" or asked.method != "GET":
            return None
        query = parse_qs(scope["query_string"].decode("latin-1"))
        tokens = query.pop("token", [])
        proof = self._access.proof
        if len(tokens) != 1 or proof is None or not self._access.takes(tokens[0]):
            return None
        # the address without the token: it shall not stay in the browser's history
        rest = urlencode(query, doseq=True)
        path = "/" + scope["path"].lstrip("/")
        response = RedirectResponse(f"{path}?{rest}" if rest else path, 303)
        response.set_cookie(COOKIE, proof, httponly=True, samesite="strict")
        return response

    async def _pass_on(self, scope: Scope, receive: Receive, send: Send) -> None:
        received, started, exceeded = 0, False, False

        async def counted() -> Message:
            nonlocal received, exceeded
            message = await receive()
            if message["type"] == "http.request":
                received += len(message.get("body", b""))
                if received > MAX_BODY:
                    exceeded = True
                    raise TooLargeError
            return message

        async def decorated(message: Message) -> None:
            nonlocal started
            if exceeded and not started:
                return  # whatever the application makes of the interruption
            if message["type"] == "http.response.start":
                started = True
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        try:
            await self._app(scope, counted, decorated)
        except TooLargeError:
            LOG.warning("a request of more than %d bytes was refused", MAX_BODY)
        except Exception as error:
            if scope["type"] == "http":
                raise
            # what a library makes of a malformed message ends that connection, and nothing else
            LOG.warning("a WebSocket was closed: %s: %s", type(error).__name__, error)
            return
        if exceeded and not started:
            await _too_large()(scope, receive, send)


def _asked(scope: Scope, headers: Headers) -> Asked:
    cookies: SimpleCookie = SimpleCookie()
    try:
        cookies.load(headers.get("cookie", ""))
    except CookieError:
        cookies.clear()
    cookie = cookies.get(COOKIE)
    return Asked(
        method=str(scope.get("method", "GET")),
        host=headers.get("host"),
        origin=headers.get("origin"),
        fetch_site=headers.get("sec-fetch-site"),
        fetch_mode=headers.get("sec-fetch-mode"),
        proof=None if cookie is None else cookie.value,
        is_websocket=scope["type"] == "websocket",
    )


def _declared(headers: Headers) -> int:
    text = headers.get("content-length", "0")
    return int(text) if text.isascii() and text.isdigit() else MAX_BODY + 1


def _refused(refusal: Refusal) -> Response:
    text = f"<!DOCTYPE html><title>rig studio</title><p>{html.escape(refusal.why)}</p>"
    return HTMLResponse(text, refusal.status, HEADERS)


def _too_large() -> Response:
    return HTMLResponse(
        f"<!DOCTYPE html><title>rig studio</title><p>More than {MAX_BODY >> 10} KiB were sent; "
        "specs are smaller than that.</p>",
        413,
        HEADERS,
    )
