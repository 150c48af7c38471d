"""PlenOctrees: values against a dense grid, exact pictures, files, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch", reason="PlenOctrees are evaluated by PyTorch")

from cagefield.cameras.camera import Camera
from cagefield.errors import FieldError
from cagefield.fields.external.external_file import load_external, save_external
from cagefield.fields.external.plenoctree import PlenOctreeField
from cagefield.formats.external.read_external import read_external
from cagefield.rendering.external.external_renderer import ExternalRenderer
from plenoctree_files import DEPTH, OFFSET, SCALE, known, plenoctree_arrays, write_plenoctree


def field_of(tmp_path: Any, arrays: dict[str, Any]) -> PlenOctreeField:
    found = read_external(write_plenoctree(tmp_path / "a.npz", arrays))
    assert found is not None and isinstance(found.field, PlenOctreeField)
    return found.field


@pytest.mark.parametrize("terms", [0, 1, 4, 9, 16, 25])
def test_values_are_those_of_the_leaves(tmp_path, terms) -> None:
    arrays = plenoctree_arrays(terms)
    field = field_of(tmp_path, arrays)
    assert field.depth == DEPTH and field.terms == terms
    rng = np.random.default_rng(4)
    cells = rng.uniform(-0.1, 1.1, (500, 3))
    # not on the leaves' faces, where float32 may fall to either side
    cells = (np.floor(cells * 8) + rng.uniform(0.01, 0.99, cells.shape)) / 8
    p, d = (cells - OFFSET) / SCALE, rng.normal(size=(500, 3))
    d /= np.linalg.norm(d, axis=1)[:, None]
    sigma, rgb = field(p, d)
    expected = known(arrays, p, d)
    assert 0.3 < (expected[0] > 0).mean() < 0.8
    np.testing.assert_allclose(sigma, expected[0], rtol=1e-6)
    inside = ((cells > 0) & (cells < 1)).all(axis=1)
    np.testing.assert_allclose(rgb[inside], expected[1][inside], atol=1e-5)


def test_pictures_are_exact_sums_over_leaves(tmp_path) -> None:
    """Oracle: 20,000 midpoints on each ray."""
    arrays = plenoctree_arrays()
    field = field_of(tmp_path, arrays)
    camera = Camera.look_at((3.0, 2.0, 4.0), field.bounds.mean(axis=0), width=6, height=6, fov_x=0.7)
    picture = ExternalRenderer(field).render(camera, background="black")
    origins, directions = camera.rays()
    t = (np.arange(20_000) + 0.5) * 12.0 / 20_000
    for row, (o, d) in enumerate(zip(origins.astype(float), directions.astype(float), strict=True)):
        sigma, rgb = known(arrays, o + t[:, None] * d, np.broadcast_to(d, (len(t), 3)))
        alpha = 1.0 - np.exp(-sigma * 12.0 / 20_000)
        weights = alpha * np.concatenate([[1.0], np.cumprod(1.0 - alpha)[:-1]])
        i, j = divmod(row, 6)
        # a face falls between two midpoints: 12 / 20,000 of density up to 4
        assert picture.opacity[i, j] == pytest.approx(weights.sum(), abs=5e-3)
        np.testing.assert_allclose(picture.rgb[i, j], (weights[:, None] * rgb).sum(axis=0), atol=5e-3)
    assert picture.opacity.max() > 0.9


def test_a_field_file_is_read_as_it_was_written(tmp_path) -> None:
    field = field_of(tmp_path, plenoctree_arrays())
    save_external(field, tmp_path / "a.safetensors")
    again = load_external(tmp_path / "a.safetensors", PlenOctreeField.KIND)
    assert again.options() == field.options()
    ours, theirs = field.arrays(), again.arrays()
    assert all((ours[name] == theirs[name]).all() for name in ours) and ours.keys() == theirs.keys()


def looped() -> np.ndarray:
    """Children of which one points back to the root."""
    child: np.ndarray = plenoctree_arrays()["child"].copy()
    child[1, 0, 0, 0] = -1
    return child


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"data": None}, "data is missing; give the octree as svox saves it"),
        ({"data": None, "quant_colors": np.zeros(3)}, "its colors are quantized"),
        ({"data_format": "SG25"}, "data_format is 'SG25'; only RGBA and SH1 to SH25"),
        ({"data_format": "SH9"}, r"data must be \[.*, 2, 2, 2, 28\], got"),
        ({"child": looped()}, "a node has two parents"),
        ({"child": np.full((4, 2, 2, 2), 7, np.int32)}, r"child points outside the 4 nodes|data must be"),
        ({"child": np.zeros((4, 2, 2, 2), np.float32)}, "child says that it is float32"),
        ({"invradius3": np.zeros(3, np.float32)}, "invradius3 must be above 0"),
        ({"offset": np.zeros(40, np.float32)}, "offset must hold up to 3 values"),
        ({"offset": np.full(3, np.inf, np.float32)}, "offset holds NaN or infinity"),
        ({"data": np.zeros((900_000, 2, 2, 2, 13), np.float16)}, "data says that it is float16"),
    ],
)
def test_what_does_not_fit_is_named(tmp_path, changes, message) -> None:
    path = write_plenoctree(tmp_path / "a.npz", plenoctree_arrays(**changes))
    with pytest.raises(FieldError, match=message) as error:
        read_external(path)
    assert str(error.value).startswith(str(path)) and "\n" not in str(error.value)
