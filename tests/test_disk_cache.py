"""What fills and lights edits is kept on disk for the next process, and made anew where it was another."""

from __future__ import annotations

import dataclasses
import os
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from cagefield.cameras.camera import Camera, turntable
from cagefield.completion import patch_cache
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.lighting.diffuse_irradiance import DiffuseLight
from cagefield.completion.lighting.directional_light import DirectionalLight
from cagefield.completion.patch_cache import DiskCache
from cagefield.completion.patch_stages import PatchStage
from cagefield.completion.patcher import Patcher
from cagefield.edits import Edit, EditStack, PreparedEdit
from cagefield.edits.patch import NewLight, Patch, SplatPatch
from cagefield.fields.voxel_field import VoxelField
from cagefield.files import user_cache
from cagefield.geometry.cage import Cage
from cagefield.images.render_result import RenderResult
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from solid_fields import solid_field
from splat_rooms import cage as splat_cage
from splat_rooms import room as splat_room

CAMERAS = turntable((0.0, 0.0, 0.0), 3.0, 4, elevation=0.7, width=48, height=48, fov_x=0.8)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    # Not by the variable of the user's cache: kernels are kept there too.
    monkeypatch.setattr(patch_cache, "cache_root", lambda: tmp_path)
    monkeypatch.setattr(patch_cache, "MIN_CACHED_SECONDS", -1.0)
    return tmp_path / "patches"


def room(dark: float = 0.0) -> VoxelField:
    """A floor with a box on it, and its shade."""
    x, y, z = np.meshgrid(*[np.linspace(-1.0, 1.0, 24)] * 3, indexing="ij")
    box = (np.maximum(np.abs(x), np.abs(y)) < 0.3) & (np.abs(z) < 0.3)
    rgb = np.stack([0.5 + 0.2 * x, 0.5 + 0.2 * y, np.full_like(z, 0.4 - dark)], axis=-1)
    rgb *= (1.0 - 0.7 * np.clip(1.0 - ndimage.distance_transform_edt(~box) / 4.0, 0.0, 1.0) * ~box)[..., None]
    return solid_field(box | (z < -0.3), rgb)


MOVE = Edit.move(Cage.box((0.0, 0.0, 0.05), (0.7, 0.7, 0.68))).translate([0.5, 0.0, 0.0])
BEND = Edit.continuous(MOVE.inner, Cage.box((0.0, 0.0, 0.2), (1.8, 1.8, 1.4))).translate([0.0, 0.0, 0.15])


class Counted:
    """Draws a field, and counts how often."""

    def __init__(self, field: VoxelField) -> None:
        self.renderer, self.count = VoxelRenderer(field), 0

    def __call__(self, camera: Camera) -> RenderResult:
        self.count += 1
        found = self.renderer.render(camera, background="black", normals=True)
        assert found is not None
        return found


def patched(edits: list[Edit], field: VoxelField | None = None, **options: bool) -> tuple[EditStack, int]:
    """The edits with their patches by a new patcher, and how many pictures it took."""
    field = room() if field is None else field
    render = Counted(field)
    return Patcher(field, CAMERAS, render).prepare(edits, **options), render.count


def arrays_of(stack: EditStack) -> list[np.ndarray]:
    """All numbers of the patches."""
    found = []
    for edit in stack.edits:
        if edit.patch is not None:
            assert isinstance(edit.patch, Patch)
            found.append(edit.patch.region.corners)
            for layer in (edit.patch.under, edit.patch.part):
                if layer is not None:
                    found += [layer.bounds, layer.vertices, layer.density, layer.sh]
    return found


def test_the_next_process_has_the_same_patches_without_a_picture(folder: Path) -> None:
    edits = [MOVE, BEND]
    first, pictures = patched(edits)
    assert pictures == len(CAMERAS)
    again, pictures = patched(edits)
    assert pictures == 0
    assert len(again.edits) == len(first.edits)
    one, other = arrays_of(first), arrays_of(again)
    assert len(one) == len(other) > 0
    for left, right in zip(one, other, strict=True):
        assert left.dtype == right.dtype
        np.testing.assert_array_equal(left, right)


@pytest.mark.nightly
def test_a_drag_after_opening_is_as_one_before(folder: Path) -> None:
    """Whoever knows the light knows what cameras see: a drag is made with both, or with neither."""
    further = [MOVE.translate([0.0, 0.1, 0.0])]
    found = []
    for _ in range(2):
        field = room()
        patcher = Patcher(field, CAMERAS, Counted(field))
        patcher.prepare([MOVE])
        found.append(arrays_of(patcher.prepare(further, stage=PatchStage.INPAINTED)))
    for left, right in zip(*found, strict=True):
        np.testing.assert_array_equal(left, right)


def test_a_drag_before_anything_is_known_is_made_again_when_it_ends() -> None:
    edit = [Edit.delete(MOVE.inner).replace(relight="none", feather=0.0)]
    field = room()
    patcher = Patcher(field, CAMERAS, Counted(field))
    moving = patcher.prepare(edit, stage=PatchStage.INPAINTED).edits[0].patch
    settled = patcher.prepare(edit).edits[0].patch
    assert moving is not None and settled is not None and settled is not moving
    assert patcher.prepare(edit, stage=PatchStage.INPAINTED).edits[0].patch is settled


@pytest.mark.nightly
def test_splats_have_the_same_patches_again() -> None:
    """Every class that a patch of splats and its light are made of is kept."""
    field = splat_room(True)
    edit = Edit.move(splat_cage(), relight="occlusion").translate([-0.5, 0.25, 0.0])
    cameras = turntable((0.0, 0.0, 0.0), 3.0, 3, elevation=0.8, width=96, height=96, fov_x=0.6)
    renderer, pictures, found = SplatRenderer(field), [], []

    def render(camera: Camera) -> RenderResult:
        pictures.append(camera)
        shown = renderer.render(camera, background="black", normals=True)
        assert shown is not None
        return shown

    for _ in range(2):
        patch = Patcher(field, cameras, render).prepare([edit]).edits[0].patch
        assert isinstance(patch, SplatPatch) and patch.field is field
        found.append(patch)
    assert len(pictures) == 3
    first, again = found
    for name in ("gone", "sources", "points", "jacobian", "gains"):
        np.testing.assert_array_equal(getattr(first, name), getattr(again, name))
    np.testing.assert_array_equal(first.light.values, again.light.values)


def test_what_moves_is_not_kept(folder: Path) -> None:
    patched([MOVE], stage=PatchStage.INPAINTED)
    assert not folder.exists()


FIELD = room()
RESULT = Patch(MOVE.inner, dataclasses.replace(FIELD))


def made_again(
    what: tuple[object, ...], field: VoxelField = FIELD, cameras: Sequence[Camera] = CAMERAS
) -> bool:
    """Whether this had to be made in a new process."""
    calls = []
    found = DiskCache(field, cameras).get_or_make(what, lambda: calls.append(1) or RESULT)
    assert isinstance(found, Patch) and found.part is None
    np.testing.assert_array_equal(found.under.density, FIELD.density)
    return bool(calls)


def test_all_that_results_follow_from_is_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    assert made_again((MOVE,)) and not made_again((MOVE,))
    assert not made_again((MOVE.replace(name="aside"),))
    assert made_again((PreparedEdit(MOVE, RESULT),))
    assert made_again((MOVE.translate([0.0, 0.1, 0.0]),))
    assert made_again((MOVE.replace(fill="none"),))
    assert made_again((BEND, MOVE))
    assert made_again((MOVE,), dataclasses.replace(FIELD, density=FIELD.density * np.float32(1.1)))
    assert made_again((MOVE,), dataclasses.replace(FIELD, contracted=True))
    assert made_again((MOVE,), cameras=CAMERAS[:3])
    assert not made_again((MOVE,))
    monkeypatch.setattr(patch_cache, "VERSIONS", ("another",))
    assert made_again((MOVE,))


def test_quick_results_are_not_kept(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(patch_cache, "MIN_CACHED_SECONDS", 1e9)
    assert made_again((MOVE,)) and made_again((MOVE,))
    assert not folder.exists()


@pytest.mark.parametrize("how", ["cut off", "empty", "other bytes", "no archive", "another tree"])
def test_damaged_files_are_made_anew(how: str, folder: Path) -> None:
    made_again((MOVE,))
    (path,) = folder.iterdir()
    data = bytearray(path.read_bytes())
    if how == "cut off":
        path.write_bytes(data[: len(data) // 2])
    elif how == "empty":
        path.write_bytes(b"")
    elif how == "other bytes":
        data[len(data) // 3 : len(data) // 3 + 200] = bytes(200)
        path.write_bytes(data)
    elif how == "no archive":
        path.write_bytes(b"\x93NUMPY")
    else:
        np.savez(path, tree=np.frombuffer(b'{"kind": "Patch", "values": {"region": 3}}', np.uint8))
    assert made_again((MOVE,))
    assert not made_again((MOVE,))


def test_without_a_folder_everything_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(patch_cache, "cache_root", lambda: tmp_path / "file")
    assert made_again((MOVE,)) and made_again((MOVE,))
    assert (tmp_path / "file").read_text() == ""


def test_a_full_disk_leaves_nothing_half(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, **arrays: np.ndarray) -> None:
        Path(path).write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    assert made_again((MOVE,)) and made_again((MOVE,))
    assert list(folder.iterdir()) == []


def test_the_last_room_on_a_disk_stays_free(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(patch_cache, "MIN_FREE_BYTES", 1 << 60)
    assert made_again((MOVE,)) and made_again((MOVE,))
    assert list(folder.iterdir()) == []


def test_a_result_that_cannot_be_marked_as_used_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    assert made_again((MOVE,))

    def refused(*_: object) -> None:
        raise PermissionError(1, "not permitted")

    monkeypatch.setattr(os, "utime", refused)
    assert not made_again((MOVE,))


def test_what_was_not_used_for_longest_goes(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made_again((MOVE,))
    (first,) = folder.iterdir()
    size, now = first.stat().st_size, time.time()
    os.utime(first, (now - 1000.0,) * 2)
    old = folder / ("0" * 32 + ".npz")
    old.write_bytes(b"old")
    os.utime(old, (now - user_cache.MAX_UNUSED_SECONDS - 60.0,) * 2)
    made_again((BEND,))
    assert not old.exists() and len(list(folder.iterdir())) == 2
    monkeypatch.setattr(patch_cache, "MAX_CACHE_BYTES", 4 * size + size // 2)
    for number in range(3):
        made_again((MOVE, number))
    assert not first.exists() and len(list(folder.iterdir())) == 4
    monkeypatch.setattr(patch_cache, "MAX_CACHE_BYTES", 2 * size)
    assert made_again(("too large",)) and made_again(("too large",))


def test_all_that_results_consist_of_comes_back() -> None:
    field = splat_room(True)
    ones = np.ones((2, 3, 4), np.float32)
    light = NewLight(np.zeros(3), np.full(3, 0.1), ones, ones)
    patch = SplatPatch(
        field,
        MOVE.inner,
        np.zeros((2, 3, 4), bool),
        light,
        None,
        np.arange(5),
        np.random.default_rng(0).normal(size=(5, 3)),
        np.broadcast_to(np.eye(3), (5, 3, 3)),
        np.ones((5, 3)),
    )
    facing = DiffuseLight((0.1, -0.2, 0.3))
    ambience = LightModel(
        (0.1, float("inf")), (0.2, 1e-300), facing, DirectionalLight((0.0, 0.0, 1.0), 0.3, 0.1, 2.0)
    )
    on_disk = DiskCache(field, CAMERAS)
    for what, made in (("patch", patch), ("ambience", ambience), ("nothing", None)):
        assert on_disk.get_or_make((what,), lambda made=made: made) is made
    never = lambda: pytest.fail("it was kept")  # noqa: E731
    assert on_disk.get_or_make(("nothing",), never) is None
    assert on_disk.get_or_make(("ambience",), never) == ambience
    again = on_disk.get_or_make(("patch",), never)
    assert isinstance(again, SplatPatch) and again.field is field and again.part is None
    assert again.region == patch.region
    for name in ("gone", "sources", "points", "jacobian", "gains"):
        left, right = getattr(patch, name), getattr(again, name)
        assert left.dtype == right.dtype
        np.testing.assert_array_equal(left, right)
    np.testing.assert_array_equal(again.light.values, light.values)


def test_pastes_and_functions_are_not_kept(folder: Path) -> None:
    on_disk = DiskCache(room(), CAMERAS)
    for what in (Edit.paste("../other", MOVE.inner), len):
        assert on_disk.get_or_make((what,), lambda: 1) == 1
        assert on_disk.get_or_make((what,), lambda: 2) == 2
    assert not folder.exists()
