"""The NeRF trainer: it learns, resumes to the same field, crops first, and refuses what it cannot train."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cagefield import Scene, load_dataset
from cagefield.cli import bake, main
from cagefield.errors import CagefieldError, FieldError
from cagefield.fields.nerf_field import NerfField
from cagefield.procedural import make_scene
from commands import printed, refused

torch = pytest.importorskip("torch", reason="PyTorch is not installed (extra nerf)")

from cagefield.training.nerf.nerf_config import NerfConfig  # noqa: E402
from cagefield.training.nerf.nerf_run import NerfRun, build_initial_network  # noqa: E402
from cagefield.training.nerf.train_nerf import evaluate_nerf, train_nerf  # noqa: E402
from tiers import nightly_after_first  # noqa: E402


@pytest.fixture(scope="module")
def photos(tmp_path_factory) -> Path:
    return make_scene("microphone", tmp_path_factory.mktemp("photos") / "m", views=8, size=24, test_views=2)


SMALL = NerfConfig.small


QUICK = ("--field", "nerf", "--preset", "small", "--steps", 60, "--resolution", 24)
"""Options of a command that trains in seconds, also where a GPU would take the paper's networks."""


def tiny(**options) -> NerfConfig:
    small = {
        "width": 24,
        "depth": 3,
        "samples": (12, 12),
        "batch_rays": 64,
        "octaves": (4, 2),
        "precrop_steps": 3,
    }
    return SMALL(**{**small, "render_samples": None, **options})


def test_it_learns(photos) -> None:
    dataset = load_dataset(photos)
    before = train_nerf(dataset, tiny(steps=1))
    after = train_nerf(dataset, tiny(steps=170))
    assert after.finished and after.steps == 170
    # an untrained network shows gray fog in the box around the scene; 170 steps find the shape
    assert after.train_psnr > before.train_psnr + 3.0
    assert after.test_psnr > before.test_psnr + 2.0


def test_a_resumed_run_ends_where_an_uninterrupted_one_does(photos, tmp_path) -> None:
    dataset = load_dataset(photos)
    config = tiny(steps=12)

    whole = NerfRun(dataset, config)
    first = NerfRun(dataset, config)
    for _ in range(12):
        # torch's chance is that of the step, so that a pause changes nothing
        torch.manual_seed(whole.step)
        whole.advance()
    for _ in range(5):
        torch.manual_seed(first.step)
        first.advance()
    first.store(tmp_path / "state")
    second = NerfRun(dataset, config)
    second.restore(tmp_path / "state")
    for _ in range(7):
        torch.manual_seed(second.step)
        second.advance()
    # the learning rate and the photos' rays depend on the step alone; Adam's moments are carried over
    for one, other in zip(second.field().coarse.layers(), whole.field().coarse.layers(), strict=True):
        np.testing.assert_allclose(one[1].weight, other[1].weight, atol=1e-6)
    assert second.step == 12


def test_a_checkpoint_of_other_options_is_refused(photos, tmp_path) -> None:
    dataset = load_dataset(photos)
    NerfRun(dataset, tiny()).store(tmp_path / "state")
    with pytest.raises(CagefieldError, match="was written with other options or photos"):
        train_nerf(dataset, tiny(width=20, steps=1), checkpoint=tmp_path / "state", resume=True)
    with pytest.raises(CagefieldError, match=r"no checkpoint at .* to resume from"):
        train_nerf(dataset, tiny(), checkpoint=tmp_path / "none", resume=True)
    (tmp_path / "state").write_bytes(b"hello")
    with pytest.raises(CagefieldError, match="is no checkpoint of this training"):
        train_nerf(dataset, tiny(), checkpoint=tmp_path / "state", resume=True)


def test_a_checkpoint_may_be_named_by_text_and_needs_a_folder_before_the_first_step(photos, tmp_path) -> None:
    dataset, told = load_dataset(photos), []
    with pytest.raises(CagefieldError, match=r"there is no folder .*none for the checkpoint"):
        train_nerf(dataset, tiny(), checkpoint=str(tmp_path / "none" / "state"), on_progress=told.append)
    assert not told
    train_nerf(dataset, tiny(steps=1), checkpoint=str(tmp_path / "state"))
    assert train_nerf(dataset, tiny(steps=1), checkpoint=str(tmp_path / "state"), resume=True).steps == 1


def test_warm_up_rays_come_from_the_middle(photos) -> None:
    run = NerfRun(load_dataset(photos), tiny(batch_rays=400))

    def edge_cosine() -> float:
        return float(run.next_batch()[0].cosines.min())

    early = edge_cosine()
    run.step = 3
    assert edge_cosine() < early
    # a quarter of the picture's width off its axis, against half of it
    camera = run.dataset.train[0].camera
    quarter = np.cos(np.arctan(np.hypot(camera.width / 4, camera.height / 4) / camera.fx))
    assert early > quarter - 1e-3


def test_targets_are_the_photos_colors_on_white(photos) -> None:
    dataset = load_dataset(photos)
    run = NerfRun(dataset, tiny(batch_rays=50))
    rays, target = run.next_batch()
    origin = rays.origins[0].cpu().numpy()
    (view,) = [v for v in dataset.train if np.allclose(v.camera.origin, origin, atol=1e-5)]
    pixels = view.camera.project(origin + 2.0 * rays.directions.cpu().numpy())[0].astype(int)
    photo = view.load().astype(np.float64) / 255
    shown = photo[pixels[:, 1], pixels[:, 0]]
    np.testing.assert_allclose(
        target.cpu().numpy(), shown[:, :3] * shown[:, 3:] + 1 - shown[:, 3:], atol=1e-5
    )


def test_presets_have_the_papers_networks_and_small_ones() -> None:
    chance = np.random.default_rng(0)
    box = np.array([[-1.0] * 3, [1.0] * 3])
    paper = build_initial_network(NerfConfig(), chance, box)
    assert str(paper) == "8 x 256, 10 + 4 octaves" and paper.skips.index(True) == 5
    assert sum(layer.weight.size + layer.bias.size for _, layer in paper.layers()) == 595_844
    assert str(build_initial_network(NerfConfig.small(), chance, box)) == "4 x 128, 8 + 3 octaves"


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("config", [NerfConfig(), SMALL(), tiny()], ids=str)
def test_an_untrained_network_is_thin_fog_so_that_it_can_learn(config, seed) -> None:
    box = np.array([[-3.0, 0.0, 1.0], [1.0, 1.0, 2.0]])
    chance = np.random.default_rng(seed)
    field = NerfField(build_initial_network(config, chance, box), None, box, 1.0, 2.0)
    points = chance.uniform(*box, (2000, 3))
    sigma, _ = field(points, np.broadcast_to([0.0, 0.0, 1.0], points.shape))
    # as PyTorch draws biases, two networks of five are empty everywhere and have no gradient at all
    assert np.median(sigma) == pytest.approx(0.5 / 2.0, rel=0.1)
    assert (sigma > 0.0).mean() > 0.6


@pytest.mark.parametrize("seed", nightly_after_first(range(3)))
def test_both_networks_learn(photos, seed) -> None:
    run = NerfRun(load_dataset(photos), tiny(steps=60, seed=seed))
    while run.done < 1.0:
        run.advance()
    after = run.field()
    for name in ("coarse", "fine"):
        for (layer, old), (_, new) in zip(
            getattr(run.start, name).layers(), getattr(after, name).layers(), strict=True
        ):
            assert np.abs(new.weight - old.weight).max() > 1e-3, (name, layer)


def test_pictures_may_have_more_samples_than_the_training(photos, tmp_path) -> None:
    dataset = load_dataset(photos)
    run = NerfRun(dataset, tiny(steps=1, render_samples=(20, 10)))
    assert run.torch.field.samples == (12, 12) and run.field().samples == (20, 10)
    run.store(tmp_path / "state")
    other = NerfRun(dataset, tiny(steps=1))
    other.restore(tmp_path / "state")
    assert other.field().samples == (12, 12)


def test_a_field_without_fine_samples_has_one_network(photos) -> None:
    result = train_nerf(load_dataset(photos), tiny(steps=2, samples=(8, 0)))
    assert result.field.fine is None


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"steps": 0}, "steps is 0; it must be from 1"),
        ({"depth": 0}, "depth is 0"),
        ({"width": 1}, "width is 1"),
        ({"batch_rays": 0}, "batch_rays is 0"),
        ({"octaves": (-1, 4)}, r"octaves are \(-1, 4\); each must be from 0 to 16"),
        ({"minutes": -1.0}, "minutes is -1.0; it must be above 0"),
        ({"lr": 2.0}, "lr is 2.0; it must be between 0 and 1"),
    ],
)
def test_impossible_options_are_refused(options, message) -> None:
    with pytest.raises(CagefieldError, match=message):
        NerfConfig(**options)


def test_no_views_have_no_psnr(photos) -> None:
    field = train_nerf(load_dataset(photos), tiny(steps=1)).field
    assert np.isnan(evaluate_nerf(field, ()).psnr)


def test_the_command_writes_a_scene_with_both_fields(photos, tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setattr(NerfConfig, "small", classmethod(lambda cls, **options: tiny(**options)))
    argv = [photos, "-o", tmp_path / "scene", *QUICK]
    text = printed(capsys, "train", *argv)
    assert (
        "60 steps, networks of 3 x 24, 4 + 2 octaves, sampled from depth" in text and "; train PSNR" in text
    )
    assert "PSNR of the voxels against the original" in text
    scene = Scene.open(tmp_path / "scene")
    assert scene.original is not None and scene.original.samples == (12, 12)
    assert len(scene.cameras["train"]) == 8
    assert not (tmp_path / "scene.training").exists()
    monkeypatch.setitem(__import__("sys").modules, "torch", None)
    message = refused(capsys, "train", photos, "-o", tmp_path / "other", "--field", "nerf")
    assert "--field nerf needs PyTorch" in message


@pytest.mark.parametrize(("words", "degree"), [([], 2), (["--sh-degree", 0], 0)])
def test_the_voxels_of_a_nerf_have_the_degree_that_is_asked_for(
    photos, tmp_path, monkeypatch, words, degree
) -> None:
    monkeypatch.setattr(NerfConfig, "small", classmethod(lambda cls, **options: tiny(**options)))
    found = []

    def asked(original, cameras, background, options, **_) -> None:
        found.append(options.sh_degree)
        raise FieldError("enough")

    monkeypatch.setattr(bake, "bake_scene", asked)
    argv = ["train", photos, "-o", tmp_path / "scene", "--field", "nerf", "--steps", 1, *words]
    assert main([str(word) for word in argv]) == 2
    assert found == [degree]


@pytest.mark.nightly
def test_a_training_whose_baking_failed_is_kept(photos, tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setattr(NerfConfig, "small", classmethod(lambda cls, **options: tiny(**options)))
    argv = [photos, "-o", tmp_path / "scene", *QUICK]
    bake_scene = bake.bake_scene

    def fails(error: BaseException) -> None:
        def raised(*arguments, **options):
            raise error

        monkeypatch.setattr(bake, "bake_scene", raised)

    def names() -> list[str]:
        return [entry.name for entry in tmp_path.iterdir()]

    fails(FieldError("nothing to bake"))
    capsys.readouterr()
    assert main([str(arg) for arg in ("train", *argv)]) == 2
    line = capsys.readouterr().err.splitlines()[-1]
    kept = "the training is kept: the same command with --resume goes straight to baking"
    assert line == f"cagefield: nothing to bake; {kept}"
    assert names() == ["scene.training"]
    assert "give --resume to go on, or --overwrite" in refused(capsys, "train", *argv)
    other = ("train", photos, "-o", tmp_path / "scene", "--steps", 2, "--resume")
    assert main([str(arg) for arg in other]) == 2
    message = capsys.readouterr().err.splitlines()[-1]  # below lines on the size and the poses of the photos
    assert "another kind of training; give the field that it was started with" in message

    monkeypatch.setattr(NerfRun, "advance", lambda run: pytest.fail("a finished run took a step"))
    fails(KeyboardInterrupt())
    assert main([str(arg) for arg in ("train", *argv, "--resume")]) == 130
    assert capsys.readouterr().out == f"{kept}\n"
    assert names() == ["scene.training"]

    monkeypatch.setattr(bake, "bake_scene", bake_scene)
    assert "60 steps, networks of 3 x 24" in printed(capsys, "train", *argv, "--resume")
    assert names() == ["scene"]
