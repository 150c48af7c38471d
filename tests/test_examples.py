"""The examples run: a user's own PyTorch module, a nerfacto."""

from __future__ import annotations

import ast
import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import cagefield

pytest.importorskip("torch", reason="PyTorch is not installed (extra nerf)")

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def loaded(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.nightly
def test_an_own_module_is_edited_exactly_and_baked(tmp_path) -> None:
    from cagefield.fields import Field
    from cagefield.images.image_files import read_image
    from cagefield.images.metrics import psnr

    example = loaded("own_field")
    assert isinstance(example.OwnField(example.Torus()), Field)
    example.main(tmp_path / "edited.png")
    picture = read_image(tmp_path / "edited.png")
    exact, fast = picture[:, :64], picture[:, 64:]
    assert exact.shape == fast.shape == (64, 64, 3)
    # 64 voxels of 0.028 for a surface 0.02 wide; both show the edited ring on white
    assert psnr(exact, fast) > 22.0
    assert 0.1 < (exact.min(axis=2) < 250).mean() < 0.9


def test_a_field_of_ones_own_needs_one_import_of_cagefield() -> None:
    tree = ast.parse((EXAMPLES / "own_field.py").read_text(encoding="utf-8"))
    imports = [node for node in ast.walk(tree) if isinstance(node, (ast.Import, ast.ImportFrom))]
    ours = [node for node in imports if "cagefield" in ast.unparse(node)]
    assert [node.module for node in ours if isinstance(node, ast.ImportFrom)] == ["cagefield"]
    assert len(ours) == 1 and {name.name for name in ours[0].names} <= set(cagefield.__all__)


def test_a_nerfacto_is_a_field() -> None:
    pytest.importorskip("nerfstudio", reason="nerfstudio is not installed")
    import torch
    from nerfstudio.fields.nerfacto_field import NerfactoField

    box = torch.tensor([[-1.0, -1, -1], [1, 1, 1]])
    inner = NerfactoField(box, num_images=2, implementation="torch", log2_hashmap_size=12)
    field = loaded("nerfstudio_nerfacto").Nerfacto(inner, box)
    np.testing.assert_array_equal(field.bounds, box.numpy())
    positions = np.random.default_rng(0).uniform(-1, 1, (10, 3)).astype(np.float32)
    sigma, rgb = field(positions, np.tile([[0.0, 0.0, -1.0]], (10, 1)))
    assert sigma.shape == (10,) and rgb.shape == (10, 3)
    assert (sigma >= 0).all() and (rgb >= 0).all() and (rgb <= 1).all()
