"""Frames on a cluster of local workers: files of one process, also where workers are killed.

The oracle is the command without a cluster: all files, byte for byte.
"""

from __future__ import annotations

import importlib.util
import pickle
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cagefield import Cage, Edit, EditStack, Scene
from cagefield.cameras.camera import Camera
from cagefield.cameras.keyframe_files import dump_path
from cagefield.cameras.keyframes import Keyframe
from cagefield.cli import main
from cagefield.cli.frame_files import FrameFiles, frames_folder, parse_frames
from cagefield.cluster import connection
from cagefield.cluster.connection import TlsFiles, connect, parse_cluster
from cagefield.cluster.frame_tasks import FrameJob, render_frame, write_contents
from cagefield.cluster.scene_archive import SceneArchive, SceneSource, content_digest
from cagefield.errors import CagefieldError, SceneError
from cagefield.images.pictures import has_pictures
from cagefield.scene.frames import FrameOptions, FrameRenderer
from certificates import certificate_of_localhost
from cluster_functions import cubed, frame_amid_kills
from commands import printed, refused
from plenoctree_files import plenoctree_arrays, write_plenoctree
from scenes import ball_cameras, ball_scene, files_of

needs_dask = pytest.mark.skipif(
    importlib.util.find_spec("distributed") is None,
    reason="dask.distributed is not installed (extra cluster)",
)


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene folder whose ball is moved up."""
    path = tmp_path_factory.mktemp("cluster") / "scene"
    lift = Edit.move(Cage.box((0, 0, 0), 1.2)).translate((0, 0, 0.4))
    ball_scene().with_edits(EditStack([lift])).save(path)
    return path


def run(*argv: object) -> None:
    assert main([str(arg) for arg in argv]) == 0


@pytest.mark.nightly
@needs_dask
@pytest.mark.parametrize(("workers", "names"), [(2, ("0002",)), (3, ("0005", "0010"))])
def test_frames_of_a_cluster_that_loses_workers_are_those_of_one_process(
    scene: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    workers: int,
    names: tuple[str, ...],
) -> None:
    """Each frame of `names` has its worker killed amid its files, at its first try."""
    from cagefield.cluster import frame_cluster

    options = ["--turntable", 6 * (workers - 1), "--size", "32x24", "--depth", "--normals", "--compare"]
    run("render", scene, "-o", tmp_path / "one", *options)
    marks = tmp_path / "marks"
    marks.mkdir()
    monkeypatch.setattr(frame_cluster, "render_frame", partial(frame_amid_kills, marks, names))
    run("render", scene, "-o", tmp_path / "many", *options, "--cluster", workers)
    assert {path.name for path in marks.iterdir()} == set(names)
    expected = files_of(tmp_path / "one")
    assert len(expected) == 4 * 6 * (workers - 1) and files_of(tmp_path / "many") == expected
    lost = "1 worker was lost" if len(names) == 1 else f"{len(names)} workers were lost"
    assert lost in capsys.readouterr().err


@pytest.mark.nightly
@needs_dask
def test_workers_that_see_no_folder_are_sent_the_scene_and_return_the_files(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As of another machine: neither scene folder nor mark; a worker is killed, and sent the scene again."""
    from cagefield.cluster import frame_cluster

    options = ["--turntable", 4, "--size", "32x24", "--depth"]
    run("render", scene, "-o", tmp_path / "one", *options)
    here = SceneSource.read(scene)
    elsewhere = SceneSource(tmp_path / "not there", here.digest)
    packed = SceneArchive.packed(here, Scene.open(scene))
    packed.source = elsewhere
    sent: list[SceneSource] = []

    def archive_of(source: SceneSource, opened: Scene) -> SceneArchive:
        sent.append(source)
        return packed

    def job_without_mark(*args: Any) -> FrameJob:
        return replace(FrameJob(*args), mark="not there")

    marks = tmp_path / "marks"
    marks.mkdir()
    monkeypatch.setattr(SceneSource, "read", lambda folder: elsewhere)
    monkeypatch.setattr(SceneArchive, "packed", archive_of)
    monkeypatch.setattr(frame_cluster, "FrameJob", job_without_mark)
    monkeypatch.setattr(frame_cluster, "render_frame", partial(frame_amid_kills, marks, ("0001",)))
    run("render", scene, "-o", tmp_path / "many", *options, "--cluster", 2)
    assert sent == [elsewhere] and [path.name for path in marks.iterdir()] == ["0001"]
    assert files_of(tmp_path / "many") == files_of(tmp_path / "one")
    assert "1 worker was lost" in capsys.readouterr().err


@pytest.mark.nightly
@needs_dask
def test_an_interrupt_cancels_the_others_and_keep_adds_them(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C after the second frame: files that are there are whole, no worker goes on."""
    from cagefield.cluster.frame_cluster import FrameCluster

    options = ["--turntable", 6, "--size", "32x24", "--depth"]
    run("render", scene, "-o", tmp_path / "one", *options)
    expected, many = files_of(tmp_path / "one"), tmp_path / "many"
    render = FrameCluster.render

    def pressed(self: FrameCluster, *args: object) -> Iterator[object]:
        for count, frame in enumerate(render(self, *args)):  # type: ignore[arg-type]
            yield frame
            if count == 1:
                raise KeyboardInterrupt

    words = ["render", scene, "-o", many, *options, "--keep", "--cluster", 2]
    with monkeypatch.context() as patched:
        patched.setattr(FrameCluster, "render", pressed)
        assert main([str(word) for word in words]) == 130
    found = files_of(many)
    assert 0 < len(found) < len(expected) and found.items() <= expected.items()
    run(*words)
    assert files_of(many) == expected


@pytest.mark.nightly
@needs_dask
def test_a_camera_path_of_a_cluster_is_the_video_of_one_process(scene: Path, tmp_path: Path) -> None:
    poses = [tuple(camera.c2w.ravel().tolist()) for camera in ball_cameras(2)]
    path = tmp_path / "path.json"
    path.write_text(dump_path([Keyframe(pose, 40.0, 1.0) for pose in poses], loop=False))
    options = ["--camera-path", path, "--fps", 3, "--size", "32x24"]
    run("render", scene, "-o", tmp_path / "one.mp4", *options)
    run("render", scene, "-o", tmp_path / "many.mp4", *options, "--cluster", 2)
    assert (tmp_path / "many.mp4").read_bytes() == (tmp_path / "one.mp4").read_bytes()


@pytest.mark.nightly
@needs_dask
def test_exact_frames_of_an_imported_field(tmp_path: Path) -> None:
    file = write_plenoctree(tmp_path / "a.npz", plenoctree_arrays())
    run("import", file, "-o", tmp_path / "scene", "--resolution", 16, "--compare", 0)
    options = ["--exact", "--turntable", 2, "--size", "8x6"]
    run("render", tmp_path / "scene", "-o", tmp_path / "one", *options)
    run("render", tmp_path / "scene", "-o", tmp_path / "many", *options, "--cluster", 1)
    assert files_of(tmp_path / "many") == files_of(tmp_path / "one")


@pytest.mark.nightly
@needs_dask
def test_encrypted_connections(scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Local workers over TLS; neither an unencrypted client nor one with another certificate gets in."""
    cert, key = certificate_of_localhost(tmp_path)
    options = ["--turntable", 2, "--size", "32x24"]
    run("render", scene, "-o", tmp_path / "one", *options)
    run("render", scene, "-o", tmp_path / "tls", *options, "--cluster", 1, "--cluster-tls", cert, cert, key)
    assert files_of(tmp_path / "tls") == files_of(tmp_path / "one")
    (tmp_path / "other").mkdir()
    other, other_key = certificate_of_localhost(tmp_path / "other")
    files = TlsFiles(cert, cert, key)
    with connect(1, files) as client:
        address = client.scheduler.address
        assert address.startswith("tls://127.0.0.1:")
        with connect(address, files) as second:
            assert second.submit(cubed, 3).result() == 27
        monkeypatch.setattr(connection, "CONNECT_SECONDS", 3.0)
        for bad, tls in (
            (address.replace("tls:", "tcp:"), None),
            (address, TlsFiles(other, other, other_key)),
        ):
            with pytest.raises(CagefieldError, match="no scheduler replies"), connect(bad, tls):
                pass


def test_kept_frames_stay_and_the_others_are_added(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--turntable", 5, "--size", "32x24", "--depth"]
    run("render", scene, "-o", tmp_path / "whole", *options)
    expected = files_of(tmp_path / "whole")
    out = tmp_path / "parts"
    run("render", scene, "-o", out, *options, "--frames", "2-3")
    assert files_of(out) == {name: expected[name] for name in expected if name[:4] in ("0002", "0003")}
    (out / "0003_depth.npy").unlink()  # incomplete: rendered again
    before = (out / "0002.png").stat().st_mtime_ns
    text = printed(capsys, "render", scene, "-o", out, *options, "--keep")
    assert "5 pictures in" in text and "1 of them kept" in text
    assert files_of(out) == expected and (out / "0002.png").stat().st_mtime_ns == before
    assert "5 of them kept" in printed(capsys, "render", scene, "-o", out, *options, "--keep")


@pytest.mark.nightly
def test_a_video_from_kept_frames_is_the_video(scene: Path, tmp_path: Path) -> None:
    options = ["--turntable", 4, "--size", "32x24", "--normals", "--depth"]
    run("render", scene, "-o", tmp_path / "one.mp4", *options)
    run("render", scene, "-o", tmp_path / "kept.mp4", *options, "--keep")
    assert (tmp_path / "kept.mp4").read_bytes() == (tmp_path / "one.mp4").read_bytes()
    assert len(list((tmp_path / "kept_frames").iterdir())) == 16


@pytest.mark.parametrize("error", [CagefieldError("connection lost"), KeyboardInterrupt()])
def test_frames_of_a_video_that_fails_are_kept(tmp_path: Path, error: BaseException) -> None:
    """They become NAME_frames, which an earlier end may have left."""
    video, kept = tmp_path / "a.mp4", tmp_path / "a_frames"
    for content, message in ((b"first", "1 picture stays in .*a_frames; go on with --keep"), (b"second", "")):
        with (
            pytest.warns(UserWarning, match=message) if message else nullcontext(),
            pytest.raises(type(error)),
            frames_folder(video, keep=False) as folder,
        ):
            folder.mkdir()
            (folder / "0003.png").write_bytes(content)
            (folder / "0003_depth.png").write_bytes(content)
            raise error
        assert [path.name for path in tmp_path.iterdir()] == ["a_frames"]
        assert files_of(kept) == {"0003.png": b"first", "0003_depth.png": b"first"}


def test_an_end_before_the_first_frame_leaves_nothing(tmp_path: Path) -> None:
    for made in (False, True):
        with pytest.raises(CagefieldError), frames_folder(tmp_path / "a.mp4", keep=False) as folder:
            if made:
                folder.mkdir()
            raise CagefieldError("no workers")
    assert not list(tmp_path.iterdir())


def test_a_worker_without_the_folders_returns_the_files(scene: Path, tmp_path: Path) -> None:
    """The archive is unpacked where the folder is not, and removed; contents are those of the files."""
    opened = Scene.open(scene)
    here = SceneSource.read(scene)
    elsewhere = SceneSource(tmp_path / "not there", here.digest)
    options = FrameOptions(depth=True)
    job = FrameJob(elsewhere, options, "cpu", tmp_path / "nor there", "mark")
    camera = ball_cameras(1)[0]
    missing = render_frame(job, camera, "0000", None)
    assert "is not on this worker" in missing.error
    archive = pickle.loads(pickle.dumps(SceneArchive.packed(here, opened)))
    archive.source = elsewhere
    archive.setup()
    try:
        unpacked = elsewhere.find()
        assert content_digest(unpacked) == here.digest
        result = render_frame(job, pickle.loads(pickle.dumps(camera)), "0000", None)
    finally:
        archive.teardown()
    assert not unpacked.exists() and result.error == ""
    write_contents(tmp_path / "0000", result)
    assert has_pictures(tmp_path / "0000", options.ends)
    pictures, scale = FrameRenderer(opened, options).pictures(camera, None)
    np.testing.assert_array_equal(np.load(tmp_path / "0000_depth.npy"), pictures["_depth.npy"])
    assert result.scale == scale and not (tmp_path / "nor there").exists()


def test_another_scene_than_the_clients_is_not_rendered(scene: Path, tmp_path: Path) -> None:
    ball_scene().save(tmp_path / "scene")
    source = SceneSource.read(tmp_path / "scene")
    assert source.find() == tmp_path / "scene"
    assert content_digest(scene) != source.digest
    Scene.open(scene).save(tmp_path / "scene", overwrite=True)
    with pytest.raises(SceneError, match="was changed since the start"):
        source.find()


def test_a_scene_with_pastes_needs_a_shared_folder(scene: Path, tmp_path: Path) -> None:
    ball_scene().save(tmp_path / "other")
    opened = Scene.open(scene)
    pasting = opened.with_edits(opened.edits.append(opened.paste(tmp_path / "other")))
    with pytest.raises(SceneError, match="pastes from other scenes"):
        SceneArchive.packed(SceneSource.read(scene), pasting)


@pytest.mark.parametrize(
    ("text", "cluster"),
    [("3", 3), ("tcp://127.0.0.1:8786", "tcp://127.0.0.1:8786"), ("tls://farm:8786", "tls://farm:8786"),
     ("scheduler.json", "scheduler.json")],
)  # fmt: skip
def test_clusters(text: str, cluster: int | str) -> None:
    assert parse_cluster(text) == cluster


@pytest.mark.parametrize("text", ["0", "-1", "257", "farm", "tcp://farm", "http://farm:1", "tcp://farm:x"])
def test_no_clusters(text: str) -> None:
    with pytest.raises(CagefieldError, match="is no cluster; give a number of local workers"):
        parse_cluster(text)


def test_frame_ranges() -> None:
    assert parse_frames(None, 3) == range(3)
    assert parse_frames("1-2", 3) == range(1, 3) and parse_frames("2", 3) == range(2, 3)
    for text in ("2-3", "2-1"):
        with pytest.raises(CagefieldError, match="pictures go from 0 to 2"):
            parse_frames(text, 3)
    with pytest.raises(CagefieldError, match="is no range"):
        parse_frames("a-b", 3)


def test_kept_pictures_of_another_size_are_refused(scene: Path, tmp_path: Path) -> None:
    run("render", scene, "-o", tmp_path / "out", "--size", "12x8")
    cameras: list[Camera] = list(ball_scene().cameras["test"])
    with pytest.raises(CagefieldError, match="8 pixels high, not 16"):
        FrameFiles(cameras, range(2), (".png",)).missing(tmp_path / "out")


@needs_dask
def test_encrypted_clusters_need_certificates(tmp_path: Path) -> None:
    with pytest.raises(CagefieldError, match="needs certificates; give --cluster-tls"), connect("tls://a:1"):
        pass
    files = TlsFiles(*(tmp_path / name for name in ("ca.pem", "cert.pem", "key.pem")))
    with pytest.raises(CagefieldError, match=r"there is no file .*ca\.pem"):
        files.security()
    with pytest.raises(CagefieldError, match="is not encrypted; give tls://"), connect("tcp://a:1", files):
        pass


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--keep", "--overwrite"], "exclude each other"),
        (["--cluster-tls", "a", "b", "c"], "belongs to --cluster"),
        (["--cluster", "none"], "is no cluster"),
        (["--frames", "9"], "pictures go from 0 to 1"),
    ],
)
def test_options_that_are_refused(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], message: str
) -> None:
    assert message in refused(capsys, "render", scene, "-o", tmp_path / "out", *options)
    assert not (tmp_path / "out").exists()


def test_without_the_package_the_cure_is_named(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    error = refused(capsys, "render", scene, "-o", tmp_path / "out", "--cluster", 2)
    assert "pip install 'cagefield[cluster]'" in error and not (tmp_path / "out").exists()
