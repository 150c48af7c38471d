"""Parts of pictures, and the coarse occupancy of edits that are being dragged."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.compute import devices
from cagefield.edits import Edit, EditStack
from cagefield.errors import CagefieldError
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.rendering.voxels.occupancy import FEW, Occupancy, encode, masks_of
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from scenes import ball_field

CAMERA = Camera.look_at((0, -3, 0.8), (0, 0, 0), width=37, height=29, fov_x=0.8)
INNER = Cage.box((0, 0, 0), 1.2)
EDITS = {
    "continuous": [
        Edit.continuous(INNER, INNER.grown(0.6), lattice=16).rotate((0.3, 0.2, 0.5)).translate((0.1, 0, 0))
    ],
    "squeezed": [Edit.continuous(INNER, INNER.grown(0.4), lattice=16).scale(0.4)],
    "copy": [Edit.copy(INNER).rotate((0.3, 0, 0)).translate((0, 0.9, 0.9))],
    "two": [
        Edit.continuous(INNER, INNER.grown(0.4), lattice=16).translate((0.2, 0, 0)),
        Edit.move(INNER).translate((0, 0.9, 0.9)),
    ],
}


@pytest.fixture(scope="module")
def plain() -> VoxelRenderer:
    devices.start()
    return VoxelRenderer(ball_field(resolution=33))


@pytest.mark.parametrize("region", [(0, 0, 37, 29), (5, 3, 20, 17), (36, 28, 1, 1), (0, 8, 37, 8)])
def test_a_region_is_that_part_of_the_picture(
    plain: VoxelRenderer, region: tuple[int, int, int, int]
) -> None:
    whole, part = plain.render(CAMERA, normals=True), plain.render(CAMERA, normals=True, region=region)
    assert whole is not None and part is not None and whole.normals is not None
    x, y, width, height = region
    rows, columns = slice(y, y + height), slice(x, x + width)
    np.testing.assert_array_equal(part.rgb, whole.rgb[rows, columns])
    np.testing.assert_array_equal(part.depth, whole.depth[rows, columns])
    np.testing.assert_array_equal(part.normals, whole.normals[rows, columns])


@pytest.mark.parametrize("region", [(30, 0, 8, 8), (0, -1, 4, 4), (0, 0, 0, 5), (0, 25, 5, 5)])
def test_a_region_outside_the_picture_is_refused(
    plain: VoxelRenderer, region: tuple[int, int, int, int]
) -> None:
    with pytest.raises(CagefieldError, match="is not inside the picture of 37x29 pixels"):
        plain.render(CAMERA, region=region)


def test_bands_of_a_region_are_the_region(plain: VoxelRenderer) -> None:
    looked = []

    def proceed() -> None:
        looked.append(1)

    part = plain.render(CAMERA.resized(90, 90), region=(10, 10, 70, 75), proceed=proceed)
    whole = plain.render(CAMERA.resized(90, 90))
    assert part is not None and whole is not None and len(looked) == 3  # 10 rows of tiles, 4 a band
    np.testing.assert_array_equal(part.rgb, whole.rgb[10:85, 10:80])


@pytest.mark.parametrize("name", EDITS)
def test_the_coarse_occupancy_holds_the_fine_one_and_shows_the_same(plain: VoxelRenderer, name: str) -> None:
    stack = EditStack(EDITS[name])
    fine, coarse = plain.with_edits(stack), plain.with_edits(stack, coarse=True)
    assert (coarse.occupancy.blocks >= fine.occupancy.blocks).all()
    pictures = [renderer.render(CAMERA) for renderer in (fine, coarse)]
    assert pictures[0] is not None and pictures[1] is not None
    assert pictures[0].opacity.max() > 0.9
    np.testing.assert_array_equal(pictures[0].rgb, pictures[1].rgb)


@pytest.mark.parametrize("seed", [0, 2])
def test_the_coarse_occupancy_holds_what_is_squeezed_strongly(seed: int) -> None:
    devices.start()
    dots = np.random.default_rng(seed).integers(21, 76, (12, 3))
    field = VoxelField(
        bounds=np.array([[-1.0] * 3, [1.0] * 3]),
        resolution=(97, 97, 97),
        vertices=np.unique(dots @ [97 * 97, 97, 1]),
        density=np.full(12, 50.0, np.float32),
        sh=np.zeros((12, 1, 3), np.float32),
    )
    plain = VoxelRenderer(field)
    stack = EditStack([Edit.continuous(INNER, Cage.box((0, 0, 0), 1.6), lattice=48).scale(0.15)])
    fine, coarse = plain.with_edits(stack), plain.with_edits(stack, coarse=True)
    assert fine.occupancy.blocks.sum() > 50
    assert (coarse.occupancy.blocks >= fine.occupancy.blocks).all()


def test_short_leaps_are_long_ones_cut_off() -> None:
    masks = masks_of(np.random.default_rng(0).random((24, 20, 28)) > 0.997)
    codes, short = encode(masks), encode(masks, FEW)
    empty = codes >= 256
    np.testing.assert_array_equal(short[~empty], codes[~empty])
    np.testing.assert_array_equal(short[empty] // 256, np.minimum(codes[empty] // 256, FEW))
    assert (encode(np.zeros((2, 2, 2), np.uint8), FEW) == 256 * FEW).all()


def test_an_occupancy_gives_its_blocks_back() -> None:
    blocks = np.random.default_rng(1).random((24, 20, 28)) > 0.9
    occupancy = Occupancy.from_masks(np.zeros(3, np.int64), masks_of(blocks))
    np.testing.assert_array_equal(occupancy.blocks, blocks)
    np.testing.assert_array_equal(occupancy.masks > 0, occupancy.codes < 256)


def test_the_opacity_choice_is_the_renderers_own(plain: VoxelRenderer) -> None:
    stack = EditStack(EDITS["squeezed"])
    kept, asked = plain.with_edits(stack), plain.with_edits(stack, preserve_opacity=False)
    assert (kept.preserve_opacity, asked.preserve_opacity) == (True, False)
    assert not asked.with_edits(EditStack([])).preserve_opacity
