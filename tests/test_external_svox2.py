"""Grids of svox2: values against SciPy, notes, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cagefield import Scene
from cagefield.errors import FieldError
from cagefield.fields.voxel_field import VoxelField
from cagefield.formats.external.checkpoint import ExternalCheckpoint
from cagefield.formats.external.read_external import read_external
from commands import printed, refused
from svox2_files import CENTER, RADIUS, SHAPE, known, svox2_arrays, write_svox2


def read(path) -> ExternalCheckpoint:
    found = read_external(path)
    assert found is not None
    return found


def places(count: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """Points between the outermost cells' centers, and directions."""
    rng = np.random.default_rng(1)
    d = rng.normal(size=(count, 3))
    half = RADIUS * (1.0 - 1.0 / np.array(SHAPE))
    return rng.uniform(CENTER - half, CENTER + half, (count, 3)), d / np.linalg.norm(d, axis=1)[:, None]


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize("compress", [False, True])
def test_voxels_are_the_same_function(tmp_path, degree, compress) -> None:
    arrays = svox2_arrays(degree)
    found = read(write_svox2(tmp_path / "a.npz", arrays, compress))
    assert isinstance(found.field, VoxelField) and found.field.sh_degree == degree
    p, d = places()
    sigma, rgb = found.field(p, d)
    expected = known(arrays, p, d)
    assert 0.2 < (expected[0] > 0).mean() < 0.9
    # float32 positions of the grid against float64
    np.testing.assert_allclose(sigma, expected[0], atol=1e-4)
    np.testing.assert_allclose(rgb, np.minimum(expected[1], 1.0), atol=1e-5)


def test_the_older_layout_holds_density_and_colors_in_one_array(tmp_path) -> None:
    arrays = svox2_arrays()
    data = np.concatenate([arrays["density_data"], arrays["sh_data"].astype(np.float32)], axis=1)
    older = {"radius": RADIUS, "center": CENTER, "links": arrays["links"], "data": data}
    found = read(write_svox2(tmp_path / "a.npz", older)).field
    same = read(write_svox2(tmp_path / "b.npz", arrays)).field
    assert isinstance(found, VoxelField) and isinstance(same, VoxelField)
    assert (found.density == same.density).all() and (found.sh == same.sh).all()


def test_what_is_left_out_is_named(tmp_path) -> None:
    plain = read(write_svox2(tmp_path / "a.npz", svox2_arrays()))
    assert not any("left out" in note for note in plain.notes)
    links = np.arange(np.prod(SHAPE), dtype=np.int32).reshape(SHAPE)
    full = svox2_arrays(
        links=links,
        density_data=np.ones((links.size, 1), np.float32),
        sh_data=np.zeros((links.size, 27), np.float16),
        background_data=np.zeros((8, 4, 4), np.float32),
        background_links=np.zeros((4, 2), np.int32),
    )
    notes = "\n".join(read(write_svox2(tmp_path / "b.npz", full)).notes)
    assert "left out: the background, 4 layers of multi-sphere images" in notes
    inner = (SHAPE[0] - 2) * (SHAPE[1] - 2) * (SHAPE[2] - 2)
    assert f"the outer half of {links.size - inner} cells with density on the grid's border" in notes


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"links": None}, "no field that is read: it holds basis_type, center"),
        ({"sh_data": None}, "sh_data is missing"),
        ({"links": np.zeros((4, 4), np.int32)}, r"links must be integers \[X,Y,Z\] from 2 to 2048"),
        ({"links": np.zeros((4, 4, 4), np.float32)}, "links must be integers"),
        ({"links": np.full((4, 4, 4), -1, np.int32)}, "the grid is empty"),
        ({"links": np.full((4, 4, 4), 10**6, np.int32)}, "links point to row 1000000, the grid has"),
        ({"density_data": np.zeros((3, 1), np.float32)}, "density_data and sh_data have 3 and"),
        ({"sh_data": np.zeros((40, 26), np.float16), "density_data": np.zeros((40, 1), np.float32)}, "27"),
        ({"basis_type": 4}, "basis_type is 4: colors have a learned texture, which is not read"),
        ({"basis_type": 255}, "basis_type is 255: colors have a learned MLP"),
        ({"basis_data": np.zeros((2, 2, 2, 9), np.float32)}, "a learned texture"),
        ({"radius": np.zeros(3, np.float32)}, "radius must be above 0"),
        ({"center": np.full(3, np.nan, np.float32)}, "center must be 3 finite numbers"),
        ({"radius": np.ones(5, np.float32)}, "radius must hold up to 3 numbers"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_named(tmp_path, changes, message) -> None:
    path = write_svox2(tmp_path / "a.npz", svox2_arrays(**changes))
    with pytest.raises(FieldError, match=message) as error:
        read_external(path)
    assert str(error.value).startswith(str(path)) and "\n" not in str(error.value)


def test_sixteen_coefficients_are_named(tmp_path) -> None:
    arrays = svox2_arrays(3)
    with pytest.raises(FieldError, match="3, 12 or 27 color coefficients"):
        read_external(write_svox2(tmp_path / "a.npz", arrays))


def test_sizes_that_a_small_file_cannot_hold_are_refused_unread(tmp_path) -> None:
    """A deflated file of zeros: 1,000 times as much as it takes."""
    count = 200_000
    bomb = svox2_arrays(
        density_data=np.zeros((count, 1), np.float32), sh_data=np.zeros((count, 27), np.float16)
    )
    path = write_svox2(tmp_path / "a.npz", bomb, compress=True)
    assert path.stat().st_size < 100_000
    with pytest.raises(FieldError, match=r"says that it holds .* numbers, the file has"):
        read_external(path)
    bomb = svox2_arrays(links=np.full((600, 600, 600), -1, np.int8))
    with pytest.raises(FieldError, match="a grid of 600 x 600 x 600 cells"):
        read_external(write_svox2(tmp_path / "b.npz", bomb, compress=True))


def test_pickled_arrays_and_damage_are_refused(tmp_path) -> None:
    arrays: dict[str, Any] = svox2_arrays()
    np.savez(tmp_path / "a.npz", **{**arrays, "links": np.array([{}], object)})
    with pytest.raises(FieldError, match=r"a\.npz: not a readable \.npz \(an array of object"):
        read_external(tmp_path / "a.npz")
    path = write_svox2(tmp_path / "b.npz", arrays)
    path.write_bytes(path.read_bytes()[:500])
    with pytest.raises(FieldError, match=r"b\.npz: not a readable \.npz"):
        read_external(path)
    with pytest.raises(FieldError, match="no such checkpoint; give the file"):
        read_external(tmp_path / "nowhere.npz")


def test_the_command_makes_a_scene_of_the_voxels(tmp_path, capsys) -> None:
    path = write_svox2(tmp_path / "a.npz", svox2_arrays())
    out = printed(capsys, "import", path, "-o", tmp_path / "scene")
    assert "svox2: 7 x 5 x 6 cells" in out and "SH degree 2" in out
    assert "cameras: positions times 0.667" in out
    scene = Scene.open(tmp_path / "scene")
    assert isinstance(scene.field, VoxelField) and scene.original is None
    assert len(scene.cameras["test"]) == 8
    message = refused(capsys, "import", path, "-o", tmp_path / "b", "--data-scale", 0)
    assert "data scale is 0; it must be from" in message
