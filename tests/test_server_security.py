"""Who may talk to the editor."""

from __future__ import annotations

from pathlib import Path

import pytest

from cagefield.server.web.security import Allowance, Guard, is_loopback, new_token, own_token

HOME = Guard("localhost", 8741)
OPEN = Guard("0.0.0.0", 8741, token="secret-token")


def refusal(
    guard: Guard,
    host: str = "localhost:8741",
    origin: str | None = None,
    *,
    token: str | None = None,
    cookie: str | None = None,
    needs_origin: bool = False,
    site: str | None = None,
    has_data: bool = True,
    bearer: str | None = None,
) -> str | None:
    headers = {"host": host} | ({} if origin is None else {"origin": origin})
    headers |= {} if site is None else {"sec-fetch-site": site}
    headers |= {} if bearer is None else {"authorization": f"Bearer {bearer}"}
    cookies = {} if cookie is None else {guard.cookie: cookie}
    query = {} if token is None else {"token": token}
    return guard.refusal(headers, cookies, query, needs_origin=needs_origin, has_data=has_data)


@pytest.mark.parametrize("host", ["localhost:8741", "127.0.0.1:8741", "[::1]:8741", "LOCALHOST:8741"])
def test_this_machines_names_are_ours(host: str) -> None:
    assert refusal(HOME, host) is None
    assert refusal(HOME, host, f"http://{host}", needs_origin=True) is None


@pytest.mark.parametrize(
    "host",
    ["evil.example:8741", "localhost:80", "localhost.evil.example:8741", "", "[::1", "192.168.0.7:8741"],
)
def test_a_name_that_merely_leads_here_is_refused(host: str) -> None:
    assert "does not answer to" in (refusal(HOME, host) or "")


@pytest.mark.parametrize("origin", ["http://evil.example", "http://localhost:9999", "null", "file://", ""])
def test_pages_of_other_origins_are_refused(origin: str) -> None:
    assert "may not talk to this editor" in (refusal(HOME, origin=origin, needs_origin=True) or "")
    assert "may not talk to this editor" in (refusal(HOME, origin=origin) or "")


def test_a_socket_must_say_its_origin_and_a_request_need_not() -> None:
    assert "may not talk" in (refusal(HOME, needs_origin=True) or "")
    assert refusal(HOME) is None


def test_other_machines_need_the_token() -> None:
    host = "192.168.0.7:8741"
    assert "token is missing or wrong" in (refusal(OPEN, host) or "")
    assert "token is missing or wrong" in (refusal(OPEN, host, token="guess") or "")
    assert "token is missing or wrong" in (refusal(OPEN, host, cookie="ünicode") or "")
    assert refusal(OPEN, host, token="secret-token") is None
    assert refusal(OPEN, host, cookie="secret-token") is None
    assert "does not answer to" in (refusal(OPEN, "evil.example:8741", token="secret-token") or "")


@pytest.mark.parametrize("site", ["cross-site", "same-site", "something new"])
def test_other_sites_get_no_data_but_may_lead_to_the_page(site: str) -> None:
    assert "another site's page asked for this" in (refusal(HOME, site=site) or "")
    assert refusal(HOME, site=site, has_data=False) is None
    for own in ("same-origin", "none"):
        assert refusal(HOME, site=own) is None


def test_programs_send_the_token_in_a_header() -> None:
    assert refusal(OPEN, bearer="secret-token") is None
    assert "token is missing" in (refusal(OPEN, bearer="secret-tokem") or "")


def test_loopback_addresses() -> None:
    assert all(map(is_loopback, ("localhost", "127.0.0.1", "127.3.2.1", "::1", "[::1]")))
    assert not any(map(is_loopback, ("0.0.0.0", "::", "192.168.0.7", "example.org", "")))


def test_tokens_differ_and_are_long() -> None:
    assert new_token() != new_token() and len(new_token()) >= 32


@pytest.mark.parametrize("damaged", ["", "short", "x" * 257, "x" * 5000, "x" * 40 + "\x1b[2J"])
def test_a_damaged_token_is_made_anew_and_then_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, damaged: str
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    first = own_token()
    assert own_token() == first
    file = tmp_path / "cagefield" / "token"
    file.write_text(damaged)
    assert own_token() not in (damaged, first)
    assert own_token() == own_token()


def test_an_allowance_is_spent_and_comes_back() -> None:
    allowance = Allowance(rate=10.0, burst=20.0, level=20.0)
    assert sum(allowance.take(0.0) for _ in range(50)) == 20
    assert sum(allowance.take(1.0) for _ in range(50)) == 10
    assert sum(allowance.take(100.0) for _ in range(50)) == 20
