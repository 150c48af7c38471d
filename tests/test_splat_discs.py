"""2DGS' discs: their oracle against rays that meet planes, their kernels against the oracle, files, edits."""

from __future__ import annotations

import dataclasses
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.cameras.lenses import Lens
from cagefield.edits import Edit, EditStack
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.splat_files import convert_splats, read_splats, write_splats
from cagefield.geometry.cage import Cage
from cagefield.rendering.splats.bake_splats import baked_splats
from cagefield.rendering.splats.raster_splats import deformed_splats
from cagefield.rendering.splats.rasterizer import near_depth
from cagefield.rendering.splats.reference_discs import FILTER, render_discs
from cagefield.rendering.splats.reference_raster_splats import deformed_splats_reference
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.typing import AnyArray
from tiers import nightly_except


def disc(size: float, turn: float) -> SplatField:
    """One disc at the origin, `size` and half of it wide, turned about x; opacity .8, gray of .5."""
    return SplatField(
        np.zeros((1, 3)), np.log([[size, 0.5 * size, 1e-3 * size]]),
        [[np.cos(turn / 2), np.sin(turn / 2), 0, 0]], [0.8], np.zeros((1, 1, 3)),
        bounds=np.array([[-1.0] * 3, [1.0] * 3]),
    )  # fmt: skip


def view(distance: float = 3.0) -> Camera:
    return Camera.look_at((0.1, 0.2, distance), (0, 0, 0), width=24, height=20, fov_x=0.7, up=(0, 1, 0))


def test_rays_meet_the_disc_where_planes_do() -> None:
    size, turn = 0.4, 1.2
    camera = view(1.5)
    origins, directions = (values.astype(np.float64).reshape(-1, 3) for values in camera.rays())
    normal = np.array([0.0, -np.sin(turn), np.cos(turn)])
    b = np.array([0.0, np.cos(turn), np.sin(turn)])
    hit = origins - directions * (origins @ normal / (directions @ normal))[:, None]
    square = (hit[:, 0] / size) ** 2 + (hit @ b / (0.5 * size)) ** 2
    alpha = 0.8 * np.exp(-0.5 * square)
    got = render_discs(disc(size, turn), camera, near=0.1, background="black").opacity.ravel()
    # Where the filter is not what shows: it reaches 2 pixels.
    clear = alpha > 0.02
    assert clear.sum() > 40
    np.testing.assert_allclose(got[clear], alpha[clear], atol=2e-5)


def test_a_distant_disc_is_a_dot_of_the_filter() -> None:
    camera = view()
    got = render_discs(disc(1e-4, 0.3), camera, near=0.1, background="black").opacity
    y, x = np.mgrid[:20, :24] + 0.5
    dot = 0.8 * np.exp(-0.25 * ((x - 12) ** 2 + (y - 10) ** 2) / FILTER)
    np.testing.assert_allclose(got, np.where(dot < 1 / 255, 0.0, dot), atol=1e-5)


def discs(kind: str, count: int = 300) -> SplatField:
    """A flat wall of discs, or a cloud of them in all directions."""
    rng = np.random.default_rng(3)
    scales = np.log(np.c_[rng.uniform(0.02, 0.25, (count, 2)), np.full(count, 1e-4)])
    means = rng.normal(0.0, 0.5, (count, 3)) * ((1, 1, 1) if kind == "cloud" else (1, 1, 0))
    turns = rng.normal(size=(count, 4)) * ((1, 1, 1, 1) if kind == "cloud" else (1, 0, 0, 1))
    return SplatField(
        means, scales, turns, rng.uniform(0.05, 1.0, count), rng.normal(0.0, 0.5, (count, 4, 3)),
        bounds=np.array([[-1.0] * 3, [1.0] * 3]), discs=True,
    )  # fmt: skip


def db(difference: AnyArray) -> float:
    return float(-10.0 * np.log10(np.mean(np.square(difference)) + 1e-12))


@pytest.mark.parametrize(
    ("kind", "angle"),
    nightly_except(
        product(["wall", "cloud"], [80, 30, 5, 1]), ("wall", 80), ("wall", 1), ("cloud", 30), ("cloud", 5)
    ),
)
def test_the_kernels_draw_what_the_oracle_does(kind: str, angle: float) -> None:
    field = discs(kind)
    a = np.radians(angle)
    camera = Camera.look_at(
        (0.1, -2.2 * np.cos(a), 2.2 * np.sin(a)), (0, 0, 0), width=75, height=50, fov_x=0.9, up=(0, 0, 1)
    )
    want = render_discs(field, camera, near=near_depth(field.bounds), background="black")
    got = SplatRenderer(field).render(camera, background="black", normals=True)
    assert got is not None and got.normals is not None
    assert db(got.rgb - want.rgb) > 70.0
    clear = want.opacity > 0.5
    np.testing.assert_allclose(got.depth[clear], want.depth[clear], rtol=2e-3)
    facing = (got.normals * camera.rays()[1].reshape(50, 75, 3)).sum(axis=-1)
    assert (facing[clear] < 0.05).all()
    # The local affine approximation is another picture.
    flat = SplatRenderer(dataclasses.replace(field, discs=False)).render(camera, background="black")
    assert flat is not None and db(flat.rgb - want.rgb) < 50.0


def test_discs_around_the_camera_and_in_a_part_of_the_picture() -> None:
    field = discs("cloud")
    camera = Camera.look_at((0.1, 0.0, 0.1), (1, 1, 0), width=64, height=48, fov_x=1.2, up=(0, 0, 1))
    want = render_discs(field, camera, near=near_depth(field.bounds), background="black")
    renderer = SplatRenderer(field)
    got = renderer.render(camera, background="black")
    part = renderer.render(camera, background="black", region=(20, 5, 33, 30))
    assert got is not None and part is not None
    assert db(got.rgb - want.rgb) > 60.0
    np.testing.assert_allclose(part.rgb, got.rgb[5:35, 20:53], atol=2e-5)
    np.testing.assert_allclose(part.depth, got.depth[5:35, 20:53], rtol=1e-4)


@pytest.mark.parametrize(
    ("model", "distortion"), [("opencv", (-0.1, 0.02, 0.001, -0.002)), ("opencv_fisheye", (0.02, 0.01, 0, 0))]
)
def test_lenses_are_taken_to_be_affine_around_each_disc(model: Lens, distortion: tuple[float, ...]) -> None:
    field = discs("wall")
    field = dataclasses.replace(field, log_scales=field.log_scales - 1.0)
    c = Camera.look_at((0.3, -1.6, 1.2), (0, 0, 0), width=80, height=60, fov_x=0.9, up=(0, 0, 1))
    camera = dataclasses.replace(c, model=model, distortion=distortion)
    want = render_discs(field, camera, near=near_depth(field.bounds), background="black")
    got = SplatRenderer(field).render(camera, background="black")
    assert got is not None and db(got.rgb - want.rgb) > 45.0


def test_opacity_gathers_up_to_where_rays_meet_discs() -> None:
    size, turn = 0.4, 1.2
    camera = view(1.5)
    field = dataclasses.replace(disc(size, turn), discs=True)
    renderer = SplatRenderer(field)
    frame = renderer.render(camera)
    assert frame is not None
    rows, columns = np.nonzero(frame.opacity > 0.3)
    pixels, depth = np.c_[columns, rows] + 0.5, frame.depth[rows, columns]
    assert len(pixels) > 20
    np.testing.assert_allclose(
        renderer.opacity_before(camera, pixels, 1.01 * depth), frame.opacity[rows, columns], atol=1e-4
    )
    assert (renderer.opacity_before(camera, pixels, 0.99 * depth) == 0.0).all()


def test_edits_carry_tangents_and_bake_into_discs() -> None:
    field = discs("cloud")
    cage = Cage.box((0.0, 0.0, 0.0), 0.6)
    edits = EditStack([Edit.continuous(cage, cage.grown(0.6)).rotate((0.0, 0.4, 0.3)).scale((1.3, 1.0, 0.9))])
    for got in (deformed_splats(field, edits), deformed_splats_reference(field, edits)):
        assert got.tangents is not None
    want = deformed_splats_reference(field, edits)
    mine = deformed_splats(field, edits)
    order, theirs = (np.lexsort(np.round(s.means, 4).T) for s in (mine, want))
    assert mine.tangents is not None and want.tangents is not None
    np.testing.assert_allclose(mine.tangents[order], want.tangents[theirs], atol=2e-4)
    camera = Camera.look_at((0.5, -2.5, 1.0), (0, 0, 0), width=75, height=50, fov_x=0.9, up=(0, 0, 1))
    edited = SplatRenderer(field, edits).render(camera)
    baked = baked_splats(field, edits)
    assert baked.discs
    again = SplatRenderer(dataclasses.replace(baked, bounds=field.bounds)).render(camera)
    assert edited is not None and again is not None and db(edited.rgb - again.rgb) > 55.0


def test_files_and_scenes_say_that_splats_are_discs(tmp_path: Path) -> None:
    field = discs("cloud", 50)
    write_splats(field, tmp_path / "a.ply")
    assert b"SplatRenderMode: 2dgs" in (tmp_path / "a.ply").read_bytes()[:200]
    assert read_splats(tmp_path / "a.ply").discs
    convert_splats(tmp_path / "a.ply", tmp_path / "b.compressed.ply")
    assert read_splats(tmp_path / "b.compressed.ply").discs
    field.save(tmp_path / "f.safetensors")
    assert SplatField.load(tmp_path / "f.safetensors").discs
    with pytest.warns(UserWarning, match="discs"):
        convert_splats(tmp_path / "a.ply", tmp_path / "c.spz")
    assert not read_splats(tmp_path / "c.spz").discs
