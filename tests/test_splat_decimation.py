"""Decimation of splats: counts, moments and costs against plain NumPy and numerical integrals."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cagefield.cli import main
from cagefield.errors import FieldError
from cagefield.fields import splat_decimation
from cagefield.fields.sh import C0
from cagefield.fields.splat_decimation import decimate_splats
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.splat_files import read_splats, write_splats
from cagefield.rendering.splats.decimation_loss import decimation_loss
from splat_scenes import ball_of_splats, random_splats


def chosen(field: SplatField, rows: np.ndarray) -> SplatField:
    names = ("means", "log_scales", "quaternions", "opacities", "sh")
    return replace(field, **{name: getattr(field, name)[rows] for name in names})


@pytest.mark.parametrize("count", [599, 300, 60, 1])
def test_as_many_splats_are_left_as_asked_for(count: int) -> None:
    field = ball_of_splats(600)
    found = decimate_splats(field, count)
    assert len(found) == count and np.array_equal(found.bounds, field.bounds)
    again = decimate_splats(field, count)
    assert np.array_equal(found.means, again.means) and np.array_equal(found.sh, again.sh)


def test_no_more_splats_than_there_are() -> None:
    field = random_splats(40)
    assert decimate_splats(field, 40) is field and decimate_splats(field, 1000) is field
    with pytest.raises(FieldError, match="at least 1 splat"):
        decimate_splats(field, 0)


def test_merges_look_better_than_the_largest_splats_and_than_a_choice() -> None:
    field = ball_of_splats(1200)
    found = decimate_splats(field, 300)
    mean, least = decimation_loss(field, found)
    areas = np.exp(np.sort(field.log_scales, axis=1)[:, 1:].sum(axis=1)) * field.opacities
    largest = np.sort(np.argsort(-areas)[:300])
    some = np.random.default_rng(0).choice(1200, 300, replace=False)
    for rows in (largest, some):
        other = decimation_loss(field, chosen(field, rows))
        assert mean > other[0] + 3.0 and least > other[1] + 3.0
    assert decimation_loss(field, field)[1] > 80.0


def test_what_is_alike_is_merged_first() -> None:
    """Twins in one place become one of their depth; a lone splat of another color stays, bit for bit."""
    lone = SplatField([[5.0, 0, 0]], [[-2.0] * 3], [[1.0, 0, 0, 0]], [0.5], [[[1.0, -1.0, 0.0]]])
    twin = SplatField(
        [[0.0, 0, 0]] * 2, [[-1.0, -1.5, -3.0]] * 2, [[0.9, 0.1, 0.3, 0.2]] * 2, [0.4] * 2, np.ones((2, 1, 3))
    )
    field = SplatField(
        *(
            np.concatenate([getattr(twin, n), getattr(lone, n)])
            for n in ("means", "log_scales", "quaternions")
        ),
        np.concatenate([twin.opacities, lone.opacities]),
        np.concatenate([twin.sh, lone.sh]),
    )
    found = decimate_splats(field, 2)
    for name in ("means", "log_scales", "quaternions", "opacities", "sh"):
        assert np.array_equal(getattr(found, name)[0], getattr(lone, name)[0])
    np.testing.assert_allclose(found.log_scales[1], twin.log_scales[0], atol=1e-5)
    np.testing.assert_allclose(
        splat_decimation.dilogarithm(found.opacities[1:]),
        2.0 * splat_decimation.dilogarithm(twin.opacities[:1]),
        rtol=1e-4,
    )
    np.testing.assert_allclose(found.sh[1], 1.0, atol=1e-6)


def test_costs_are_the_integrals_of_squared_differences() -> None:
    """By sums over a grid of the blurred splats, wide enough for the grid to resolve them."""
    rng = np.random.default_rng(4)
    field = SplatField(
        rng.normal(0.0, 0.3, (2, 3)),
        np.log(rng.uniform(0.3, 0.6, (2, 3))),
        rng.normal(size=(2, 4)),
        [0.7, 0.4],
        rng.normal(0.0, 0.5, (2, 4, 3)),
    )
    blur = 0.04
    splats = splat_decimation._Splats.of_field(field)
    merged = splat_decimation.merge(splats, np.array([0]), np.array([1]))
    costs, own = splat_decimation.merge_costs(splats, np.array([[1], [0]]), blur)
    axis = np.linspace(-4.0, 4.0, 81)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)

    def image(some: splat_decimation._Splats, n: int) -> np.ndarray:
        own_matrix = some.covariances[n][splat_decimation._FULL].reshape(3, 3)
        wide = own_matrix + blur * np.eye(3)
        area, wide_area = (np.sqrt(np.linalg.det(c) * np.trace(np.linalg.inv(c))) for c in (own_matrix, wide))
        offset = grid - some.means[n]
        g = np.exp(-0.5 * np.einsum("ni,ij,nj->n", offset, np.linalg.inv(wide), offset))
        color = np.concatenate([[1.0], 0.5 + C0 * some.sh[n, 0]])
        return splat_decimation.dilogarithm(some.opacities[n : n + 1]) * area / wide_area * g[:, None] * color

    first, second, both = image(splats, 0), image(splats, 1), image(merged, 0)
    unit = (axis[1] - axis[0]) ** 3 / (2.0 * np.pi) ** 1.5
    np.testing.assert_allclose(own, [(first**2).sum() * unit, (second**2).sum() * unit], rtol=1e-3)
    np.testing.assert_allclose(costs[:, 0], ((first + second - both) ** 2).sum() * unit, rtol=1e-2)


def test_the_command_writes_fewer_splats_and_says_what_it_costs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, target = tmp_path / "ball.ply", tmp_path / "small.spz"
    write_splats(ball_of_splats(400), source)
    assert main(["convert", str(source), str(target), "--splats", "100"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "400 splats merged to 100: PSNR " in text and len(read_splats(target)) == 100
    before = target.read_bytes()
    assert main(["convert", str(source), str(target), "--splats", "50"]) == 2
    assert main(["convert", str(source), str(tmp_path / "none.ply"), "--splats", "0"]) == 2
    assert target.read_bytes() == before and not (tmp_path / "none.ply").exists()
    assert main(["convert", str(source), str(tmp_path / "all.ply"), "--splats", "1000"]) == 0
    assert "all are kept" in " ".join(capsys.readouterr().out.split())
