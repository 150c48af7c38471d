"""Splats that a page draws with its own GPU, in headless Chromium, against the rasterizer's pictures."""

from __future__ import annotations

import base64
import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cagefield.cameras.camera import Camera, turntable
from cagefield.completion.splat_patch import build_splat_patch
from cagefield.edits import Edit, EditStack, PreparedEdit, PreparedStack
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.splat_files import read_splats
from cagefield.geometry.cage import Cage
from cagefield.images.metrics import psnr
from cagefield.images.render_result import RenderResult
from cagefield.pages.page_splat_edits import encode_page_splat_edits
from cagefield.pages.page_splats import encode_page_splats
from cagefield.rendering.splats.raster_splats import changed_splats
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.rendering.splats.splitting import split_of
from field_page import Drawn, FieldPage, field_page
from splat_rooms import LIGHT, cage, room
from splat_scenes import ball_of_splats, random_splats

LEAST = 40.0
"""dB between the page's and the rasterizer's pictures: 8 bits alone are 59, and their two roundings 55."""

FILES = Path(__file__).resolve().parents[2] / "shared" / "data" / "splats"


@pytest.fixture(scope="module")
def page() -> Iterator[FieldPage]:
    with field_page(splats=True) as opened:
        yield opened


def splats(degree: int = 3, count: int = 2000, antialiased: bool = False) -> SplatField:
    """Splats of all shapes, the longest ten times as long as wide and more."""
    field = random_splats(count, degree)
    small = field.log_scales - 1.0
    return dataclasses.replace(field, log_scales=small, antialiased=antialiased)


def camera(width: int = 96, height: int = 72) -> Camera:
    """Its picture's middle lies where its lens's does not."""
    seen = turntable((0, 0, 0), 3.2, 3, elevation=0.4, width=width, height=height, fov_x=0.8)[1]
    return dataclasses.replace(seen, cx=0.45 * width, fy=1.1 * seen.fy)


def check_alike(ours: RenderResult | None, drawn: Drawn, least: float = LEAST) -> None:
    """Color, opacity and depth at least so many dB alike, and the picture not empty."""
    assert ours is not None and ours.normals is not None
    solid = ours.opacity > 0.5
    assert solid.mean() > 0.05
    assert psnr(np.clip(ours.rgb, 0.0, 1.0), drawn.rgb) >= least  # a picture of 8 bits ends at white
    assert psnr(ours.opacity, drawn.opacity) >= least
    scale = float(ours.depth[solid].max())
    assert psnr(ours.depth[solid] / scale, drawn.depth[solid] / scale) >= least
    # Which of two alike axes is the shortest, and which way one across the view points, rounding says.
    off = np.abs(ours.normals[solid] - drawn.normals[solid]).max(axis=1)
    usual = off <= np.quantile(off, 0.98)
    assert psnr(0.5 * ours.normals[solid][usual], 0.5 * drawn.normals[solid][usual]) >= 35.0


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 4])
def test_the_page_draws_what_the_rasterizer_draws(page: FieldPage, degree: int) -> None:
    field = splats(degree)
    page.load(encode_page_splats(field))
    check_alike(SplatRenderer(field).render(camera(), normals=True), page.draw(camera()), 45.0)


def test_the_filter_of_antialiased_splats(page: FieldPage) -> None:
    field = splats(1, antialiased=True)
    field = dataclasses.replace(field, log_scales=field.log_scales - 1.5)
    page.load(encode_page_splats(field))
    ours = SplatRenderer(field).render(camera(), normals=True)
    other = SplatRenderer(dataclasses.replace(field, antialiased=False)).render(camera())
    assert ours is not None and other is not None and psnr(ours.rgb, other.rgb) < 35.0
    check_alike(ours, page.draw(camera()), 45.0)


def test_a_camera_amid_the_splats(page: FieldPage) -> None:
    """Splats behind, around and right before the camera, and far outside the picture."""
    field = splats(2)
    page.load(encode_page_splats(field))
    seen = Camera.look_at((0.2, -0.6, 0.1), (0.0, 0.5, 0.1), width=96, height=72, fov_x=1.4)
    check_alike(SplatRenderer(field).render(seen, normals=True), page.draw(seen))


def test_levels_add_up(page: FieldPage, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cagefield.pages.page_splats.FIRST", 500)
    monkeypatch.setattr("cagefield.pages.page_splats.GROWTH", 3)
    field = splats(1)
    figures = page.load(encode_page_splats(field))
    assert figures["levels"] == [[1, 3], [2, 3], [3, 3]]
    check_alike(SplatRenderer(field).render(camera(), normals=True), page.draw(camera()))
    picture = """async ([data, camera]) => {
        const seen = [];
        const draw = (number) => {
            r.setSize(camera.width, camera.height);
            r.setCamera(camera);
            r.render();
            seen.push([number, r.count, r.read().rgba.filter((_, n) => n % 4 === 3 && _ > 127).length]);
        };
        await r.load(bytes(data), { onLevel: draw });
        return seen;
    }"""
    text = base64.b64encode(encode_page_splats(dataclasses.replace(field))).decode()
    seen = page.page.evaluate(picture, [text, {**camera().to_dict(), "c2w": camera().c2w.ravel().tolist()}])
    assert [(number, count) for number, count, _ in seen] == [(1, 500), (2, 1500), (3, 2000)]
    # The quarter of the splats that comes first covers most of what all do.
    assert 0.6 * seen[2][2] < seen[0][2] < seen[1][2] < seen[2][2]


def test_many_splats_are_sorted_by_a_worker(page: FieldPage) -> None:
    field = splats(0, 33_000)
    page.load(encode_page_splats(dataclasses.replace(field, log_scales=field.log_scales - 1.5)))
    there, back = (
        {**seen.to_dict(), "c2w": seen.c2w.ravel().tolist()}
        for seen in turntable((0, 0, 0), 3.2, 2, elevation=0.4, width=48, height=36, fov_x=0.8)
    )
    off = page.page.evaluate(
        """async ([there, back]) => {
            r.setSize(there.width, there.height);
            const shot = (camera, sorted) => {
                r.setCamera(camera);
                r.render({ sorted });
                return r.read().rgba;
            };
            const off = (one, other) => one.reduce((sum, value, n) => sum + Math.abs(value - other[n]), 0);
            const wanted = shot(back, true);
            shot(there, true);
            const answer = new Promise((done) => { r.onOrder = done; });
            const before = off(shot(back, false), wanted);
            await answer;
            r.onOrder = null;
            return [before, off(shot(back, false), wanted)];
        }""",
        [there, back],
    )
    # Seen from the other side, the order of this one is the wrong way round.
    assert off[0] > 48 * 36 and off[1] == 0


def test_a_drag_of_many_splats_is_unpacked_and_sorted_beside_the_page(page: FieldPage) -> None:
    field = splats(0, 33_000)
    field = dataclasses.replace(field, log_scales=field.log_scales - 1.5)
    page.load(encode_page_splats(field))
    turned = [Edit.move(Cage.box((0, 0, 0), (2.2,) * 3)).rotate((0.0, angle, 0.0)) for angle in (0.8, 1.6)]
    files = [edited_unsplit(field, EditStack([edit])) for edit in turned]
    # Large enough for the worker, and most splats are in it.
    assert all(len(file) > 1 << 20 for file in files)
    there, back = (
        {**seen.to_dict(), "c2w": seen.c2w.ravel().tolist()}
        for seen in turntable((0, 0, 0), 3.2, 2, elevation=0.4, width=48, height=36, fov_x=0.8)
    )
    steps = page.page.evaluate(
        """async ([files, there, back]) => {
            r.setSize(there.width, there.height);
            const shot = (camera, sorted) => {
                r.setCamera(camera);
                r.render({ sorted });
                return r.read().rgba.join();
            };
            shot(there, true);
            const seen = [];
            for (const file of files) {
                const edits = await cagefieldViewer.readEditsBeside(bytes(file));
                const before = r.sortedHere;
                const prepared = r.prepare(edits);
                shot(back, false);  // a view that is turned meanwhile does not wait either
                r.setCamera(there);
                await prepared;
                r.setEdits(edits);
                const drawn = shot(there, false);
                seen.push([r.sortedHere - before, r.inOrder, drawn]);
            }
            r.setEdits(null);
            const before = r.sortedHere;
            for (const [n, file] of files.entries()) {
                r.setEdits(await cagefieldViewer.readSplatEdits(bytes(file)));
                seen[n].push(shot(there, true) === seen[n][2]);
            }
            return [seen.map(([here, order, _, same]) => [here, order, same]), r.sortedHere - before];
        }""",
        [[base64.b64encode(file).decode() for file in files], there, back],
    )
    assert steps == [[[0, True, True]] * 2, 2]
    page.edit(None)


def test_without_workers_many_splats_are_sorted_on_the_page(page: FieldPage) -> None:
    field = splats(0, 33_000)
    page.load(encode_page_splats(dataclasses.replace(field, log_scales=field.log_scales - 1.5)))
    there, back = (
        {**seen.to_dict(), "c2w": seen.c2w.ravel().tolist()}
        for seen in turntable((0, 0, 0), 3.2, 2, elevation=0.4, width=48, height=36, fov_x=0.8)
    )
    order = page.page.evaluate(
        """async ([data, there, back]) => {
            const { Worker } = window;
            window.Worker = class {
                constructor() { setTimeout(() => this.onerror(new Event("error"))); }
                postMessage() {}
                addEventListener() {}
                terminate() {}
            };
            try {
                const own = new cagefieldViewer.SplatRenderer(gl);
                await own.load(bytes(data));
                own.setSize(there.width, there.height);
                const seen = [];
                const draw = (camera) => { own.setCamera(camera); own.render(); seen.push(own.inOrder); };
                draw(there);
                const answer = new Promise((done) => { own.onOrder = done; });
                draw(back);
                await answer;
                draw(back);
                own.dispose();
                return seen;
            } finally {
                window.Worker = Worker;
            }
        }""",
        [base64.b64encode(encode_page_splats(field)).decode(), there, back],
    )
    assert order == [True, False, True]


def test_eight_bits_do_where_there_are_no_floats(page: FieldPage) -> None:
    field = ball_of_splats()
    page.page.evaluate(
        """() => {
            window.other = r;
            const formats = { color: gl.RGBA8, distance: gl.RGBA8, isByte: true };
            window.r = new cagefieldViewer.SplatRenderer(gl, 1e9, formats);
        }"""
    )
    try:
        page.load(encode_page_splats(field))
        check_alike(SplatRenderer(field).render(camera(), normals=True), page.draw(camera()), 30.0)
    finally:
        page.page.evaluate("() => { r.dispose(); window.r = other; }")


INNER, OUTER = Cage.box((0.1, 0.0, 0.0), (0.9, 0.8, 0.7)), Cage.box((0.1, 0.0, 0.0), (1.9, 1.6, 1.5))
TWISTED = (
    Edit.continuous(INNER, OUTER)
    .rotate((0.1, 0.2, 0.9))
    .scale((1.2, 0.7, 1.0))
    .move_corner(7, (0.2, 0.1, 0.1))
)
MOVED = Edit.move(Cage.box((0.6, 0.5, 0.3), (1.0, 0.9, 0.9))).translate((0.0, -0.5, 0.8))
COPIED = (
    Edit.copy(Cage.box((0.5, 0.3, 0.2), (0.6, 0.5, 0.6))).rotate((0.0, 0.9, 0.0)).translate((0.2, -0.4, 0.7))
)
GONE = Edit.delete(Cage.box((0.6, 0.5, 0.3), (0.9, 0.9, 1.0)))
STRETCHED = Edit.move(INNER).scale(1.6)
STACKS = {
    "moved": [MOVED],
    "twisted and deleted": [GONE, TWISTED],
    "copied": [TWISTED, COPIED],
    "mirrored": [MOVED.mirror("x"), COPIED.mirror("y")],
    "graded": [
        TWISTED.grade(exposure=0.6, temperature=0.8, tint=0.2, hue_deg=100.0, opacity=0.5),
        MOVED.grade(exposure=3.0, saturation=0.2),
    ],
}


@pytest.mark.parametrize(
    ("name", "preserve_opacity"),
    [
        *((name, True) for name in ("twisted and deleted", "mirrored")),
        ("stretched", False),
        *(pytest.param(name, True, marks=pytest.mark.nightly) for name in ("moved", "copied", "graded")),
    ],
)
def test_the_page_draws_edits_as_the_rasterizer_does(
    page: FieldPage, name: str, preserve_opacity: bool
) -> None:
    field, edits = splats(), EditStack(STACKS.get(name, [STRETCHED]))
    renderer = SplatRenderer(field, edits, preserve_opacity=preserve_opacity)
    ours, without = renderer.render(camera(), normals=True), SplatRenderer(field).render(camera())
    assert ours is not None and without is not None
    assert psnr(ours.rgb, without.rgb) < 30.0
    page.load(encode_page_splats(field))
    page.edit(edited(field, edits, preserve_opacity))
    check_alike(ours, page.draw(camera()), 45.0)
    page.edit(None)
    assert psnr(without.rgb, page.draw(camera()).rgb) >= 45.0


def test_the_page_fills_and_relights_as_the_rasterizer_does(page: FieldPage) -> None:
    field, edit = room(True), Edit.delete(cage())
    edits = PreparedStack([PreparedEdit(edit, build_splat_patch(field, EditStack(), edit, LIGHT))])
    ours, bare = (
        SplatRenderer(field, each).render(camera(), normals=True) for each in (edits, EditStack([edit]))
    )
    assert ours is not None and bare is not None and psnr(ours.rgb, bare.rgb) < 28.0
    page.load(encode_page_splats(field))
    page.edit(edited(field, edits))
    check_alike(ours, page.draw(camera()))


def edited(field: SplatField, edits: EditStack, preserve_opacity: bool = True) -> bytes:
    """The file of edits."""
    split = split_of(field, edits)
    changed = changed_splats(field, edits, preserve_opacity=preserve_opacity, split=split)
    return encode_page_splat_edits(field, changed)


def test_edits_of_other_splats_are_refused(page: FieldPage) -> None:
    page.load(encode_page_splats(splats(0, 100)))
    said = page.page.evaluate(
        """async (data) => {
            const edits = await cagefieldViewer.readSplatEdits(new Uint8Array(data).buffer);
            try { r.setEdits(edits); } catch (error) { return error.message; }
        }""",
        list(edited(splats(0, 90), EditStack([GONE]))),
    )
    assert "edits of 90 splats, the page has 100" in said


def test_edits_beyond_the_memory_are_refused(page: FieldPage) -> None:
    field = splats(0, 100)
    copies = EditStack([Edit.copy(Cage.box((0, 0, 0), (2.2,) * 3))])
    copies = EditStack([edit.translate((3.0, 0.0, 0.0)) for edit in copies])
    # 100 splats take 100 (32 + 68) bytes, and as many copies 100 (64 + 68) more.
    said = page.page.evaluate(
        """async ([field, edits]) => {
            const buffer = (data) => new Uint8Array(data).buffer;
            const changed = await cagefieldViewer.readSplatEdits(buffer(edits));
            const tried = [];
            for (const memory of [23700, 22700]) {
                const small = new cagefieldViewer.SplatRenderer(gl, memory);
                await small.load(buffer(field));
                try { small.setEdits(changed); tried.push(""); } catch (error) { tried.push(error.message); }
                small.dispose();
            }
            return tried;
        }""",
        [list(encode_page_splats(field)), list(edited_unsplit(field, copies))],
    )
    assert said == ["", "the edited splats take 1 MiB of the GPU, more than the 1 allowed"]


def edited_unsplit(field: SplatField, edits: EditStack) -> bytes:
    """The file of edits that split nothing."""
    return encode_page_splat_edits(field, changed_splats(field, edits))


@pytest.mark.nightly
def test_pictures_are_the_same_after_the_context_was_lost(page: FieldPage) -> None:
    field = splats(1)
    page.load(encode_page_splats(field))
    page.edit(edited(field, EditStack([TWISTED])))
    before = page.draw(camera())
    page.lose_context()
    np.testing.assert_array_equal(before.rgb, page.draw(camera()).rgb)
    page.edit(None)


@pytest.mark.parametrize("name", ["fruit_drops_minimal.ply", "playbot_sog/meta.json", "tiny_gauss.ply"])
def test_genuine_files(page: FieldPage, name: str) -> None:
    path = FILES / name
    if not path.exists():
        pytest.skip(f"{path} is not there")
    field = read_splats(path)
    radius = float(np.linalg.norm(field.half_size))
    seen = turntable(
        field.center, 2.2 * radius, 2, elevation=-0.3, up=(0, -1, 0), width=160, height=120, fov_x=0.9
    )[0]
    page.load(encode_page_splats(field))
    check_alike(SplatRenderer(field).render(seen, normals=True), page.draw(seen), 45.0)
