"""Checkpoints of trainings whose parts do not fit together: refused in a line, before anything is taken."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cagefield.compute import devices
from cagefield.datasets import Dataset, load_dataset
from cagefield.errors import CagefieldError
from cagefield.procedural import make_scene
from cagefield.training.checkpoint import read_checkpoint, write_checkpoint
from cagefield.training.checkpoint_checks import check_arrays, check_counts, check_finite, check_run
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.splat_run import SplatRun
from cagefield.training.voxels.voxel_config import VoxelConfig
from cagefield.training.voxels.voxel_run import VoxelRun

devices.start()

Parts = dict[str, Any]


@pytest.fixture(scope="module")
def photos(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    folder = tmp_path_factory.mktemp("photos") / "chair"
    make_scene("chair", folder, views=3, size=12, test_views=1, depth="none")
    return load_dataset(folder)


def stored(run: Any, path: Path, damage: Callable[[Parts, Parts], None]) -> None:
    """The run's checkpoint, with its numbers and arrays changed."""
    run.store(path)
    scalars, arrays = read_checkpoint(path, run._signature())
    damage(scalars, arrays)
    write_checkpoint(path, run._signature(), scalars, arrays)


def put(name: str, value: Any) -> Callable[[Parts, Parts], None]:
    """Puts a number or an array in the place of that name; a function makes it of what is there."""

    def damage(scalars: Parts, arrays: Parts) -> None:
        where = arrays if name in arrays else scalars
        where[name] = value(where[name]) if callable(value) else value

    return damage


def first(value: Any) -> Callable[[Any], Any]:
    """An array with another first number."""

    def changed(array: Any) -> Any:
        copy = array.copy()
        copy.reshape(-1)[0] = value
        return copy

    return changed


COMMON = [
    (lambda scalars, arrays: scalars.pop("step"), "'step'"),
    (lambda scalars, arrays: arrays.pop("gains"), "it has no gains"),
    (put("step", -1), "step is -1"),
    (put("step", 10**40), "step is 1000000"),
    (put("step", 1.5), "step is 1.5"),
    (put("seconds", "3"), "seconds is 3"),
    (put("running_loss", -2.0), "running_loss is -2.0"),
    (put("gains", lambda gains: gains[:1]), "gains is float32"),
    (put("gains", first(np.nan)), "gains holds NaN or infinity"),
]


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        *COMMON,
        (put("density", lambda density: density.astype(np.float64)), "density is float64"),
        (put("density", first(np.inf)), "density holds NaN or infinity"),
        (put("weight", lambda weight: weight[1:]), "weight is float32"),
        (put("vertices", first(-1)), "vertices outside of its grid"),
        (put("vertices", first(10**9)), "vertices outside of its grid"),
        (put("vertices", lambda vertices: first(vertices[1])(vertices)), "vertices that are there twice"),
        (put("resolution", np.array([2000, 2000, 2000])), r"a grid of \[2000, 2000, 2000\] vertices"),
        (put("bounds", lambda bounds: bounds[::-1]), "a grid of"),
        (put("sh", lambda sh: np.repeat(sh, 3, axis=1)), "colors of 12 numbers in stage 0"),
        (put("patches", first(7)), "patches of no photo"),
        (put("position", 10**6), "position is 1000000"),
        (put("epoch", -1), "epoch is -1"),
        (put("stage", 99), "stage is 99"),
        (put("stage_began", 5), "stage_began is 5"),
    ],
)
def test_voxels(photos: Dataset, tmp_path: Path, damage: Any, message: str) -> None:
    run = VoxelRun(photos, VoxelConfig(steps=4, resolution=16))
    stored(run, tmp_path / "x", damage)
    with pytest.raises(CagefieldError, match=rf"x: a damaged checkpoint \({message}.*; start anew"):
        run.restore(tmp_path / "x")


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        *COMMON,
        (lambda scalars, arrays: arrays.pop("running"), "it has no running"),
        (lambda scalars, arrays: arrays.update(more=np.zeros(3)), r"\d+ splats and 15 arrays"),
        (put("means", lambda means: means[1:]), "log_scales is float32"),
        (put("means", first(np.nan)), "means holds NaN or infinity"),
        (put("queue", [7]), r"photos that come next: \[7\]"),
        (put("queue", [0] * 9), "photos that come next"),
        (put("random", {"bit_generator": "MT19937"}), "state must be for a PCG64"),
    ],
)
def test_splats(photos: Dataset, tmp_path: Path, damage: Any, message: str) -> None:
    run = SplatRun(photos, SplatConfig(steps=4, splats=100))
    stored(run, tmp_path / "x", damage)
    with pytest.raises(CagefieldError, match=rf"x: a damaged checkpoint \({message}.*; start anew"):
        run.restore(tmp_path / "x")


def test_what_a_run_wrote_is_taken(photos: Dataset, tmp_path: Path) -> None:
    """After steps, and what has no loss yet."""
    for run in (
        VoxelRun(photos, VoxelConfig(steps=4, resolution=16)),
        SplatRun(photos, SplatConfig(steps=4, splats=100)),
    ):
        for _ in range(3):
            stored(run, tmp_path / "x", lambda scalars, arrays: None)
            run.restore(tmp_path / "x")
            run.advance()
        assert run.step == 3


def test_numbers_without_names_are_no_checkpoint(tmp_path: Path) -> None:
    np.savez(tmp_path / "x.npz", scalars="[1, 2]", config="mine")
    with pytest.raises(CagefieldError, match=r"its numbers have no names.*start anew"):
        read_checkpoint(tmp_path / "x.npz", "mine")


def test_texts_whose_letters_are_none_are_refused(tmp_path: Path) -> None:
    for order in "<>":
        letters = np.array([ord("["), sys.maxunicode + 1], f"{order}u4").view(f"{order}U2")[0:1].reshape(())
        np.savez(tmp_path / "x.npz", scalars=letters, config="mine")
        with pytest.raises(CagefieldError, match=r"letters are none.*start anew"):
            read_checkpoint(tmp_path / "x.npz", "mine")


@pytest.mark.nightly
def test_the_sums_of_other_networks_are_refused(photos: Dataset, tmp_path: Path) -> None:
    torch = pytest.importorskip("torch", reason="PyTorch is not installed (extra nerf)")
    from cagefield.training.nerf.nerf_config import NerfConfig
    from cagefield.training.nerf.nerf_run import NerfRun

    run = NerfRun(photos, NerfConfig(steps=4, width=8, depth=2, samples=(4, 4), batch_rays=16))
    run.advance()
    run.store(tmp_path / "x")
    run.restore(tmp_path / "x")
    for name, value in (("exp_avg", torch.zeros(3)), ("step", torch.tensor(-5.0))):
        state = torch.load(tmp_path / "x", weights_only=True)
        state["optimizer"]["state"][0][name] = value
        torch.save(state, tmp_path / "y")
        with pytest.raises(CagefieldError, match=r"sums of gradients of other networks.*start anew"):
            run.restore(tmp_path / "y")
    state = torch.load(tmp_path / "x", weights_only=True)
    torch.save(state | {"step": -1}, tmp_path / "y")
    with pytest.raises(CagefieldError, match=r"step is -1.*start anew"):
        run.restore(tmp_path / "y")


def test_the_checks_themselves() -> None:
    arrays = {"a": np.zeros((3, 2)), "b": np.zeros(3, np.int32)}
    assert check_arrays(arrays, {"a": ("float64", ("N", 2)), "b": ("int32", ("N",))}) == {"N": 3}
    for form, message in (
        (("float64", ("N",)), r"a is float64 \[3, 2\], not float64 \[3\]"),
        (("float32", ("N", 2)), r"a is float64 \[3, 2\], not float32 \[3, 2\]"),
        (("float64", (4, 2)), r"not float64 \[4, 2\]"),
    ):
        with pytest.raises(ValueError, match=message):
            check_arrays(arrays, {"a": form})
    check_finite(arrays, ("a",))
    check_counts({"n": 3}, n=3)
    for value in (4, -1, True, "3", None):
        with pytest.raises(ValueError, match="not a whole number up to 3"):
            check_counts({"n": value}, n=3)
    check_run({"step": 0, "seconds": 0, "loss": float("nan")}, "loss")
    with pytest.raises(ValueError, match="seconds is no number"):
        check_run({"step": 0, "seconds": float("nan"), "loss": 1.0}, "loss")
