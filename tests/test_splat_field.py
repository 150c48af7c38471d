"""SplatField: files, errors, what it says of itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cagefield.errors import FieldError
from cagefield.fields.splat_field import SplatField
from splat_scenes import assert_same_splats, random_splats


@pytest.mark.parametrize("degree", [0, 3, 4])
def test_files_hold_everything(tmp_path: Path, degree: int) -> None:
    box = np.array([[-1.0, -2.0, -3.0], [1.0, 2.0, 3.5]])
    field = replace(random_splats(degree=degree), antialiased=True, bounds=box, unbounded=True)
    field.save(tmp_path / "field.safetensors")
    read = SplatField.load(tmp_path / "field.safetensors")
    # Quaternions are normalized again.
    assert_same_splats(read, field, atol=1e-7)
    np.testing.assert_array_equal(read.bounds, box)
    assert read.unbounded and read.sh_degree == degree
    random_splats().save(tmp_path / "field.safetensors")
    assert not SplatField.load(tmp_path / "field.safetensors").unbounded


def rewritten(path: Path, change, **header: str) -> None:
    from safetensors.numpy import load_file, save_file

    tensors = load_file(path)
    change(tensors)
    save_file(tensors, path, {"kind": "SplatField", "version": "1", **header})


def spoil(name: str, value: float):
    def change(tensors) -> None:
        tensors[name][3] = value

    return change


@pytest.mark.parametrize(
    ("change", "header", "message"),
    [
        (spoil("means", np.nan), {}, "means must be finite, splat 3 of 40 is not; remove it"),
        (spoil("sh", np.inf), {}, "sh must be finite, splat 3 of 40"),
        (spoil("opacities", 1.5), {}, r"opacities must lie in \[0, 1\], got .* to 1.5"),
        (spoil("quaternions", 0.0), {}, "quaternion 3 of 40 is 0; a rotation has length 1"),
        (lambda tensors: tensors.pop("log_scales"), {}, "tensors missing: log_scales"),
        (
            lambda tensors: tensors.update(sh=tensors["sh"][:, :3]),
            {},
            r"sh must be \[40, 1\|4\|9\|16\|25, 3\]",
        ),
        (lambda tensors: tensors.update(opacities=np.ones(39, np.float32)), {}, r"opacities must be \[40\]"),
        (lambda tensors: tensors.update(bounds=np.zeros((2, 3))), {}, "bounds must be 2 finite corners"),
        (lambda tensors: tensors.update(means=np.array(1.0)), {}, r"means must be \[0, 3\], got \[\]"),
        (lambda tensors: None, {"version": "9"}, "field format '9', this cagefield reads '1'; update"),
        (lambda tensors: None, {"kind": "VoxelField"}, "kind is 'VoxelField', expected 'SplatField'"),
    ],
)
def test_damaged_files_are_one_line(tmp_path: Path, change, header: dict[str, str], message: str) -> None:
    file = tmp_path / "field.safetensors"
    random_splats().save(file)
    rewritten(file, change, **header)
    with pytest.raises(FieldError, match=r"field\.safetensors: .*" + message) as caught:
        SplatField.load(file)
    assert "\n" not in str(caught.value)


def test_truncated_and_missing_files(tmp_path: Path) -> None:
    file = tmp_path / "field.safetensors"
    with pytest.raises(FieldError, match="no such field file; train one with `cagefield train"):
        SplatField.load(file)
    random_splats().save(file)
    file.write_bytes(file.read_bytes()[:500])
    with pytest.raises(FieldError, match=r"not a readable field file .* truncated"):
        SplatField.load(file)
    file.write_bytes(b"splats")
    with pytest.raises(FieldError, match="not a readable field file"):
        SplatField.load(file)


def test_sample_spacing_is_what_most_splats_are_wide() -> None:
    scales = np.array([[1e-4, 0.02, 0.3]] * 6 + [[0.1, 0.001, 0.5]] * 3 + [[7.0, 7.0, 7.0]])
    means = np.zeros((10, 3))
    means[9] = 100.0
    field = SplatField(
        means,
        np.log(scales),
        np.tile([1.0, 0, 0, 0], (10, 1)),
        np.r_[np.full(6, 0.4), np.full(3, 0.9), 1.0],
        np.zeros((10, 1, 3)),
        bounds=[[-1] * 3, [1] * 3],
    )
    # 2.4 of .02 against 2.7 of .1 by opacity; the one of 7 is outside of the box
    assert field.sample_spacing == pytest.approx(0.1, rel=1e-5)
    assert replace(field, opacities=np.full(10, 0.5)).sample_spacing == pytest.approx(0.02, rel=1e-5)
    none = replace(field, opacities=np.zeros(10))
    assert none.sample_spacing == pytest.approx(2e-3)
    # a scene in other units has the same spacing in them
    larger = replace(field, log_scales=field.log_scales + np.log(100.0), means=field.means * 100.0,
                     bounds=field.bounds * 100.0)  # fmt: skip
    assert larger.sample_spacing == pytest.approx(100.0 * field.sample_spacing, rel=1e-4)


def test_read_only_arrays_are_not_copied() -> None:
    field = random_splats()
    again = replace(field, antialiased=True)
    for name in ("means", "log_scales", "opacities", "sh"):
        assert np.shares_memory(getattr(again, name), getattr(field, name)), name
    mine = field.means.copy()
    taken = replace(field, means=mine)
    mine[:] = 7.0
    np.testing.assert_array_equal(taken.means, field.means)
