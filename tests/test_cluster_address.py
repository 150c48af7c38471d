"""Addresses of schedulers: refused and late ones, scheduler files, and a notice of the wait."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from cagefield.cluster import connection, scheduler_address
from cagefield.cluster.connection import connect
from cagefield.cluster.scheduler_address import (
    announced_wait,
    call_within,
    read_scheduler_file,
    wait_for_listener,
)
from cagefield.errors import CagefieldError


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scheduler_address, "CONNECTION_NOTICE_SECONDS", 0.05)
    monkeypatch.setattr(scheduler_address, "REFUSED_SECONDS", 0.2)
    monkeypatch.setattr(scheduler_address, "_AGAIN_SECONDS", 0.01)


@pytest.fixture
def port() -> Iterator[int]:
    """A port of the loopback interface at which nobody listens: it is bound, and so is no one else's."""
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))
        yield held.getsockname()[1]


def test_an_address_where_nobody_listens_is_given_up_and_announced_before(port: int) -> None:
    pytest.importorskip("distributed")
    address = f"tcp://127.0.0.1:{port}"
    with (
        pytest.warns(UserWarning, match=f"waiting for a scheduler at {address}, 30 s at most"),
        pytest.raises(
            CagefieldError,
            match=rf"listens at {address} \(connection refused, \d+ s\); check the address, or start",
        ),
        connect(address),
    ):
        pass


def test_connections_are_refused_for_a_while_before_the_end(
    port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried = 0
    create = socket.create_connection

    def counted(*args: object, **options: object) -> socket.socket:
        nonlocal tried
        tried += 1
        return create(*args, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(socket, "create_connection", counted)
    begun = time.monotonic()
    with pytest.raises(CagefieldError, match="connection refused"):
        wait_for_listener(f"tcp://127.0.0.1:{port}", 30.0)
    assert tried > 1 and time.monotonic() - begun >= 0.2


def test_a_scheduler_that_begins_late_is_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scheduler_address, "REFUSED_SECONDS", 60.0)
    with socket.socket() as late:
        late.bind(("127.0.0.1", 0))
        timer = threading.Timer(0.05, late.listen)
        timer.start()
        wait_for_listener(f"tcp://127.0.0.1:{late.getsockname()[1]}", 60.0)
        timer.join()


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (socket.gaierror(-2, "Name or service not known"), "no host of this name is known"),
        (OSError(113, "No route to host"), "No route to host"),
        (TimeoutError(), "no reply"),
    ],
)
def test_reasons(error: OSError, reason: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(socket, "create_connection", failing)
    with pytest.raises(CagefieldError, match=rf"no scheduler listens at tls://farm:8786 \({reason}, \d+ s\)"):
        wait_for_listener("tls://farm:8786", 0.3)


def test_a_listener_that_says_nothing_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(connection, "CONNECT_SECONDS", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as mute:
        address = f"tcp://127.0.0.1:{mute.getsockname()[1]}"
        with (
            pytest.warns(UserWarning, match=f"waiting for a scheduler at {address}"),
            pytest.raises(CagefieldError, match=rf"no scheduler replies at {address} \(no reply in 0 s\)"),
            connect(address),
        ):
            pass


def test_a_call_in_time_has_its_result_or_its_error() -> None:
    assert call_within(60.0, lambda: 5) == 5
    with pytest.raises(ZeroDivisionError):
        call_within(60.0, lambda: 1 // 0)
    with pytest.raises(TimeoutError, match="closed early"):
        call_within(60.0, refusing)


def refusing() -> None:
    raise TimeoutError("closed early")


def test_a_wait_that_is_over_soon_is_not_announced(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scheduler_address, "CONNECTION_NOTICE_SECONDS", 600.0)
    before = set(threading.enumerate())
    with announced_wait("tcp://farm:8786", 30.0):
        (timer,) = set(threading.enumerate()) - before
    timer.join(60.0)
    assert not timer.is_alive()


def test_the_address_in_a_scheduler_file(tmp_path: Path) -> None:
    path = tmp_path / "scheduler.json"
    path.write_text('{"type": "Scheduler", "address": "tls://10.0.0.1:8786", "workers": {}}')
    assert read_scheduler_file(path) == "tls://10.0.0.1:8786"


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "null", "{}", '{"address": 5}', '{"address": "farm"}', '{"address": "tcp://a:99999999"}',
     '{"address": "tcp://a\\u001b[2J:80"}', "[" * 10_000],
)  # fmt: skip
def test_files_that_are_no_scheduler_files(tmp_path: Path, text: str) -> None:
    path = tmp_path / "notes.json"
    path.write_text(text)
    with pytest.raises(
        CagefieldError, match=r"notes\.json is no scheduler file with an address; give one that"
    ):
        read_scheduler_file(path)


def test_scheduler_files_that_are_not_there_or_no_files(tmp_path: Path) -> None:
    with pytest.raises(CagefieldError, match=r"there is no scheduler file .*none\.json; give its path"):
        read_scheduler_file(tmp_path / "none.json")
    with pytest.raises(CagefieldError, match="give a scheduler file"):
        read_scheduler_file(tmp_path)


def test_certificates_are_asked_for_where_the_file_names_an_encrypted_address(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    path = tmp_path / "scheduler.json"
    path.write_text('{"address": "tls://127.0.0.1:8786"}')
    with (
        pytest.raises(CagefieldError, match=r"tls://127\.0\.0\.1:8786 needs certificates"),
        connect(str(path)),
    ):
        pass
