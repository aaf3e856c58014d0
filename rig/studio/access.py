"""Who may talk to the studio: decisions on one request, without a server.

A browser sends cookies and opens WebSockets on behalf of any page; what tells our own pages from
others is `Origin`, which scripts cannot forge. `Host` is checked against DNS rebinding: a foreign
name that resolves to this computer.
"""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
from dataclasses import dataclass
from http import HTTPStatus
from urllib.parse import urlsplit

from rig.studio.errors import AccessError

LOOPBACK = "127.0.0.1"
LOOPBACK_NAMES = frozenset({"localhost", "127.0.0.1", "::1"})
WILDCARDS = frozenset({"0.0.0.0", "::"})
TOKEN_CHARACTERS = 16
"""A token has at least so many."""
SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
OWN_SITE = frozenset({"same-origin", "none"})
"""`Sec-Fetch-Site` of our own pages and of an address that a person typed."""


@dataclass(frozen=True)
class Asked:
    """What matters of a request; a header that is missing is None."""

    method: str
    host: str | None
    origin: str | None = None
    fetch_site: str | None = None
    fetch_mode: str | None = None
    proof: str | None = None
    """The cookie that the token was traded for."""
    is_websocket: bool = False


@dataclass(frozen=True)
class Refusal:
    """Why a request goes no further."""

    status: HTTPStatus
    why: str


@dataclass(frozen=True)
class Access:
    """The rules of one server."""

    host: str
    port: int
    token: str | None = None

    @classmethod
    def checked(cls, host: str, port: int, token: str | None) -> Access:
        """Rules for a server bound to `host`; raises AccessError where it would stand open."""
        if token is not None and len(token) < TOKEN_CHARACTERS:
            raise AccessError(
                f"the token has {len(token)} characters; expected at least {TOKEN_CHARACTERS}, as "
                "`python -c 'import secrets; print(secrets.token_urlsafe())'` makes them."
            )
        if not is_loopback(host) and token is None:
            raise AccessError(
                f"--host {host} would let everybody on the network move the bench. Give a secret "
                f"with --token as well, or leave --host away and come in through an ssh tunnel: "
                f"`ssh -L {port}:{LOOPBACK}:{port} BENCH-COMPUTER`."
            )
        return cls(host, port, token)

    @property
    def proof(self) -> str | None:
        """What the cookie holds: the token itself is only ever sent once."""
        if self.token is None:
            return None
        return hashlib.sha256(b"rig studio " + self.token.encode()).hexdigest()

    def takes(self, token: str) -> bool:
        """Whether this is the token."""
        return self.token is not None and hmac.compare_digest(self.token.encode(), token.encode())

    def refusal(self, asked: Asked) -> Refusal | None:
        """Why a request is refused; None if it may pass."""
        if not self._is_ours(asked.host):
            return Refusal(
                HTTPStatus.MISDIRECTED_REQUEST,
                "This address is not the studio's: open it by the address that `rig studio` said.",
            )
        foreign = self._foreign(asked)
        if foreign is not None:
            return Refusal(HTTPStatus.FORBIDDEN, foreign)
        if self.proof is not None and not hmac.compare_digest(
            self.proof.encode(), (asked.proof or "").encode()
        ):
            return Refusal(
                HTTPStatus.UNAUTHORIZED,
                "The studio asks for its token: open the address with ?token=... at its end.",
            )
        return None

    def _is_ours(self, host: str | None) -> bool:
        name, port = _name_and_port(host or "")
        if port != self.port:
            return False
        if is_loopback(self.host):
            return name in LOOPBACK_NAMES
        # bound to everything, any name may be ours; a foreign one has no cookie of ours
        return self.host in WILDCARDS or name == self.host or name in LOOPBACK_NAMES

    def _foreign(self, asked: Asked) -> str | None:
        if asked.origin is not None:
            if _netloc(asked.origin) != asked.host:
                return "Another site's page asked for this; the studio answers its own pages only."
            return None
        if asked.is_websocket:
            return "A WebSocket without an origin is not opened."
        if asked.fetch_site is None or asked.fetch_site in OWN_SITE:
            return None
        if asked.method in SAFE_METHODS and asked.fetch_mode == "navigate":
            return None  # a link from elsewhere to a page: it shows, and changes nothing
        return "Another site's page asked for this; the studio answers its own pages only."


def is_loopback(host: str) -> bool:
    """Whether only this computer reaches `host`."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _netloc(origin: str) -> str:
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return ""


def _name_and_port(host: str) -> tuple[str, int | None]:
    """Of a `Host` header; a default port is 80."""
    try:
        parts = urlsplit(f"//{host}")
        return (parts.hostname or ""), (parts.port if parts.port is not None else 80)
    except ValueError:
        return "", None
