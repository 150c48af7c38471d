"""Selections of a field's elements: regions of the screen, neighborhoods, attributes, floaters."""

from __future__ import annotations

import colorsys
import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.edits import Edit, EditStack
from cagefield.errors import CagefieldError, FieldError
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.rendering.renderers import renderer_of
from cagefield.selection import Elements, Selection
from cagefield.selection.brush_and_lasso import Lasso, Rectangle, Stroke, elements_in_region
from cagefield.selection.element_positions import deformed_positions
from cagefield.selection.elements import ATTRIBUTES, histogram
from cagefield.selection.field_elements import MAX_GRID_CELLS, elements_of_field, without_elements
from cagefield.selection.floater_preset import floaters
from cagefield.selection.neighborhoods import flood, grow, interior, shrink
from scenes import ball_field
from solid_fields import solid_field
from splat_scenes import ball_of_splats, random_splats


def cubes(side: int = 33) -> VoxelField:
    """Two opaque cubes, red at x < 0 and blue at x > 0, 6 voxels apart, in the cube [-1, 1]^3."""
    solid = np.zeros((side,) * 3, bool)
    solid[5:13, 10:18, 10:18] = True
    solid[19:27, 10:18, 10:18] = True
    rgb = np.zeros((side,) * 3 + (3,))
    rgb[: side // 2, ..., 0] = 0.9
    rgb[side // 2 :, ..., 2] = 0.9
    return solid_field(solid, rgb)


def front_camera(side: int = 120) -> Camera:
    return Camera.look_at((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), width=side, height=side, fov_x=0.8)


# ---- elements ----


def test_elements_of_voxels_are_the_dense_vertices() -> None:
    field = ball_field()
    elements = elements_of_field(field)
    assert len(elements) == len(field.vertices) and elements.kind == "cells"
    index = np.stack(np.unravel_index(field.vertices, field.resolution), axis=1)
    np.testing.assert_allclose(elements.positions, index / 8.0 - 1.0, atol=1e-6)
    np.testing.assert_allclose(elements.rgb, np.tile([0.9, 0.2, 0.1], (len(elements), 1)), atol=1e-5)
    # A ray across a cell of edge 1/8 and density 40.
    np.testing.assert_allclose(elements.opacities, 1.0 - np.exp(-5.0), atol=1e-6)
    assert elements is elements_of_field(field)


def test_fine_voxels_share_cells() -> None:
    side = 2 * MAX_GRID_CELLS
    linear = np.ravel_multi_index(np.array([[0, 0, 0], [1, 1, 1], [2, 0, 0]]).T, (side, 8, 8))
    density = np.array([50.0, 100.0, 200.0], np.float32)
    sh = np.array([[[1.0, 0, 0]], [[0, 0, 0]], [[0, 0, 0]]], np.float32)
    field = VoxelField(np.array([[0.0] * 3, [side - 1.0, 7.0, 7.0]]) / 100, (side, 8, 8), linear, density, sh)
    elements = elements_of_field(field)
    np.testing.assert_array_equal(elements.cells, [[0, 0, 0], [1, 0, 0]])
    np.testing.assert_allclose(elements.positions, [[0.005] * 3, [0.025, 0.005, 0.005]], atol=1e-7)
    # The mean of (.5 + C0, .5, .5) and gray, weighted by 50 and 100.
    assert elements.rgb[0, 0] == pytest.approx(0.5 + 0.28209479 / 3.0, abs=1e-5)
    assert elements.opacities[0] == pytest.approx(1.0 - np.exp(-2.0 * 100.0 * 0.01), abs=1e-5)


def test_cells_of_a_contracted_field_are_at_their_world_positions() -> None:
    field = ball_field()
    contracted = VoxelField(field.bounds, field.resolution, field.vertices, field.density, field.sh, True)
    elements = elements_of_field(contracted)
    np.testing.assert_allclose(
        contracted.grid_coordinates(elements.positions),
        np.stack(np.unravel_index(field.vertices, field.resolution), axis=1),
        atol=1e-4,
    )


def test_elements_of_splats() -> None:
    field = random_splats(50)
    elements = elements_of_field(field)
    assert elements.kind == "splats" and len(elements) == 50
    np.testing.assert_array_equal(elements.positions, field.means)
    np.testing.assert_allclose(elements.sizes, field.scales.max(axis=1))
    inside = elements.in_grid
    assert 0 < inside.sum() < 50  # bounds hold the central 98 %
    at = elements.occupancy[tuple(elements.cells[inside].T)]
    # A cell is at least as opaque as the splat whose mean it holds, as far as that is at a sample.
    assert (at >= 0.6 * np.minimum(field.opacities[inside], 0.999)).all()
    assert elements.occupancy.max() <= 1.0


def test_wide_splats_occupy_the_cells_that_they_cover() -> None:
    wide = SplatField(
        np.array([[0.0, 0, 0], *np.full((20, 3), 0.9)]),
        np.log(np.array([[0.3, 0.3, 0.003], *np.full((20, 3), 0.01)])),
        np.tile([1.0, 0, 0, 0], (21, 1)),
        np.full(21, 0.9),
        np.zeros((21, 1, 3)),
        bounds=np.array([[-1.0] * 3, [1.0] * 3]),
    )
    elements = elements_of_field(wide)
    occupied = np.argwhere(elements.occupancy > 0.2)
    center = occupied * elements.cell_edge - 1.0 + 0.5 * elements.cell_edge
    disc = center[np.abs(center[:, 2]) < 0.1]
    assert 0.35 < np.linalg.norm(disc[:, :2], axis=1).max() < 0.5  # to 1.5 standard deviations


def test_another_field_is_refused() -> None:
    with pytest.raises(FieldError, match="bake the field first"):
        elements_of_field(FakeField())  # type: ignore[arg-type]


class FakeField:
    """Neither splats nor voxels."""


def test_hue_saturation_and_value() -> None:
    field = random_splats(200, degree=0)
    elements = elements_of_field(field)
    expected = [colorsys.rgb_to_hsv(*(float(c) for c in rgb)) for rgb in elements.rgb]
    for n, name in enumerate(("hue", "saturation", "value")):
        np.testing.assert_allclose(elements.attribute(name), [e[n] for e in expected], atol=2e-6)  # type: ignore[arg-type]


def test_histograms_count_every_element() -> None:
    elements = elements_of_field(random_splats(300))
    selected = elements.in_range("opacity", 0.0, 0.5)
    for name in ATTRIBUTES:
        found = histogram(elements, name, selected)
        assert sum(found.counts) == 300 and sum(found.selected) == selected.sum()
    sizes = histogram(elements, "size", selected)
    assert sizes.low == pytest.approx(elements.sizes.min()) and sizes.high == pytest.approx(
        elements.sizes.max()
    )
    assert elements.in_range("size", sizes.low, sizes.high).all()


def test_ranges() -> None:
    elements = elements_of_field(random_splats(300))
    mask = elements.in_range("size", 0.1, 0.2)
    np.testing.assert_array_equal(mask, (elements.sizes >= 0.1) & (elements.sizes <= 0.2))
    with pytest.raises(CagefieldError, match=r"low <= high, got 0\.5 to 0\.2"):
        elements.in_range("opacity", 0.5, 0.2)
    with pytest.raises(CagefieldError, match="low <= high"):
        elements.in_range("opacity", float("nan"), 0.2)
    with pytest.raises(CagefieldError, match='attribute "weight" must be one of size, opacity'):
        elements.attribute("weight")  # type: ignore[arg-type]


# ---- the value ----


def test_modes_of_selections() -> None:
    chance = np.random.default_rng(0)
    a, b = chance.random((2, 1001)) < 0.4
    first, second = Selection.from_mask(a), Selection.from_mask(b)
    assert first.count == a.sum() and len(first.bits) < 300 and first == Selection.from_mask(a.copy())
    for mode, expected in (("replace", b), ("add", a | b), ("subtract", a & ~b), ("intersect", a & b)):
        np.testing.assert_array_equal(first.combine(second, mode).mask, expected)  # type: ignore[arg-type]
    np.testing.assert_array_equal(first.inverse.mask, ~a)
    assert not Selection.none(7) and Selection.none(7).total == 7
    with pytest.raises(CagefieldError, match="selection of 1001 elements does not fit one of 7"):
        Selection.none(7).combine(first, "add")
    with pytest.raises(CagefieldError, match="mode"):
        first.combine(second, "xor")  # type: ignore[arg-type]


# ---- regions of the screen ----


def test_rasters_of_regions() -> None:
    width, height = 90, 60
    y, x = np.mgrid[0:height, 0:width] + 0.5
    rectangle = Rectangle((0.8, 0.7), (0.2, 0.1)).raster(width, height)
    np.testing.assert_array_equal(rectangle, (x >= 18) & (x <= 72) & (y >= 6) & (y <= 42))
    triangle = Lasso(((0.1, 0.1), (0.9, 0.1), (0.1, 0.9))).raster(width, height)
    inside = (x > 9) & (y > 6) & ((x - 9) / 72 + (y - 6) / 48 < 1.0)
    assert (triangle != inside).sum() <= 2
    # Even-odd: the middle of a pentagram, wound twice, is outside.
    star = [(0.5 + 0.4 * np.sin(a), 0.5 - 0.4 * np.cos(a)) for a in 4 * np.pi / 5 * np.arange(5)]
    drawn = Lasso(star).raster(60, 60)
    assert not drawn[30, 30] and drawn[10, 30]
    stroke = Stroke(((0.2, 0.5), (0.8, 0.5)), 0.1).raster(width, height)
    distance = np.hypot(np.maximum(np.maximum(18 - x, x - 72), 0.0), y - 30)
    assert not stroke[distance > 7.5].any() and stroke[distance < 5.0].all()


def test_regions_that_cannot_be() -> None:
    with pytest.raises(CagefieldError, match="a lasso has 3 to 4096 points, got 2"):
        Lasso(((0, 0), (1, 1)))
    with pytest.raises(CagefieldError, match="shares of the image from -10 to 10"):
        Rectangle((0, 0), (float("nan"), 1))
    with pytest.raises(CagefieldError, match="radius"):
        Stroke(((0, 0),), 0.0)


@pytest.mark.parametrize("field", [ball_field(60.0, 33), ball_of_splats(1500)], ids=["voxels", "splats"])
def test_only_the_visible_surface_is_picked(field: VoxelField | SplatField) -> None:
    """Of a ball, the half that faces the camera; through it, all of it."""
    elements = elements_of_field(field)
    camera = front_camera()
    frame = renderer_of(field).render(camera)
    depth = np.where(frame.opacity > 0.5, frame.depth, np.inf).astype(np.float32)
    seen = deformed_positions(elements.positions, EditStack())
    everything = Rectangle((0.0, 0.0), (1.0, 1.0))
    tolerance = np.full(len(elements), 2.0 * elements.cell_edge)
    visible = elements_in_region(everything, camera, seen, len(elements), depth=depth, tolerance=tolerance)
    through = elements_in_region(everything, camera, seen, len(elements))
    assert through.all()
    front = elements.positions[:, 1] < 0.0
    shell = np.linalg.norm(elements.positions, axis=1) > 0.42
    facing = elements.positions @ (camera.origin / 3.0) > 0.4
    assert visible[shell & facing].mean() > 0.97
    assert not visible[~front & (elements.positions[:, 1] > 0.2)].any()


def test_a_region_picks_where_edits_show_elements() -> None:
    field = cubes()
    elements = elements_of_field(field)
    red = elements.positions[:, 0] < 0.0
    cage = Cage.box(elements.positions[red].mean(axis=0), 0.7)
    camera = front_camera()
    up = (0.0, 0.0, 0.8)

    def picked(edit: Edit, z: float) -> NDArray[np.bool_]:
        """Elements seen around the red cube's place, `z` higher."""
        seen = deformed_positions(elements.positions, EditStack([edit]))
        place = Cage.box(cage.center + np.array([0.0, 0.0, z]), 0.6)
        corners = camera.project(place.corners)[0] / camera.width
        region = Rectangle(tuple(corners.min(axis=0)), tuple(corners.max(axis=0)))
        return elements_in_region(region, camera, seen, len(elements))

    move, copy = Edit.move(cage).translate(up), Edit.copy(cage).translate(up)
    assert picked(move, 0.8)[red].all() and not picked(move, 0.0)[red].any()
    assert picked(copy, 0.8)[red].all() and picked(copy, 0.0)[red].all()
    assert not picked(Edit.delete(cage), 0.0)[red].any()
    continuous = Edit.continuous(cage, cage.grown((0.02, 0.2, 0.9))).translate((0.0, 0.0, 0.5))
    assert picked(continuous, 0.5)[red].all()
    assert not picked(move, 0.8)[~red].any()


def test_depth_of_another_size_is_refused() -> None:
    elements = elements_of_field(ball_field())
    seen = deformed_positions(elements.positions, EditStack())
    with pytest.raises(CagefieldError, match=r"depth must be \[120, 120\]"):
        elements_in_region(
            Rectangle((0, 0), (1, 1)), front_camera(), seen, len(elements), depth=np.zeros((2, 2), np.float32)
        )


# ---- neighborhoods ----


def in_cube(elements: Elements, low: int, high: int) -> NDArray[np.bool_]:
    return np.asarray(((elements.cells >= low) & (elements.cells < high)).all(axis=1))


def test_growing_and_shrinking_in_a_solid_cube() -> None:
    field = solid_field(np.ones((20,) * 3, bool), np.full((20, 20, 20, 3), 0.5))
    elements = elements_of_field(field)
    core = in_cube(elements, 8, 12)
    np.testing.assert_array_equal(grow(elements, core), in_cube(elements, 7, 13))
    np.testing.assert_array_equal(grow(elements, core, 3), in_cube(elements, 5, 15))
    np.testing.assert_array_equal(shrink(elements, core), in_cube(elements, 9, 11))
    np.testing.assert_array_equal(shrink(elements, grow(elements, core)), core)
    np.testing.assert_array_equal(interior(elements, core), in_cube(elements, 9, 11))
    everything = np.ones(len(elements), bool)
    np.testing.assert_array_equal(shrink(elements, everything), everything)
    with pytest.raises(CagefieldError, match="1 cell or more"):
        grow(elements, core, 0)


def test_a_flood_stays_on_its_object() -> None:
    elements = elements_of_field(cubes())
    red = elements.positions[:, 0] < 0.0
    seed = elements.nearest(np.array([-0.4, -0.1, -0.1]))
    np.testing.assert_array_equal(flood(elements, seed), red)
    bounded = flood(elements, seed, reach=0.2)
    distance = np.linalg.norm(elements.positions - elements.positions[seed], axis=1)
    np.testing.assert_array_equal(bounded, red & (distance <= 0.2 + 1e-6))
    with pytest.raises(CagefieldError, match="threshold"):
        flood(elements, seed, threshold=0.0)
    with pytest.raises(CagefieldError, match="reach"):
        flood(elements, seed, reach=0.0)


def test_a_flood_over_splats() -> None:
    near, far = ball_of_splats(800, 0.25), ball_of_splats(800, 0.25)
    both = SplatField(
        np.concatenate([near.means, far.means + np.float32([0.7, 0.0, 0.0])]),
        *(np.tile(getattr(near, name), (2, *[1] * (getattr(near, name).ndim - 1))) for name in
          ("log_scales", "quaternions", "opacities", "sh")),
        bounds=np.array([[-1.0] * 3, [1.0] * 3]),
    )  # fmt: skip
    elements = elements_of_field(both)
    found = flood(elements, 0)
    assert found[:800].all() and not found[800:].any()


# ---- floaters ----


def cubes_with_specks(scale: float = 1.0) -> VoxelField:
    solid = np.zeros((40,) * 3, bool)
    solid[10:30, 10:30, 10:30] = True
    solid[2, 2, 2] = solid[35, 35, 35] = True
    return solid_field(solid, np.full((40, 40, 40, 3), 0.5), scale)


def test_floaters_of_voxels_have_no_scale() -> None:
    elements = elements_of_field(cubes_with_specks())
    specks = ~in_cube(elements, 10, 30)
    assert specks.sum() == 2
    np.testing.assert_array_equal(floaters(elements), specks)
    larger = elements_of_field(cubes_with_specks(1000.0))
    np.testing.assert_array_equal(floaters(larger), floaters(elements))


def splats_with_floaters(scale: float = 1.0) -> tuple[SplatField, NDArray[np.bool_]]:
    """A ball of splats, 5 lone splats away from it, 5 large and faint ones at it, and which these are."""
    ball = ball_of_splats(3000)
    lone = np.array([[0.9, 0.9, 0.9], [-0.9, 0.9, 0.2], [0.9, -0.9, 0], [-0.9, 0, -0.9], [0, 0.9, -0.9]])
    veil = 0.55 * np.eye(3)[[0, 1, 2, 0, 1]] * np.array([1, 1, 1, -1, -1])[:, None]
    extra = np.concatenate([lone, veil])
    widths = np.log(np.repeat([[0.02], [0.4]], 5, axis=0) * np.ones(3))
    opacities = np.repeat([0.9, 0.03], 5)
    field = SplatField(
        scale * np.concatenate([ball.means, extra]),
        np.concatenate([ball.log_scales, widths]) + np.log(scale),
        np.concatenate([ball.quaternions, np.tile([1.0, 0, 0, 0], (10, 1))]),
        np.concatenate([ball.opacities, opacities]),
        np.concatenate([ball.sh, np.zeros((10, 1, 3))]),
        bounds=scale * np.array([[-1.0] * 3, [1.0] * 3]),
    )
    return field, np.arange(3010) >= 3000


def test_floaters_of_splats() -> None:
    field, expected = splats_with_floaters()
    found = floaters(elements_of_field(field))
    np.testing.assert_array_equal(found, expected)
    large, _ = splats_with_floaters(250.0)
    np.testing.assert_array_equal(floaters(elements_of_field(large)), expected)


def test_strength_of_floaters_is_monotone() -> None:
    elements = elements_of_field(random_splats(400))
    masks = [floaters(elements, strength) for strength in np.linspace(0.0, 1.0, 6)]
    assert all((~before | after).all() for before, after in itertools.pairwise(masks))
    with pytest.raises(CagefieldError, match=r"strength of floaters lies in \[0, 1\], not 2"):
        floaters(elements, 2.0)


# ---- fields without elements ----


def test_a_field_without_elements() -> None:
    field = cubes()
    elements = elements_of_field(field)
    red = elements.positions[:, 0] < 0.0
    rest = without_elements(field, elements, red)
    camera = front_camera()
    image = renderer_of(rest).render(camera, background="black").rgb
    assert image[..., 0].max() < 0.05 and image[..., 2].max() > 0.8
    # The blue half is what it was.
    before = renderer_of(field).render(camera, background="black").rgb
    np.testing.assert_allclose(image[:, 62:], before[:, 62:], atol=1e-6)
    splats = ball_of_splats(100)
    kept = without_elements(splats, elements_of_field(splats), np.arange(100) < 30)
    assert isinstance(kept, SplatField) and len(kept) == 70
    with pytest.raises(FieldError, match="leave something"):
        without_elements(field, elements, np.ones(len(elements), bool))
