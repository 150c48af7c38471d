"""Files of splats in the editor: opened without an import, sent by a page, edited and downloaded."""

from __future__ import annotations

import asyncio
import contextlib
import os
import tempfile
import zipfile
from collections.abc import AsyncIterator, Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

import httpx
import numpy as np
import pytest
from starlette.types import Message

from cagefield.cameras.camera import Camera
from cagefield.compute.kernel_cache import kernel_cache
from cagefield.errors import CagefieldError, SceneError
from cagefield.formats.splats.splat_files import read_splats, write_splats
from cagefield.scene.scene import Scene
from cagefield.server.editor.persistence import SceneStore, stem_of
from cagefield.server.protocol.client_messages import ExportSplats
from cagefield.server.render_worker.subprocess_task import run_in_process
from cagefield.server.web import splat_file_scene, uploads
from cagefield.server.web.app import application
from cagefield.server.web.launch import open_scene
from cagefield.server.web.security import Guard
from cagefield.server.web.splat_file_scene import KEPT_DAYS, open_mask_folder, scene_of_file
from editor_server import EditorServer, PageClient, editor_server, page
from scenes import ball_scene
from splat_damage import ksplat_of
from splat_scenes import ball_of_splats, random_splats, splat_scene
from tiers import nightly_after_first

EDIT = (
    "version: 1\nedits:\n  - name: ball\n    inner: {center: [0, 0, 0], size: 1.2}\n"
    "    operations: [translate: [3, 0, 0]]\n    adjustment: discrete\n"
)
HOME = {"Origin": "http://localhost"}


@pytest.fixture(autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of the test's own for opened files, with the compiled kernels of all tests."""
    kernels = kernel_cache()
    folder = tmp_path_factory.mktemp("cache") / "cagefield"
    folder.mkdir()
    if kernels is not None:
        (folder / "kernels").symlink_to(kernels.parent)
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder.parent))
    return folder


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A file of splats, alone in its folder."""
    (tmp_path / "capture").mkdir()
    write_splats(ball_of_splats(), tmp_path / "capture" / "ball.ply")
    return tmp_path / "capture" / "ball.ply"


@pytest.fixture
def server(file: Path, cache: Path) -> Iterator[EditorServer]:
    with editor_server(file) as running:
        yield running


# ---- opening ----


def test_a_file_opens_without_an_import_and_nothing_is_written_beside_it(file: Path) -> None:
    before = file.read_bytes()
    coordinator, hello = open_scene(file)
    assert (hello.name, hello.splats) == ("ball.ply", True)
    state = coordinator.state()
    assert state.is_file and state.path == str(file.with_name("ball-scene"))
    np.testing.assert_allclose(coordinator.store.scene.field.means, ball_of_splats().means, atol=1e-6)
    coordinator.session.load_edits(EDIT, False)
    coordinator.changed()
    with pytest.raises(SceneError, match="is a file and stays as it is; use Save as"):
        coordinator.save()
    assert [entry.name for entry in file.parent.iterdir()] == ["ball.ply"]
    assert file.read_bytes() == before


def test_what_was_not_saved_comes_back_wherever_the_file_lies(file: Path, tmp_path: Path) -> None:
    coordinator, _ = open_scene(file)
    coordinator.session.load_edits(EDIT, False)
    coordinator.changed()
    moved = file.rename(tmp_path / "ball.ply")
    again, _ = open_scene(moved)
    assert [entry.edit.name for entry in again.session.document.entries] == ["ball"]
    assert "restored" in (again.greeting or "")


def test_save_as_makes_the_scene_beside_the_file(file: Path) -> None:
    coordinator, _ = open_scene(file)
    coordinator.session.load_edits(EDIT, False)
    coordinator.changed()
    coordinator.save_as("mine", False)
    saved = Scene.open(file.parent / "mine")
    assert [edit.name for edit in saved.edits] == ["ball"] and len(saved.field) == 600
    state = coordinator.state()
    assert not state.is_file and state.saved and state.path == str(file.parent / "mine")
    coordinator.session.load_edits(EDIT, True)
    coordinator.save()
    assert len(Scene.open(file.parent / "mine").edits) == 2
    assert not list(open_mask_folder().glob(".*autosave.json"))


def test_a_scenes_path_is_not_a_files(file: Path, tmp_path: Path) -> None:
    splat_scene().save(tmp_path / "scene")
    store = SceneStore(Scene.open(tmp_path / "scene"), tmp_path / "scene")
    assert store.shown_path == store.path == tmp_path / "scene"
    assert stem_of(Path("x/biker.compressed.ply")) == "biker" and stem_of(Path("a.b.spz")) == "a.b"


def test_scenes_that_nobody_opened_for_long_leave_the_cache(file: Path, tmp_path: Path) -> None:
    old, edited = scene_of_file(file), tmp_path / "other.ply"
    write_splats(ball_of_splats(500), edited)
    kept = scene_of_file(edited)
    (kept.parent / f".{kept.name}.cagefield-autosave.json").write_text("{}")
    for scene in (old, kept):
        os.utime(scene, (0, os.stat(file).st_mtime - 86400.0 * (KEPT_DAYS + 1)))
    write_splats(ball_of_splats(400), tmp_path / "third.ply")
    newest = scene_of_file(tmp_path / "third.ply")
    assert (old.exists(), kept.exists(), newest.exists()) == (False, True, True)
    assert scene_of_file(tmp_path / "third.ply") == newest


@pytest.mark.skipif(os.name != "posix", reason="files with holes are POSIX's")
def test_what_memory_cannot_hold_is_refused_before_its_digest(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file of 20 GB, all holes, would take minutes to go through; one that fits is opened as others are."""
    monkeypatch.setattr(splat_file_scene, "_LARGE", 1)
    scene = scene_of_file(file)
    assert len(read_splats(file)) == len(Scene.open(scene).field) and scene_of_file(file) == scene
    huge = tmp_path / "huge.splat"
    huge.touch()
    os.truncate(huge, 20 << 30)
    monkeypatch.setattr("cagefield.files.memory.free_memory", lambda: 16 << 30)
    monkeypatch.setattr(splat_file_scene, "_digest", lambda *_: pytest.fail("it was gone through"))
    monkeypatch.setattr(
        "cagefield.formats.splats.antimatter15_splat._is_plausible", lambda *_: True
    )  # zeros are no splats
    with pytest.raises(CagefieldError, match=r"its 671088640 splats are too many: it takes 37\.6 GB"):
        scene_of_file(huge)


@pytest.mark.skipif(os.name != "posix", reason="files with holes are POSIX's")
@pytest.mark.parametrize("ending", [".ply", ".compressed.ply", ".glb", ".ksplat"])
def test_of_a_file_that_ends_in_a_hole_only_what_it_declares_is_gone_through(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str
) -> None:
    """20 GB more than its splats take, which nobody reads."""
    file, read = tmp_path / f"a{ending}", list[int]()
    if ending == ".ksplat":
        file.write_bytes(ksplat_of(random_splats(300, degree=1)))
    else:
        write_splats(random_splats(300, degree=1), file)
    size = file.stat().st_size
    os.truncate(file, 20 << 30)
    whole = splat_file_scene.open_regular

    @contextlib.contextmanager
    def counted(path: Path) -> Iterator[BinaryIO]:
        with whole(path) as stream:
            yield stream
            read.append(stream.tell())

    monkeypatch.setattr(splat_file_scene, "open_regular", counted)
    scene = scene_of_file(file)
    assert read == [size]
    os.truncate(file, size)
    assert scene_of_file(file) == scene  # a small file's is the digest of all of it
    assert len(Scene.open(scene).field) == len(read_splats(file))


def test_a_large_file_of_few_splats_is_refused_before_its_digest(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a format that does not say where it ends."""
    packed = file.with_suffix(".spz")
    write_splats(read_splats(file), packed)
    size = packed.stat().st_size
    monkeypatch.setattr(splat_file_scene, "_LARGE", 1)
    scene_of_file(packed)
    monkeypatch.setattr(splat_file_scene, "_MOST_OF_ONE", 1)
    monkeypatch.setattr(splat_file_scene, "_digest", lambda *_: pytest.fail("it was gone through"))
    monkeypatch.setattr(
        "cagefield.formats.splats.antimatter15_splat._is_plausible", lambda *_: True
    )  # zeros are no splats
    with pytest.raises(CagefieldError, match=f"it has {size} bytes for 600 splats; it is damaged"):
        scene_of_file(packed)


def test_a_file_with_a_long_name_is_opened(tmp_path: Path) -> None:
    """Its scene has a name that leaves room for those of its autosave and its drafts."""
    file = tmp_path / ("\u00e9" * 120 + ".ply")
    write_splats(ball_of_splats(300), file)
    scene = scene_of_file(file)
    assert scene.name.startswith("\u00e9" * 50 + "-")
    store = SceneStore(Scene.open(scene), scene, file)
    assert len(os.fsencode(store.autosave_path.name)) < 200


# ---- files that pages send ----


async def _blocks(*blocks: bytes) -> AsyncIterator[bytes]:
    for block in blocks:
        yield block


async def posted(
    path: Path, name: str, content: bytes, headers: dict[str, str] | None = None, token: str | None = None
) -> httpx.Response:
    """The answer to a file that is sent to the editor of a scene, which opens nothing."""
    guard = Guard("localhost" if token is None else "0.0.0.0", 80, token)
    transport = httpx.ASGITransport(
        application(*open_scene(path), guard, lambda scene, source: open_scene(scene))
    )
    async with httpx.AsyncClient(transport=transport, base_url="http://localhost:80") as client:
        return await client.post(
            "/open", params={"name": name}, content=content, headers=HOME if headers is None else headers
        )


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    splat_scene().save(tmp_path / "scene")
    return tmp_path / "scene"


@pytest.mark.parametrize("headers", [{}, {"Origin": "http://evil.example"}])
def test_pages_of_other_sites_send_no_files(scene: Path, headers: dict[str, str]) -> None:
    answer = asyncio.run(posted(scene, "a.ply", b"ply", headers))
    assert answer.status_code == 403 and "may not talk to this editor" in answer.text


def test_other_machines_need_the_token_to_send_files(scene: Path) -> None:
    answer = asyncio.run(posted(scene, "a.ply", b"ply", token="secret-token"))
    assert answer.status_code == 403 and "token is missing" in answer.text


@pytest.mark.parametrize(
    ("name", "content", "line"),
    [
        ("a.ply", b"no splats", "a.ply: not a PLY file"),
        ("..", b"ply", "is no name of a file"),
        ("", b"ply", "is no name of a file"),
        ("x/.hidden.ply", b"ply", "is no name of a file"),
        ("x\x00.ply", b"ply", "is no name of a file"),
        ("x\n.ply", b"ply", "is no name of a file"),
        ("...", b"ply", "is no name of a file"),
        ("   ", b"ply", "is no name of a file"),
        ("x" * 300 + ".ply", b"ply", "has 304 bytes, at most 200; rename the file"),
        ("\u00e9" * 140 + ".ply", b"ply", "has 284 bytes, at most 200; rename the file"),
        ("x.ply ", b"no splats", "x.ply: not a PLY file"),
        ('a<b>:"|?*.ply', b"no splats", "|?*.ply: not a PLY file"),
        ("x.ply.", b"ply", "x.ply.: no format of splats that is known"),
    ],
)
def test_what_is_no_file_of_splats_is_one_line(scene: Path, name: str, content: bytes, line: str) -> None:
    answer = asyncio.run(posted(scene, name, content))
    assert answer.status_code == 400 and line in answer.text and "\n" not in answer.text
    assert "Errno" not in answer.text and tempfile.gettempdir() not in answer.text
    assert not list(open_mask_folder().glob("*"))


def test_a_page_that_hangs_up_amid_a_file_is_no_error(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    app = application(
        *open_scene(scene), Guard("localhost", 80, None), lambda scene, source: open_scene(scene)
    )
    headers = {"host": "localhost", "content-length": "1000", **HOME}
    scope = {
        **{"type": "http", "method": "POST", "path": "/open", "root_path": "", "query_string": b"name=a.ply"},
        "headers": [(name.lower().encode(), text.encode()) for name, text in headers.items()],
    }
    come = [{"type": "http.request", "body": b"ply", "more_body": True}, {"type": "http.disconnect"}]
    sent: list[Message] = []

    async def receive() -> Message:
        return come.pop(0)

    async def send(message: Message) -> None:
        sent.append(message)

    asyncio.run(app(scope, receive, send))
    assert sent[0]["status"] == 499 and not come
    assert not list((tmp_path / "temporary").iterdir())


def test_a_file_that_is_too_large_is_refused_by_what_it_says_and_by_what_comes(
    scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(uploads, "MAX_UPLOAD_BYTES", 1000)
    answer = asyncio.run(posted(scene, "a.ply", b"x" * 1001))
    assert answer.status_code == 413 and "open it with `cagefield view FILE`" in answer.text
    editor = uploads.OpenEditor(*open_scene(scene), lambda scene, source: open_scene(scene))
    with pytest.raises(uploads.TooLargeError):
        asyncio.run(editor.open("a.ply", _blocks(b"x" * 600, b"x" * 600), None))
    with pytest.raises(CagefieldError, match="3 of 4 bytes came"):
        asyncio.run(editor.open("a.ply", _blocks(b"ply"), 4))


@pytest.mark.nightly
def test_a_dropped_file_takes_the_scenes_place_and_pages_come_again(
    server: EditorServer, tmp_path: Path
) -> None:
    write_splats(ball_of_splats(300), tmp_path / "other.ply")
    origin = f"http://localhost:{server.port}"
    with page(server) as (client, hello):
        client.send("load_edits", text=EDIT, append=False)
        client.state(lambda state: not state["saved"])
        answer = httpx.post(
            f"{origin}/open",
            params={"name": "C:\\captures\\other.ply"},
            content=(tmp_path / "other.ply").read_bytes(),
            headers={**server.headers, "Origin": origin},
            timeout=120,
        )
        assert (answer.status_code, answer.text) == (200, "opened")
        with pytest.raises(Exception, match="1012"):
            while True:
                client.take(60)
    with page(server) as (client, other):
        assert other["name"] == "other.ply" and other["scene"] != hello["scene"]
        assert client.joined["is_file"] and client.joined["edits"] == []
        client.look_from(other)
        assert client.final()["final"]


# ---- downloads ----


def done(client: PageClient) -> dict[str, Any]:
    """The end of the export that goes on."""
    return client.until(lambda m: m["type"] == "job" and m["what"] == "splats" and m["state"] != "running")


@pytest.mark.nightly
def test_a_download_has_the_edits_in_it_and_the_page_that_asked_is_told(
    server: EditorServer, tmp_path: Path
) -> None:
    with page(server) as (client, hello):
        client.send("load_edits", text=EDIT, append=False)
        client.send("export", form="ply")
        job = done(client)
        assert (job["state"], job["page"], job["out"]) == ("done", hello["page"], "ball.ply")
        address = f"http://localhost:{server.port}/exports/{job['job']}/ball.ply"
        answer = httpx.get(address, headers=server.headers)
        assert 'filename="ball.ply"' in answer.headers["content-disposition"]
        (tmp_path / "down.ply").write_bytes(answer.content)
        means = read_splats(tmp_path / "down.ply").means
        expected = ball_of_splats().means + np.float32([3, 0, 0])
        np.testing.assert_allclose(
            means[np.lexsort(means.T)], expected[np.lexsort(expected.T)], atol=2e-6
        )  # float32 at 3.5
        assert (
            httpx.get(address, headers={**server.headers, "Origin": "http://evil.example"}).status_code == 403
        )
        assert (
            httpx.get(address.replace(f"/{job['job']}/", "/999/"), headers=server.headers).status_code == 404
        )


def test_an_export_can_be_stopped(server: EditorServer) -> None:
    with page(server) as (client, _):
        client.send("export", form="ply")
        job = client.until(lambda m: m["type"] == "job" and m["state"] == "running")
        client.send("cancel_job", job=job["job"])
        assert done(client)["state"] == "cancelled"
        assert (
            httpx.get(
                f"http://localhost:{server.port}/exports/{job['job']}/ball.ply", headers=server.headers
            ).status_code
            == 404
        )


def keyframe(parts: dict[str, float]) -> dict[str, Any]:
    """A keyframe of the protocol, one second before the next."""
    camera = Camera.look_at((0, -3, 0.5), (0, 0, 0), width=16, height=9, fov_x=0.8)
    return {"c2w": camera.c2w.ravel().tolist(), "fov_y_deg": 40.0, "seconds": 1.0, "parts": parts}


@pytest.mark.nightly
@pytest.mark.parametrize("form", nightly_after_first(["ply", "usdc"]))
def test_frames_of_the_camera_path_download_as_their_videos_show_them(
    server: EditorServer, tmp_path: Path, form: str
) -> None:
    """Five frames; an edit that is hidden and one that changes nothing have no number in between."""
    if form == "usdc":
        pytest.importorskip("pxr.Usd", reason="USD is read by usd-core (extra usd)")
    idle = EDIT.split("edits:\n")[1].replace("[3, 0, 0]", "[0, 0, 0]").replace("ball", "idle")
    with page(server) as (client, _):
        client.send("export", form=form, along_path=True)
        told = client.until(lambda m: m["type"] == "notice" and m["level"] == "error")
        assert "a camera path needs at least one keyframe" in told["text"]
        client.send("load_edits", text=EDIT.replace("edits:\n", "edits:\n" + idle), append=False)
        client.state(lambda state: len(state["edits"]) == 2)
        client.send("set_path", keys=[keyframe({"2": 0.0}), keyframe({"2": 1.0})])
        client.send("export", form=form, along_path=True, fps=4)
        job = done(client)
        steps = [m["done"] for m in client.messages if m["type"] == "job" and m["job"] == job["job"]]
        name = "ball.ply.zip" if form == "ply" else "ball.usdc"
        assert (job["state"], job["out"], job["total"]) == ("done", name, 5)
        assert steps[0] == 0 and steps[-1] == 5 and steps == sorted(steps) and len(set(steps)) > 2
        address = f"http://localhost:{server.port}/exports/{job['job']}/{name}"
        (tmp_path / name).write_bytes(httpx.get(address, headers=server.headers).content)
    if form == "ply":
        with zipfile.ZipFile(tmp_path / name) as archive:
            assert archive.namelist() == [f"ball_{n:04d}.ply" for n in range(5)]
            archive.extractall(tmp_path)
        frames = [read_splats(tmp_path / f"ball_{n:04d}.ply") for n in range(5)]
    else:
        frames = [read_splats(tmp_path / name, time_code=n) for n in range(5)]
    for frame, part in zip(frames, (0.0, 0.25, 0.5, 0.75, 1.0), strict=True):
        expected = ball_of_splats().means + np.float32([3 * part, 0, 0])
        found = frame.means[np.lexsort(frame.means.T)]
        np.testing.assert_allclose(found, expected[np.lexsort(expected.T)], atol=2e-6)  # float32 at 3.5


def test_voxels_have_no_splats_to_download(tmp_path: Path) -> None:
    ball_scene().save(tmp_path / "voxels")
    coordinator, hello = open_scene(tmp_path / "voxels")
    assert not hello.splats
    with pytest.raises(CagefieldError, match="the scene holds voxels; `cagefield export SCENE"):
        coordinator.background.export(1, ExportSplats(form="spz"))


# ---- a process for each ----


def test_work_in_its_own_process_returns_raises_and_is_lost_in_one_line() -> None:
    assert asyncio.run(run_in_process(len, "abc")) == 3
    with pytest.raises(CagefieldError, match="that failed: ZeroDivisionError"):
        asyncio.run(run_in_process(divmod, 1, 0))
    with pytest.raises(CagefieldError, match="the process that did this ended"):
        asyncio.run(run_in_process(os._exit, 3))


def in_thirds(text: str, *, on_progress: Callable[[float], None]) -> str:
    """Work that reports its progress."""
    for number in range(1, 4):
        on_progress(number / 3)
    return text


def test_work_in_its_own_process_reports_its_progress() -> None:
    shares: list[float] = []
    assert asyncio.run(run_in_process(in_thirds, "abc", on_progress=shares.append)) == "abc"
    assert shares == [1 / 3, 2 / 3, 1.0]
