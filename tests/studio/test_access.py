"""Who gets in: decisions on requests as browsers, other sites' pages and scripts send them."""

from __future__ import annotations

from dataclasses import replace
from http import HTTPStatus

import pytest

from rig.studio.access import Access, Asked
from rig.studio.errors import AccessError

TOKEN = "a-token-of-enough-characters"
LOCAL = Access.checked("127.0.0.1", 8137, None)
OPEN = Access.checked("0.0.0.0", 8137, TOKEN)
PAGE = Asked("GET", "127.0.0.1:8137", fetch_site="none", fetch_mode="navigate")
SOCKET = Asked("GET", "127.0.0.1:8137", origin="http://127.0.0.1:8137", is_websocket=True)


def test_only_this_computer_is_reached_without_a_token() -> None:
    for host in ("127.0.0.1", "::1", "localhost", "127.3.2.1"):
        assert Access.checked(host, 80, None).token is None
    for host in ("0.0.0.0", "::", "192.168.1.5", "bench.lab"):
        with pytest.raises(AccessError, match="--token"):
            Access.checked(host, 80, None)


def test_a_token_that_can_be_guessed_is_refused() -> None:
    with pytest.raises(AccessError, match="expected at least 16"):
        Access.checked("0.0.0.0", 80, "secret")


@pytest.mark.parametrize("asked", [PAGE, SOCKET, replace(PAGE, host="localhost:8137")])
def test_our_own_pages_pass(asked: Asked) -> None:
    assert LOCAL.refusal(asked) is None


@pytest.mark.parametrize(
    "host", ["evil.example:8137", "evil.example", "127.0.0.1:80", "127.0.0.1", None, "[", ":8137"]
)
def test_a_foreign_name_that_resolves_here_is_refused(host: str | None) -> None:
    refusal = LOCAL.refusal(replace(PAGE, host=host))
    assert refusal is not None
    assert refusal.status == HTTPStatus.MISDIRECTED_REQUEST


@pytest.mark.parametrize(
    "asked",
    [
        replace(SOCKET, origin="http://evil.example"),
        replace(SOCKET, origin="http://127.0.0.1:9999"),
        replace(SOCKET, origin="null"),
        replace(SOCKET, origin="http://["),
        replace(SOCKET, origin=None),
        replace(PAGE, method="POST", origin="http://evil.example"),
        replace(PAGE, method="POST", fetch_site="cross-site"),
        replace(PAGE, fetch_site="cross-site", fetch_mode="no-cors"),
        replace(PAGE, fetch_site="same-site", fetch_mode="cors"),
    ],
)
def test_what_another_site_asks_for_is_refused(asked: Asked) -> None:
    refusal = LOCAL.refusal(asked)
    assert refusal is not None
    assert refusal.status == HTTPStatus.FORBIDDEN


def test_a_link_from_elsewhere_shows_a_page() -> None:
    assert LOCAL.refusal(replace(PAGE, fetch_site="cross-site")) is None


def test_a_server_on_the_network_asks_for_the_token_s_cookie() -> None:
    asked = replace(PAGE, host="10.0.0.7:8137")
    for proof in (None, "", TOKEN, "x" * 64, "ä"):
        refusal = OPEN.refusal(replace(asked, proof=proof))
        assert refusal is not None
        assert refusal.status == HTTPStatus.UNAUTHORIZED
    assert OPEN.refusal(replace(asked, proof=OPEN.proof)) is None
    assert OPEN.takes(TOKEN)
    assert not OPEN.takes(TOKEN + "x")
    assert not LOCAL.takes("")


def test_a_server_at_one_address_of_the_network_is_asked_for_by_it_or_from_here() -> None:
    one = Access.checked("10.0.0.7", 8137, TOKEN)
    for host in ("10.0.0.7:8137", "localhost:8137"):
        assert one.refusal(replace(PAGE, host=host, proof=one.proof)) is None
    refusal = one.refusal(replace(PAGE, host="evil.example:8137", proof=one.proof))
    assert refusal is not None
    assert refusal.status == HTTPStatus.MISDIRECTED_REQUEST


def test_the_cookie_does_not_tell_the_token() -> None:
    assert OPEN.proof is not None
    assert TOKEN not in OPEN.proof
