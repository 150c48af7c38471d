"""Fields as files for pages: what comes back of them, and what broken ones say."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from cagefield.cameras.camera import turntable
from cagefield.errors import FieldError
from cagefield.fields.voxel_field import VoxelField
from cagefield.images.metrics import psnr
from cagefield.pages.page_field import BRICK, FINEST, coarse_field, decode_page_field, encode_page_field
from cagefield.pages.page_file import pack, unpack
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from cagefield.scene.scene import Scene
from page_fields import lumps
from scenes import ball_field


@pytest.mark.nightly
def test_pictures_come_back() -> None:
    check_pictures(lumps(2, False))


@pytest.mark.nightly
def test_pictures_of_a_trained_field_come_back(trained_digger: Path) -> None:
    field = Scene.open(trained_digger).field
    assert isinstance(field, VoxelField)
    check_pictures(field)


def check_pictures(field: VoxelField) -> None:
    """Pictures before and after encoding are 45 dB alike."""
    back = decode_page_field(encode_page_field(field, step=0.7, background=(0.2, 0.4, 0.6)))
    assert (back.step, back.background) == (0.7, (0.2, 0.4, 0.6))
    ours, theirs = VoxelRenderer(field), VoxelRenderer(back.field)
    for camera in turntable(field.center, 3.0, 3, elevation=0.4, width=96, height=96, fov_x=0.8):
        first, second = ours.render(camera), theirs.render(camera)
        assert first is not None and second is not None
        assert psnr(first.rgb, second.rgb) >= 45.0
        assert psnr(first.opacity, second.opacity) >= 45.0


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize("contracted", [False, True])
def test_numbers_come_back_to_half_a_step(degree: int, contracted: bool) -> None:
    field = lumps(degree, contracted, resolution=(19, 16, 17))
    back = decode_page_field(encode_page_field(field)).field
    assert (back.resolution, back.contracted) == (field.resolution, contracted)
    np.testing.assert_array_equal(back.bounds, field.bounds)
    kept = np.isin(field.vertices, back.vertices)
    np.testing.assert_array_equal(back.vertices, field.vertices[kept])
    assert (field.density[~kept] <= 0.0).all()
    # A float16 has 11 bits.
    np.testing.assert_allclose(back.density, field.density[kept], rtol=2.0**-11)
    steps = np.maximum(np.abs(field.sh).max(axis=(0, 2)) / 127.0, FINEST)
    assert (np.abs(back.sh - field.sh[kept]).max(axis=(0, 2)) <= 0.5001 * steps).all()


def test_vertices_that_no_picture_shows_are_left_out() -> None:
    field = ball_field(resolution=17)
    padded = VoxelField(
        field.bounds,
        field.resolution,
        np.arange(17**3),
        np.where(np.isin(np.arange(17**3), field.vertices), 40.0, -1.0).astype(np.float32),
        np.zeros((17**3, 1, 3), np.float32),
    )
    back = decode_page_field(encode_page_field(padded)).field
    assert len(field.vertices) < len(back.vertices) < 17**3
    camera = turntable((0, 0, 0), 3.0, 1, elevation=0.3, width=48, height=48, fov_x=0.8)[0]
    ours, theirs = VoxelRenderer(padded).render(camera), VoxelRenderer(back).render(camera)
    assert ours is not None and theirs is not None
    # -1 and 40 are float16 numbers up to the unit, 0 is exact: what is left out is not seen.
    np.testing.assert_allclose(ours.opacity, theirs.opacity, atol=2e-3)


def test_the_coarse_level_keeps_what_light_goes_through() -> None:
    field = lumps(2, False, resolution=(97, 81, 65))
    coarse = coarse_field(field, 33)
    assert coarse.resolution == (33, 28, 22) and coarse.sh_degree == 0
    # The integral of the density: cells times their sum.
    total = np.maximum(field.density, 0.0).sum() * field.voxel_size.prod()
    assert coarse.density.sum() * coarse.voxel_size.prod() == pytest.approx(total, rel=1e-4)
    levels = decode_page_field(encode_page_field(field)).levels
    assert [max(level.resolution) for level in levels] == [64, 97]


def test_a_field_without_density_is_refused() -> None:
    field = ball_field()
    empty = VoxelField(field.bounds, field.resolution, field.vertices, -field.density, field.sh)
    with pytest.raises(FieldError, match="the field is empty"):
        encode_page_field(empty)


def test_cut_and_garbled_files_are_refused_in_a_line() -> None:
    whole = encode_page_field(ball_field())
    refused = 0
    for cut in range(0, len(whole), 7):
        with pytest.raises(FieldError) as caught:
            decode_page_field(whole[:cut])
        assert "\n" not in str(caught.value)
    rng = np.random.default_rng(0)
    for _ in range(200):
        bad = bytearray(whole)
        bad[int(rng.integers(len(bad)))] ^= 1 << int(rng.integers(8))
        try:
            back = decode_page_field(bytes(bad)).field
        except FieldError as error:
            refused += 1
            assert "\n" not in str(error)
        else:  # a bit of a number in the header: another field, but a valid one
            assert back.resolution == (17, 17, 17)
    assert refused > 100


def test_another_kind_and_another_version_say_so() -> None:
    whole = encode_page_field(ball_field())
    with pytest.raises(FieldError, match="not a field for pages"):
        decode_page_field(b"something else entirely")
    with pytest.raises(FieldError, match=r"version 7, this cagefield reads 1; update cagefield"):
        decode_page_field(whole[:8] + struct.pack("<I", 7) + whole[12:])
    other = pack(b"cagepage", 1, {"brick": BRICK + 1, "levels": []}, {})
    with pytest.raises(FieldError, match=f"bricks of {BRICK + 1} vertices"):
        decode_page_field(other)


def test_an_array_that_unpacks_to_more_than_it_says_is_refused() -> None:
    data = pack(b"somefile", 1, {}, {"a": np.zeros(1000, np.uint8)})
    assert unpack(data, b"somefile", 1, "a file")[1]["a"].shape == (1000,)
    with pytest.raises(FieldError, match="garbled"):
        unpack(data.replace(b'"shape":[1000]', b'"shape":[ 100]'), b"somefile", 1, "a file")
