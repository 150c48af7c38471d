"""Pictures that a page draws with its own GPU, in headless Chromium, against those of the fused renderer."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from cagefield.cameras.camera import Camera, turntable
from cagefield.edits import Edit, EditStack, Grade, PreparedStack, Trilinear
from cagefield.errors import EditError
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.images.metrics import psnr
from cagefield.images.render_result import RenderResult
from cagefield.pages.page_edits import (
    FINEST_LATTICE,
    LATTICE,
    MAGIC,
    VERSION,
    encode_changed_edits,
    encode_page_edits,
    for_pages,
)
from cagefield.pages.page_field import encode_page_field
from cagefield.pages.page_file import unpack
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from field_page import Drawn, FieldPage, field_page
from page_fields import lumps
from tiers import nightly_except

LEAST = 40.0
"""dB between the page's and the kernel's pictures: 8 bits alone are 59, and their two roundings 55."""


@pytest.fixture(scope="module")
def page() -> Iterator[FieldPage]:
    with field_page() as opened:
        yield opened


def camera(contracted: bool) -> Camera:
    """Outside a bounded field, amid an unbounded one."""
    if contracted:
        # No sample of it lies on a face between cells, where rounding says which cell's slope is taken.
        return Camera.look_at((0.31, -1.27, 0.23), (0.1, 0.4, 0.0), width=64, height=48, fov_x=1.2)
    return turntable((0, 0, 0), 3.2, 3, elevation=0.4, width=64, height=48, fov_x=0.8)[1]


def check_alike(ours: RenderResult | None, drawn: Drawn, least: float = LEAST) -> None:
    """Color, opacity, depth and normals at least so many dB alike, and most of the picture not empty."""
    assert ours is not None and ours.normals is not None
    solid = ours.opacity > 0.5
    assert solid.mean() > 0.05
    assert psnr(ours.rgb, drawn.rgb) >= least
    assert psnr(ours.opacity, drawn.opacity) >= least
    scale = float(ours.depth[solid].max())
    assert psnr(ours.depth[solid] / scale, drawn.depth[solid] / scale) >= least
    # Slopes jump between cells: where a sample lies on a face, rounding says which one is taken.
    off = np.abs(ours.normals[solid] - drawn.normals[solid]).max(axis=1)
    usual = off <= np.quantile(off, 0.98)
    normals = ours.normals[solid][usual], drawn.normals[solid][usual]
    assert psnr(0.5 + 0.5 * normals[0], 0.5 + 0.5 * normals[1]) >= least


@pytest.mark.parametrize("contracted", [False, True])
@pytest.mark.parametrize("degree", [0, 1, 2])
def test_the_page_draws_what_the_kernel_draws(page: FieldPage, degree: int, contracted: bool) -> None:
    field = lumps(degree, contracted)
    page.edit(None)
    page.load(encode_page_field(field))
    seen = camera(contracted)
    check_alike(VoxelRenderer(field).render(seen, normals=True), page.draw(seen))


def test_samples_behind_empty_space_lie_beside_faces_of_cells_in_an_unbounded_field(page: FieldPage) -> None:
    field = lumps(1, True)
    page.edit(None)
    page.load(encode_page_field(field))
    seen = Camera.look_at((0.2, 0.1, 0.9), (0.1, 0.2, 0.0), width=64, height=48, fov_x=1.4)
    ours, drawn = VoxelRenderer(field).render(seen, normals=True), page.draw(seen)
    assert ours is not None and ours.normals is not None
    solid = ours.opacity > 0.5
    off = np.linalg.norm(ours.normals[solid] - drawn.normals[solid], axis=1)
    # Where a sample is on a face, rounding says which cell's slope is taken.
    assert solid.mean() > 0.05 and (off > 0.1).mean() < 2e-3


def test_the_coarse_level_comes_first(page: FieldPage) -> None:
    field = lumps(0, False, resolution=(81, 70, 66))
    page.edit(None)
    figures = page.load(encode_page_field(field))
    assert figures["levels"] == [[1, 2], [2, 2]]
    seen = camera(False)
    check_alike(VoxelRenderer(field).render(seen, normals=True), page.draw(seen))


def test_a_field_larger_than_allowed_is_refused_and_the_page_goes_on(page: FieldPage) -> None:
    field = encode_page_field(lumps(0, False))
    said = page.page.evaluate(
        """async (data) => {
            const small = new cagefieldViewer.FieldRenderer(gl, 1000);
            try { await small.load(new Uint8Array(data).buffer); } catch (error) { return error.message; }
            finally { small.dispose(); }
        }""",
        list(field),
    )
    assert "MiB of the GPU, more than" in said


def test_pictures_are_the_same_after_the_context_was_lost(page: FieldPage) -> None:
    page.edit(None)
    page.load(encode_page_field(lumps(1, False)))
    seen = camera(False)
    before = page.draw(seen)
    page.lose_context()
    after = page.draw(seen)
    np.testing.assert_array_equal(before.rgb, after.rgb)


@pytest.mark.nightly
def test_what_is_closed_leaves_nothing_on_the_gpu(page: FieldPage) -> None:
    field = lumps(0, False, (17, 17, 17))
    edits = encode_page_edits(VoxelRenderer(field, EditStack([MOVED])))
    left = page.page.evaluate(
        """async ([field, edits]) => {
            const kinds = ["Texture", "Buffer", "Framebuffer", "VertexArray", "Program"];
            const own = document.createElement("canvas").getContext("webgl2");
            const alive = Object.fromEntries(kinds.map((kind) => [kind, 0]));
            for (const kind of kinds) {
                const [make, free] = [own["create" + kind], own["delete" + kind]];
                own["create" + kind] = () => { alive[kind]++; return make.call(own); };
                own["delete" + kind] = (it) => { if (it) alive[kind]--; free.call(own, it); };
            }
            let most = 0;
            for (let n = 0; n < 6; n++) {
                const renderer = new cagefieldViewer.FieldRenderer(own);
                renderer.setEdits(await cagefieldViewer.readEdits(new Uint8Array(edits).buffer));
                await renderer.load(new Uint8Array(field).buffer);
                renderer.setSize(8, 8 + (n & 1));
                const c2w = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 3, 0, 0, 0, 1];
                renderer.setCamera({ c2w, width: 8, height: 8, fx: 8, fy: 8, cx: 4, cy: 4 });
                renderer.render({ normals: true });
                renderer.show(8, 8);
                renderer.setSize(9, 9);
                most = Math.max(most, alive.Texture);
                renderer.dispose();
            }
            const error = own.getError();
            own.getExtension("WEBGL_lose_context").loseContext();
            return { ...alive, error, most };
        }""",
        [list(encode_page_field(field)), list(edits)],
    )
    # Density, one of color, index, two occupancies, a lattice: the targets went with the size.
    assert left.pop("most") == 6
    assert set(left.values()) == {0}


INNER, OUTER = Cage.box((0.1, 0.0, 0.0), (0.9, 0.8, 0.7)), Cage.box((0.1, 0.0, 0.0), (1.9, 1.6, 1.5))
TURNED = (
    Edit.continuous(INNER, OUTER, lattice=32, name="turned").rotate((0.1, 0.2, 0.7)).scale((1.1, 0.8, 1.0))
)
BENT = (
    Edit.continuous(INNER, OUTER, lattice=24)
    .move_corner(7, (0.2, 0.1, 0.15))
    .move_face("-x", (-0.1, 0.0, 0.05))
)
LEANING = Edit.continuous(
    INNER,
    Cage(OUTER.corners + 0.15 * (OUTER.corners[:, [2, 0, 1]] > 0.5)),
    lattice=24,
    name="outer cage bent",
).rotate((0.0, 0.0, 0.4))
SHELL = Edit.continuous(INNER, OUTER, shell=Trilinear(), lattice=32).translate((0.15, 0.0, 0.1))
MOVED = Edit.move(Cage.box((0.6, 0.5, 0.3), (1.0, 0.9, 0.9))).translate((0.0, -0.5, 0.8))
COPIED = (
    Edit.copy(Cage.box((0.5, 0.3, 0.2), (0.6, 0.5, 0.6)))
    .translate((0.2, -0.4, 0.7))
    .move_corner(3, (0.1, 0.1, 0.1))
)
GONE = Edit.delete(Cage.box((0.6, 0.5, 0.3), (0.9, 0.9, 1.0)))

GRADE = Grade(exposure=0.6, temperature=0.8, tint=0.2, saturation=1.4, hue_deg=100.0, opacity=0.5)

STACKS = {
    "affine": [TURNED],
    "bent": [BENT],
    "bent outer cage": [LEANING],
    "trilinear shell": [SHELL],
    "moved": [MOVED],
    "copied": [COPIED],
    "deleted": [GONE],
    "stack": [GONE, TURNED, COPIED, MOVED],
    "graded": [Edit.continuous(INNER, OUTER, lattice=24, grading=GRADE)],
    "graded, turned": [TURNED.replace(grading=GRADE)],
    "graded stack": [
        LEANING.replace(grading=GRADE),
        COPIED.grade(saturation=0.3, opacity=2.0),
        MOVED.grade(hue_deg=-60.0),
    ],
    "mirrored": [MOVED.mirror("x").mirror("z")],
    "mirrored, bent": [COPIED.mirror("y")],
}


EVERY_RUN = ("bent outer cage", "trilinear shell", "stack", "mirrored, bent")
"""Every kind of edit, of cage and of shell, and mirrors."""


@pytest.mark.parametrize("name", nightly_except(STACKS, *EVERY_RUN))
def test_the_page_draws_edits_as_the_kernel_does(page: FieldPage, name: str) -> None:
    check_edits(page, lumps(1, False), EditStack(STACKS[name]))


def test_the_page_draws_edits_of_an_unbounded_field(page: FieldPage) -> None:
    check_edits(page, lumps(0, True), EditStack([GONE, TURNED]))


def test_density_may_stay_as_it_is(page: FieldPage) -> None:
    check_edits(page, lumps(1, False), EditStack([TURNED]), preserve_opacity=False)


def check_edits(page: FieldPage, field: VoxelField, edits: EditStack, preserve_opacity: bool = True) -> None:
    """The page's picture under edits is the kernel's, and not the one without them."""
    seen = camera(field.contracted)
    renderer = VoxelRenderer(field, edits, preserve_opacity=preserve_opacity)
    ours, without = renderer.render(seen, normals=True), VoxelRenderer(field).render(seen)
    assert ours is not None and without is not None
    assert psnr(ours.rgb, without.rgb) < 30.0
    page.load(encode_page_field(field))
    page.edit(encode_page_edits(renderer))
    check_alike(ours, page.draw(seen))
    page.edit(None)
    plain = page.draw(seen)
    assert psnr(without.rgb, plain.rgb) >= LEAST


def test_a_shell_without_a_lattice_gets_one_for_pages() -> None:
    exact = EditStack([TURNED.replace(lattice=None), MOVED])
    with pytest.raises(EditError, match='edit "turned" has no lattice'):
        encode_page_edits(VoxelRenderer(lumps(0, False), exact))
    turned, moved = for_pages(PreparedStack(exact))
    assert turned.edit == TURNED.replace(lattice=LATTICE) and moved.edit is MOVED
    (fine,) = for_pages(PreparedStack([TURNED.replace(lattice=200)]))
    assert fine.edit == TURNED.replace(lattice=FINEST_LATTICE)


def test_a_page_is_sent_what_it_has_not(page: FieldPage) -> None:
    field, seen = lumps(1, False), camera(False)
    first = VoxelRenderer(field, EditStack([GONE, TURNED, BENT]))
    whole = encode_changed_edits(first)
    moved = first.with_edits(EditStack([GONE, TURNED, BENT.translate((0.05, 0.0, 0.05))]))
    ours = moved.render(seen, normals=True)
    assert whole.occupancy is not None
    change = encode_changed_edits(moved, whole.keys, {whole.keys[-1]: whole.occupancy})
    arrays = unpack(change.data, MAGIC, VERSION, "edits")[1]
    # The lattice that is other than before, and a part of the occupancy.
    assert set(arrays) == {"rows", "lattice.1", "occupancy"}
    assert 0 < arrays["occupancy"].size < moved.occupancy.codes.size
    page.load(encode_page_field(field))
    page.edit(whole.data)
    page.edit(change.data, changes=True)
    uploaded = page.page.evaluate("r.uploaded.last")
    # 24^3 nodes take 7 rows of 2048.
    assert uploaded == arrays["rows"].nbytes + 7 * 2048 * 6 + arrays["occupancy"].nbytes
    check_alike(ours, page.draw(seen))
    same = encode_changed_edits(moved, change.keys)
    assert set(unpack(same.data, MAGIC, VERSION, "edits")[1]) == {"rows"}
    with pytest.raises(Exception, match=r'no array "lattice\.0"'):
        page.edit(change.data)


def test_too_many_edits_are_refused() -> None:
    edits = EditStack([MOVED.translate((0.001 * n, 0, 0)) for n in range(23)])
    with pytest.raises(EditError, match="23 edits are more than"):
        encode_page_edits(VoxelRenderer(lumps(0, False, (9, 9, 9)), edits))
