"""A NeRF on a device whose numbers the host cannot read: PyTorch's "meta" device, which has shapes alone.

It stands in for a GPU: an operation that reads a number on the host, or joins tensors of two devices, raises.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cagefield import Cage, Edit, EditStack, load_dataset
from cagefield.cameras.camera import Camera
from cagefield.procedural import make_scene

torch = pytest.importorskip("torch", reason="PyTorch is not installed (extra nerf)")

from cagefield.fields.nerf_torch import TorchNerf  # noqa: E402
from cagefield.rendering.nerf import torch_edit_map  # noqa: E402
from cagefield.rendering.nerf.nerf_renderer import Jitter, Rays, march, trace  # noqa: E402
from cagefield.training.nerf.nerf_config import NerfConfig  # noqa: E402
from cagefield.training.nerf.nerf_run import NerfRun  # noqa: E402
from nerf_networks import small_field  # noqa: E402

FAR = torch.device("meta")
CAMERA = Camera.look_at((0.0, -4.0, 1.0), (0.0, 0.0, 0.0), width=6, height=5, fov_x=0.8)
EDITS = EditStack([Edit.move(Cage.box((0, 0, 0), 0.4)).translate((0.2, 0, 0))])
KINDS = [{}, {"lindisp": True}, {"ndc": (0.6, 0.5)}, {"bounded": True}]


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, ...]]:
    """What the edits' kernel is called with, which the stand-in cannot run."""
    found: list[tuple[Any, ...]] = []
    monkeypatch.setattr(torch_edit_map, "map_tensors", lambda *arguments: found.append(arguments))
    # How many samples are in bounds is the one number that is asked for.
    monkeypatch.setattr(torch, "nonzero", lambda mask: torch.empty((len(mask), 1), dtype=int, device=FAR))
    return found


def test_the_stand_in_refuses_what_a_round_trip_does() -> None:
    values = torch.zeros(3, device=FAR)
    for trip in (values.cpu, values.numpy, values.sum().item, lambda: values + torch.zeros(3)):
        with pytest.raises((RuntimeError, NotImplementedError, TypeError)):
            trip()


@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_edited_rays_are_traced_without_the_host(kind: dict[str, Any], calls: list[tuple[Any, ...]]) -> None:
    field = TorchNerf(small_field(**kind), FAR)
    parts = trace(field, Rays.from_camera(CAMERA, FAR), EDITS)
    assert [(part.device.type, tuple(part.shape)) for part in parts] == [
        ("meta", (30, 3)), ("meta", (30,)), ("meta", (30,)),
    ]  # fmt: skip
    assert [len(samples) for samples, *_ in calls] == [30 * 12, 30 * 28]
    for samples, _deal, out, edits, *_ in calls:
        assert {values.device.type for values in (samples, out, edits.params, edits.lattice)} == {"meta"}


@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_a_training_step_goes_forward_and_back_without_the_host(
    kind: dict[str, Any], calls: list[tuple[Any, ...]]
) -> None:
    field = TorchNerf(small_field(**kind), FAR, trainable=True)
    coarse, fine = march(field, Rays.from_camera(CAMERA, FAR), jitter=Jitter(1.0))
    optimizer = torch.optim.Adam(field.parameters)
    (coarse.premultiplied.mean() + fine.premultiplied.mean()).backward()
    optimizer.step()
    assert {values.grad.device.type for values in field.parameters} == {"meta"}
    assert not calls


@pytest.mark.nightly
def test_networks_in_half_precision_learn_as_those_in_full(tmp_path) -> None:
    photos = load_dataset(make_scene("microphone", tmp_path / "m", views=8, size=24, test_views=2))
    runs = {}
    for half in (False, True):
        config = NerfConfig.small(
            width=24, depth=3, samples=(12, 12), octaves=(4, 2), precrop_steps=3, steps=200, bfloat16=half
        )
        run = runs[half] = NerfRun(photos, config)
        kinds = set()
        network = run.torch.coarse
        trunk = network.trunk
        network.trunk = lambda p, trunk=trunk, kinds=kinds: kinds.add((found := trunk(p))[0].dtype) or found
        while run.done < 1.0:
            run.advance()
        assert kinds == {torch.bfloat16 if half else torch.float32}
    assert all(values.dtype == torch.float32 for values in runs[True].torch.parameters)
    full, half = (runs[kind].progress().psnr for kind in (False, True))
    assert half > full - 1.0
    weights = [run.field().coarse.density.weight for run in runs.values()]
    assert np.abs(weights[0] - weights[1]).max() > 0.0
