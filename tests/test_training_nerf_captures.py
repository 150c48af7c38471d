"""NeRFs of captures without bounds: the worlds they are moved to, how they are sampled, that they learn."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from cagefield import Scene, load_dataset
from cagefield.datasets import Dataset
from cagefield.datasets.nerf_normalization import (
    ndc_box,
    ndc_obstacle,
    normalize_to_ndc,
    normalize_to_unit_cube,
)
from cagefield.errors import CagefieldError, DatasetError
from cagefield.fields.contraction import contract
from cagefield.procedural import make_scene
from commands import printed, refused
from posed_photos import room_capture
from tiers import nightly_after_first

torch = pytest.importorskip("torch", reason="PyTorch is not installed (extra nerf)")

from cagefield.training.nerf.nerf_config import NerfConfig  # noqa: E402
from cagefield.training.nerf.nerf_run import PHOTOS_PER_BATCH, NerfRun  # noqa: E402
from cagefield.training.nerf.nerf_space import build_sampling_space  # noqa: E402
from cagefield.training.nerf.train_nerf import train_nerf  # noqa: E402

SMALL = NerfConfig.small


@pytest.fixture(scope="module")
def forward(tmp_path_factory) -> Path:
    return room_capture(tmp_path_factory.mktemp("forward"))


@pytest.fixture(scope="module")
def around(tmp_path_factory) -> Path:
    return room_capture(tmp_path_factory.mktemp("around"), forward_facing=False)


def tiny(**options) -> NerfConfig:
    small = {
        "width": 32,
        "depth": 3,
        "samples": (16, 16),
        "batch_rays": 96,
        "octaves": (4, 1),
        "precrop_steps": 0,
    }
    return SMALL(**{**small, **options})


def flat_psnr(dataset: Dataset) -> float:
    """PSNR of the test photos against the mean color of the training photos: a picture without content."""
    color = np.concatenate([view.load().reshape(-1, 3) for view in dataset.train]).mean(axis=0) / 255
    return float(np.mean([-10 * np.log10(((v.load() / 255 - color) ** 2).mean()) for v in dataset.test]))


def unstated(dataset: Dataset) -> Dataset:
    """The capture as if nothing were known of its depth."""
    return dataclasses.replace(dataset, depths=None)


def test_the_nearest_and_farthest_depth_are_those_of_the_file(forward) -> None:
    assert load_dataset(forward).depths == (3.5, 14.0)
    with pytest.raises(DatasetError, match=r"depths must be 0 < nearest < farthest, got \(2, 1\)"):
        dataclasses.replace(load_dataset(forward), depths=(2, 1))


def test_moving_a_capture_changes_no_picture(forward) -> None:
    """A world point is seen at the same pixels before and after, and `source_to_world` follows."""
    dataset = load_dataset(forward)
    source = np.array([[0.5, 0.1, -6.0], [-1.0, 2.0, -11.0]])
    for moved in (normalize_to_ndc(dataset)[0], normalize_to_unit_cube(dataset)):
        for before, after in zip(dataset.train, moved.train, strict=True):
            pixels = [
                view.camera.project(source @ data.source_to_world[:3, :3].T + data.source_to_world[:3, 3])[0]
                for data, view in ((dataset, before), (moved, after))
            ]
            np.testing.assert_allclose(pixels[1], pixels[0], atol=1e-9)
        scale = np.cbrt(np.linalg.det(moved.source_to_world[:3, :3]))
        np.testing.assert_allclose(moved.depths, np.multiply(dataset.depths, scale))


def test_a_forward_facing_capture_is_trained_in_ndc(forward) -> None:
    dataset = load_dataset(forward)
    space = build_sampling_space(dataset)
    camera = dataset.train[0].camera
    assert space.ndc == pytest.approx((camera.width / (2 * camera.fx), camera.height / (2 * camera.fy)))
    assert (space.near, space.far, space.lindisp) == (0.0, 1.0, False)
    cameras = [view.camera for view in (*space.dataset.train, *space.dataset.test)]
    np.testing.assert_allclose(np.mean([c.origin for c in cameras], axis=0), 0, atol=1e-12)
    ahead = np.mean([c.forward for c in cameras], axis=0)
    np.testing.assert_allclose(ahead / np.linalg.norm(ahead), [0, 0, -1], atol=1e-12)
    # the nearest bound at 4/3, so that the near plane z = -1 has a margin
    assert space.dataset.depths is not None and space.dataset.depths[0] == pytest.approx(4 / 3)
    assert build_sampling_space(dataset, ndc=False).ndc is None


def test_the_box_of_ndc_contracts_space_to_them() -> None:
    """Inside the pyramid of sight, beyond z = -1: (x', y', z') = (2 - 1/|z|) (x/(a|z|), y/(b|z|), -1)."""
    a, b = 0.6, 0.4
    rng = np.random.default_rng(0)
    z = -rng.uniform(1, 50, 200)
    x, y = rng.uniform(-1, 1, (2, 200)) * np.abs(z) * [[a], [b]]
    box = ndc_box((a, b))
    np.testing.assert_allclose(box.mean(axis=0), 0)
    found = contract(np.stack([x, y, z], axis=1) / box[1])
    picture = np.stack([x / (a * -z), y / (b * -z), -np.ones(200)], axis=1)
    np.testing.assert_allclose(found, (2 - 1 / -z)[:, None] * picture, atol=1e-12)


def test_other_captures_are_sampled_in_depth(around) -> None:
    dataset = load_dataset(around)
    space = build_sampling_space(dataset)
    assert space.ndc is None and space.lindisp
    np.testing.assert_allclose(space.dataset.bounds, [[-1] * 3, [1] * 3])
    scale = 2.0 / (dataset.bounds[1] - dataset.bounds[0]).max()
    np.testing.assert_allclose((space.near, space.far), (0.9 * 3.5 * scale, 14.0 * scale))
    assert "even in 1/depth" in str(space)
    # without stated depths, multiples of the cameras' distance from the ball, 5
    unknown = build_sampling_space(unstated(dataset))
    np.testing.assert_allclose((unknown.near, unknown.far), (0.2 * 5 * scale, 20 * 5 * scale), rtol=0.02)


def test_bounded_scenes_stay_as_they_are(tmp_path) -> None:
    dataset = load_dataset(make_scene("plant", tmp_path / "p", views=3, size=16, test_views=1))
    space = build_sampling_space(dataset)
    assert space.dataset is dataset and space.ndc is None and not space.lindisp
    box = dataset.bounds
    points = np.random.default_rng(0).uniform(box[0], box[1], (500, 3))
    for view in dataset.train:
        depth = (points - view.camera.origin) @ view.camera.forward
        assert space.near <= depth.min() and depth.max() <= space.far


def test_ndc_are_refused_where_they_do_not_suit(forward, around, tmp_path) -> None:
    dataset = load_dataset(forward)
    assert ndc_obstacle(dataset) is None
    with pytest.raises(CagefieldError, match=r"cannot be trained in NDC: camera .* looks aside"):
        train_nerf(load_dataset(around), tiny(ndc=True))
    with pytest.raises(CagefieldError, match="nothing is known of its depth"):
        build_sampling_space(unstated(dataset), ndc=True)
    bounded = load_dataset(make_scene("plant", tmp_path / "p", views=2, size=16, test_views=1))
    with pytest.raises(CagefieldError, match="it is bounded, and NDC are for forward-facing captures"):
        build_sampling_space(bounded, ndc=True)
    with pytest.raises(CagefieldError, match="stands beyond the nearest depth"):
        build_sampling_space(dataclasses.replace(dataset, depths=(0.1, 14.0)), ndc=True)
    turned = [
        dataclasses.replace(v, camera=v.camera.with_c2w(v.camera.c2w @ np.diag([-1.0, 1, -1, 1])))
        for v in dataset.train[::2]
    ]
    with pytest.raises(CagefieldError, match="its cameras look all around"):
        build_sampling_space(
            dataclasses.replace(dataset, train=(*dataset.train[1::2], *turned), test=()), ndc=True
        )


@pytest.mark.parametrize(("kind", "gain"), nightly_after_first([("forward", 2.0), ("around", 0.5)]))
def test_it_learns(kind, gain, request) -> None:
    dataset = load_dataset(request.getfixturevalue(kind))
    result = train_nerf(dataset, tiny(steps=150))
    assert (result.space.ndc is not None) == (kind == "forward")
    assert result.test_psnr > flat_psnr(dataset) + gain


def test_captures_are_trained_with_noise_on_the_density(forward, tmp_path) -> None:
    """Without it a network whose density starts below its ReLU stays empty: black is what it shows."""
    assert NerfRun(load_dataset(forward), tiny()).jitter.noise == 1.0
    assert NerfRun(load_dataset(forward), tiny(raw_noise_std=0.25)).jitter.noise == 0.25
    bounded = make_scene("plant", tmp_path / "p", views=2, size=16, test_views=1)
    assert NerfRun(load_dataset(bounded), tiny()).jitter.noise == 0.0


def test_a_batch_of_a_capture_holds_rays_of_several_photos(forward) -> None:
    run = NerfRun(load_dataset(forward), tiny(batch_rays=33))
    rays, target = run.next_batch()
    assert len(rays.origins) == len(target) == 33
    assert 3 <= len(np.unique(rays.origins.numpy(), axis=0)) <= PHOTOS_PER_BATCH


@pytest.mark.parametrize("kind", ["forward", "around"])
def test_a_resumed_run_ends_where_an_uninterrupted_one_does(kind, request, tmp_path) -> None:
    dataset = load_dataset(request.getfixturevalue(kind))
    runs = [NerfRun(dataset, tiny(steps=6)) for _ in range(3)]

    def advance(run: NerfRun, steps: int) -> None:
        for _ in range(steps):
            torch.manual_seed(run.step)
            run.advance()

    advance(runs[0], 6)
    advance(runs[1], 3)
    runs[1].store(tmp_path / "state")
    runs[2].restore(tmp_path / "state")
    advance(runs[2], 3)
    for one, other in zip(runs[2].field().coarse.layers(), runs[0].field().coarse.layers(), strict=True):
        np.testing.assert_allclose(one[1].weight, other[1].weight, atol=1e-6)
    with pytest.raises(CagefieldError, match="was written with other options or photos"):
        NerfRun(dataset, tiny(ndc=False)).restore(tmp_path / "state")


@pytest.mark.nightly
def test_the_command_writes_a_scene_that_the_editor_can_show(forward, tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setattr(NerfConfig, "small", classmethod(lambda cls, **options: tiny(**options)))
    argv = [forward, "-o", tmp_path / "scene", "--field", "nerf", "--steps", 120, "--resolution", 48]
    text = printed(capsys, "train", *argv)
    assert "sampled in NDC (forward-facing); train PSNR" in text
    scene = Scene.open(tmp_path / "scene")
    assert scene.original is not None and scene.original.ndc is not None and scene.field.contracted
    assert "NDC" in printed(capsys, "info", tmp_path / "scene")
    camera = scene.cameras["test"][0]
    voxels, exact = scene.render(camera), scene.render(camera, exact=True)
    assert exact.opacity.mean() > 0.8
    # up to 24 voxels across 24 pixels
    assert -10 * np.log10(((voxels.rgb - exact.rgb) ** 2).mean()) > 20.0
    message = refused(capsys, "train", *argv[:2], tmp_path / "other", *argv[3:], "--ndc", "off", "--steps", 0)
    assert "steps is 0" in message
