"""Layers of patches as pages have them: what is sent, and pictures of the page, the kernel and the oracle."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from cagefield.completion.pasting.paste_composite import composite_paste
from cagefield.completion.pasting.paste_content import SourceContent, extract_content
from cagefield.edits import Edit, EditStack, PreparedEdit, PreparedStack
from cagefield.fields.voxel_field import VoxelField
from cagefield.fields.voxel_layers import BRICK_VERTICES
from cagefield.geometry.cage import Cage
from cagefield.images.metrics import psnr
from cagefield.pages.page_edits import MAGIC, VERSION, encode_changed_edits, encode_page_edits
from cagefield.pages.page_field import BRICK, encode_page_field
from cagefield.pages.page_file import from_byte_planes, unpack
from cagefield.pages.page_layers import encode_layer
from cagefield.rendering.reference_renderer import render_sampled
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from field_page import FieldPage, field_page
from page_fields import lumps
from page_layers import block_layer, patch_by_hand
from test_field_page import GONE, LEAST, MOVED, TURNED, camera, check_alike
from tiers import nightly_after_first


@pytest.fixture(scope="module")
def page() -> Iterator[FieldPage]:
    with field_page() as opened:
        yield opened


def patched(field: VoxelField, edit: Edit, *, part: bool, seed: int = 0) -> PreparedEdit:
    return PreparedEdit(edit, patch_by_hand(field, edit.inner, part=part, seed=seed))


def copied(by: tuple[float, float, float], moved: PreparedEdit) -> PreparedEdit:
    """A copy, elsewhere, that shows the patch of a move."""
    operations = MOVED.translate(by).operations
    return PreparedEdit(Edit.copy(MOVED.inner, operations=operations, **MOVED.shared_options), moved.patch)


def stack(field: VoxelField, name: str) -> PreparedStack:
    """Stacks with patches: their parts' layers, an edit before and one after, layers of the same content."""
    moved = patched(field, MOVED, part=True)
    gone = patched(field, GONE, part=False, seed=3)
    again = copied((-0.3, 0.0, -0.4), moved)
    edits = {
        "deleted": [gone],
        "after another": [TURNED, moved],
        "two and another": [gone, moved, again, TURNED.translate((0.1, 0.0, 0.0))],
    }
    return PreparedStack(edits[name])


def check_patched(page: FieldPage, field: VoxelField, edits: PreparedStack) -> VoxelRenderer:
    """The page's picture is the kernel's, and neither that without patches nor that without edits."""
    seen = camera(field.contracted)
    renderer = VoxelRenderer(field, edits)
    ours = renderer.render(seen, normals=True)
    bare = VoxelRenderer(field, EditStack(step.edit for step in edits)).render(seen)
    assert ours is not None and bare is not None
    assert psnr(ours.rgb, bare.rgb) < 30.0
    page.edit(None)
    page.load(encode_page_field(field))
    page.edit(encode_page_edits(renderer))
    check_alike(ours, page.draw(seen))
    return renderer


@pytest.mark.parametrize("name", nightly_after_first(["two and another", "deleted", "after another"]))
def test_the_page_draws_patches_as_the_kernel_does(page: FieldPage, name: str) -> None:
    field = lumps(1, False)
    check_patched(page, field, stack(field, name))


@pytest.mark.nightly
def test_the_page_draws_patches_of_an_unbounded_field(page: FieldPage) -> None:
    field = lumps(0, True)
    check_patched(page, field, stack(field, "after another"))


@pytest.mark.parametrize("contracted", nightly_after_first([False, True]))
def test_the_page_draws_pastes_as_the_kernel_does(page: FieldPage, contracted: bool) -> None:
    """Another scene's lumps, twice: turned and scaled, put over the field's own."""
    field, other, seen = lumps(1, contracted), lumps(2, False, seed=9), camera(contracted)
    cage = Cage.box((0.1, 0.0, 0.0), 0.9)
    shown = extract_content(SourceContent(other, EditStack()), cage, field)
    edit = Edit.paste("other", cage).scale(0.6).rotate((0.2, 0.0, 0.7))
    first = edit.translate((0.1, -0.6, 0.1) if contracted else (-0.5, 0.3, 0.2))
    both = composite_paste(field, EditStack(), first, shown)
    assert both is not shown
    second = edit.translate((0.6, -0.2, 0.3))
    pastes = PreparedEdit(first, pasted=both), PreparedEdit(second, pasted=shown)
    renderer = VoxelRenderer(field, PreparedStack([TURNED, *pastes]))
    page.edit(None)
    page.load(encode_page_field(field))
    page.edit(encode_page_edits(renderer))
    check_alike(renderer.render(seen, normals=True), page.draw(seen))
    bare = VoxelRenderer(field, EditStack([TURNED])).render(seen)
    assert bare is not None and psnr(page.draw(seen).rgb, bare.rgb) < (38.0 if contracted else 25.0)


def test_the_page_draws_patches_as_the_oracle_does(page: FieldPage) -> None:
    field, seen = lumps(2, False), camera(False).resized(32, 24)
    edits = PreparedStack([TURNED, patched(field, MOVED, part=True)])
    page.edit(None)
    # Samples as close as the oracle's: cuts are seen at the first sample behind them.
    page.load(encode_page_field(field, step=0.1))
    page.edit(encode_page_edits(VoxelRenderer(field, edits)))
    drawn = page.draw(seen, normals=False)
    exact = render_sampled(field, seen, edits=edits, samples=300)
    assert psnr(exact.rgb, drawn.rgb) >= LEAST
    assert psnr(exact.opacity, drawn.opacity) >= LEAST


def test_a_page_is_sent_layers_once(page: FieldPage) -> None:
    field, seen = lumps(1, False), camera(False)
    moved = patched(field, MOVED, part=False)
    first = VoxelRenderer(field, PreparedStack([moved]))
    whole = encode_changed_edits(first)
    header, arrays = unpack(whole.data, MAGIC, VERSION, "edits")
    assert {"layer.0.box", "layer.0.cells", "layer.0.sh"} <= set(arrays)
    assert header["layers"][0]["key"] in whole.keys
    # The cage goes on, what it left stays: nothing of the layer is sent or uploaded.
    there = first.with_edits(PreparedStack([PreparedEdit(MOVED.translate((0.05, 0.0, 0.0)), moved.patch)]))
    change = encode_changed_edits(there, whole.keys)
    assert set(unpack(change.data, MAGIC, VERSION, "edits")[1]) == {"rows", "occupancy"}
    page.edit(None)
    page.load(encode_page_field(field))
    page.edit(whole.data)
    page.edit(change.data, changes=True)
    assert page.page.evaluate("r.uploaded.last") < 4 * there.occupancy.codes.size
    check_alike(there.render(seen, normals=True), page.draw(seen))
    # The same content in two edits, at places that are not the ones of before.
    twice = first.with_edits(
        PreparedStack(
            [
                patched(field, GONE, part=False),
                moved,
                copied((-0.3, 0.0, -0.4), moved),
            ]
        )
    )
    more = encode_changed_edits(twice, change.keys)
    sent = {name.split(".")[1] for name in unpack(more.data, MAGIC, VERSION, "edits")[1] if "layer" in name}
    assert sent == {"0"}
    page.edit(more.data, changes=True)
    check_alike(twice.render(seen, normals=True), page.draw(seen))


@pytest.mark.nightly
def test_layers_are_there_after_the_context_was_lost_and_gone_with_their_edits(page: FieldPage) -> None:
    field, seen = lumps(1, False), camera(False)
    page.edit(None)
    page.load(encode_page_field(field))
    plain = page.draw(seen)
    page.edit(encode_page_edits(VoxelRenderer(field, stack(field, "two and another"))))
    before = page.draw(seen)
    page.lose_context()
    np.testing.assert_array_equal(before.rgb, page.draw(seen).rgb)
    page.edit(None)
    np.testing.assert_array_equal(plain.rgb, page.draw(seen).rgb)


@pytest.mark.nightly
def test_textures_grow_for_layers_up_to_the_memory(page: FieldPage) -> None:
    """Many edits, whose layers take more room than a field's textures have to spare."""
    field, seen = lumps(0, False), camera(False)
    cages = [Cage.box((x, y, 0.0), 0.3) for x in (-0.5, 0.5) for y in (-0.4, 0.4)]
    edits = PreparedStack(
        PreparedEdit(Edit.delete(cage), patch_by_hand(field, cage, part=False, margin=0.4, seed=n))
        for n, cage in enumerate(cages)
    )
    renderer = VoxelRenderer(field, edits)
    first = VoxelRenderer(field, PreparedStack(edits[:1]))
    content, few = encode_page_edits(renderer), encode_page_edits(first)
    page.edit(None)
    bytes_before = page.load(encode_page_field(field))["bytes"]
    page.edit(few)
    assert page.page.evaluate("r.bytes") == bytes_before
    page.edit(content)
    assert page.page.evaluate("r.bytes") > bytes_before
    check_alike(renderer.render(seen, normals=True), page.draw(seen))
    said = page.page.evaluate(
        """async ([field, edits, limit]) => {
            const small = new cagefieldViewer.FieldRenderer(gl, limit);
            await small.load(new Uint8Array(field).buffer);
            const read = await cagefieldViewer.readEdits(new Uint8Array(edits).buffer);
            try { small.setEdits(read); } catch (error) { return error.message; }
            finally { small.dispose(); }
        }""",
        [list(encode_page_field(field)), list(content), bytes_before],
    )
    assert "MiB of the GPU, more than" in said


def decoded(arrays: dict[str, np.ndarray], shape: tuple[int, int, int], K: int) -> tuple[np.ndarray, ...]:
    """(density in the field's unit, sh, sent) [x,y,z] of a layer's arrays; sent: the file has the vertex."""
    low = arrays["box"][0]
    held = np.argwhere(arrays["bricks"] > 0)
    bits = np.unpackbits(arrays["masks"], axis=1, bitorder="little").astype(bool)
    brick, local = np.nonzero(bits)
    at = (held[brick] + low) * BRICK + np.stack(np.unravel_index(local, (BRICK,) * 3), axis=1)
    density, sh, sent = np.zeros(shape), np.full((*shape, K, 3), 128), np.zeros(shape, bool)
    place = tuple(at.T)
    density[place] = from_byte_planes(arrays["density"])
    planes = np.cumsum(arrays["sh"], axis=2, dtype=np.uint8) + np.uint8(128)
    sh[place] = planes.transpose(2, 0, 1)
    sent[place] = True
    return density, sh, sent


def test_what_is_sent_of_a_layer_is_where_it_is_other_than_the_field() -> None:
    field = lumps(1, False)
    layer = block_layer(field, np.array([[-0.4, -0.5, -0.7], [0.9, 0.4, 0.3]]))
    arrays = {name[2:]: array for name, array in encode_layer(layer, field, "l").items()}
    density, sh, sent = decoded(arrays, field.resolution, 4)
    steps = np.asarray(unpack(encode_page_field(field), b"cagepage", 1, "a field")[0]["levels"][-1]["steps"])
    unit = 1.0 / field.voxel_size.min()

    def dense(source: VoxelField) -> tuple[np.ndarray, np.ndarray]:
        values, colors = np.zeros(np.prod(field.resolution)), np.zeros((np.prod(field.resolution), 4, 3))
        values[source.vertices], colors[source.vertices] = source.density, source.sh
        return values.reshape(field.resolution), colors.reshape(*field.resolution, 4, 3)

    (ours, our_sh), (theirs, their_sh) = dense(layer), dense(field)
    ends = np.stack(np.unravel_index(layer.vertices[[0, -1]], field.resolution), axis=1)
    block = tuple(slice(int(low), int(high) + 1) for low, high in ends.T)
    inside = np.zeros(field.resolution, bool)
    inside[block] = True
    assert not sent[~inside].any()
    # Sent ones have the layer's numbers, to half a step; its colors may lie beyond the field's.
    np.testing.assert_allclose(density[sent] * unit, ours[sent], rtol=2.0**-10)
    wanted = np.clip(128 + our_sh / steps[:, None], 0, 255)
    assert np.abs(sh - wanted)[sent].max() <= 0.51
    # Others are the field's, as well as a file knows.
    kept = inside & ~sent
    assert kept.mean() > 0.01
    np.testing.assert_allclose(ours[kept], theirs[kept], rtol=2.0**-10)
    assert (np.abs(our_sh - their_sh)[kept] <= 1.01 * steps[:, None]).all()
    # Bricks of cells: 0 where no vertex was sent, 1 where one was and there is density, else 2.
    cells = arrays["cells"]
    for brick in np.argwhere(np.ones_like(cells)):
        at = tuple(slice(int(b) * BRICK, int(b) * BRICK + BRICK + 1) for b in brick + arrays["box"][0])
        expected = 0 if not sent[at].any() else 1 if (ours[at] > 0.0).any() else 2
        assert cells[tuple(brick)] == expected
    assert set(np.unique(cells)) == {0, 1, 2}


def test_an_empty_layer_empties_what_the_field_has_there() -> None:
    field = lumps(0, False)
    ends = np.array([0, np.prod(field.resolution) - 1])
    empty = VoxelField(
        field.bounds, field.resolution, ends, np.zeros(2, np.float32), np.zeros((2, 1, 3), np.float32)
    )
    arrays = encode_layer(empty, field, "l")
    assert 2 in arrays["l.cells"] and 1 not in arrays["l.cells"]
    nothing = VoxelField(field.bounds, field.resolution, ends[:0], empty.density[:0], empty.sh[:0])
    assert encode_layer(nothing, nothing, "l")["l.sh"].shape == (1, 3, 0)


def test_places_keep_bricks_whole() -> None:
    assert BRICK_VERTICES == BRICK
