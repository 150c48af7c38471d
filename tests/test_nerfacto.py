"""nerfacto checkpoints of both layouts against scalar loops, its ray samples against np.interp."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed (extra nerf)")

import nerfacto_files as files  # noqa: E402
from cagefield.cameras.camera import Camera  # noqa: E402
from cagefield.errors import FieldError  # noqa: E402
from cagefield.fields.external.external_field import number, whole_number  # noqa: E402
from cagefield.fields.external.external_file import load_external, save_external  # noqa: E402
from cagefield.fields.external.nerfacto import NerfactoField  # noqa: E402
from cagefield.fields.external.nerfacto_torch import next_bins  # noqa: E402
from cagefield.formats.external.nerfstudio_config import read_config  # noqa: E402
from cagefield.formats.external.read_external import read_external  # noqa: E402
from cagefield.rendering.external.external_renderer import ExternalRenderer  # noqa: E402
from hash_oracle import (  # noqa: E402
    PHASE,
    harmonics,
    perceptron,
    sigmoid,
    tcnn_features,
    tcnn_levels,
    torch_features,
)

Array = np.ndarray[Any, Any]

# float32 sums of a few hundred products of size 1
TOLERANCE = 2e-5

POSITIONS = np.array(
    [[0.1, -0.2, 0.3], [0.7, 0.5, -0.9], [0.99, -0.99, 0.2], [3.0, 0.5, -1.0], [-40.0, 7.0, 90.0]], np.float32
)
DIRECTIONS = np.array(
    [[0.6, 0.0, 0.8], [0.0, -1.0, 0.0], [-0.48, 0.6, 0.64], [0.28, -0.96, 0.0], [-0.6, -0.64, -0.48]],
    np.float32,
)


def contracted(p: Array) -> Array:
    m = float(np.abs(p).max())
    return p if m < 1.0 else (2.0 - 1.0 / m) * p / m


def oracle(p: Array, d: Array, values: dict[str, Any], layout: str) -> tuple[float, Array]:
    """(sigma, rgb) at a position of a contracted field with density scale .5 and the mean embedding."""
    x = (contracted(p.astype(float)) + 2.0) / 4.0
    g, torch_layout = files.GRID, layout == "torch"
    if torch_layout:
        features = torch_features(x, values["table"], 4, 4, files.growth(g), 9)
        hidden = perceptron(features, *values["base"])
        basis = harmonics((d + 1.0) / 2.0)
    else:
        features = tcnn_features(x, values["table"], tcnn_levels(4, 4, files.growth(g), 9))
        hidden = perceptron(features, values["base"][0])  # behind a grid, padding is 0
        basis = PHASE * harmonics(d)
    inputs = np.concatenate([basis, hidden[1:], values["appearance"].mean(axis=0)])
    matrices, biases = values["head"]
    if torch_layout:
        color = perceptron(inputs, matrices, biases)
    else:  # a network alone is padded with ones, to 48 inputs; the file's padding holds .25
        extra = [np.full((len(matrices[0]), 48 - len(inputs)), 0.25), np.ones(48 - len(inputs))]
        first = np.concatenate([matrices[0], extra[0]], axis=1)
        color = perceptron(np.concatenate([inputs, extra[1]]), [first, *matrices[1:]])
    return 0.5 * float(np.exp(hidden[0])), sigmoid(color)


@pytest.mark.parametrize("layout", ["torch", "tcnn"])
def test_density_and_color_are_those_of_scalar_loops(tmp_path: Path, layout: str) -> None:
    found = read_external(files.write_run(tmp_path, layout))
    assert found is not None and isinstance(found.field, NerfactoField) and found.field.unbounded
    sigma, rgb = found.field(POSITIONS, DIRECTIONS)
    values = files.arrays(layout=layout)
    for row, (p, d) in enumerate(zip(POSITIONS, DIRECTIONS, strict=True)):
        expected = oracle(p, d, values, layout)
        assert sigma[row] == pytest.approx(expected[0], rel=20 * TOLERANCE)
        assert rgb[row] == pytest.approx(expected[1], abs=TOLERANCE)
    several = found.field.evaluate_directions(POSITIONS, DIRECTIONS[None].repeat(5, axis=0))[1]
    assert several[[0, 1, 2], [0, 1, 2]] == pytest.approx(rgb[:3], abs=TOLERANCE)


def test_zeros_replace_the_appearance_where_the_config_says_so(tmp_path: Path) -> None:
    mean = read_external(files.write_run(tmp_path / "a"))
    zeros = read_external(files.write_run(tmp_path / "b", mean=False))
    assert mean is not None and zeros is not None
    values = files.arrays()
    values["appearance"] = np.zeros_like(values["appearance"])
    expected = oracle(POSITIONS[0], DIRECTIONS[0], values, "torch")[1]
    assert zeros.field(POSITIONS[:1], DIRECTIONS[:1])[1][0] == pytest.approx(expected, abs=TOLERANCE)
    assert not np.allclose(mean.field(POSITIONS, DIRECTIONS)[1], zeros.field(POSITIONS, DIRECTIONS)[1])


def test_a_field_without_contraction_ends_at_its_box(tmp_path: Path) -> None:
    found = read_external(files.write_run(tmp_path, box=True, background="white"))
    assert found is not None and isinstance(found.field, NerfactoField)
    assert not found.field.unbounded and found.background == (1.0, 1.0, 1.0)
    sigma = found.field(np.array([[1.49, 0, 0], [1.51, 0, 0]]), DIRECTIONS[:2])[0]
    assert sigma[0] > 0.0 and sigma[1] == 0.0


def test_world_takes_the_reconstruction_to_the_fields_coordinates(tmp_path: Path) -> None:
    found = read_external(files.write_run(tmp_path))
    assert found is not None and found.from_source
    # .5 (R p + t) with R p = (-y, x, z) and t = (.5, 0, -.25)
    assert found.world.transform_points(np.array([[1.0, 2.0, 3.0]]))[0] == pytest.approx([-0.75, 0.5, 1.375])


def test_a_field_file_keeps_everything(tmp_path: Path) -> None:
    found = read_external(files.write_run(tmp_path, "tcnn"))
    assert found is not None and isinstance(found.field, NerfactoField)
    save_external(found.field, tmp_path / "field.safetensors")
    loaded = load_external(tmp_path / "field.safetensors", NerfactoField.KIND)
    assert loaded.describe() == found.field.describe()
    camera = Camera.from_fov(np.eye(4), 6, 4, 1.0)
    pictures = [ExternalRenderer(field).render(camera).rgb for field in (found.field, loaded)]
    assert np.array_equal(*pictures)


def test_next_bins_are_quantiles_of_the_padded_weights() -> None:
    rng = np.random.default_rng(3)
    bins = np.sort(rng.random((7, 12)), axis=1)
    weights = rng.random((7, 11)) ** 4
    found = next_bins(torch.from_numpy(bins), torch.from_numpy(weights), 20).numpy()
    u = (np.arange(21) + 0.5) / 21
    for row in range(7):
        padded = weights[row] + 0.01
        total = np.concatenate([[0.0], np.cumsum(padded / padded.sum())])
        # torch.linspace is float32
        assert found[row] == pytest.approx(np.interp(u, total, bins[row]), abs=1e-5)


@pytest.mark.parametrize("spacing", ["piecewise", "uniform"])
def test_samples_reach_from_the_camera_to_far(tmp_path: Path, spacing: str) -> None:
    found = read_external(files.write_run(tmp_path, spacing=spacing))
    assert found is not None and isinstance(found.field, NerfactoField)
    empty = torch.zeros(2, 3), torch.tensor([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
    samples = found.field.torch.ray_samples(*empty, None, lambda _, t: torch.zeros_like(t))
    assert samples.t.shape == (2, 24)
    # With empty proposals the weights' padding is even: quantiles (k + 1/2) / 25 of the previous bins', twice
    edge = 0.5 / 17 + (0.5 / 25) * 16 / 17  # first edge of the last round, as a share of [0, 1]
    if spacing == "uniform":
        first = 20.0 * edge
    else:
        s = edge * (1.0 - 0.5 / 20.0)
        first = 2.0 * s
    next_edge = 0.5 / 17 + (1.5 / 25) * 16 / 17
    last = 20.0 * next_edge if spacing == "uniform" else 2.0 * next_edge * (1.0 - 0.5 / 20.0)
    assert float(samples.t[0, 0]) == pytest.approx(0.5 * (first + last), rel=1e-4)
    assert float(samples.delta[0, -1]) == pytest.approx(1e20)


def test_the_last_sample_absorbs_what_is_left(tmp_path: Path) -> None:
    camera = Camera.from_fov(np.eye(4), 5, 5, 1.0)
    endless = read_external(files.write_run(tmp_path / "a"))
    black = read_external(files.write_run(tmp_path / "b", background="black"))
    assert endless is not None and black is not None
    assert isinstance(endless.field, NerfactoField) and isinstance(black.field, NerfactoField)
    assert ExternalRenderer(endless.field).render(camera).opacity == pytest.approx(np.ones((5, 5)), abs=1e-5)
    assert black.field.endless is False


def test_yaml_tags_are_never_followed(tmp_path: Path) -> None:
    config = tmp_path / "config.yml"
    config.write_text("a: !!python/object/apply:os.system ['touch hacked']\nb: !!python/name:os.system ''\n")
    assert read_config(config) == {"a": ["touch hacked"], "b": ""}
    assert not Path("hacked").exists()


CYCLE = "a: &x\n  b: *x\n"
ALIASES = "a: &a [x, x, x, x, x, x, x, x]\n" + "".join(
    f"{b}: &{b} [{', '.join([f'*{a}'] * 8)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    ("text", "message"),
    [(CYCLE, "nested too deeply"), (ALIASES, "values"), ("- 1", "no mapping"), ("a: [", "YAML")],
)
def test_hostile_configs_are_refused(tmp_path: Path, text: str, message: str) -> None:
    checkpoint = files.write_run(tmp_path)
    (tmp_path / "config.yml").write_text(text)
    with pytest.raises(FieldError, match=message) as caught:
        read_external(checkpoint)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [10**400, -(10**400), float("inf"), float("nan"), 1e308])
def test_numbers_beyond_all_floats_are_refused(value: float) -> None:
    with pytest.raises(FieldError, match=r"near is .*; it must be from 0 to 100"):
        number("near", value, 0.0, 100.0)
    with pytest.raises(FieldError, match=r"levels is .*; it must be from 1 to 16"):
        whole_number("levels", value, 1, 16)


def test_a_missing_config_names_the_option(tmp_path: Path) -> None:
    checkpoint = files.write_run(tmp_path)
    (tmp_path / "config.yml").unlink()
    with pytest.raises(FieldError, match=r"config\.yml.*--config"):
        read_external(checkpoint)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("num_levels: 4", "num_levels: 5", "entries"),
        ("far_plane: 20.0", "far_plane: -1", "far_plane"),
        ("    - 32\n", "    - many\n", "number of samples"),
        ("background_color: last_sample", "background_color: plaid", "background_color"),
        ("disable_scene_contraction: false", "disable_scene_contraction: perhaps", "true or false"),
        ("max_res: 32", "max_res: 999999999999", "max_res"),
        ("log2_hashmap_size: 9", "log2_hashmap_size: 31", "log2_hashmap_size"),
        ("  model:", "  other:", "pipeline.model"),
    ],
)
def test_options_that_do_not_fit_are_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    checkpoint = files.write_run(tmp_path)
    config = tmp_path / "config.yml"
    text = config.read_text()
    assert old in text
    config.write_text(text.replace(old, new, 1))
    with pytest.raises(FieldError, match=message):
        read_external(checkpoint)


@pytest.mark.parametrize("layout", ["torch", "tcnn"])
def test_a_missing_tensor_is_named(tmp_path: Path, layout: str) -> None:
    checkpoint = files.write_run(tmp_path, layout)
    content = torch.load(checkpoint, weights_only=True)
    for name in [n for n in content["pipeline"] if "embedding" not in n]:
        rest = {key: value for key, value in content["pipeline"].items() if key != name}
        torch.save({**content, "pipeline": rest}, checkpoint)
        with pytest.raises(FieldError, match=r"pipeline|config|neither|another model"):
            read_external(checkpoint)
