"""Scenes as one HTML file: what is in it, and what Chromium shows of it without server or network."""

from __future__ import annotations

import dataclasses
import itertools
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera, turntable
from cagefield.cameras.keyframe_files import dump_path
from cagefield.cameras.keyframes import Keyframe, Timeline
from cagefield.completion.patch_stages import PatchStage
from cagefield.completion.patcher import Patcher
from cagefield.edits import Continuous, Edit, EditStack, Move, PreparedEdit, PreparedStack
from cagefield.edits.partial_edit import partial_edit
from cagefield.edits.patch import Patch
from cagefield.errors import EditError
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.images.metrics import psnr
from cagefield.pages.page_file import bytes_until, unpack
from cagefield.pages.page_layers import layer_key
from cagefield.pages.page_path import MAGIC, VERSION
from cagefield.pages.path_states import path_edits
from cagefield.pages.scene_page import INDEX, NAMES, SCRIPT, ScenePage, write_folder
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from cagefield.scene import Scene
from commands import printed, refused
from exported_page import pixels, rendered, settle, shown, until, web_server
from hand import Hand
from page_fields import MOVE, SIZE, lumps, lumps_scene
from page_layers import patch_by_hand

MIDDLE = SIZE / 2, SIZE / 2
"""Of the page."""


RING = turntable((0, 0, 0), 3.2, 6, elevation=0.4, width=SIZE, height=SIZE, fov_x=0.8)


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A page of lumps with a short camera path, from the second to the third place of `RING`."""
    keys = tuple(Keyframe(tuple(camera.c2w.ravel()), 45.0, 1.0) for camera in RING[2:4])
    file = tmp_path_factory.mktemp("page") / "scene.html"
    file.write_text(ScenePage.build(lumps_scene(), "lumps <&> @FIELD@", keys).one_file(), encoding="utf-8")
    with shown(file, touch=True) as page:
        yield page


@pytest.fixture
def page(opened: Any) -> Any:
    """The page, its camera where it begins."""
    opened.press("body", "h")
    settle(opened)
    return opened


def test_the_page_shows_the_edited_scene_and_the_one_before(page: Any) -> None:
    scene = lumps_scene()
    camera = scene.cameras["test"][0]
    after, before = rendered(scene, camera), rendered(scene, camera, edits=False)
    assert psnr(after, before) < 30.0
    assert page.title() == "lumps <&> @FIELD@"
    assert psnr(pixels(page), after) >= 40.0
    page.press("body", "b")
    settle(page)
    assert psnr(pixels(page), before) >= 40.0
    page.press("body", "b")
    settle(page)
    assert psnr(pixels(page), after) >= 40.0


def test_mouse_wheel_and_keys_move_the_camera(page: Any) -> None:
    seen = [pixels(page)]
    first, target = orbit(page)
    page.mouse.move(*MIDDLE)
    page.mouse.down()
    page.mouse.move(MIDDLE[0] + SIZE / 4, MIDDLE[1], steps=3)
    page.mouse.up()
    settle(page)
    turned, target = orbit(page)
    # A quarter of the height is an eighth of a full turn, about the orbit's center, at the same height.
    a, b = (v[:2] / np.linalg.norm(v[:2]) for v in (first - target, turned - target))
    assert np.dot(a, b) == pytest.approx(np.cos(np.pi / 4), abs=1e-6)
    assert turned[2] == pytest.approx(first[2])
    seen.append(pixels(page))
    page.mouse.wheel(0, 300)
    settle(page)
    assert np.linalg.norm(orbit(page)[0] - target) > 1.2 * np.linalg.norm(turned - target)
    seen.append(pixels(page))
    page.press("body", "h")
    settle(page)
    assert psnr(pixels(page), seen[0]) > 50.0
    for one, other in itertools.pairwise(seen):
        assert psnr(one, other) < 30.0


def orbit(page: Any) -> NDArray[np.float64]:
    """[eye, target] of the page's camera."""
    return np.array(page.evaluate("[cagefieldViewer.viewer.orbit.eye, cagefieldViewer.viewer.orbit.target]"))


def test_one_finger_turns_and_two_shift_and_pinch(page: Any) -> None:
    hand = Hand(page)
    eye, target = orbit(page)
    hand.move([MIDDLE], [(MIDDLE[0] + SIZE / 4, MIDDLE[1])])
    turned, same = orbit(page)
    np.testing.assert_allclose(same, target, atol=1e-9)
    a, b = (v[:2] / np.linalg.norm(v[:2]) for v in (eye - target, turned - target))
    assert np.dot(a, b) == pytest.approx(np.cos(np.pi / 4), abs=1e-6)
    # Both fingers by a third of the height: what was in the middle of the picture is there now.
    left, low = SIZE / 3, MIDDLE[1] + SIZE / 3
    hand.move([(left, MIDDLE[1]), MIDDLE], [(left, low), (MIDDLE[0], low)])
    shifted, center = orbit(page)
    far = np.linalg.norm(turned - target)
    np.testing.assert_allclose(shifted - center, turned - target, atol=1e-6)
    tangent = np.tan(0.5 * np.radians(page.evaluate("cagefieldViewer.viewer.fov")))
    assert np.linalg.norm(center - target) == pytest.approx(2.0 * tangent * far / 3.0, rel=1e-6)
    # Twice as far apart is twice as near.
    near, far_apart = ([(MIDDLE[0] + sign * SIZE / part, MIDDLE[1]) for sign in (-1, 1)] for part in (12, 6))
    hand.move(near, far_apart)
    nearer, center = orbit(page)
    assert np.linalg.norm(nearer - center) == pytest.approx(0.5 * far, rel=1e-6)


def test_the_camera_path_is_played(page: Any) -> None:
    page.press("body", " ")
    until(page, "!cagefieldViewer.viewer.plays")
    settle(page)
    end = np.array(page.evaluate("cagefieldViewer.viewer.orbit.eye"))
    np.testing.assert_allclose(end, RING[3].origin, atol=1e-6)


TURN = Edit.continuous(Cage.box((0, 0, 0), (0.8, 0.8, 0.8)), Cage.box((0, 0, 0), (1.7, 1.6, 1.5)), lattice=32)


BARE: Any = {"fill": "none", "relight": "none", "feather": 0.0}
"""Options of edits that have no patch, or one made by hand."""


@pytest.mark.nightly
def test_edits_move_along_the_camera_path(tmp_path: Path) -> None:
    scene = lumps_scene()
    gone = Edit.delete(Cage.box((-0.8, 0.0, 0.0), (0.4, 1.8, 1.6))).replace(**BARE)
    move = MOVE.replace(**BARE)
    patch = patch_by_hand(scene.field, MOVE.inner, part=True)
    turn = TURN.rotate((0.0, 0.0, np.pi / 2)).replace(relight="none")
    scene = with_patch(dataclasses.replace(scene, edits=EditStack([turn, move, gone])), patch)
    pose = tuple(scene.cameras["test"][0].c2w.ravel())
    keys = (
        Keyframe(pose, 45.0, 1.0, {1: 0.0, 2: 0.0, 3: 0.0}),
        Keyframe(pose, 45.0, 0.5, {1: 1.0, 2: 0.2, 3: 0.4}),
        Keyframe(pose, 45.0, 1.0, {1: 1.0, 2: 1.0, 3: 1.0}),
    )
    page_of = ScenePage.build(scene, "lumps", keys)
    assert page_of.along is not None and page_of.along.states <= 19 and len(page_of.along.data) < 4e6
    # Half-way between states as exact as the lattices of the whole edits are.
    assert page_of.along.error[0] < 0.05 * scene.field.sample_spacing
    file = tmp_path / "scene.html"
    file.write_text(page_of.one_file(), encoding="utf-8")
    line = Timeline(keys, loop=False)
    with shown(file) as page:
        until(page, "cagefieldViewer.viewer.canPlay")
        objects = page.evaluate("({...gpuObjects})")
        pictures = []
        for seconds in (0.42, 1.3):
            page.evaluate(f"cagefieldViewer.viewer.seek(cagefieldViewer.viewer.header.path, {seconds})")
            settle(page)
            parts = line.parts(np.array([seconds]))
            there = [partial_edit(edit, float(parts[n][0])) for n, edit in enumerate(scene.edits, start=1)]
            stack = EditStack([edit for edit in there if edit is not None])
            camera = dataclasses.replace(_as_shown(scene.cameras["test"][0], 45.0))
            # The patch shows what the turn makes once it is whole.
            whole = with_patch(dataclasses.replace(scene, edits=stack), patch if parts[1][0] == 1.0 else None)
            pictures.append(rendered(whole, camera))
            assert psnr(pixels(page), pictures[-1]) >= 36.0, seconds
        page.press("body", "h")
        settle(page)
        assert psnr(pixels(page), rendered(scene, scene.cameras["test"][0])) >= 40.0
        after = page.evaluate("({...gpuObjects})")
        # Shaders of other numbers of edits stay.
        assert {**after, "Program": 0} == {**objects, "Program": 0}
    for one, other in itertools.pairwise(pictures):
        assert psnr(one, other) < 30.0


def with_patch(scene: Scene, patch: Patch | None) -> Scene:
    """The scene, whose moves all show a patch."""
    scene.__dict__["patcher"] = _MovePatches(patch, patch)
    return scene


class _Patches:
    """Gives discrete edits one patch while they move, and another then."""

    def __init__(self, moving: Patch | None, settled: Patch | None) -> None:
        self.moving, self.settled = moving, settled

    def prepare(
        self,
        edits: Sequence[Edit],
        *,
        stage: PatchStage = PatchStage.LIT,
        relight_continuous: bool = True,
        preserve_opacity: bool = True,
    ) -> PreparedStack:
        patch = self.settled if stage is PatchStage.LIT else self.moving
        return PreparedStack(
            PreparedEdit(edit, None if isinstance(edit, Continuous) else patch) for edit in edits
        )


class _MovePatches(_Patches):
    """Gives moves one patch, and no other edits any."""

    def prepare(self, edits: Sequence[Edit], **options: Any) -> PreparedStack:
        return PreparedStack(
            PreparedEdit(edit, self.settled if isinstance(edit, Move) else None) for edit in edits
        )


def test_patches_are_those_of_edits_that_have_begun_and_of_whole_ones() -> None:
    scene = lumps_scene()
    field = scene.field
    assert isinstance(field, VoxelField)
    patches = _Patches(*(patch_by_hand(field, MOVE.inner, part=n == 1, seed=n) for n in range(2)))
    above = MOVE.translate((-0.1, 0.0, 0.0))
    pose = tuple(scene.cameras["test"][0].c2w.ravel())
    # The edit before goes all the way first.
    keys = (
        Keyframe(pose, 45.0, 0.3, {1: 0.0, 2: 0.0}),
        Keyframe(pose, 45.0, 0.3, {1: 1.0, 2: 0.5}),
        Keyframe(pose, 45.0, 0.3, {1: 1.0, 2: 1.0}),
    )
    found = path_edits(VoxelRenderer(field), EditStack([MOVE, above]), keys, False, cast(Patcher, patches))
    assert found is not None
    header, arrays = unpack(found.data, MAGIC, VERSION, "a path")
    shown = []
    for state in arrays["states"]:
        shown.append([number for number, *_ in header["layers"][state]])
        places = [8 * place for _, place, *_ in header["layers"][state]]
        rows = arrays[f"rows.{state}"]
        have = [rows[44 * edit + row, 3] for edit in range(2) for row in (5, 7)]
        assert [place for place in have if place > 0] == places
    keys_of = [
        layer_key(layer)
        for patch in (patches.moving, patches.settled)
        for layer in (patch.under, patch.part)
        if layer is not None
    ]
    named = [[keys_of.index(header["layer_keys"][number]) for number in numbers] for numbers in shown]
    # 0 is what a move left; 1 and 2 are a whole edit's.
    assert list(dict.fromkeys(map(tuple, named))) == [(), (0,), (1, 2, 0), (1, 2, 1, 2)]


def _as_shown(camera: Camera, fov_y_deg: float) -> Camera:
    focal = 0.5 * camera.height / np.tan(0.5 * np.radians(fov_y_deg))
    return dataclasses.replace(camera, fx=focal, fy=focal)


def test_a_path_that_moves_no_edit_has_no_states() -> None:
    scene = lumps_scene()
    keys = tuple(Keyframe(tuple(camera.c2w.ravel()), 45.0) for camera in scene.cameras["train"])
    assert "path" not in ScenePage.build(scene, "lumps", keys).files


@pytest.mark.nightly
def test_parts_of_an_edit_that_are_impossible_are_named() -> None:
    """After a quarter turn the cage is inside again, on the way its corners are not."""
    close = Edit.continuous(TURN.inner, Cage.box((0, 0, 0), (1.0, 1.0, 1.0)), name="spin").rotate(
        (0.0, 0.0, np.pi / 2)
    )
    scene = dataclasses.replace(lumps_scene(), edits=EditStack([close]))
    pose = tuple(scene.cameras["test"][0].c2w.ravel())
    keys = (Keyframe(pose, 45.0, 1.0, {1: 0.0}), Keyframe(pose, 45.0, 1.0))
    with pytest.raises(EditError, match=r'shows an edit at \d+% of its way: edit "spin": .*outer'):
        ScenePage.build(scene, "lumps", keys)


@pytest.mark.nightly
def test_a_folder_shows_its_coarse_level_while_the_rest_loads(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = dataclasses.replace(lumps_scene(), field=lumps(1, False, (84, 40, 36)))
    scene.save(tmp_path / "lumps")
    out = tmp_path / "site" / "deep" / "lumps"
    said = printed(capsys, "export", tmp_path / "lumps", "-o", out, "--embed")
    assert '<iframe src="lumps/index.html"' in said
    assert {each.name for each in out.iterdir()} == {INDEX, SCRIPT, NAMES["field"], NAMES["edits"]}
    (out / "notes.txt").write_text("mine")
    assert "exists already" in refused(capsys, "export", tmp_path / "lumps", "-o", out, "--embed")
    printed(capsys, "export", tmp_path / "lumps", "-o", out, "--embed", "--overwrite")
    assert (out / "notes.txt").read_text() == "mine"
    outer = out.parent / "outer.html"
    outer.write_text(
        '<!doctype html><link rel="icon" href="data:,"><body style="margin: 0">'
        f'<iframe src="lumps/{INDEX}" width="{SIZE}" height="{SIZE}" style="border: 0"></iframe>'
    )
    printed(capsys, "export", tmp_path / "lumps", "-o", out.parent / "one.html")
    text = (out.parent / "one.html").read_bytes()
    cuts = {
        NAMES["field"]: bytes_until((out / NAMES["field"]).read_bytes(), "1."),
        # In one file the coarse level comes before the edits.
        "one.html": text.index(b'take("edits"'),
    }
    whole = rendered(scene, scene.cameras["test"][0])
    for address in ("outer.html", "one.html"):
        go_on = threading.Event()
        with (
            web_server(tmp_path / "site", cuts, go_on) as link,
            shown(f"{link}/deep/{address}") as page,
        ):
            until(page, "document.querySelector('canvas, iframe') !== null")
            frame = page.main_frame if address == "one.html" else page.frames[1]
            settle(frame, "level?.last === false")
            coarse = pixels(page)
            assert 16.0 < psnr(coarse, rendered(scene, scene.cameras["test"][0], edits=False)) < 36.0
            go_on.set()
            settle(frame)
            assert psnr(pixels(page), whole) >= 40.0


def test_a_folder_on_a_disk_says_how_it_is_opened(tmp_path: Path) -> None:
    write_folder(tmp_path / "lumps", ScenePage.build(lumps_scene(), "lumps").folder())
    with shown((tmp_path / "lumps" / INDEX).as_uri()) as page:
        until(page, "document.querySelector('.message').textContent.includes('serve the folder')")


def test_the_command_writes_a_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = lumps_scene()
    folder = tmp_path / "lumps"
    scene.save(folder)
    keys = [Keyframe(tuple(camera.c2w.ravel()), 45.0) for camera in scene.cameras["train"]]
    (folder / "camera_path.json").write_text(dump_path(keys, loop=True))
    out = tmp_path / "lumps.html"
    assert "1 edit, a camera path of 2 keys" in printed(capsys, "export", folder, "-o", out)
    text = out.read_text(encoding="utf-8")
    assert text.startswith("<!doctype html>") and '"loop": true' in text
    assert "src=" not in text.split("<script>")[0] and 'href="data:,"' in text.split("<script>")[0]
    for words, said in (
        (("-o", out), "exists already"),
        (("-o", tmp_path / "x.html", "--as", "mesh"), "are not written as a page"),
        (("-o", tmp_path / "x.ply", "--as", "page"), "a page is written as .html"),
        (("-o", tmp_path / "x.html", "--selection", "x"), "leave out --selection"),
        (("-o", tmp_path / "x.html", "--embed"), "--embed writes a folder"),
        (("-o", folder, "--embed", "--overwrite"), "holds no viewer.js and is left as it is"),
    ):
        assert said in refused(capsys, "export", folder, *words)
