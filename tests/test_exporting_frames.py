"""Edits along a camera path: USD time samples and sequences of files, against the splats of each frame."""

from __future__ import annotations

import json
import tracemalloc
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.cameras.keyframe_files import dump_path
from cagefield.cameras.keyframes import Keyframe
from cagefield.edits import Edit, EditStack
from cagefield.errors import CagefieldError, EditError
from cagefield.exporting import edited_splats, upright
from cagefield.exporting.path_frames import CameraPath, edits_at, splats_at
from cagefield.exporting.sequences import frame_file, write_sequence, write_sequence_archive
from cagefield.exporting.usd_scenes import StageScene, edited_parts, write_scenes_usd
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.splat_files import read_splats, write_splats
from cagefield.geometry.cage import Cage
from cagefield.rendering.splats.bake_splats import baked_splats
from cagefield.scene.scene import Scene
from commands import given_up, printed, refused
from full_disks import fill, small_disk
from scenes import files_of
from splat_scenes import ball_of_splats, random_splats, splat_scene
from tiers import nightly_after_first

Usd: Any = pytest.importorskip("pxr.Usd", reason="USD is read by usd-core (extra usd)")

INNER = Cage.box((0.3, 0, 0), 0.6)
MOVED = Edit.move(INNER, name="ball").translate((0.5, 0, 0)).replace(fill="none", relight="none")
FPS = 4.0


def key(part: float, x: float = 0.0) -> Keyframe:
    camera = Camera.look_at((x, -3.0, 0.5), (0.0, 0.0, 0.0), width=16, height=9, fov_x=0.8)
    return Keyframe(tuple(camera.c2w.ravel().tolist()), 40.0, 1.0, {1: part})


KEYS = (key(0.0), key(1.0, 0.5))
PATH = CameraPath(KEYS, fps=FPS)


def scene_with(*edits: Edit) -> Scene:
    return splat_scene().with_edits(EditStack(edits))


def saved(tmp_path: Path, scene: Scene) -> Path:
    scene.save(tmp_path / "scene")
    (tmp_path / "scene" / "camera_path.json").write_text(dump_path(KEYS, loop=False, fps=FPS))
    return tmp_path / "scene"


def expected_frames(scene: Scene) -> list[SplatField]:
    """Splats of each frame by the edit's own operation at the part of the frame, for the file's axes."""
    frames, (whole,) = [], scene.edits
    for still in PATH.stills():
        part = still.parts[1]
        edit = whole.replace(operations=tuple(operation.part(part) for operation in whole.operations))
        edits = EditStack([edit] if part else [])
        frames.append(upright(baked_splats(scene.field, edits), scene.up))
    return frames


def assert_close(got: SplatField, expected: SplatField) -> None:
    assert len(got) == len(expected)
    np.testing.assert_allclose(got.means, expected.means, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(got.log_scales, expected.log_scales, atol=1e-6)
    np.testing.assert_allclose(got.opacities, expected.opacities, rtol=1e-6)
    np.testing.assert_allclose(got.sh, expected.sh, atol=1e-5)


@pytest.mark.parametrize("suffix", nightly_after_first([".usdc", ".usda", ".usdz"]))
def test_time_samples_are_the_splats_of_each_frame(tmp_path: Path, suffix: str) -> None:
    scene, file = scene_with(MOVED), tmp_path / f"x{suffix}"
    info = write_scenes_usd(file, [StageScene("ball", scene, scene.up)], PATH)
    frames = expected_frames(scene)
    assert info.frames == len(frames) == 5
    assert len({len(frame) for frame in frames}) > 1  # splats are split while the cage moves
    for number, frame in enumerate(frames):
        assert_close(read_splats(file, time_code=float(number)), frame)
    stage = Usd.Stage.Open(str(file))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode(), stage.GetTimeCodesPerSecond()) == (0, 4, FPS)


KINDS = {
    "continuous": lambda part: Edit.continuous(INNER, INNER.grown(0.4)).translate((0.2 * part, 0, 0)),
    "lattice": lambda part: Edit.continuous(INNER.subdivided((3, 3, 3)), INNER.grown(0.4)).translate(
        (0, 0.1 * part, 0)
    ),
    "graded": lambda part: Edit.continuous(INNER, INNER.grown(0.4)).grade(
        exposure=0.8 * part, hue_deg=50 * part, opacity=1 - 0.5 * part
    ),
    "mirrored copy": lambda part: (
        Edit.copy(INNER, fill="none", relight="none").mirror("x").translate((-0.9 * part, 0.2 * part, 0))
    ),
}
"""Edits by kind, as functions of the part that is done, written out without the parts of operations."""


@pytest.mark.nightly
@pytest.mark.parametrize("degree", [1, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_time_samples_of_each_kind_of_edit(tmp_path: Path, kind: str, degree: int) -> None:
    scene = Scene(random_splats(150, degree), EditStack([KINDS[kind](1.0)]))
    write_scenes_usd(tmp_path / "x.usdc", [StageScene("x", scene, scene.up)], PATH)
    for number, still in enumerate(PATH.stills()):
        edits = EditStack([KINDS[kind](still.parts[1])] if still.parts[1] else [])
        expected = upright(baked_splats(scene.field, edits), scene.up)
        assert_close(read_splats(tmp_path / "x.usdc", time_code=float(number)), expected)


def test_the_camera_of_the_path_looks_at_the_splats(tmp_path: Path) -> None:
    """USD's own camera projects a splat to the pixel at which the scene's camera sees it."""
    from pxr import UsdGeom

    scene, file = scene_with(MOVED), tmp_path / "x.usda"
    write_scenes_usd(file, [StageScene("ball", scene, scene.up)], PATH)
    stage = Usd.Stage.Open(str(file))
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/World/camera"))
    for number, (still, frame) in enumerate(zip(PATH.stills(), expected_frames(scene), strict=True)):
        frustum = camera.GetCamera(float(number)).frustum
        both = frustum.ComputeViewMatrix() * frustum.ComputeProjectionMatrix()
        point = frame.means[7].astype(float) * (1.0, -1.0, -1.0)
        x, y, _ = both.Transform(point.tolist())
        world = np.append(splats_at(scene, still.parts).means[7].astype(float), 1.0)
        eye = np.linalg.inv(still.camera.c2w) @ world
        pixel = still.camera.fx * eye[:2] / -eye[2]
        np.testing.assert_allclose(
            (x * still.camera.width / 2, y * still.camera.height / 2), pixel, rtol=1e-4, atol=1e-3
        )


def test_scenes_and_pastes_are_prims(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    heap = random_splats(60, degree=1)
    write_splats(heap, tmp_path / "heap.ply")
    paste = Edit.paste(str(tmp_path / "heap.ply"), Cage.box((0, 0, 0), 4.0), name="the heap").replace(
        relight="none"
    )
    folder = saved(tmp_path, scene_with(MOVED, paste.translate((3, 0, 0))))
    Scene(random_splats(30)).save(tmp_path / "other")
    out = tmp_path / "x.usda"
    said = printed(capsys, "export", folder, "-o", out, "--add", tmp_path / "other")
    assert "prims: scene, the_heap, other" in said
    stage = Usd.Stage.Open(str(out))
    counts = {
        p.GetName(): len(p.GetAttribute("positions").Get())
        for p in stage.Traverse()
        if p.GetName() != "World"
    }
    parts = edited_parts(Scene.open(folder))
    assert counts == {"scene": len(parts[""]), "the_heap": len(heap), "other": 30}
    assert sum(map(len, parts.values())) == len(edited_splats(Scene.open(folder)))
    np.testing.assert_allclose(parts["the heap"].means, heap.means + np.array([3, 0, 0]), atol=1e-5)
    assert len(read_splats(out)) == sum(counts.values())


@pytest.mark.parametrize("suffix", [".ply", ".spz"])
def test_a_sequence_has_the_splats_of_each_frame(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], suffix: str
) -> None:
    scene = scene_with(MOVED)
    folder, pattern = saved(tmp_path, scene), tmp_path / "frames" / f"f_%03d{suffix}"
    said = printed(capsys, "export", folder, "-o", pattern, "--fps", FPS)
    assert "5 frames of splats, 5 written" in said
    files = sorted((tmp_path / "frames").iterdir())
    assert [file.name for file in files] == [f"f_{n:03d}{suffix}" for n in range(5)]
    for number, frame in enumerate(expected_frames(Scene.open(folder))):
        write_splats(frame, tmp_path / f"expected{suffix}")
        assert files[number].read_bytes() == (tmp_path / f"expected{suffix}").read_bytes()
    # An interrupted export goes on: what is there is kept, and only that.
    files[1].write_bytes(b"mine")
    files[3].unlink()
    said = printed(capsys, "export", folder, "-o", pattern, "--fps", FPS)
    assert "1 written; 4 were there and are kept" in said
    assert files[1].read_bytes() == b"mine" and files[3].exists()
    printed(capsys, "export", folder, "-o", pattern, "--fps", FPS, "--overwrite")
    assert files[1].read_bytes() != b"mine"


def test_an_archive_has_the_files_of_a_sequence(tmp_path: Path) -> None:
    scene = scene_with(MOVED)
    write_sequence(scene, PATH, tmp_path / "frames" / "f_%02d.spz", scene.up)
    shares: list[float] = []
    out = tmp_path / "out" / "frames.zip"
    assert write_sequence_archive(scene, PATH, out, "f_%02d.spz", scene.up, on_progress=shares.append) == 5
    with zipfile.ZipFile(out) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    assert members == files_of(tmp_path / "frames") and len(members) == 5
    assert shares == [0.2, 0.4, 0.6, 0.8, 1.0]
    assert [file.name for file in out.parent.iterdir()] == ["frames.zip"]
    with pytest.raises(CagefieldError, match="one %d or %04d"):
        write_sequence_archive(scene, PATH, out, "f.spz", scene.up)


@pytest.mark.nightly
def test_a_sequence_takes_the_memory_of_one_frame(tmp_path: Path) -> None:
    """Five times the frames, no more memory; the frames together would take seven times the slack."""
    field = ball_of_splats(20_000)
    scene = replace(splat_scene(), field=field).with_edits(EditStack([MOVED]))

    def peak(frames: int, name: str) -> int:
        path = replace(PATH, fps=float(frames))
        tracemalloc.start()
        write_sequence(scene, path, tmp_path / f"{name}_%d.ply", scene.up)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    peak(1, "warm")
    few = peak(7, "few")  # more than the stacks that a set keeps
    assert peak(35, "many") < few + 28 * 20_000 * 56 / 7


@pytest.mark.robust
def test_a_sequence_on_a_full_disk_keeps_whole_frames(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = saved(tmp_path, scene_with(MOVED))
    arguments = ("export", folder, "-o")
    printed(capsys, *arguments, tmp_path / "all" / "%d.ply", "--fps", FPS)
    whole = files_of(tmp_path / "all")
    with small_disk(tmp_path / "disk", 400) as disk:
        filler = fill(disk, sum(map(len, whole.values())) * 2 // 5)
        pattern = disk / "%d.ply"
        line = given_up(capsys, *arguments, pattern, "--fps", FPS)
        assert "No space left on device" in line and "/." not in line
        there = {name: data for name, data in files_of(disk).items() if name != "filler"}
        assert 0 < len(there) < 5 and all(data == whole[name] for name, data in there.items())
        filler.unlink()
        assert f"{len(there)} were there and are kept" in printed(capsys, *arguments, pattern, "--fps", FPS)
        assert files_of(disk) == whole


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("%d_%d.ply", (), "has one %d or %04d"),
        ("%s.ply", (), "has one %d or %04d"),
        ("%d.xyz", (), "no format of splats that is written"),
        ("%d.ply", ("--selection", "ball"), "leave out --selection"),
        ("%d.ply", ("--fps", "0"), "--fps is 0"),
        ("x.ply", ("--camera-path", "{path}"), "are for .usda, .usdc and .usdz"),
        ("x.usda", ("--camera-path", "{path}", "--axes", "rub"), "leave out --selection"),
        ("x.html", ("--camera-path", "{path}"), "leave out --camera-path"),
        ("x.usda", ("--camera-path", "{broken}"), "must be a list"),
    ],
)
def test_refusals(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, options: tuple[str, ...], message: str
) -> None:
    folder = saved(tmp_path, scene_with(MOVED))
    (tmp_path / "broken.json").write_text(json.dumps({"keyframes": 3}))
    files = {"{path}": folder / "camera_path.json", "{broken}": tmp_path / "broken.json"}
    before = files_of(tmp_path)
    line = refused(
        capsys, "export", folder, "-o", tmp_path / name, *(files.get(word, word) for word in options)
    )
    assert message in line
    assert files_of(tmp_path) == before


def test_a_scene_without_a_camera_path_has_no_sequence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = saved(tmp_path, scene_with(MOVED))
    (folder / "camera_path.json").unlink()
    line = refused(capsys, "export", folder, "-o", tmp_path / "frames" / "%d.ply")
    assert "has no camera path whose frames a sequence could be; give --camera-path" in line
    assert not (tmp_path / "frames").exists()


def test_an_edit_that_is_impossible_on_its_way() -> None:
    """At nine tenths of its way the inner cage has left the outer one."""
    cage = Cage.box((0, 0, 0), 0.4)
    edit = Edit.continuous(cage, cage.grown(0.1), name="out").translate((0.3, 0, 0))
    with pytest.raises(EditError, match="the camera path shows edit 1 at 90% of its way"):
        edits_at(EditStack([edit]), {1: 0.9})


def test_names_of_frames() -> None:
    assert frame_file(Path("a/x_%04d.ply"), 12) == Path("a/x_0012.ply")
    assert frame_file(Path("%d.spz"), 12) == Path("12.spz")
