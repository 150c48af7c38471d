"""Blocks of a capture: partition, photos, scaffold, merging, training that goes on where it stopped."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from cagefield.datasets.views import Dataset, SparsePoints
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.training.splats import train_blocks as training
from cagefield.training.splats.block_jobs import BlockJob, read_block, read_copies
from cagefield.training.splats.blocks import (
    FAR_DEPTHS,
    MIN_BLOCK_POINTS,
    MIN_PHOTO_SHARE,
    NEAREST_PHOTOS,
    Block,
    block_dataset,
    divide,
    inside_cell,
    left_out,
    merge,
    partition,
    visible_points,
)
from cagefield.training.splats.refinement import consensus
from cagefield.training.splats.scaffold import scaffold_dataset
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.splat_run import SplatRun
from cagefield.training.splats.train_blocks import (
    plan_blocks,
    train_block,
    train_blocks,
    training_stages,
)
from cagefield.training.splats.train_splats import train_splat
from splat_captures import painted_ball, points_along_x, ring_capture

QUICK = SplatConfig(steps=60, splats=400)


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return ring_capture(tmp_path_factory.mktemp("blocks"))


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


def test_photos_that_see_enough_of_a_block_are_chosen(capture: Dataset) -> None:
    """Oracle: counts by loops over points and names, and the nearest photos of each point by sorting."""
    points = points_along_x(capture)
    blocks = divide(capture, points, 3)
    chosen: dict[int, set[int]] = {n: set() for n in range(3)}
    origins = {view.name: view.camera.origin for view in capture.train}
    nearest = [
        sorted(names & set(origins), key=lambda name: float(np.linalg.norm(origins[name] - position)))[:4]
        for position, names in zip(points.positions, points.seen_by, strict=True)
    ]
    assert NEAREST_PHOTOS == 4
    for n, view in enumerate(capture.train):
        counts, close = [0, 0, 0], [0, 0, 0]
        for number, block in enumerate(blocks):
            for position, names, four in zip(points.positions, points.seen_by, nearest, strict=True):
                inside = all(block.region[0] <= position) and all(position < block.region[1])
                counts[number] += inside and view.name in names
                close[number] += inside and view.name in four
        total = sum(view.name in names for names in points.seen_by)
        for number, count in enumerate(counts):
            if count >= MIN_BLOCK_POINTS and (
                count >= MIN_PHOTO_SHARE * total or count == max(counts) or close[number] >= MIN_BLOCK_POINTS
            ):
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


def test_a_background_is_trained_by_the_photos_that_see_it_best(capture: Dataset) -> None:
    """A thing between two walls: each photo sees much of the thing, and few points of the wall behind it.

    The block of a wall takes the photos that see that wall, none of which has a quarter of its points there.
    """
    chance = np.random.default_rng(6)
    thing = chance.normal(0, 0.3, (600, 3))
    walls = [chance.normal((x, 0, 0), (0.1, 0.5, 0.5), (60, 3)) for x in (-8.0, 8.0)]
    names = [view.name for view in capture.train]
    facing = [
        frozenset(n for n, view in zip(names, capture.train, strict=True) if side * view.camera.origin[0] < 0)
        for side in (-1.0, 1.0)
    ]
    points = SparsePoints(
        np.concatenate([thing, *walls]),
        np.zeros((720, 3), np.uint8),
        (*[frozenset(names)] * 600, *[facing[0]] * 60, *[facing[1]] * 60),
    )
    blocks = divide(capture, points, 3)
    assert all(4 <= len(side) < len(names) for side in facing)
    for wall, side in zip(walls, facing, strict=True):
        block = blocks[int(np.argmax([block.contains(wall).sum() for block in blocks]))]
        taken = {names[n] for n in block.photos}
        origins = {view.name: view.camera.origin for view in capture.train}
        near = [sorted(side, key=lambda name: float(np.linalg.norm(origins[name] - p)))[:4] for p in wall]
        best = {name for four in near for name in four if sum(name in each for each in near) >= 10}
        assert best and best <= taken


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


def test_merged_splats_are_those_that_blocks_contain_and_the_scaffolds_elsewhere() -> None:
    """Near splats from the block of their core; far ones, and those of a missing block, from the scaffold."""
    ball, fields = painted_ball(80), []
    for shift in (0.0, 0.1, 0.2):
        moved = 5.0 * ball.means + np.float32(shift)
        fields.append(dataclasses.replace(ball, means=moved, bounds=ball.bounds))
    reach = float(np.median(np.linalg.norm(fields[2].means, axis=1)))
    blocks = [dataclasses.replace(block, cameras=np.zeros((1, 3)), reach=reach) for block in halves()]
    own = [block.own(field) for block, field in zip(blocks, fields[:2], strict=True)]
    found = merge(blocks, own, fields[2])
    near = [np.linalg.norm(field.means.astype(float), axis=1) < reach for field in fields]
    rows = [inside_cell(block.core, field.means) for block, field in zip(blocks, fields[:2], strict=True)]
    expected = [fields[0].means[rows[0] & near[0]], fields[1].means[rows[1] & near[1]]]
    np.testing.assert_array_equal(found.means, np.concatenate([*expected, fields[2].means[~near[2]]]))
    assert all(len(part) for part in expected) and 0 < near[2].sum() < 80
    half = merge(blocks[:1], own[:1], fields[2])
    rest = ~(inside_cell(blocks[0].core, fields[2].means) & near[2])
    np.testing.assert_array_equal(half.means, np.concatenate([expected[0], fields[2].means[rest]]))


def test_far_content_is_in_no_block(capture: Dataset) -> None:
    """Oracle: the nearest camera, the median distance of points from the photos that see them, by loops."""
    points = points_along_x(capture)
    blocks = divide(capture, points, 3)
    origins = {view.name: view.camera.origin for view in capture.train}
    pairs = zip(points.positions, points.seen_by, strict=True)
    distances = [float(np.linalg.norm(origins[name] - p)) for p, names in pairs for name in names]
    positions = np.random.default_rng(0).uniform(-60, 60, (300, 3))
    nearest = np.min([np.linalg.norm(positions - origin, axis=1) for origin in origins.values()], axis=0)
    held = np.stack([block.contains(positions) for block in blocks])
    np.testing.assert_array_equal(held.sum(axis=0), nearest < FAR_DEPTHS * np.median(distances))
    for block, mask in zip(blocks, held, strict=True):
        assert (block.trains(positions) >= mask).all()


def test_blocks_have_equal_shares_of_the_photos_points(capture: Dataset) -> None:
    """Each photo weighs 1: points that one photo sees of thousands do not draw the planes to them."""
    points = points_along_x(capture)
    chance = np.random.default_rng(5)
    many = chance.normal((40.0, 0, 0), 0.5, (4000, 3))
    name = capture.train[7].name
    crowded = SparsePoints(
        np.concatenate([points.positions, many]),
        np.zeros((4400, 3), np.uint8),
        (*points.seen_by, *[frozenset({name})] * 4000),
    )
    plane = divide(capture, crowded, 2)[0].core[1, 0]
    before = divide(capture, points, 2)[0].core[1, 0]
    assert abs(plane - before) < 1.0 < abs(np.median(crowded.positions[:, 0]) - before)


def test_a_block_is_trained_among_frozen_splats_of_the_scaffold(capture: Dataset, tmp_path: Path) -> None:
    blocks, last = plan_blocks(capture, QUICK, 2, tmp_path)
    (scaffold,), jobs, refinements = training_stages(last)
    assert refinements == last and scaffold is jobs[0].scaffold is jobs[1].scaffold
    assert jobs[0].copies() is None
    assert (scaffold.config.steps, scaffold.config.splats) == (18, 100)
    with pytest.raises(CagefieldError, match=r"scaffold\.safetensors is not there; the folder must be"):
        jobs[0].context()
    assert train_block(scaffold)
    coarse = read_block(scaffold)
    context = jobs[0].context()
    assert coarse is not None and context is not None and 0 < len(context.frozen) < len(coarse.field)
    assert not blocks[0].trains(context.frozen.means).any()
    photos = list(blocks[0].photos)
    np.testing.assert_array_equal(context.gains, coarse.gains[photos])
    run = SplatRun(jobs[0].dataset, jobs[0].config, context=context)
    frozen = len(context.frozen)
    assert run.state.frozen.sum() == frozen and blocks[0].trains(run.state.means[:-frozen]).all()
    while run.done < 1.0:
        run.advance()
    for name in ("means", "log_scales", "sh"):
        after = getattr(run.state, name)[run.state.frozen]
        np.testing.assert_array_equal(after, getattr(context.frozen, name).reshape(after.shape))
    np.testing.assert_array_equal(run.gains, context.gains)
    assert len(run.field()) == len(run.state) - frozen <= jobs[0].config.splats
    assert np.isfinite(run.running_loss)


@pytest.mark.parametrize(
    ("size", "factor"), [((60, 40), 1), ((400, 300), 2), ((96, 100), 2), ((95, 400), 1), ((6000, 4000), 4)]
)
def test_photos_of_the_scaffold(capture: Dataset, size: tuple[int, int], factor: int) -> None:
    """Half the size, or less for more than 50 million pixels, here of 12 photos; 48 pixels at the least."""
    views = [
        dataclasses.replace(view, camera=view.camera.resized(*size))
        for view in (*capture.train, *capture.test)
    ]
    small = scaffold_dataset(dataclasses.replace(capture, train=tuple(views)))
    assert {(v.camera.width, v.camera.height) for v in small.train} == {
        (size[0] // factor, size[1] // factor)
    }
    assert small.test == ()


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


@pytest.mark.nightly
@pytest.mark.train
def test_finished_blocks_are_not_trained_again(
    capture: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocks, jobs = plan_blocks(capture, QUICK, 2, tmp_path)
    whole = train_blocks(capture, blocks, jobs, evaluate=False)
    trained = [done for stage in training_stages(jobs) for job in stage if (done := read_block(job))]
    assert len(trained) == 5 and sum(len(done.field) for done in trained) > len(whole.field) > 0
    refined = [read_copies(job) for job in jobs]
    means = [consensus(n, blocks[n].own(done.field), refined).means for n, done in enumerate(trained[1:3])]
    np.testing.assert_array_equal(whole.field.means[: sum(map(len, means))], np.concatenate(means))
    assert whole.steps == sum(done.steps for done in trained)
    np.testing.assert_array_equal(whole.gains, trained[0].gains)
    for path in jobs[1].folder.glob("*-0002*"):
        path.unlink()
    began: list[str] = []

    def counted(job: BlockJob, on_stage: object = None) -> bool:
        began.append(job.name)
        return train_block(job)

    monkeypatch.setattr(training, "train_block", counted)
    again = train_blocks(capture, blocks, jobs, evaluate=False)
    assert began == ["block 2", "block 2, refinement"] and same(again.field, whole.field)
    other = plan_blocks(capture, dataclasses.replace(QUICK, seed=5), 2, tmp_path)[1]
    with pytest.raises(CagefieldError, match="is of other photos or options; give those of the first run"):
        read_block(other[0])
    jobs[0].path(".json").write_text("{", encoding="utf-8")
    with pytest.raises(CagefieldError, match=r"is damaged .* remove it to train block 1, refinement again"):
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
