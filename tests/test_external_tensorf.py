"""TensoRF checkpoints: values against NumPy, exact pictures through edits, files, refusals."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch", reason="TensoRF checkpoints need PyTorch")

from cagefield import Cage, Edit, EditStack, Scene
from cagefield.cameras.camera import Camera
from cagefield.edits import Trilinear
from cagefield.errors import FieldError
from cagefield.fields.external.external_file import load_external, save_external
from cagefield.fields.external.tensorf import TensorfField
from cagefield.formats.external.read_external import read_external
from cagefield.rendering.edited_field import EditedField
from cagefield.rendering.external.external_renderer import ExternalRenderer
from commands import printed, refused
from tensorf_files import BOX, GRID, known, tensorf_content, write_tensorf

ROUNDING: dict[str, Any] = {"rtol": 2e-4, "atol": 2e-4}
"""float32 products of planes and lines, up to about 30, against float64."""

MODELS = [
    ("TensorVMSplit", "MLP_Fea"), ("TensorVMSplit", "MLP"), ("TensorVMSplit", "MLP_PE"), ("TensorCP", "SH"),
    ("TensorVMSplit", "RGB"), ("TensorVM", "MLP"),
]  # fmt: skip


def field_of(tmp_path: Path, content: dict[str, Any]) -> TensorfField:
    found = read_external(write_tensorf(tmp_path / "a.th", content))
    assert found is not None and isinstance(found.field, TensorfField)
    return found.field


def places(count: int = 300, grown: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    d = rng.normal(size=(count, 3))
    return rng.uniform(BOX[0] - grown, BOX[1] + grown, (count, 3)), d / np.linalg.norm(d, axis=1)[:, None]


def camera(size: int = 12) -> Camera:
    return Camera.look_at((2.2, 1.4, 1.8), (0, 0, 0.3), width=size, height=size, fov_x=0.9)


@pytest.mark.parametrize(("model", "shading"), MODELS)
def test_values_are_those_of_the_published_formulas(tmp_path, model, shading) -> None:
    content = tensorf_content(model, shading)
    field = field_of(tmp_path, content)
    p, d = places()
    sigma, rgb = field(p, d)
    expected = known(content, p, d)
    assert 0.1 < (expected[0] > 0).mean() < 0.99
    np.testing.assert_allclose(sigma, expected[0], rtol=2e-4, atol=2e-3)
    np.testing.assert_allclose(rgb, expected[1], **ROUNDING)
    # several directions at once
    several = np.stack([d, d[::-1], -d], axis=1)
    both = field.evaluate_directions(p, several)
    np.testing.assert_allclose(both[0], sigma, rtol=1e-5)
    np.testing.assert_allclose(both[1][:, 1], known(content, p, d[::-1])[1], **ROUNDING)


def test_a_relu_density_is_signed_for_baking(tmp_path) -> None:
    content = tensorf_content("TensorVMSplit", "RGB", mask=False, fea2denseAct="relu", density_shift=0.0)
    field = field_of(tmp_path, content)
    p, d = places()
    signed = field.signed_density(p, d)
    assert (signed < 0).any()
    np.testing.assert_allclose(np.maximum(signed, 0.0), known(content, p, d)[0], rtol=2e-4, atol=2e-3)


def test_the_field_is_empty_outside_its_box_and_mask(tmp_path) -> None:
    field = field_of(tmp_path, tensorf_content(mask=False))
    p, d = places(500, grown=0.5)
    inside = ((p >= BOX[0]) & (p <= BOX[1])).all(axis=1)
    assert 0.1 < inside.mean() < 0.9
    assert ((field(p, d)[0] > 0) == inside).all()


def sums(field: Any, origin: np.ndarray, d: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, float]:
    """(premultiplied color [3], opacity) of one ray by the formulas, of samples t [S]."""
    sigma, rgb = field((origin + t[:, None] * d).astype(np.float32), np.broadcast_to(d, (len(t), 3)))
    alpha = 1.0 - np.exp(-sigma.astype(np.float64) * np.diff(t, append=t[-1]))
    weights = alpha * np.concatenate([[1.0], np.cumprod(1.0 - alpha + 1e-10)[:-1]])
    return (np.where(weights > 1e-4, weights, 0.0)[:, None] * rgb).sum(axis=0), weights.sum()


@pytest.mark.parametrize("edited", [False, True])
def test_pictures_are_the_sums_along_rays_through_edits(tmp_path, edited) -> None:
    """Oracle: the float64 edit map and one ray at a time in NumPy."""
    field = field_of(tmp_path, tensorf_content(mask=False, density_shift=-5.0, distance_scale=3.0))
    inner, outer = Cage.box((0.1, 0.2, 0.4), 0.7), Cage.box((0.1, 0.2, 0.4), 1.5)
    edit = Edit.continuous(inner, outer, shell=Trilinear()).translate((0.2, 0.0, 0.2))
    edits = EditStack([edit]) if edited else None
    picture = ExternalRenderer(field, edits).render(camera(), background="black")
    origins, directions = camera().rays()
    mapped = field if edits is None else EditedField(field, edits, BOX)
    count = int(np.linalg.norm(BOX[1] - BOX[0]) / field.step) + 1
    drawn = changed = 0
    for row in range(0, len(origins), 5):
        o, d = origins[row].astype(np.float64), directions[row].astype(np.float64)
        enter = np.clip(np.minimum((BOX[0] - o) / d, (BOX[1] - o) / d).max(), *field.near_far)
        color, opacity = sums(mapped, o, d, enter + field.step * np.arange(count))
        i, j = divmod(row, 12)
        assert picture.opacity[i, j] == pytest.approx(opacity, abs=2e-3)
        np.testing.assert_allclose(picture.rgb[i, j], color, atol=2e-3)
        drawn += opacity > 0.05
        changed += abs(opacity - sums(field, o, d, enter + field.step * np.arange(count))[1]) > 0.01
    assert drawn >= 5 and (changed >= 3) == edited


def test_content_moved_out_of_the_box_is_drawn(tmp_path) -> None:
    field = field_of(tmp_path, tensorf_content(mask=False, density_shift=-6.0, step_ratio=0.1))
    cage = Cage.box((0, 0.1, 0.3), 2.1)
    move = Edit.move(cage).translate((0.0, 0.0, 2.5))
    seen = Camera.look_at((0, -5.5, 2.8), (0, 0, 2.8), width=16, height=16, fov_x=0.6)
    still = Camera.look_at((0, -5.5, 0.3), (0, 0, 0.3), width=16, height=16, fov_x=0.6)
    moved = ExternalRenderer(field, EditStack([move])).render(seen, background="black")
    plain = ExternalRenderer(field).render(still, background="black")
    assert plain.opacity.max() > 0.3
    # other samples of one function: within a step's quadrature error
    np.testing.assert_allclose(moved.opacity, plain.opacity, atol=0.05)


def test_a_field_file_is_read_as_it_was_written(tmp_path) -> None:
    for model, shading in MODELS:
        field = field_of(tmp_path, tensorf_content(model, shading, mask=model == "TensorCP"))
        save_external(field, tmp_path / "a.safetensors")
        again = load_external(tmp_path / "a.safetensors", TensorfField.KIND)
        assert isinstance(again, TensorfField) and again.options() == field.options()
        ours, theirs = field.arrays(), again.arrays()
        assert ours.keys() == theirs.keys()
        assert all((ours[name] == theirs[name]).all() and ours[name].size for name in ours)


def test_a_scene_keeps_the_field_that_its_voxels_were_baked_from(tmp_path) -> None:
    field = field_of(tmp_path, tensorf_content(density_shift=-6.0))
    scene = Scene.baked(field, {"test": (camera(),)}, resolution=24)
    scene.save(tmp_path / "scene")
    again = Scene.open(tmp_path / "scene")
    assert isinstance(again.original, TensorfField)
    exact = again.render(camera(), exact=True)
    np.testing.assert_array_equal(exact.rgb, ExternalRenderer(field).render(camera()).rgb)


def changed(**changes: Any) -> dict[str, Any]:
    """A content with options or tensors replaced, or left out where None."""
    content = tensorf_content()
    for name, value in changes.items():
        part = content["kwargs"] if name in content["kwargs"] else content["state_dict"]
        name = name.replace("__", ".")
        if name.startswith("alphaMask."):
            part = content
        if value is None:
            part.pop(name)
        else:
            part[name] = value
    return content


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"near_far": [0.0, 1.0]}, r"near_far is \[0, 1\]: trained on a forward-facing capture"),
        ({"near_far": [6.0, 2.0]}, "near < far"),
        ({"near_far": "x"}, "near_far must be two numbers"),
        ({"shadingMode": "MLP_Other"}, "shadingMode is 'MLP_Other'; expected one of MLP_Fea"),
        ({"fea2denseAct": "exp"}, "fea2denseAct is 'exp'; expected softplus or relu"),
        ({"density_shift": float("nan")}, "density_shift is nan; it must be from"),
        ({"distance_scale": "much"}, "distance_scale must be a number, got str"),
        ({"gridSize": [1, 5, 7]}, "gridSize is 1; it must be from 2"),
        ({"gridSize": [6, 5]}, r"gridSize must be 3 numbers"),
        ({"step_ratio": 1e-6}, "step of samples is .*; it must be from"),
        ({"fea_pe": 10**9}, "fea_pe is 1e[+]09; it must be from 0 to 32"),
        ({"aabb": np.zeros((2, 3))}, "aabb must have lower < upper"),
        ({"basis_mat__weight": None}, r"state_dict: tensor missing: basis_mat\.weight"),
        ({"basis_mat__weight": np.zeros((5, 11))}, r"basis_mat must be \[N, 12\], got \[5, 11\]"),
        ({"density_line__1": np.zeros((1, 2, 5, 1))}, r"density planes have \[3, 3, 3\] components, lines"),
        ({"density_plane__0": np.full((1, 3, 5, 6), np.inf)}, "density_planes.0 holds NaN or infinity"),
        ({"app_plane__2": np.zeros((2, 4, 7, 5))}, r"app_plane\.2 must be \[1, C, H, W\], got"),
        ({"renderModule__mlp__2__bias": np.zeros(9)}, r"MLP bias 1 must be \[8\], got \[9\]"),
        ({"alphaMask__shape": (1, 1, 8, 9, 11)}, "alphaMask.mask must be 99 bytes for the shape"),
        ({"alphaMask__shape": (1, 1, 2**14, 2**14, 2**14)}, "alphaMask.mask must be"),
        ({"alphaMask__shape": (1, 1, 2**40, 1, 1)}, "alphaMask.shape is .*; it must be from 1"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_named(tmp_path, changes, message) -> None:
    path = write_tensorf(tmp_path / "a.th", changed(**changes))
    with pytest.raises(FieldError, match=message) as error:
        read_external(path)
    assert str(error.value).startswith(str(path)) and "\n" not in str(error.value)


class Runs:
    """An object whose pickle runs a command."""

    def __init__(self, proof: Path) -> None:
        self.proof = proof

    def __reduce__(self) -> Any:
        return os.mkdir, (str(self.proof),)


class Huge:
    """An array whose pickle names a shape that it has no bytes for."""

    def __reduce__(self) -> Any:
        return np._core.multiarray._reconstruct, (np.ndarray, (1 << 40,), b"b")  # type: ignore[attr-defined]


def test_code_in_a_checkpoint_is_refused_and_not_run(tmp_path) -> None:
    import torch

    content = tensorf_content()
    content["kwargs"]["aabb"] = Runs(tmp_path / "proof")
    torch.save(content, tmp_path / "a.th")
    with pytest.raises(FieldError, match=r"holds Python objects beside tensors \(posix.mkdir\)"):
        read_external(tmp_path / "a.th")
    assert not (tmp_path / "proof").exists()


def test_the_grid_of_the_samples_is_the_authors_rule(tmp_path) -> None:
    field = field_of(tmp_path, tensorf_content())
    edges = (BOX[1] - BOX[0]) / (np.array(GRID) - 1)
    assert field.step == pytest.approx(0.5 * edges.mean(), rel=1e-6)


def test_the_command_bakes_it_and_keeps_the_field(tmp_path, capsys) -> None:
    path = write_tensorf(tmp_path / "a.th", tensorf_content(mask=False, density_shift=-6.0))
    out = printed(capsys, "import", path, "-o", tmp_path / "scene", "--resolution", 32, "--compare", 1)
    assert "TensoRF: VM 6 x 5 x 7, 3+3+3 density and 4+4+4 appearance components, MLP_Fea shading" in out
    assert "PSNR of the voxels against the original" in out and "white is assumed" in out
    scene = Scene.open(tmp_path / "scene")
    assert isinstance(scene.original, TensorfField) and len(scene.cameras["train"]) == 24
    assert "original    TensoRF: VM 6 x 5 x 7" in printed(capsys, "info", tmp_path / "scene")
    assert "--fov-deg is for" in refused(capsys, "import", path, "-o", tmp_path / "b", "--fov-deg", 40)


def test_an_array_whose_pickle_names_a_huge_shape_allocates_nothing(tmp_path) -> None:
    import torch

    content = tensorf_content()
    content["alphaMask.mask"] = Huge()
    torch.save(content, tmp_path / "a.th")
    with pytest.raises(FieldError, match=r"alphaMask.mask must be 90 bytes"):
        read_external(tmp_path / "a.th")
