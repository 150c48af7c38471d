"""The fused renderer against the plain sampled one, closed forms, and itself without skipping."""

from __future__ import annotations

import dataclasses
from functools import cache
from itertools import product

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.compute import devices
from cagefield.edits import Edit, EditStack, PreparedEdit, PreparedStack, Trilinear
from cagefield.edits.device.packing import ALONE, BASE_PLACE, IS_CUT
from cagefield.edits.device_stack import DeviceStack
from cagefield.edits.patch import Patch
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.images.metrics import psnr
from cagefield.rendering.reference_renderer import render_sampled
from cagefield.rendering.voxels import occupancy
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from tiers import nightly_after_first, nightly_except

devices.start()

N = 49
CAMERA = Camera.look_at((2.6, -1.9, 1.4), (0, 0, 0), width=40, height=32, fov_x=0.75)


def ball(
    contracted: bool = False, density: float = 25.0, radius: float = 0.55, degree: int = 1
) -> VoxelField:
    """A soft ball with a smooth pattern, in a box of half-size 1."""
    extent = 2.0 if contracted else 1.0
    axis = np.linspace(-extent, extent, N)
    p = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    sigma = density * np.clip((radius - np.linalg.norm(p, axis=1)) / 0.1, -1, 1)
    keep = np.flatnonzero(sigma > -density)
    sh = np.zeros((len(keep), (degree + 1) ** 2, 3))
    sh[:, 0] = np.sin(4 * p[keep] + [0, 1, 2])
    if degree:
        sh[:, 1:4] = 0.15 * np.cos(3 * p[keep])[:, None, :]
    bounds = np.array([[-1.0] * 3, [1.0] * 3])
    return VoxelField(bounds, (N, N, N), keep, sigma[keep], sh, contracted)


def sampled(field: VoxelField, edits: EditStack | None = None, samples: int = 600, camera: Camera = CAMERA):
    return render_sampled(field, camera, near=1.5, far=5.5, samples=samples, background="white", edits=edits)


@pytest.mark.parametrize("contracted", [False, True])
@pytest.mark.parametrize("degree", nightly_except([0, 1, 2], 0, 2))
def test_fused_matches_the_plain_renderer(degree, contracted):
    field = ball(contracted, degree=degree)
    fused = VoxelRenderer(field, step=0.1).render(CAMERA, background="white")
    plain = sampled(field)
    # Both are midpoint rules with steps of a tenth of a voxel; rays stop at T = 1e-3.
    assert psnr(fused.rgb, plain.rgb) > 50
    np.testing.assert_allclose(fused.opacity, plain.opacity, atol=4e-3)
    solid = plain.opacity > 0.9
    assert solid.sum() > 50
    np.testing.assert_allclose(fused.depth[solid], plain.depth[solid], atol=5e-3)


def test_uniform_density_obeys_beer_lambert():
    n = (9, 9, 9)
    field = VoxelField(
        np.array([[-1.0] * 3, [1.0] * 3]), n, np.arange(729), np.full(729, 0.7), np.zeros((729, 1, 3))
    )
    camera = Camera.look_at((0, -4, 0), (0, 0, 0), width=5, height=5, fov_x=0.02)
    frame = VoxelRenderer(field, step=0.25).render(camera, background="black")
    # Every ray passes 2 units; color 0.5 everywhere. The last step may overhang by half a step of 1/16.
    expected = 1 - np.exp(-0.7 * 2)
    np.testing.assert_allclose(frame.opacity, expected, atol=0.7 * np.exp(-1.4) / 16)
    np.testing.assert_allclose(frame.rgb, 0.5 * frame.opacity[..., None].repeat(3, -1), atol=1e-4)


@pytest.mark.parametrize("contracted", [False, True])
def test_skipping_empty_space_changes_nothing(contracted, monkeypatch):
    field = ball(contracted)
    skipped = VoxelRenderer(field).render(CAMERA, background="white")

    def full(field_, threshold=0.0):
        return occupancy.of_vertices(np.ones(field_.resolution, bool))

    monkeypatch.setattr(occupancy, "of_field", full)
    whole = VoxelRenderer(field).render(CAMERA, background="white")
    if contracted:
        # Steps follow the ray's own speed, so leaps move the samples: equal up to quadrature error.
        assert psnr(skipped.rgb, whole.rgb) > 40
    else:
        np.testing.assert_allclose(skipped.rgb, whole.rgb, atol=2e-5)


INNER = Cage.box((0.1, 0, 0.1), (0.7, 0.6, 0.8))
OUTER = Cage.box((0.05, 0, 0.1), (2.4, 2.4, 2.4))
EDITS = {
    "continuous": EditStack(
        [Edit.continuous(INNER, OUTER, shell=Trilinear()).rotate((0.1, 0.2, 0.3)).translate((0.1, 0.05, 0.1))]
    ),
    "corner": EditStack([Edit.continuous(INNER, OUTER, shell=Trilinear()).move_corner(7, (0.15, 0.1, 0.2))]),
    "move": EditStack([Edit.move(INNER).translate((0.2, -0.9, 0.3))]),
    "copy out of bounds": EditStack([Edit.copy(INNER).translate((0.0, -1.2, 0.2))]),
    "delete": EditStack([Edit.delete(INNER)]),
    "lattice": EditStack(
        [
            Edit.continuous(INNER, OUTER, shell=Trilinear(), lattice=24)
            .rotate((0.1, 0.2, 0.3))
            .translate((0.1, 0.05, 0.1))
        ]
    ),
    "points": EditStack(
        [Edit.points([[0, 0, 0.1]], radius=0.9, lattice=24).translate((0.3, -0.2, 0.3)).rotate((0, 0, 0.8))]
    ),
    # Samples that the second edit moves land in the box of the first, which their ray does not meet.
    "lattices that overlap": EditStack(
        [
            Edit.continuous(
                Cage.box((-0.25, 0.1, 0.1), (0.4, 0.4, 0.6)),
                Cage.box((-0.25, 0.1, 0.1), (0.8, 0.9, 1.2)),
                shell=Trilinear(),
                lattice=24,
            ).translate((-0.15, 0, 0.1)),
            Edit.continuous(
                Cage.box((-0.2, 0, 0.1), (0.9, 0.9, 0.9)),
                Cage.box((0.3, 0, 0.1), (2.2, 2.0, 2.0)),
                shell=Trilinear(),
                lattice=24,
            ).translate((0.5, 0.1, 0)),
        ]
    ),
    # Of the second edit alone rays go straight, but what it shows the first one has changed.
    "copy of what was changed": EditStack(
        [
            Edit.continuous(INNER, Cage.box((0.1, 0, 0.1), (1.2, 1.1, 1.3)), shell=Trilinear()).translate(
                (0, 0, 0.2)
            ),
            Edit.copy(INNER).translate((-0.65, -0.9, 0)),
        ]
    ),
    "copy through a bent cage": EditStack(
        [Edit.copy(INNER).translate((-0.4, -0.9, 0.2)).move_corner(7, (0.2, 0.1, 0.1))]
    ),
    "turned copy": EditStack(
        [Edit.copy(INNER).rotate((0.7, 0.5, 0.9)).scale(1.4).translate((-0.4, -0.9, 0.2))]
    ),
    "two": EditStack(
        [
            Edit.move(INNER).rotate((0, 0, 0.8)).translate((0, -0.5, 0)),
            Edit.continuous(
                Cage.box((0, -0.4, 0.1), (0.9, 0.9, 0.9)),
                Cage.box((0, -0.4, 0.1), (1.8, 1.8, 1.8)),
                shell=Trilinear(),
            ).scale(1.3),
        ]
    ),
}


EVERY_RUN = (
    (True, "two"),
    *((False, name) for name in ("corner", "lattices that overlap", "turned copy", "two")),
)
"""(contracted, edits): each kind of map, and all that edits of a stack do to each other."""

FEWER_PIXELS = CAMERA.resized(20, 16)
"""A smaller view for edited fields, whose plain pictures take seconds."""


def test_each_frame_is_that_of_its_own_camera():
    """Arguments of launches are temporary objects, whose addresses are used again."""
    renderer = VoxelRenderer(ball(), step=0.5)
    for angle in np.linspace(0.0, 5.0, 8):
        eye = (3.0 * np.cos(angle), 3.0 * np.sin(angle), 1.0)
        camera = Camera.look_at(eye, (0, 0, 0), width=16, height=12, fov_x=0.6)
        frame = renderer.render(camera, background="white")
        assert psnr(frame.rgb, sampled(ball(), samples=150, camera=camera).rgb) > 35


@cache
def unedited(contracted: bool):
    return sampled(ball(contracted), samples=200, camera=FEWER_PIXELS)


@pytest.mark.parametrize(("contracted", "name"), nightly_except(product([False, True], EDITS), *EVERY_RUN))
def test_edited_matches_the_plain_renderer(name, contracted):
    field, edits = ball(contracted), EDITS[name]
    renderer = VoxelRenderer(field, step=0.1).with_edits(edits)
    fused = renderer.render(FEWER_PIXELS, background="white")
    plain = sampled(field, edits, camera=FEWER_PIXELS)
    assert psnr(plain.rgb, unedited(contracted).rgb) < 30  # the edit shows
    # Jumps at cage faces are hit a fraction of a step apart; everything else agrees as without edits.
    assert psnr(fused.rgb, plain.rgb) > 42
    assert (np.abs(fused.opacity - plain.opacity) > 0.1).mean() < 0.01


@pytest.mark.parametrize("name", list(EDITS))
def test_deformed_occupancy_holds_all_density_and_is_tight(name):
    """No point with density lies in a block marked empty; the marked blocks are not many more."""
    field, edits = ball(), EDITS[name]
    occupied = VoxelRenderer(field, edits).occupancy
    rng = np.random.default_rng(0)
    low, high = np.minimum(-1, edits.bounds[0]), np.maximum(1, edits.bounds[1])
    p = rng.uniform(low, high, (60000, 3))
    c = edits.to_canonical(p)
    sigma, _ = field(c.points, np.tile([0.0, 0, 1], (len(p), 1)))
    sigma = np.where(c.emptied, 0, sigma)
    block = (np.floor(field.grid_coordinates(p)).astype(int) - occupied.origin) // 2
    inside = ((block >= 0) & (block < occupied.blocks.shape)).all(axis=1)
    assert not (sigma[~inside] > 0).any()
    marked = occupied.blocks[tuple(block[inside].T)]
    assert not (sigma[inside][~marked] > 0).any()
    # Tight: by volume, at most a block's layer more than what has density (a ball of 13 blocks across).
    assert marked.mean() < 2.2 * (sigma[inside] > 0).mean()


def test_normals_face_outwards_on_a_ball_and_follow_an_edit():
    field = ball(density=200.0)
    frame = VoxelRenderer(field, step=0.25).render(CAMERA, normals=True)
    origins, directions = CAMERA.rays()
    solid = (frame.opacity > 0.99).ravel()
    points = origins + directions * np.where(solid, frame.depth.ravel(), 0)[:, None]
    outward = points / np.maximum(np.linalg.norm(points, axis=1, keepdims=True), 1e-9)
    facing = (np.einsum("nc,nc->n", outward, directions) < -0.5) & solid
    cosine = np.einsum("nc,nc->n", outward, frame.normals.reshape(-1, 3))[facing]
    assert facing.sum() > 30
    assert cosine.min() > 0.97  # a soft ball on a grid of 49: within 14 degrees
    turned = EditStack(
        [Edit.continuous(Cage.box((0, 0, 0), 1.3), Cage.box((0, 0, 0), 1.9), shell=Trilinear()).scale(1.1)]
    )
    after = VoxelRenderer(field, turned, step=0.25).render(CAMERA, normals=True)
    both = (after.opacity.ravel() > 0.99) & facing
    assert np.einsum("nc,nc->n", outward, after.normals.reshape(-1, 3))[both].mean() > 0.97


def test_a_frame_can_be_abandoned_between_bands():
    calls = []

    def proceed() -> None:
        calls.append(1)
        if len(calls) > 1:
            raise InterruptedError

    camera = Camera.look_at((2.6, -1.9, 1.4), (0, 0, 0), width=40, height=80, fov_x=0.75)
    renderer = VoxelRenderer(ball())
    with pytest.raises(InterruptedError):
        renderer.render(camera, proceed=proceed)
    assert len(calls) == 2
    whole = renderer.render(camera)
    banded = renderer.render(camera, proceed=lambda: None)
    np.testing.assert_array_equal(whole.rgb, banded.rgb)


def test_a_distorted_camera_is_rendered_with_its_own_rays():
    field = ball()
    bent = Camera(
        c2w=CAMERA.c2w,
        width=40,
        height=32,
        fx=CAMERA.fx,
        fy=CAMERA.fy,
        cx=CAMERA.cx,
        cy=CAMERA.cy,
        model="opencv",
        distortion=(-0.5, 0.1, 0.02, 0.0),
    )
    fused = VoxelRenderer(field, step=0.1).render(bent, background="white")
    plain = render_sampled(field, bent, near=1.5, far=5.5, samples=600, background="white")
    assert psnr(fused.rgb, plain.rgb) > 50
    assert psnr(fused.rgb, sampled(field).rgb) < 40


@pytest.mark.parametrize("edited", nightly_after_first([False, True]))
def test_a_field_ends_at_its_grid(edited: bool) -> None:
    """The last bricks of 17 cells reach beyond the grid, where nothing is."""
    n = 18
    field = VoxelField(
        np.array([[-1.0] * 3, [1.0] * 3]),
        (n,) * 3,
        np.arange(n**3),
        np.full(n**3, 1.5, np.float32),
        np.full((n**3, 1, 3), 0.8, np.float32),
    )
    inner = Cage.box((0.4, 0.4, 0.4), 0.3)
    edits = EditStack(
        [Edit.continuous(inner, inner.grown(0.2), lattice=8).translate((0.05, 0.0, 0.0))] if edited else []
    )
    camera = Camera.look_at((3.0, 2.4, 1.8), (0.6, 0.5, 0.4), width=20, height=20, fov_x=0.5)
    frame = VoxelRenderer(field, edits, step=0.1).render(camera, background="black")
    oracle = render_sampled(field, camera, samples=1200, background="black", edits=edits)
    assert frame is not None and psnr(frame.rgb, oracle.rgb) > 45.0


FLOWS = tuple(
    Edit.continuous(Cage.box(center, inner), Cage.box(center, outer)).rotate(turn).translate(move)
    for center, inner, outer, turn, move in [
        ((-0.2, 0, 0.1), (0.5, 0.6, 0.6), (1.6, 1.6, 1.6), (0.1, 0.3, 0.2), (0, 0, 0)),
        ((0.4, 0, 0.1), (0.4, 0.5, 0.6), (1.3, 1.4, 1.5), (0, 0, 0), (0.15, 0.1, -0.1)),
    ]
)
"""Two flows that overlap, evaluated exactly."""


def drawn(*edits: Edit) -> np.ndarray:
    return VoxelRenderer(ball(), EditStack(edits)).render(CAMERA).rgb


def test_maps_interpolated_along_rays_show_each_sample_mapped_alone():
    # A discrete edit of empty space in the first one's box forbids interpolation.
    alone = drawn(Edit.delete(Cage.box((-0.95, -0.75, 0.85), 0.04)), *FLOWS)
    interpolated = drawn(*FLOWS)
    difference = np.abs(interpolated - alone)
    assert difference.max() < 0.01
    assert np.sqrt((difference**2).mean()) < 5e-4


def test_arcs_in_a_lattice_show_each_sample_mapped_alone():
    turned = FLOWS[0].replace(lattice=32).rotate((0.0, 0.2, 0.3))
    alone = drawn(Edit.delete(Cage.box((-0.95, -0.75, 0.85), 0.04)), turned)
    difference = np.abs(drawn(turned) - alone)
    assert difference.max() < 0.02
    assert np.sqrt((difference**2).mean()) < 7e-4
    assert np.sqrt(((drawn() - alone) ** 2).mean()) > 0.02  # the edit shows


def test_maps_are_interpolated_through_a_light_and_not_where_a_cut_reaches():
    far = Edit.delete(Cage.box((-0.9, 0.0, 0.0), 0.05))
    light = PreparedEdit(Edit.delete(Cage.box((-0.2, 0, 0.1), 1.6)), is_light=True)
    lit = DeviceStack.from_stack(PreparedStack([PreparedEdit(FLOWS[0], light=light)]))
    assert not lit.params[:, IS_CUT].any()
    # The cut lies in the first one's box, which the second one's reaches.
    cut = DeviceStack.from_stack(EditStack([far, *FLOWS]))
    assert cut.params[:, IS_CUT].all()


def lit_by(region: Cage, under: VoxelField) -> PreparedEdit:
    """A light: samples in the region read another field."""
    return PreparedEdit(Edit.delete(region), Patch(region, under), is_light=True)


@pytest.mark.parametrize(("size", "is_held"), [(1.9, True), (0.9, False)])
def test_lattices_and_moves_over_a_light_show_its_layer(size: float, is_held: bool):
    """The light holds all that the lattice moves, or a part of it; the move is in V or falls through."""
    field = ball()
    under = dataclasses.replace(field, sh=(0.2 * field.sh).astype(np.float32))
    inner = Cage.box((-0.2, 0, 0.1), (0.5, 0.6, 0.6))
    turned = Edit.continuous(inner, inner.grown(0.25), lattice=24).rotate((0.1, 0.3, 0.2))
    moved = Edit.move(Cage.box((0.3, 0, 0.2), 0.3)).translate((0.2, -0.1, 0.3))
    light = lit_by(Cage.box((0, 0, 0), size), under)
    stack = PreparedStack([PreparedEdit(turned, light=light), PreparedEdit(moved)])
    packed = DeviceStack.from_stack(stack).params
    assert packed[1, ALONE] == is_held
    assert packed[1, BASE_PLACE] == (stack.places[0] if is_held else 0)
    fused = VoxelRenderer(field, stack, step=0.1).render(FEWER_PIXELS, background="white")
    plain = sampled(field, stack, camera=FEWER_PIXELS)
    unlit = sampled(field, EditStack([turned, moved]), camera=FEWER_PIXELS)
    assert psnr(plain.rgb, unlit.rgb) < 30
    assert psnr(fused.rgb, plain.rgb) > 42


def test_a_light_leaves_the_occupancy_of_its_field():
    # Faces of the region lie on no vertex: some blocks are partly in it.
    field = ball()
    lit = VoxelRenderer(field, PreparedStack([lit_by(Cage.box((0.1, 0, 0), (0.93, 1.01, 0.71)), field)]))
    assert (lit.occupancy.blocks == occupancy.of_field(field).blocks).all()


def test_rays_step_over_no_cut_that_is_thinner_than_a_segment():
    # A slit of half a voxel's width, through a shell and what it holds.
    slit = Edit.delete(Cage.box((-0.2, 0.0, 0.1), (0.02, 1.2, 1.2)))
    side = Camera.look_at((4.0, 0, 0.1), (0, 0, 0.1), width=8, height=8, fov_x=0.1)
    cut = VoxelRenderer(ball(density=2.0), EditStack([slit, FLOWS[0]])).render(side)
    whole = VoxelRenderer(ball(density=2.0), EditStack([FLOWS[0]])).render(side)
    plain = sampled(ball(density=2.0), EditStack([slit, FLOWS[0]]), samples=1200, camera=side)
    lost, expected = ((whole.opacity - other.opacity).mean() for other in (cut, plain))
    assert expected > 0.005
    assert 0.75 < lost / expected < 1.25
