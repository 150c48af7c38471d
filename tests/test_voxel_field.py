"""VoxelField: interpolation, files, errors; the contraction of unbounded space."""

from __future__ import annotations

import json

import numpy as np
import pytest

from cagefield.errors import FieldError
from cagefield.fields.contraction import contract, uncontract
from cagefield.fields.voxel_field import VoxelField

BOUNDS = np.array([[-1.0, -0.5, 0.0], [1.0, 0.5, 2.0]])


def linear_field(degree: int = 1, contracted: bool = False) -> VoxelField:
    """Density 3 + x + 2y - z and color coefficients linear in position: interpolation is exact on them."""
    n = (5, 4, 6)
    bounds = np.array([[-1.0] * 3, [1.0] * 3]) if contracted else BOUNDS
    grid = np.array([[-2.0] * 3, [2.0] * 3]) if contracted else bounds
    axes = [np.linspace(grid[0, a], grid[1, a], n[a]) for a in range(3)]
    p = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    terms = (degree + 1) ** 2
    sh = 0.05 * (p @ np.ones((3, terms * 3)) + np.arange(terms * 3)).reshape(-1, terms, 3) / terms
    return VoxelField(bounds, n, np.arange(len(p)), 7 + p @ [1.0, 2.0, -1.0], sh, contracted)


def test_trilinear_interpolation_is_exact_on_linear_data():
    rng = np.random.default_rng(0)
    p = rng.uniform(BOUNDS[0], BOUNDS[1], (50, 3))
    d = rng.normal(size=(50, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    sigma, rgb = linear_field()(p, d)
    np.testing.assert_allclose(sigma, 7 + p @ [1.0, 2.0, -1.0], rtol=1e-5)  # float32 storage
    # The SH basis is degree 1: C0, then C1 * (-y, z, -x).
    basis = np.stack(
        [np.full(50, 0.2820948), -0.4886025 * d[:, 1], 0.4886025 * d[:, 2], -0.4886025 * d[:, 0]], 1
    )
    coefficients = 0.05 * (p.sum(1)[:, None] + np.arange(12)).reshape(50, 4, 3) / 4
    expected = np.clip(0.5 + np.einsum("nl,nlc->nc", basis, coefficients), 0, 1)
    np.testing.assert_allclose(rgb, expected, atol=1e-5)


def test_sigma_is_zero_outside_and_where_nothing_is_stored():
    field = linear_field()
    outside = np.array([[1.01, 0, 1], [0, 0.51, 1], [0, 0, -0.01]])
    assert (field(outside, np.tile([0.0, 0, 1], (3, 1)))[0] == 0).all()
    half = VoxelField(BOUNDS, field.resolution, field.vertices[:1], field.density[:1], field.sh[:1])
    assert half(np.array([[0.9, 0.4, 1.9]]), np.array([[0.0, 0, 1]]))[0] == 0


def test_contracted_field_reaches_far_positions():
    field = linear_field(contracted=True)
    far = np.array([[0.0, 0.0, 40.0], [-3.0, 1.0, 0.5]])
    sigma, _ = field(far, np.tile([0.0, 0, 1], (2, 1)))
    c = contract(far)
    np.testing.assert_allclose(sigma, 7 + c @ [1.0, 2.0, -1.0], rtol=1e-5)


def test_contraction_keeps_the_box_of_interest_and_inverts():
    rng = np.random.default_rng(1)
    inner = rng.uniform(-1, 1, (100, 3))
    assert (contract(inner) == inner).all()
    outer = rng.normal(size=(200, 3)) * 10
    c = contract(outer)
    assert (np.abs(c) < 2).all()
    np.testing.assert_allclose(uncontract(c), outer, rtol=1e-9)
    # mip-NeRF 360, equation 10 with the max norm: (2 - 1/m) p / m.
    np.testing.assert_allclose(contract(np.array([[4.0, 2.0, 0.0]])), [[1.75, 0.875, 0.0]])


def test_file_round_trip_is_exact(tmp_path):
    field = linear_field(2)
    field.save(tmp_path / "f.safetensors")
    again = VoxelField.load(tmp_path / "f.safetensors")
    for name in ("bounds", "vertices", "density", "sh"):
        np.testing.assert_array_equal(getattr(again, name), getattr(field, name))
    assert again.resolution == field.resolution
    assert again.sh_degree == 2
    assert again.contracted is False


def test_a_file_may_be_read_by_whom_other_new_files_may(tmp_path):
    (tmp_path / "other").touch()
    linear_field(1).save(tmp_path / "field.safetensors")
    assert (tmp_path / "field.safetensors").stat().st_mode == (tmp_path / "other").stat().st_mode


@pytest.mark.parametrize(("numbers", "size"), [("BF16", 2), ("F8_E4M3", 1), ("F8_E5M2", 1), ("C64", 8)])
def test_numbers_that_numpy_does_not_know_are_one_clear_error(tmp_path, numbers, size):
    path = tmp_path / "f.safetensors"
    linear_field().save(path)
    content = path.read_bytes()
    end = 8 + int.from_bytes(content[:8], "little")
    header = json.loads(content[8:end])
    first, last = header["density"]["data_offsets"]
    header["density"] |= {"dtype": numbers, "shape": [(last - first) // size]}
    changed = json.dumps(header).encode()
    path.write_bytes(len(changed).to_bytes(8, "little") + changed + content[end:])
    with pytest.raises(FieldError, match=rf"tensor 'density' is of type {numbers}, .*; write it as F32$"):
        VoxelField.load(path)


def test_truncated_file_is_one_clear_error(tmp_path):
    path = tmp_path / "f.safetensors"
    linear_field().save(path)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(FieldError, match="truncated"):
        VoxelField.load(path)
    with pytest.raises(FieldError, match="no such field file"):
        VoxelField.load(tmp_path / "none.safetensors")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bounds": np.array([[0.0, 0, 0], [1, -1, 1]])}, "lower < upper"),
        ({"bounds": np.full((2, 3), np.nan)}, "finite"),
        ({"resolution": (5, 4, 1)}, "2 to 2048"),
        ({"vertices": np.arange(120)[::-1]}, "strictly increasing"),
        ({"vertices": np.arange(120) + 5}, "within"),
        ({"density": np.full(120, np.nan)}, "density must be finite, vertex 0"),
        ({"density": np.zeros(7)}, r"must be \[M\]"),
        ({"sh": np.zeros((120, 5, 3))}, "degree 0 to 2"),
    ],
)
def test_bad_arrays_are_named(change, message):
    field = linear_field()
    good = {name: getattr(field, name) for name in ("bounds", "resolution", "vertices", "density", "sh")}
    with pytest.raises(FieldError, match=message):
        VoxelField(**{**good, **change})
