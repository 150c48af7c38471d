"""Patches: what edits uncover goes on, shadows go along, and every renderer reads the same."""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.cameras.camera import Camera, turntable
from cagefield.completion.discrete_patch import build_patch
from cagefield.completion.inpainting.support_inpainting import solve_membrane
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.patch_stages import PatchStage, needs_patch
from cagefield.completion.surfaces.block_extraction import extract_block, interpolate_field
from cagefield.completion.surfaces.footprint import Footprint
from cagefield.completion.surfaces.support_plane import Support
from cagefield.completion.surfaces.visibility import render_visibility
from cagefield.edits import Edit, EditStack, PreparedEdit, PreparedStack, dump_edits, parse_edits
from cagefield.edits.options import Clone
from cagefield.edits.patch import Patch
from cagefield.errors import EditError, EditFileError
from cagefield.fields.voxel_field import VoxelField
from cagefield.fields.voxel_layers import BRICK_VERTICES, layer_slices, layer_x_offsets
from cagefield.geometry.cage import Cage
from cagefield.rendering.reference_renderer import render_sampled
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from cagefield.scene.scene import Scene
from solid_fields import db, solid_field

C0 = 0.28209479177387814
FLOOR, TOP = -0.5, 0.1
STRENGTH = 0.7
"""How much of its light a corner lacks."""


def room(box: bool, *, scale: float = 1.0, resolution: int = 44, reach: float = 0.3) -> VoxelField:
    """A colored floor, with a box on it or without one, shaded by how near the other is.

    Under the box, which no photo would show, the floor is black.
    """
    axis = np.linspace(-1.0, 1.0, resolution)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    edge = axis[1] - axis[0]
    floor = (z <= FLOOR) & (z > FLOOR - 4.0 * edge)
    block = (np.abs(x - 0.1) < 0.25) & (np.abs(y) < 0.25) & (z > FLOOR) & (z < TOP) & box
    solid = floor | block
    rgb = np.zeros((*solid.shape, 3))
    rgb[floor] = np.stack([0.45 + 0.2 * x, 0.55 + 0.15 * y, 0.5 - 0.1 * x], axis=-1)[floor]
    rgb[block] = (0.8, 0.3, 0.2)
    if box:
        from_block = ndimage.distance_transform_edt(~block) * edge
        from_floor = ndimage.distance_transform_edt(~floor) * edge
        other = np.where(floor, from_block, from_floor)
        rgb *= (1.0 - STRENGTH * np.clip(1.0 - other / reach, 0.0, 1.0))[..., None]
        rgb[floor & (np.abs(x - 0.1) < 0.25) & (np.abs(y) < 0.25)] = 0.0
    return solid_field(solid, rgb, scale)


def cage(scale: float = 1.0) -> Cage:
    """Around the box, from a voxel above the floor on."""
    return Cage.box(
        scale * np.array([0.1, 0.0, 0.5 * (FLOOR + 0.04 + TOP + 0.06)]), scale * np.array([0.6, 0.6, 0.62])
    )


def cameras(scale: float = 1.0) -> tuple[Camera, ...]:
    """Around the floor, from above."""
    return turntable((0.0, 0.0, -0.3 * scale), 3.0 * scale, 8, elevation=0.7, width=54, height=54, fov_x=0.6)


def seen(scene: Scene) -> NDArray[np.float32]:
    """Pictures of a scene from some of its cameras."""
    return np.stack([scene.render(camera).rgb for camera in cameras(float(scene.field.bounds[1, 0]))[::4]])


@pytest.fixture(scope="module")
def scenes() -> tuple[Scene, Scene]:
    """(the floor with its box, the floor alone)."""
    both = (Scene(room(box), cameras={"train": cameras()}) for box in (True, False))
    return next(both), next(both)


def test_a_box_leaves_no_trace(scenes: tuple[Scene, Scene]) -> None:
    scene, truth = scenes
    found = {}
    for fill, relight in (("none", "none"), ("surroundings", "none"), ("surroundings", "occlusion")):
        edit = dataclasses.replace(Edit.delete(cage()), fill=fill, relight=relight)
        found[fill, relight] = db(seen(scene.with_edits(EditStack([edit]))), seen(truth))
    none, filled, both = found.values()
    assert filled > none + 2.0 and both > filled + 4.0 and both > 30.0, found


def test_what_cameras_see_of_a_floor() -> None:
    """Beside a box, not within it nor beneath the floor; of the hole of a footprint that is left out."""
    field = room(True)
    sight = render_visibility(lambda camera: VoxelRenderer(field).render(camera), cameras(), field.bounds)
    asked = np.array([[0.1, 0.4, FLOOR], [0.1, 0.0, FLOOR - 0.15], [0.1, 0.0, 0.0]])
    beside, beneath, within = sight.count_views(asked, 0.05)
    assert beside >= 4 and beneath == within == 0
    hole = np.zeros((9, 9), bool)
    hole[1:8, 1:8] = True
    support = Support(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.eye(3)[:2], np.zeros((0, 3)))
    footprint = Footprint(
        support, np.zeros(2, np.int64), hole, ~hole, np.ones_like(hole), np.zeros(hole.shape)
    )
    nothing = np.zeros((9, 9, 9), bool)
    all_but_one = np.ones(49, bool)
    all_but_one[24] = False
    left = footprint.remove_known(all_but_one, nothing)
    assert not left.hole.any() and left.surroundings.all()  # one alone shows through a gap
    stands = nothing.copy()
    stands[3:6, 3:6, 3] = True
    left = footprint.remove_known(np.ones(49, bool), stands)
    assert left.hole[3:6, 3:6].all() and not left.hole[1, 1] and (left.hole ^ left.surroundings).all()
    # Where the support has no surface nothing is known of it.
    bare = dataclasses.replace(footprint, has_surface=~hole)
    assert (bare.remove_known(np.ones(49, bool), nothing).hole == hole).all()
    # Where cameras look through it, it does not go on: unless that is a small gap amid the support.
    air = np.zeros((7, 7), bool)
    air[:, :3] = air[6, 6] = True
    assert (footprint.remove_free_space(air.reshape(-1)).hole == hole).all()
    ends = dataclasses.replace(footprint, surroundings=~hole & (np.arange(9) > 0))
    left = ends.remove_free_space(air.reshape(-1))
    assert not left.hole[2:7, 1:4].any() and left.hole[1:8, 4:8].all()


@pytest.mark.nightly
def test_units_make_no_difference(scenes: tuple[Scene, Scene]) -> None:
    scene, _ = scenes
    large = Scene(room(True, scale=50.0), cameras={"train": cameras(50.0)})
    small = seen(scene.with_edits(EditStack([Edit.delete(cage())])))
    assert db(seen(large.with_edits(EditStack([Edit.delete(cage(50.0))]))), small) > 40.0


@pytest.mark.nightly
def test_the_fit_finds_the_shade_and_none_where_none_is(scenes: tuple[Scene, Scene]) -> None:
    scene, _ = scenes
    ambience = scene.patcher.light_model
    assert ambience.has_effect and 0.4 < sum(ambience.weights) < 0.95
    field = scene.field
    assert isinstance(field, VoxelField)
    plain = dataclasses.replace(field, sh=np.zeros_like(field.sh))
    assert sum(Scene(plain, cameras=scene.cameras).patcher.light_model.weights) < 0.1
    bare = Scene(plain).patcher.light_model  # without cameras it is looked at from around
    assert sum(bare.weights) < 0.2


@pytest.mark.nightly
def test_shadows_go_along(scenes: tuple[Scene, Scene]) -> None:
    """The box at its new place shades the floor there, about as much as where it stood."""
    scene, truth = scenes
    moved = Edit.move(cage()).translate((-0.8, 0.0, 0.0))

    def beside(edit: Edit, x: float) -> float:
        """How bright the floor is beside the box at x, over what it is without a box."""
        eye = (x, -0.29, 1.5)
        camera = Camera.look_at(eye, (x, -0.289, FLOOR), width=3, height=3, fov_x=0.01)
        own = scene.with_edits(EditStack([edit])).render(camera).rgb.mean()
        return float(own / truth.render(camera).rgb.mean())

    left = dataclasses.replace(moved, relight="none")
    assert beside(left, 0.1) < 0.85 and beside(moved, 0.1) > 0.8
    assert beside(left, -0.7) > 0.95 and beside(moved, -0.7) < 0.8


def test_switched_off_nothing_is_patched(scenes: tuple[Scene, Scene]) -> None:
    scene, _ = scenes
    edit = dataclasses.replace(Edit.delete(cage()), fill="none", relight="none")
    assert not needs_patch(edit) and scene.with_edits(EditStack([edit])).prepared_edits[0].patch is None
    plain = VoxelRenderer(scene.field, EditStack([edit])).render(cameras()[0])  # type: ignore[arg-type]
    own = scene.with_edits(EditStack([edit])).render(cameras()[0])
    assert plain is not None and np.array_equal(plain.rgb, own.rgb)
    continuous = Edit.continuous(cage(), cage().grown(0.1)).translate((0.05, 0.0, 0.0))
    assert not needs_patch(continuous) and not needs_patch(Edit.delete(cage()).replace(enabled=False))


@pytest.mark.nightly
def test_patches_are_kept_while_a_cage_is_dragged(scenes: tuple[Scene, Scene]) -> None:
    scene, _ = scenes
    edit = Edit.move(cage()).translate((-0.5, 0.0, 0.0))
    further = edit.translate((-0.2, 0.0, 0.0))
    first, second = (scene.patcher.prepare([e], stage=PatchStage.INPAINTED)[0].patch for e in (edit, further))
    assert first is second and first is not None and first.part is None
    settled = scene.patcher.prepare([further])[0].patch
    assert settled is not first and settled is not None and settled.part is not None
    assert scene.patcher.prepare([further])[0].patch is settled


def other(field: VoxelField, box: NDArray[np.float64], rgb: tuple[float, float, float]) -> VoxelField:
    """A layer of one color in a box, as dense as its height says."""
    block = extract_block(field, EditStack(), box)
    every = np.ones(block.shape, bool)
    heights = block.positions(every)[:, 2]
    full = block.with_density(every, (20.0 * (heights > 0.0)).astype(np.float32))
    return full.with_colors(full.slot >= 0, np.broadcast_to(rgb, (int((full.slot >= 0).sum()), 3))).to_layer()


@pytest.mark.parametrize("contracted", [False, True])
def test_kernel_and_oracle_read_the_same_layers(contracted: bool) -> None:
    field = dataclasses.replace(room(True, resolution=24), contracted=contracted)
    if contracted:
        # Nothing lies beyond the box of interest, which the oracle samples evenly.
        at = np.stack(np.unravel_index(field.vertices, field.resolution), axis=1)
        kept = (np.abs(at - 11.5) < 5.0).all(axis=1)
        field = VoxelField(
            field.bounds * 0.4,
            field.resolution,
            field.vertices[kept],
            field.density[kept],
            field.sh[kept],
            contracted=True,
        )
    box = np.array([[-0.3, -0.4, -0.6], [0.5, 0.4, 0.5]]) * (0.4 if contracted else 1.0)
    inner = Cage.box(box.mean(axis=0), 0.7 * (box[1] - box[0]))
    size = float(box[1, 0] - box[0, 0])
    patch = Patch(
        Cage.box(box.mean(axis=0), 0.95 * (box[1] - box[0])),
        other(field, box, (0.1, 0.6, 0.2)),
        other(field, box, (0.2, 0.2, 0.9)),
    )
    edit = Edit.move(inner).translate((-size, 0.0, 0.1 * size)).rotate((0.0, 0.0, 0.4))
    earlier = Edit.continuous(inner, inner.grown(0.2 * size), lattice=16).translate((0.05 * size, 0.0, 0.0))
    stack = PreparedStack([earlier, PreparedEdit(edit, patch)])
    assert len(set(stack.places)) == 2 and min(stack.places) >= max(field.resolution) - BRICK_VERTICES
    camera = Camera.look_at(
        (1.2 * size, -2.5 * size, 1.4 * size), tuple(box.mean(axis=0)), width=28, height=28, fov_x=0.7
    )
    frame = VoxelRenderer(field, stack, step=0.25).render(camera, background="black")
    assert frame is not None
    source = field.__call__ if contracted else field
    oracle = render_sampled(
        source, camera, near=0.0, far=8.0 * size, samples=1000, edits=stack, background="black"
    )
    plain = render_sampled(
        source, camera, near=0.0, far=8.0 * size, samples=250, background="black",
        edits=EditStack([earlier, edit]),
    )  # fmt: skip
    assert db(frame.rgb, oracle.rgb) > 36.0 > 25.0 > db(plain.rgb, oracle.rgb)
    # Without the patch the grid of the field is used as it was.
    assert VoxelRenderer(field, stack).with_edits(EditStack([])).grid.layers == ()


def test_layers_lie_behind_the_field_and_apart() -> None:
    field = room(True, resolution=24)
    low, high = (
        other(field, np.array(box), (0.5, 0.5, 0.5))
        for box in ([[-1, -1, -1], [0, 0, 0]], [[0, 0, 0], [1, 1, 1]])
    )
    again = dataclasses.replace(low)
    places = layer_x_offsets((low, high, again))
    spans = [
        (p + layer_slices(layer)[0], p + layer_slices(layer)[1])
        for p, layer in zip(places, (low, high, again), strict=True)
    ]
    # The same layer twice is there once.
    assert layer_x_offsets((low, high, low, again)) == (places[0], places[1], places[0], places[2])
    assert all(p % BRICK_VERTICES == 0 for p in places) and spans[0][0] >= 24
    assert all(before[1] <= after[0] for before, after in itertools.pairwise(spans))


def test_a_patch_over_an_earlier_edit_shows_what_that_made() -> None:
    field = room(True)
    earlier = Edit.move(cage()).translate((-0.7, 0.0, 0.0)).rotate((0.0, 0.0, 0.5))
    block = extract_block(field, EditStack([earlier]), np.array([[-0.9, -0.4, -0.7], [0.5, 0.4, 0.3]]))
    mapped = EditStack([earlier]).to_canonical(block.positions(np.ones(block.shape, bool)))
    raw, _ = interpolate_field(field, mapped.points)
    expected = np.where(mapped.layer < 0, 0.0, np.maximum(raw, 0.0)).reshape(block.shape)
    np.testing.assert_allclose(np.maximum(block.density, 0.0), expected, atol=1e-4 * expected.max())
    # The box that was moved is taken away again, where it is now.
    again = Edit.delete(earlier.deformed)
    patch = build_patch(field, EditStack([earlier]), again, None)
    at = earlier.deformed.center[None]
    assert interpolate_field(patch.under, at)[0][0] <= 0.0


def test_membranes_are_harmonic() -> None:
    u, v = np.meshgrid(np.arange(20.0), np.arange(14.0), indexing="ij")
    hole = (u > 4) & (u < 15) & (v > 3) & (v < 11)
    values = np.stack([2.0 * u - v + 3.0, u * v], axis=-1).reshape(-1, 2)  # both harmonic on a grid
    table = np.where(hole.reshape(-1, 1), 0.0, values)
    np.testing.assert_allclose(solve_membrane(hole, ~hole, table), values, atol=1e-2)


@pytest.mark.nightly
def test_a_table_ends_at_its_edge(scenes: tuple[Scene, Scene]) -> None:
    """A box that stands over a floor's edge leaves no floor in the air."""
    field = room(True)
    x = np.linspace(-1.0, 1.0, 44)[field.vertices // 44**2]
    z = np.linspace(-1.0, 1.0, 44)[field.vertices % 44]
    kept = (z > FLOOR) | (x < 0.1)
    cut = VoxelField(
        field.bounds, field.resolution, field.vertices[kept], field.density[kept], field.sh[kept]
    )
    box = Cage.box((0.1, 0.0, 0.5 * (FLOOR + TOP) + 0.02), (0.6, 0.6, TOP - FLOOR + 0.06))
    scene = Scene(cut, EditStack([Edit.delete(box)]), cameras={"train": cameras()})
    down = [
        Camera.look_at((at, 0.0, 2.0), (at + 1e-3, 0.0, FLOOR), width=3, height=3, fov_x=0.01)
        for at in (0.0, 0.25)
    ]
    assert scene.render(down[0]).opacity.min() > 0.9 and scene.render(down[1]).opacity.max() < 0.1


@pytest.mark.nightly
def test_strange_cages_are_patched_without_a_traceback(scenes: tuple[Scene, Scene]) -> None:
    scene, _ = scenes
    for odd in (
        Cage.box((0.0, 0.0, 0.0), 8.0),  # holds all of the field
        Cage.box((5.0, 5.0, 5.0), 0.5),  # holds nothing, outside of the grid
        Cage.box((0.9, 0.9, 0.9), 0.5),  # over the grid's edge
        Cage.box((0.0, 0.0, FLOOR), 1e-4),  # smaller than a voxel
        Cage.box((0.1, 0.0, FLOOR), (0.5, 0.5, 0.6), (0.3, 0.2, 0.5)),  # through the floor
    ):
        for edit in (
            Edit.delete(odd),
            Edit.move(odd).translate((-0.4, 0.1, 0.3)),
            Edit.copy(odd).scale(0.5),
        ):
            assert np.isfinite(scene.with_edits(EditStack([edit])).render(cameras()[0]).rgb).all()


@pytest.mark.nightly
def test_a_field_of_nothing_solid_is_patched() -> None:
    field = room(True)
    thin = dataclasses.replace(field, density=np.full_like(field.density, 1e-3))
    scene = Scene(thin, EditStack([Edit.delete(cage())]))
    assert not scene.patcher.light_model.has_effect
    assert np.isfinite(scene.render(cameras()[0]).rgb).all()


def test_options_are_read_and_written(tmp_path: Path) -> None:
    stack = EditStack(
        [dataclasses.replace(Edit.delete(cage()), fill="none", relight="none"), Edit.delete(cage())]
    )
    text = dump_edits(stack)
    assert parse_edits(text) == stack and text.count("fill: none") == 1 == text.count("relight: none")
    with pytest.raises(EditFileError, match=r'fill must be one of surroundings, none, got "grass"'):
        parse_edits(text.replace("fill: none", "fill: grass"))
    with pytest.raises(EditError, match="relight must be one of"):
        Edit.move(cage(), relight="moon")  # type: ignore[arg-type]


def test_openness_needs_weights() -> None:
    assert not LightModel((), ()).has_effect and LightModel((), ()).max_radius == 0.0
    both = LightModel((0.1, 0.2), (0.5, 0.5))
    np.testing.assert_allclose(np.exp(both.log_openness(np.array([[0.0, 0.0], [1.0, 0.0]]))), [1.0, 0.5])


@pytest.mark.nightly
def test_a_clone_fills_with_what_another_cage_holds(scenes: tuple[Scene, Scene]) -> None:
    """A hole through the floor shows the floor beside it, without a seam; the file says so."""
    scene, truth = scenes
    through = Cage.box((0.1, 0.0, -0.2), (0.66, 0.66, 0.9))
    source = through.translate((-0.7, 0.55, 0.0))
    edits = {
        fill: EditStack([dataclasses.replace(Edit.delete(through), fill=fill)])
        for fill in ("none", Clone(source))
    }
    assert all(parse_edits(dump_edits(stack)) == stack for stack in edits.values())
    hole, clone = (db(seen(scene.with_edits(stack)), seen(truth)) for stack in edits.values())
    assert clone > hole + 3.0 and clone > 24.0, (hole, clone)


def test_the_rim_of_a_part_blends_into_what_it_is_put_into() -> None:
    """A piece of floor, set into the floor elsewhere: its colors differ, and a feathered seam is softer."""
    scene = Scene(room(False), cameras={"train": cameras()})
    piece = Cage.box((-0.4, -0.4, FLOOR), (0.5, 0.5, 0.4))
    above = Camera.look_at((0.35, 0.3, 1.5), (0.35, 0.31, FLOOR), width=64, height=64, fov_x=0.4)
    steps = {}
    for feather in (0.0, 1.0, 4.0):
        edit = Edit.copy(piece, relight="none", feather=feather)
        moved = EditStack([edit.translate((0.75, 0.7, 0.0))])
        assert parse_edits(dump_edits(moved)) == moved
        picture = scene.with_edits(moved).render(above).rgb
        steps[feather] = float(np.abs(np.diff(picture, axis=1)).max())
    assert steps[4.0] < steps[1.0] < 0.9 * steps[0.0] and steps[4.0] < 0.6 * steps[0.0], steps


def test_widths_of_seams_that_make_no_sense_are_refused() -> None:
    for feather in (-1.0, 9.0, float("nan")):
        with pytest.raises(EditError, match="feather must be 0"):
            Edit.move(cage(), feather=feather)
