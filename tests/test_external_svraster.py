"""SVRaster: values against loops over voxels, pictures against fine sums, files, refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch", reason="SVRaster models are evaluated by PyTorch")

from cagefield.cameras.camera import Camera
from cagefield.cli import main
from cagefield.errors import FieldError
from cagefield.fields.external.external_file import load_external, save_external
from cagefield.fields.external.svraster import SvrasterField
from cagefield.formats.external.read_external import read_external
from cagefield.rendering.external.external_renderer import ExternalRenderer
from svraster_files import INSIDE, known, quantize, svraster_content, voxels, write_svraster


def field_of(tmp_path: Path, content: dict[str, Any]) -> SvrasterField:
    found = read_external(write_svraster(tmp_path / "iter000100_model.pt", content))
    assert found is not None and isinstance(found.field, SvrasterField)
    return found.field


@pytest.mark.parametrize(("degree", "outside"), [(0, 0), (2, 1), (3, 2)])
def test_values_are_those_of_the_voxels(tmp_path: Path, degree: int, outside: int) -> None:
    octs = voxels(outside=outside)
    content = svraster_content(octs, degree=degree, outside=outside)
    field = field_of(tmp_path, content)
    assert field.unbounded == (outside > 0)
    rng = np.random.default_rng(5)
    cells = 8 << outside  # cells finer than the voxels, and positions away from their faces
    u = (rng.integers(-1, cells + 1, (400, 3)) + rng.uniform(0.05, 0.95, (400, 3))) / cells - 0.5
    p, d = content["scene_center"] + u * INSIDE * 2**outside, rng.normal(size=(400, 3))
    d /= np.linalg.norm(d, axis=1)[:, None]
    sigma, rgb = field(p, d)
    full, colors = known(content, octs, p, d)
    assert 0.1 < (full > 0).mean() < 0.95
    # float32: values to 1e-6 of a voxel, through an exponential
    np.testing.assert_allclose(sigma, full, rtol=2e-4)
    np.testing.assert_allclose(rgb[full > 0], colors[full > 0], atol=1e-5)


def test_pictures_are_sums_along_rays(tmp_path: Path) -> None:
    """Oracle: 3,000 midpoints on each ray, through the shell around the cube of interest too."""
    octs = voxels(seed=3)
    content = svraster_content(octs, seed=3, values=lambda points: np.full(len(points), -4.0) + points[:, 0])
    field = field_of(tmp_path, content)
    camera = Camera.look_at((3.0, 2.5, 3.2), field.center, width=4, height=4, fov_x=0.7)
    picture = ExternalRenderer(field).render(camera, background="black")
    origins, directions = camera.rays()
    t = (np.arange(3_000) + 0.5) * 9.0 / 3_000
    for row, (o, d) in enumerate(zip(origins.astype(float), directions.astype(float), strict=True)):
        sigma, rgb = field(o + t[:, None] * d, np.broadcast_to(d, (len(t), 3)))
        alpha = 1.0 - np.exp(-sigma * 9.0 / 3_000)
        weights = alpha * np.concatenate([[1.0], np.cumprod(1.0 - alpha)[:-1]])
        i, j = divmod(row, 4)
        # the density, up to 10 here, bends within a finest voxel; a face falls between two midpoints
        assert picture.opacity[i, j] == pytest.approx(weights.sum(), abs=0.02)
        np.testing.assert_allclose(picture.rgb[i, j], (weights[:, None] * rgb).sum(axis=0), atol=0.02)
    assert picture.opacity.max() > 0.5


def test_quantized_arrays_are_looked_up(tmp_path: Path) -> None:
    content = svraster_content(quantized=True)
    field = field_of(tmp_path, content)
    plain = svraster_content()
    for name, array in (("_geo_grid_pts", plain["_geo_grid_pts"]),):
        coded = quantize(array)
        plain[name] = coded["codebook"][coded["index"]]
    for name in ("_sh0", "_shs"):
        parts = [quantize(plain[name][:, n : n + 1]) for n in range(plain[name].shape[1])]
        plain[name] = np.concatenate([part["codebook"][part["index"]] for part in parts], axis=1)
    expected = field_of(tmp_path, plain)
    assert all((field.arrays()[name] == array).all() for name, array in expected.arrays().items())


def test_a_field_file_is_read_as_it_was_written(tmp_path: Path) -> None:
    field = field_of(tmp_path, svraster_content())
    save_external(field, tmp_path / "a.safetensors")
    again = load_external(tmp_path / "a.safetensors", SvrasterField.KIND)
    assert again.options() == field.options() and again.describe() == field.describe()
    ours, theirs = field.arrays(), again.arrays()
    assert ours.keys() == theirs.keys() and all((ours[name] == theirs[name]).all() for name in ours)


def changed(**arrays: Any) -> dict[str, Any]:
    return svraster_content() | arrays


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (changed(_geo_grid_pts=np.zeros((5, 1), np.float32)), "_geo_grid_pts has 5 values, the voxels have"),
        (changed(octlevel=svraster_content()["octlevel"] + 17), "octlevel must be 1 to 16"),
        (changed(octlevel=svraster_content()["octlevel"].astype(np.float32)), "octlevel must be .* whole"),
        (changed(octpath=svraster_content()["octpath"] + 1), "octpath and octlevel do not fit"),
        (changed(octpath=0 * svraster_content()["octpath"]), "voxels within others"),
        (changed(active_sh_degree=7), "active_sh_degree is 7"),
        (changed(_shs=svraster_content()["_shs"][:, :2]), "_shs has 2 harmonics, active_sh_degree 2 takes 8"),
        (changed(scene_extent=np.array([-1.0], np.float32)), "scene_extent is -1"),
        (changed(inside_extent=np.array([9.0], np.float32)), "inside_extent is 9"),
        (changed(quantized=True), "must have index and codebook"),
        (changed(_sh0=svraster_content()["_sh0"] * np.nan), "holds NaN or infinity"),
        ({"octpath": np.zeros((1, 1), np.int64), "octlevel": np.ones((1, 1), np.int8)}, "tensor missing"),
    ],
)  # fmt: skip
def test_files_that_do_not_fit_are_refused(tmp_path: Path, content: dict[str, Any], message: str) -> None:
    with pytest.raises(FieldError, match=message):
        read_external(write_svraster(tmp_path / "a.pt", content))


@pytest.mark.nightly  # two minutes of fitting
def test_the_command_bakes_and_exports_splats(tmp_path: Path) -> None:
    """A field of a checkpoint as a scene, and splats fitted to its voxels as an export."""
    solid = svraster_content(outside=0, values=lambda points: np.where(points[:, 2] < 0.1, 1.0, -9.0))
    checkpoint = write_svraster(tmp_path / "model.pt", solid)
    scene, splats = tmp_path / "scene", tmp_path / "edited.ply"
    assert main(["import", str(checkpoint), "-o", str(scene), "--resolution", "24"]) == 0
    assert main(["export", str(scene), "-o", str(splats)]) == 0
    from cagefield.formats.splats.splat_files import read_splats

    written = read_splats(splats)
    positions = written.means
    assert len(positions) > 50
    # the lower half of the cube is solid: an edge of half the length, up to two voxels on each side
    spans = np.sort(np.quantile(positions, 0.98, axis=0) - np.quantile(positions, 0.02, axis=0))
    assert spans[0] < INSIDE / 2 + 4 * INSIDE / 24 and spans[2] > 0.6 * INSIDE
