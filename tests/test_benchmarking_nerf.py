"""The edit benchmark on the original NeRF: trained, rendered exactly, told apart from voxels."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from benchmarks.common import workbench
from benchmarks.common.cases import chosen
from benchmarks.common.workbench import Settings, Workbench
from benchmarks.edits.compare_shells import seen
from benchmarks.edits.edit_quality import measure
from benchmarks.edits.edits_table import table

from cagefield.cli import main
from cagefield.images.metrics import psnr
from commands import refused

torch = pytest.importorskip("torch", reason="PyTorch is not installed (extra nerf)")

from cagefield.rendering.nerf.nerf_renderer import NerfRenderer  # noqa: E402
from cagefield.training.nerf.nerf_config import NerfConfig  # noqa: E402


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workbench, "BAKED", 16)


@pytest.mark.nightly
def test_a_nerf_is_measured_by_its_exact_pictures(tmp_path: Path) -> None:
    config = NerfConfig.small(width=24, depth=3, samples=(12, 12), octaves=(4, 2), precrop_steps=3, steps=8)
    settings = Settings(8, 24, 2, config, exact_size=16, exact_views=1, discrete_views=1)
    bench = Workbench(settings, tmp_path)
    (score,) = measure(chosen(["microphone"], ["move_weight"]), bench)
    scene = bench.scene("microphone")
    assert scene.original is not None and max(scene.field.resolution) == 16
    cameras = scene.cameras["test"][:1]
    exact = np.clip(NerfRenderer(scene.original).render(cameras[0], background="white").rgb, 0, 1)
    np.testing.assert_allclose(seen(scene, cameras)[0], exact, atol=1e-6)
    truth = bench.modeled("microphone", cameras)[0] / 255.0
    assert score.views == 1 and score.figures.unedited == pytest.approx(psnr(exact, truth), abs=1e-3)
    text = table([score], settings).markdown()
    assert "8 steps: the original NeRF, networks of 3 x 24, 12 + 12 samples a ray" in text
    assert "voxels along the longest axis" not in text


def test_the_command_trains_the_chosen_preset(tmp_path: Path, capsys, monkeypatch) -> None:
    asked = []

    def refuse(dataset, config, **_) -> None:
        asked.append(config)
        raise KeyboardInterrupt

    monkeypatch.setattr("cagefield.training.nerf.train_nerf.train_nerf", refuse)
    argv = [
        "bench", "edits", "--field", "nerf", "--preset", "small", "--no-methods", "--steps", "5",
        "--scenes", "microphone", "--edits", "delete_base", "--views", "2", "--size", "16",
        "--test-views", "1", "-o", str(tmp_path / "edits.md"),
    ]  # fmt: skip
    assert main(argv) == 130
    assert asked == [NerfConfig.small(steps=5)]


def test_methods_are_not_compared_on_a_nerf(tmp_path: Path, capsys) -> None:
    text = refused(capsys, "bench", "edits", "--field", "nerf", "-o", tmp_path / "edits.md")
    assert "methods are compared on voxels only; give --no-methods" in text


def test_presets_without_a_nerf_are_refused(tmp_path: Path, capsys) -> None:
    text = refused(capsys, "bench", "edits", "--preset", "small", "-o", tmp_path / "edits.md")
    assert "--preset is for the original NeRF; give --field nerf too" in text
    for option, value in (("--preset", "paper"), ("--ndc", "on")):
        text = refused(capsys, "train", tmp_path, "-o", tmp_path / "scene", option, value)
        assert "--preset and --ndc are for the original NeRF; give --field nerf too" in text
