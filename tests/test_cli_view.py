"""`cagefield view`: what it refuses, in one line each, and what it serves."""

from __future__ import annotations

import socket
import sys
from pathlib import Path

import pytest

from cagefield.cli.demo import Demo
from cagefield.server.web import launch
from cagefield.server.web.security import Guard
from commands import printed, refused
from scenes import ball_scene


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A small scene folder."""
    ball_scene().save(tmp_path / "scene")
    return tmp_path / "scene"


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> list[Guard]:
    """The guards of the editors that would have been served; nothing is."""
    guards: list[Guard] = []

    def serve(coordinator: object, hello: object, guard: Guard, listening: socket.socket, *_: object) -> None:
        listening.close()
        guards.append(guard)

    monkeypatch.setattr(launch, "serve", serve)
    return guards


def test_a_missing_scene_is_one_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert "does not exist; give the folder" in refused(capsys, "view", tmp_path / "no")


@pytest.mark.parametrize(
    ("file", "content", "message"),
    [
        (
            "edits.yaml",
            "version: 1\nedits:\n  - inner: {center: [.nan, 0, 0], size: 1}\n",
            "numbers must be finite",
        ),
        ("camera_path.json", "{", "camera_path.json is not JSON"),
        ("field.safetensors", "cut off", "it may be truncated"),
        ("scene.json", "{}", "give a scene folder"),
        ("cameras.json", "{", "is not readable JSON"),
    ],
)
def test_a_damaged_scene_is_one_line_that_names_the_file(
    capsys: pytest.CaptureFixture[str], scene: Path, file: str, content: str, message: str
) -> None:
    (scene / file).write_text(content)
    line = refused(capsys, "view", scene, "--no-browser", "--port", "0")
    assert message in line and str(scene / file) in line


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--port", "70000"), "--port is 70000; give a number from 0 to 65535"),
        (("--token", "short"), "--token is too short"),
        (("--root", "nowhere"), "--root nowhere is no folder"),
        (("--host", "no such host"), "is no address"),
        (("--host", "192.0.2.1", "--port", "0"), "cannot listen on 192.0.2.1:0"),
    ],
)
def test_impossible_options_are_one_line(
    capsys: pytest.CaptureFixture[str], scene: Path, options: tuple[str, ...], message: str
) -> None:
    assert message in refused(capsys, "view", scene, "--no-browser", *options)


def test_a_port_that_is_taken_is_one_line(capsys: pytest.CaptureFixture[str], scene: Path) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        message = refused(capsys, "view", scene, "--no-browser", "--host", "127.0.0.1", "--port", port)
    assert f"cannot listen on 127.0.0.1:{port}" in message and "give another --port" in message


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of the test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "cagefield"


def test_at_home_a_token_is_needed_too_and_stays_the_same(
    capsys: pytest.CaptureFixture[str], scene: Path, served: list[Guard], cache: Path
) -> None:
    """Other users of the machine reach the port; pages that are open come again after a restart."""
    for _ in range(2):
        text = printed(capsys, "view", scene, "--no-browser", "--port", "0")
        assert f"http://localhost:{served[-1].port}/?token={served[-1].token}  (" in text
    first, second = (guard.token for guard in served)
    assert first == second and first is not None and len(first) >= 32
    assert (cache / "token").stat().st_mode & 0o777 == 0o600
    (cache / "token").chmod(0o644)
    printed(capsys, "view", scene, "--no-browser", "--port", "0")
    assert served[-1].token != first


def test_a_token_from_the_environment(
    capsys: pytest.CaptureFixture[str], scene: Path, served: list[Guard], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CAGEFIELD_TOKEN", "from the environment")
    text = printed(capsys, "view", scene, "--no-browser", "--port", "0")
    assert served[0].token == "from the environment" and "?token=from+the+environment  (" in text
    monkeypatch.setenv("CAGEFIELD_TOKEN", "short")
    assert "$CAGEFIELD_TOKEN is too short" in refused(capsys, "view", scene, "--no-browser")


def test_other_machines_need_the_token_in_the_link(
    capsys: pytest.CaptureFixture[str], scene: Path, served: list[Guard]
) -> None:
    text = printed(capsys, "view", scene, "--no-browser", "--port", "0", "--host", "0.0.0.0")
    (guard,) = served
    assert guard.token is not None and len(guard.token) >= 32
    assert f"http://{socket.gethostname()}:{guard.port}/?token={guard.token}  (" in text


def test_the_browser_is_opened_unless_told_not_to(
    capsys: pytest.CaptureFixture[str], scene: Path, served: list[Guard], monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    printed(capsys, "view", scene, "--port", "0")
    printed(capsys, "view", scene, "--port", "0", "--no-browser")
    assert opened == [f"http://localhost:{served[0].port}/?token={served[0].token}"]


@pytest.mark.parametrize(("answer", "opens"), [("y", 1), ("", 0), ("n", 0)])
def test_the_demo_ends_by_offering_the_editor(
    scene: Path,
    served: list[Guard],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    answer: str,
    opens: int,
) -> None:
    scene.rename(scene.with_name("edited"))
    monkeypatch.setattr("webbrowser.open", lambda link: None)
    monkeypatch.setattr("builtins.input", lambda prompt: answer)
    for stream in (sys.stdin, sys.stdout):
        monkeypatch.setattr(stream, "isatty", lambda: True, raising=False)
    Demo(out=scene.parent)._offer()
    assert f"cagefield view {scene.parent}/edited" in capsys.readouterr().out
    assert len(served) == opens


def test_a_page_is_told_where_up_is_and_where_to_begin(scene: Path) -> None:
    coordinator, hello = launch.open_scene(scene)
    assert coordinator.session.saved and hello.name == "scene"
    assert hello.up == (0.0, 0.0, 1.0)
    camera = ball_scene().cameras["test"][0]
    assert hello.start.c2w == camera.c2w.reshape(-1).tolist()
    assert (hello.start.width, hello.start.height) == (24, 16)
