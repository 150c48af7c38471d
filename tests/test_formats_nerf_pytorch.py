"""Checkpoints of both nerf-pytorch projects, rebuilt here by their documented keys."""

from __future__ import annotations

import argparse
import os
import pickle
import re
import warnings
from pathlib import Path

import numpy as np
import pytest

from cagefield.errors import FieldError
from cagefield.fields.nerf_field import NerfField
from nerf_networks import (
    forward_krrish94,
    forward_yenchenlin,
    krrish94_state,
    layer,
    state,
    yenchenlin_state,
)

torch = pytest.importorskip("torch", reason="PyTorch is not installed (extra nerf)")

from cagefield.formats.nerf.nerf_pytorch import read_checkpoint  # noqa: E402

SHARED = Path(__file__).resolve().parents[2] / "shared" / "data" / "nerf-pytorch"
BOX = [[-1.5] * 3, [1.5] * 3]
# float32 networks against float64 ones: rounding of about 1e-6 per layer
ROUNDING = {"rtol": 1e-4, "atol": 2e-5}


def tensors(arrays):
    return {name: torch.from_numpy(np.array(value)) for name, value in arrays.items()}


def yenchenlin_file(path: Path, coarse=None, fine=None, **more) -> Path:
    content = {
        "global_step": 500,
        "network_fn_state_dict": tensors(yenchenlin_state(0) if coarse is None else coarse),
        "network_fine_state_dict": tensors(yenchenlin_state(1) if fine is None else fine),
        "optimizer_state_dict": {"state": {}, "param_groups": [{"lr": 5e-4}]},
    }
    torch.save({**content, **more}, path)
    return path


def krrish94_file(path: Path, coarse, fine) -> Path:
    content = {
        "iter": 99,
        "model_coarse_state_dict": tensors(coarse),
        "loss": torch.tensor(0.1),
        "psnr": 21.0,
    }
    torch.save({**content, "model_fine_state_dict": None if fine is None else tensors(fine)}, path)
    return path


def samples(count: int = 40):
    rng = np.random.default_rng(7)
    d = rng.normal(size=(count, 3))
    return rng.uniform(-1.5, 1.5, (count, 3)), d / np.linalg.norm(d, axis=1, keepdims=True)


def test_yenchenlin_networks_are_what_its_forward_pass_computes(tmp_path) -> None:
    found = read_checkpoint(yenchenlin_file(tmp_path / "000500.tar"))
    assert (found.project, found.step) == ("yenchenlin/nerf-pytorch", 500)
    assert found.coarse.skips == (False, False, False, False, False, True, False, False)
    assert found.coarse.position_encoding == (3, True) and found.coarse.view_encoding == (2, True)
    assert str(found.fine) == "8 x 24, 3 + 2 octaves"
    p, d = samples()
    for network, seed in ((found.coarse, 0), (found.fine, 1)):
        sigma, rgb = NerfField(network, None, BOX)(p, d)
        expected = forward_yenchenlin(yenchenlin_state(seed), p, d)
        assert (expected[0] > 0).any()
        np.testing.assert_allclose(sigma, expected[0], **ROUNDING)
        np.testing.assert_allclose(rgb, expected[1], **ROUNDING)


@pytest.mark.parametrize("skip", [None, 2])
def test_krrish94_networks_are_what_its_forward_pass_computes(tmp_path, skip) -> None:
    file = krrish94_file(tmp_path / "a.ckpt", krrish94_state(3, skip=skip), krrish94_state(4, skip=skip))
    found = read_checkpoint(file)
    assert (found.project, found.step) == ("krrish94/nerf-pytorch", 99)
    p, d = samples()
    for network, seed in ((found.coarse, 3), (found.fine, 4)):
        sigma, rgb = NerfField(network, None, BOX)(p, d)
        expected = forward_krrish94(krrish94_state(seed, skip=skip), p, d, skip)
        assert (expected[0] > 0).any()
        np.testing.assert_allclose(sigma, expected[0], **ROUNDING)
        np.testing.assert_allclose(rgb, expected[1], **ROUNDING)


def test_a_checkpoint_without_a_fine_network(tmp_path) -> None:
    assert read_checkpoint(krrish94_file(tmp_path / "a.ckpt", krrish94_state(), None)).fine is None


def test_a_network_without_view_directions_has_one_output_layer(tmp_path) -> None:
    rng = np.random.default_rng(0)
    layers = {
        "pts_linears.0": layer(rng, 8, 15),
        "pts_linears.1": layer(rng, 8, 8),
        "views_linears.0": layer(rng, 4, 8 + 3),
        "output_linear": layer(rng, 5, 8),
    }
    file = yenchenlin_file(tmp_path / "a.tar", state(layers), state(layers))
    found = read_checkpoint(file)
    assert found.coarse.view == () and found.coarse.view_encoding is None
    np.testing.assert_array_equal(found.coarse.rgb.weight, layers["output_linear"][0][:3])
    np.testing.assert_array_equal(found.coarse.density.weight, layers["output_linear"][0][3:4])
    p, d = samples()
    sigma, rgb = NerfField(found.coarse, None, BOX)(p, d)
    turned = NerfField(found.coarse, None, BOX)(p, d[::-1])
    np.testing.assert_array_equal(rgb, turned[1])
    np.testing.assert_array_equal(sigma, turned[0])


def test_names_of_data_parallel_training_are_read(tmp_path) -> None:
    wrapped = {f"module.{name}": value for name, value in yenchenlin_state(0).items()}
    found = read_checkpoint(yenchenlin_file(tmp_path / "a.tar", wrapped))
    np.testing.assert_array_equal(found.coarse.rgb.weight, yenchenlin_state(0)["rgb_linear.weight"])


def changed(**changes):
    arrays = yenchenlin_state(0)
    for name, value in changes.items():
        name = name.replace("__", ".")
        if value is None:
            del arrays[name]
        else:
            arrays[name] = np.asarray(value, np.float32)
    return arrays


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        (changed(alpha_linear__bias=None), r"network_fn_state_dict: tensors missing: alpha_linear\.bias"),
        (changed(pts_linears__3__weight=None), r"tensors missing: pts_linears\.3\.weight"),
        (changed(tail__weight=[[1.0]]), r"tensors that this network does not have: tail\.weight"),
        (
            changed(pts_linears__2__weight=np.zeros((24, 30))),
            r"pts_linears\.2\.weight is \[24, 30\], expected \[24, 24\] or \[24, 45\]",
        ),
        (changed(pts_linears__0__weight=np.zeros((24, 22))), "22 of its inputs would be an encoding"),
        (changed(pts_linears__1__bias=np.zeros(3)), r"pts_linears\.1\.bias must be \[24\]"),
        (
            changed(rgb_linear__weight=np.zeros((3, 24))),
            r"rgb_linear\.weight is \[3, 24\], expected \[3, 12\]",
        ),
        (changed(alpha_linear__weight=np.zeros((2, 24)), alpha_linear__bias=[0, 0]), r"expected \[1, 24\]"),
        (changed(rgb_linear__bias=[0, np.nan, 0]), r"rgb_linear\.bias must be finite"),
        (changed(rgb_linear__weight=np.zeros(3)), r"rgb_linear\.weight must have 2 dimensions"),
    ],
)
def test_tensors_that_do_not_fit_are_named(tmp_path, arrays, message) -> None:
    file = yenchenlin_file(tmp_path / "a.tar", arrays)
    with pytest.raises(FieldError, match=message):
        read_checkpoint(file)


def test_krrish94_layers_that_do_not_fit_are_named(tmp_path) -> None:
    arrays = krrish94_state()
    arrays["layers_xyz.0.weight"] = np.zeros((16, 20), np.float32)
    with pytest.raises(FieldError, match=r"layers_xyz\.0\.weight is \[16, 20\], expected \[16, 16\]"):
        read_checkpoint(krrish94_file(tmp_path / "a.ckpt", arrays, None))


def test_an_output_layer_of_another_size_is_named(tmp_path) -> None:
    rng = np.random.default_rng(0)
    arrays = state({"pts_linears.0": layer(rng, 8, 15), "output_linear": layer(rng, 3, 8)})
    with pytest.raises(FieldError, match=r"output_linear\.weight is \[3, 8\], expected \[4, 8\]"):
        read_checkpoint(yenchenlin_file(tmp_path / "a.tar", arrays))


class Payload:
    """Pickles as a call, as an attack would."""

    def __init__(self, target: Path) -> None:
        self.target = target

    def __reduce__(self):
        return os.mkdir, (str(self.target),)


def test_a_pickle_that_would_run_code_is_refused_and_not_run(tmp_path) -> None:
    target = tmp_path / "made-by-the-pickle"
    file = yenchenlin_file(tmp_path / "a.tar", extra=Payload(target))
    with pytest.raises(FieldError, match=r"Python objects beside tensors.*refused"):
        read_checkpoint(file)
    assert not target.exists()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"weights": torch.zeros(1)}, "no nerf-pytorch checkpoint: it holds weights; expected"),
        ([1, 2], "holds a list, expected a dict"),
        ({"network_fn_state_dict": 3}, "network_fn_state_dict must be a dict of tensors, got int"),
        ({}, "it holds nothing"),
    ],
)
def test_other_content_is_refused(tmp_path, content, message) -> None:
    torch.save(content, tmp_path / "a.tar")
    with pytest.raises(FieldError, match=message):
        read_checkpoint(tmp_path / "a.tar")


def test_files_that_are_no_checkpoints_are_refused(tmp_path) -> None:
    with pytest.raises(FieldError, match="no such checkpoint; give the"):
        read_checkpoint(tmp_path / "a.tar")
    whole = yenchenlin_file(tmp_path / "b.tar").read_bytes()
    for content in (whole[: len(whole) // 2], b"", b"hello"):
        (tmp_path / "c.tar").write_bytes(content)
        with pytest.raises(FieldError, match=r"not a readable checkpoint|is no checkpoint") as refusal:
            read_checkpoint(tmp_path / "c.tar")
        # a reason in words, or none
        assert re.search(r"\((\d*)\)", str(refusal.value)) is None


def test_a_pickle_of_another_kind_is_refused_without_a_warning(tmp_path) -> None:
    (tmp_path / "a.tar").write_bytes(pickle.dumps({"args": argparse.Namespace()}, protocol=4))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(FieldError, match="so it is refused"):
            read_checkpoint(tmp_path / "a.tar")


@pytest.mark.skipif(not SHARED.is_dir(), reason="../shared/data/nerf-pytorch is not there")
@pytest.mark.parametrize(("name", "octaves"), [("chair", 10), ("lego", 10), ("fern", 6)])
def test_published_networks_have_the_shapes_of_their_weights(name, octaves) -> None:
    (file,) = (SHARED / f"{name}-lowres").glob("*.ckpt")
    found = read_checkpoint(file)
    # 4 layers of 128 whatever config.yml says; the first two are one affine layer
    assert str(found.coarse) == str(found.fine) == f"3 x 128, {octaves} + 4 octaves"
    assert str(found).endswith("(layer1 is folded into layers_xyz.0)")
