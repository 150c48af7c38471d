"""Kernels start without PyTorch, and take its tensors once it is there."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

STARTED = """
import json, sys
import numpy as np
from cagefield import Cage, Edit
from cagefield.edits import EditStack, Trilinear
from cagefield.edits.device_stack import DeviceStack

inner = Cage.box((0, 0, 0), 0.5)
stack = EditStack([Edit.continuous(inner, inner.grown(0.5), shell=Trilinear()).translate((0.1, 0, 0))])
points, along = np.full((1, 3), 0.1, np.float32), np.ones((1, 3), np.float32)
mapped = DeviceStack.from_stack(stack).to_canonical(points, along)[0]
found = ["torch" in sys.modules, mapped.tolist()]
"""

TENSORS = """
import torch
from cagefield.rendering.nerf.kernels.torch_edit_map import map_tensors
from cagefield.rendering.nerf.torch_edit_map import TensorMap

mapped = TensorMap(stack, torch.device("cpu"), as_tensors=True)(*map(torch.from_numpy, (points, along)))[0]
found += [mapped.tolist(), map_tensors._primal.src_ll_cache_observations.cache_loaded]
"""


def found(cache: Path, program: str) -> list[object]:
    done = subprocess.run(
        [sys.executable, "-c", program + "print(json.dumps(found))"],
        env={**os.environ, "XDG_CACHE_HOME": str(cache)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    out: list[object] = json.loads(done.stdout.splitlines()[-1])
    return out


@pytest.mark.nightly
@pytest.mark.skipif(importlib.util.find_spec("torch") is None, reason="PyTorch is not installed")
def test_kernels_start_without_pytorch_and_take_its_tensors_later(tmp_path: Path) -> None:
    loaded, by_array, by_tensor, kept = found(tmp_path, STARTED + TENSORS)
    assert not loaded and not kept
    assert by_tensor == by_array != [[0.1, 0.1, 0.1]]
    # The kernel for tensors is kept on the disk as the others are.
    assert found(tmp_path, STARTED + TENSORS) == [False, by_array, by_tensor, True]
    # Where PyTorch was there before, it stays.
    assert found(tmp_path, "import torch\n" + STARTED) == [True, by_array]
