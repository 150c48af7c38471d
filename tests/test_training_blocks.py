"""Blocks of a capture: partition, photos, gains, merging, training that goes on where it stopped."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from cagefield.datasets.views import Dataset, SparsePoints
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.training.splats import train_blocks as training
from cagefield.training.splats.blocks import (
    MIN_BLOCK_POINTS,
    MIN_PHOTO_SHARE,
    Block,
    align_gains,
    block_dataset,
    divide,
    inside_cell,
    left_out,
    merge,
    partition,
    visible_points,
)
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.train_blocks import plan_blocks, read_block, train_block, train_blocks
from cagefield.training.splats.train_splats import train_splat
from splat_captures import around, as_dataset, painted_ball, photos_of, points_near, write_views

QUICK = SplatConfig(steps=60, splats=400)


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    """Twelve photos of a painted ball, two of them for tests, with points that all photos may see."""
    ball, cameras = painted_ball(), around(12, 0.4, 48)
    views = write_views(tmp_path_factory.mktemp("blocks"), cameras, photos_of(ball, cameras))
    points = points_near(ball)
    return as_dataset(Path("ball"), views[2:], views[:2], points, unbounded=True)


def uneven_points(count: int = 600) -> np.ndarray:
    """Points in two clouds of different density, and some far away."""
    chance = np.random.default_rng(0)
    return np.concatenate(
        [chance.normal(0, 1, (count, 3)), chance.normal((9, 2, 0), (4, 1, 0.3), (count // 2, 3))]
    )


@pytest.mark.parametrize("count", [1, 2, 3, 4, 7])
def test_every_position_is_in_exactly_one_core(count: int) -> None:
    points = uneven_points()
    cells = partition(points, count)
    far = np.random.default_rng(1).uniform(-1e6, 1e6, (500, 3))
    for positions in (points, far):
        assert (np.sum([inside_cell(cell, positions) for cell in cells], axis=0) == 1).all()
    sizes = [inside_cell(cell, points).sum() for cell in cells]
    assert len(cells) == count and max(sizes) - min(sizes) <= 2


def test_far_positions_are_in_the_nearest_core() -> None:
    """Oracle: distances to the cores' parts of the points' box."""
    points = uneven_points()
    box = np.stack([points.min(axis=0), points.max(axis=0)])
    cells = partition(points, 5)
    bounded = [np.clip(cell, box[0], box[1]) for cell in cells]
    far = np.random.default_rng(1).uniform(-60, 60, (800, 3))
    distances = np.stack([np.linalg.norm(far - far.clip(*cell), axis=1) for cell in bounded])
    mine = distances[np.argmax([inside_cell(cell, far) for cell in cells], axis=0), np.arange(len(far))]
    np.testing.assert_allclose(mine, distances.min(axis=0), atol=1e-9)


def street(dataset: Dataset, seed: int = 3) -> SparsePoints:
    """Points along x, each seen by the photos whose number is near its place; one photo sees few of them."""
    chance = np.random.default_rng(seed)
    x = chance.uniform(0, len(dataset.train), 400)
    positions = np.stack([x, chance.normal(0, 0.2, 400), chance.normal(0, 0.2, 400)], axis=1)
    names = [view.name for view in dataset.train]
    seen = [frozenset(name for n, name in enumerate(names) if abs(n + 0.5 - at) < 1.2 and n != 4) for at in x]
    seen[0] |= {names[4]}
    return SparsePoints(positions, np.zeros((400, 3), np.uint8), tuple(seen))


def test_photos_that_see_enough_of_a_block_are_chosen(capture: Dataset) -> None:
    """Oracle: counts by loops over points and names."""
    points = street(capture)
    blocks = divide(capture, points, 3)
    chosen: dict[int, set[int]] = {n: set() for n in range(3)}
    for n, view in enumerate(capture.train):
        counts = [0, 0, 0]
        for number, block in enumerate(blocks):
            for position, names in zip(points.positions, points.seen_by, strict=True):
                inside = all(block.region[0] <= position) and all(position < block.region[1])
                counts[number] += inside and view.name in names
        total = sum(view.name in names for names in points.seen_by)
        for number, count in enumerate(counts):
            if count >= MIN_BLOCK_POINTS and (count >= MIN_PHOTO_SHARE * total or count == max(counts)):
                chosen[number].add(n)
    assert [set(block.photos) for block in blocks] == list(chosen.values())
    assert 1 < len(chosen[0]) < len(capture.train)
    assert left_out(capture, blocks) == (capture.train[4].name,)
    for block in blocks:
        assert block.region_points == inside_cell(block.region, points.positions).sum()
        part = block_dataset(capture, points, block)
        assert [view.name for view in part.train] == [capture.train[n].name for n in block.photos]
        names = {view.name for view in part.train}
        both = [row for row, seen in enumerate(points.seen_by) if len(seen & names) >= 2]
        assert part.points is not None
        np.testing.assert_array_equal(part.points.positions, points.positions[both])
    assert sum(block.core_points for block in blocks) == len(points)


def test_points_of_unknown_photos_are_visible_in_the_frustum(capture: Dataset) -> None:
    points = SparsePoints(np.array([[0.0, 0, 0], [0, 0, 50.0]]), np.zeros((2, 3), np.uint8))
    np.testing.assert_array_equal(
        visible_points(capture.train, points).toarray(), [[True, False]] * len(capture.train)
    )


def halves() -> tuple[Block, Block]:
    cells = partition(uneven_points(), 2)
    photos = (tuple(range(5)), tuple(range(3, 9)))
    left, right = (
        Block(cell, cell, chosen, np.arange(3), 3, 3) for cell, chosen in zip(cells, photos, strict=True)
    )
    return left, right


def test_gains_of_shared_photos_fix_the_blocks_factors() -> None:
    """Gains with known factors between blocks come back, up to the mean of 1."""
    chance = np.random.default_rng(2)
    true = np.exp(chance.uniform(-0.2, 0.2, (9, 3)))
    factors = np.array([[1.0, 1.1, 0.9], [0.8, 1.3, 1.0]])
    blocks = halves()
    gains = [
        (true[list(block.photos)] * factor).astype(np.float32)
        for block, factor in zip(blocks, factors, strict=True)
    ]
    found, merged = align_gains(blocks, gains, 10)
    np.testing.assert_allclose(merged[:9], true / true.mean(axis=0), rtol=1e-5)
    np.testing.assert_array_equal(merged[9], 1.0)
    # photo = gain x color: the colors times found factors are those that the merged gains explain
    for block, gain, factor in zip(blocks, gains, found, strict=True):
        np.testing.assert_allclose(merged[list(block.photos)] * factor, gain, rtol=1e-5)


def test_merged_splats_are_those_in_the_cores() -> None:
    ball = painted_ball(80)
    blocks, fields = halves(), []
    for shift in (0.0, 0.1):
        fields.append(
            dataclasses.replace(ball, means=5.0 * ball.means + np.float32(shift), bounds=ball.bounds)
        )
    factors = np.array([[1.0, 1.0, 1.0], [0.5, 1.0, 2.0]])
    found = merge(blocks, fields, factors)
    rows = [block.contains(field.means) for block, field in zip(blocks, fields, strict=True)]
    expected = np.concatenate([field.means[row] for field, row in zip(fields, rows, strict=True)])
    np.testing.assert_array_equal(found.means, expected)
    assert rows[1].any() and 0 < rows[0].sum() < 80
    along = np.tile([[0.0, 0.0, 1.0]], (80, 1))
    last = found.means[-1:]
    color = fields[1].take(rows[1])(last, along[:1])[1]
    np.testing.assert_allclose(
        found.take(np.arange(rows[0].sum(), len(found)))(last, along[:1])[1], color * factors[1], atol=1e-5
    )


def same(a: SplatField, b: SplatField) -> bool:
    """Equal arrays; quaternions, which a file's reader normalizes once more, up to their last bits."""
    names = ("means", "log_scales", "opacities", "sh")
    equal = all(np.array_equal(getattr(a, name), getattr(b, name)) for name in names)
    return equal and len(a) == len(b) and float(np.abs(a.quaternions - b.quaternions).max()) < 1e-6


@pytest.mark.train
def test_one_block_is_the_training_without_blocks(capture: Dataset, tmp_path: Path) -> None:
    alone = train_splat(capture, QUICK)
    blocks, jobs = plan_blocks(capture, QUICK, 1, tmp_path)
    merged = train_blocks(capture, blocks, jobs)
    assert same(merged.field, alone.field) and merged.steps == alone.steps == 60
    np.testing.assert_array_equal(merged.gains, alone.gains)
    assert merged.test_psnr == pytest.approx(alone.test_psnr, abs=1e-3) and merged.finished


@pytest.mark.train
def test_finished_blocks_are_not_trained_again(
    capture: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocks, jobs = plan_blocks(capture, QUICK, 2, tmp_path)
    whole = train_blocks(capture, blocks, jobs, evaluate=False)
    assert sum(len(field) for field in (read_block(job).field for job in jobs)) > len(whole.field) > 0
    for path in jobs[1].folder.glob("block-0002*"):
        path.unlink()
    began: list[str] = []

    def counted(job: training.BlockJob, on_stage: object = None) -> bool:
        began.append(job.name)
        return train_block(job)

    monkeypatch.setattr(training, "train_block", counted)
    again = train_blocks(capture, blocks, jobs, evaluate=False)
    assert began == ["block 2"] and same(again.field, whole.field)
    other = plan_blocks(capture, dataclasses.replace(QUICK, seed=5), 2, tmp_path)[1]
    with pytest.raises(CagefieldError, match="is of other photos or options; give those of the first run"):
        read_block(other[0])
    jobs[0].path(".json").write_text("{", encoding="utf-8")
    with pytest.raises(CagefieldError, match=r"is damaged .* remove it to train block 1 again"):
        read_block(jobs[0])


@pytest.mark.parametrize(
    ("count", "config", "message"),
    [
        (0, QUICK, "blocks is 0; give a number from 1"),
        (60, QUICK, "points are too few for 60 blocks"),
        (2, dataclasses.replace(QUICK, refine_poses=True), "leave out --refine-poses"),
    ],
)
def test_blocks_that_cannot_be(
    capture: Dataset, tmp_path: Path, count: int, config: SplatConfig, message: str
) -> None:
    with pytest.raises(CagefieldError, match=message):
        plan_blocks(capture, config, count, tmp_path)
