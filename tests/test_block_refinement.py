"""Refinement of blocks: copies of shared splats, their training, their means in the merged field."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from cagefield.datasets.views import Dataset, View
from cagefield.errors import CagefieldError, FieldError
from cagefield.fields.splat_field import SplatField
from cagefield.training.splats.block_jobs import BlockJob, read_block, read_copies
from cagefield.training.splats.blocks import Block
from cagefield.training.splats.refinement import FAR_OWNER, REFINEMENT_START_PROGRESS, Copies, consensus
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.train_blocks import (
    plan_blocks,
    train_block,
    train_blocks,
    training_stages,
)
from splat_captures import painted_ball, points_along_x, ring_capture

QUICK = SplatConfig(steps=60, splats=400)


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return ring_capture(tmp_path_factory.mktemp("refinement"))


def copies_of(field: SplatField, rows: list[int], visits: list[int], owner: int = 0, seed: int = 0) -> Copies:
    """Copies of some rows, each moved, turned, scaled, recolored by chance."""
    chance, part = np.random.default_rng(seed), field.take(np.array(rows))
    n = len(rows)
    moved = dataclasses.replace(
        part,
        means=part.means + chance.normal(0, 0.1, (n, 3)).astype(np.float32),
        log_scales=part.log_scales + chance.normal(0, 0.1, (n, 3)).astype(np.float32),
        quaternions=part.quaternions + chance.normal(0, 0.1, (n, 4)).astype(np.float32),
        opacities=chance.uniform(0.1, 0.9, n).astype(np.float32),
        sh=part.sh + chance.normal(0, 0.1, part.sh.shape).astype(np.float32),
    )
    return Copies(moved, *(np.array(a, np.int32) for a in ([owner] * n, rows, visits)))


def test_merged_splats_are_means_of_their_copies_weighted_by_steps() -> None:
    """Oracle: loops over splats and copies; one has a copy without steps, one of another owner, one none."""
    start = painted_ball(6)
    found = [
        copies_of(start, [0, 1, 2], [3, 5, 0], seed=1),
        copies_of(start, [1, 2, 3], [10, 0, 1], seed=2),
        copies_of(start, [4], [7], owner=1, seed=3),
    ]
    # One rotation, with the other sign.
    found[1].field.quaternions.flags.writeable = True
    found[1].field.quaternions[0] *= -1.0
    merged = consensus(0, start, found)
    assert len(merged) == 6
    for row in range(6):
        pairs = [
            (copies.field, at, int(copies.visits[at]))
            for copies in found
            for at in range(len(copies.rows))
            if copies.owners[at] == 0 and copies.rows[at] == row and copies.visits[at] > 0
        ]
        pairs = pairs or [(start, row, 1)]
        total = sum(steps for _, _, steps in pairs)
        for name in ("means", "log_scales", "sh"):
            mean = sum(steps * getattr(field, name)[at].astype(float) for field, at, steps in pairs) / total
            np.testing.assert_allclose(getattr(merged, name)[row], mean, rtol=1e-5, atol=1e-6)
        odds = sum(s * np.log(f.opacities[at] / (1.0 - f.opacities[at])) for f, at, s in pairs) / total
        assert merged.opacities[row] == pytest.approx(1.0 / (1.0 + np.exp(-odds)), abs=1e-5)
        turns = [
            f.quaternions[at] * np.sign(f.quaternions[at] @ start.quaternions[row]) for f, at, _ in pairs
        ]
        mean = sum(s * turn for (_, _, s), turn in zip(pairs, turns, strict=True))
        expected = mean / np.linalg.norm(mean)
        assert abs(expected @ merged.quaternions[row]) == pytest.approx(1.0, abs=1e-5)
    np.testing.assert_array_equal(merged.means[[2, 4, 5]], start.means[[2, 4, 5]])


def test_needles_are_left_out_of_the_merged_field() -> None:
    start = painted_ball(5)
    found = copies_of(start, [1, 3], [2, 2])
    found.field.log_scales.flags.writeable = True
    found.field.log_scales[0] = (-9.0, -9.0, 0.0)
    merged = consensus(0, start, [found])
    np.testing.assert_array_equal(merged.means[[0, 1, 3]], start.means[[0, 2, 4]])
    assert len(merged) == 4


def test_copies_of_splats_that_an_owner_lacks_are_refused() -> None:
    start = painted_ball(5)
    with pytest.raises(FieldError, match="copies of splats that are not there"):
        consensus(0, start.take(np.arange(3)), [copies_of(start, [4], [1])])


@pytest.mark.parametrize("damage", ["cut", "fewer", "negative", "floats"])
def test_damaged_numbers_of_copies_are_refused(tmp_path: Path, damage: str) -> None:
    copies, path = copies_of(painted_ball(5), [0, 4], [1, 2]), tmp_path / "refined-0001.copies"
    changed = {
        "cut": copies,
        "fewer": dataclasses.replace(copies, rows=copies.rows[:1]),
        "negative": dataclasses.replace(copies, rows=-copies.rows),
        "floats": dataclasses.replace(copies, visits=copies.visits.astype(np.float32)),
    }
    copies.save(path)
    same = Copies.load(path, copies.field)
    np.testing.assert_array_equal([same.owners, same.rows, same.visits], [[0, 0], [0, 4], [1, 2]])
    changed[damage].save(path)
    if damage == "cut":
        path.write_bytes(path.read_bytes()[:-3])
    with pytest.raises(FieldError, match=str(path)):
        Copies.load(path, copies.field)


def finished_by_chance(capture: Dataset, folder: Path) -> tuple[tuple[Block, ...], tuple[BlockJob, ...]]:
    """Three blocks along x, their first trainings and the scaffold finished with random splats."""
    points = points_along_x(capture)
    blocks, jobs = plan_blocks(dataclasses.replace(capture, points=points), QUICK, 3, folder)
    (scaffold,), first, _ = training_stages(jobs)
    chance = np.random.default_rng(2)
    low, high = points.positions.min(axis=0), points.positions.max(axis=0)
    for job in (scaffold, *first):
        ball = painted_ball(300)
        means = chance.uniform(low, high, (len(ball), 3)).astype(np.float32)
        means[:20] += np.float32(3.0 * blocks[0].reach)
        dataclasses.replace(ball, means=means, bounds=ball.bounds).save(job.path(".safetensors"))
        gains = chance.uniform(0.8, 1.2, (job.photo_count, 3)).astype(np.float32)
        record = {"key": job.key, "steps": 3, "seconds": 1.0, "gains": gains.tolist()}
        job.path(".json").write_text(json.dumps(record), encoding="utf-8")
    return blocks, jobs


def test_a_refinement_shares_all_splats_that_its_photos_show(capture: Dataset, tmp_path: Path) -> None:
    """Own splats, the neighbor's, far ones of the scaffold; its near ones elsewhere stay frozen."""
    with pytest.raises(CagefieldError, match=r"scaffold\.safetensors is not there"):
        plan_blocks(dataclasses.replace(capture, points=points_along_x(capture)), QUICK, 3, tmp_path)[1][
            0
        ].copies()
    blocks, jobs = finished_by_chance(capture, tmp_path)
    photos = [set(block.photos) for block in blocks]
    assert photos[0] & photos[1] and photos[1] & photos[2] and not photos[0] & photos[2]
    assert [[job.number for job in refined.neighbors] for refined in jobs] == [[1], [0, 2], [1]]
    (scaffold,), first, _ = training_stages(jobs)
    assert [job.config.steps + last.config.steps for job, last in zip(first, jobs, strict=True)] == [
        round(60 * len(block.photos) / len(capture.train)) for block in blocks
    ]
    coarse, fields = read_block(scaffold), [read_block(job) for job in first]
    copies, context = jobs[0].copies(), jobs[0].context()
    assert coarse is not None and copies is not None and context is not None
    own = [block.own(done.field) for block, done in zip(blocks, fields, strict=True) if done is not None]
    far = coarse.field.take(blocks[0].is_far(coarse.field.means))
    assert len(own) == 3 and 0 < len(far) < len(coarse.field)
    for owner, field, everything in ((0, own[0], True), (1, own[1], False), (FAR_OWNER, far, False)):
        shown = [
            everything or any(_in_margin(view, mean) for view in jobs[0].dataset.train)
            for mean in field.means
        ]
        mine = copies.owners == owner
        np.testing.assert_array_equal(copies.rows[mine], np.flatnonzero(shown))
        np.testing.assert_array_equal(copies.field.means[mine], field.means[shown])
    assert set(copies.owners) <= {0, 1, FAR_OWNER} and not copies.visits.any() and len(own[1]) > 0
    near = ~blocks[0].is_far(coarse.field.means)
    elsewhere = near & ~blocks[0].contains(coarse.field.means) & ~blocks[1].contains(coarse.field.means)
    around = coarse.field.means[elsewhere]
    shown = [any(_in_margin(view, mean) for view in jobs[0].dataset.train) for mean in around]
    np.testing.assert_array_equal(context.frozen.means, around[shown])
    np.testing.assert_array_equal(context.gains, coarse.gains[list(blocks[0].photos)])
    assert context.start_progress == REFINEMENT_START_PROGRESS


def test_a_refinement_keeps_its_rows_and_counts_its_steps(capture: Dataset, tmp_path: Path) -> None:
    _, jobs = finished_by_chance(capture, tmp_path)
    before = jobs[0].copies()
    assert train_block(jobs[0]) and before is not None
    after = read_copies(jobs[0])
    np.testing.assert_array_equal([after.owners, after.rows], [before.owners, before.rows])
    assert after.visits.max() <= jobs[0].config.steps and (after.visits > 0).any()
    still, moved = after.visits == 0, after.visits > 0
    np.testing.assert_array_equal(after.field.means[still], before.field.means[still])
    assert (after.field.sh[moved] != before.field.sh[moved]).any(axis=(1, 2)).mean() > 0.9
    assert not list(tmp_path.glob("*.training"))
    # a kill amid the removal of the files leaves some: the refinement is not finished
    for kind in (".copies", ".safetensors", ".json"):
        kept = jobs[0].path(kind).read_bytes()
        jobs[0].path(kind).unlink()
        assert read_block(jobs[0]) is None
        jobs[0].path(kind).write_bytes(kept)
    assert read_block(jobs[0]) is not None


def _in_margin(view: View, mean: np.ndarray) -> bool:
    """Whether a point lies in front of the camera, in the photo or a quarter of its size around it."""
    (x, y), depth = (values[0] for values in view.camera.project(mean[None].astype(np.float64)))
    width, height = view.camera.width, view.camera.height
    return bool(depth > 0 and -0.25 * width <= x < 1.25 * width and -0.25 * height <= y < 1.25 * height)


@pytest.mark.nightly
@pytest.mark.train
def test_refinement_lowers_the_loss_of_two_blocks_on_all_photos(capture: Dataset, tmp_path: Path) -> None:
    """The ball is cut in two; without refinements, as after Ctrl-C, and with them."""
    config = SplatConfig(steps=400, splats=400)
    blocks, jobs = plan_blocks(capture, config, 2, tmp_path)
    (scaffold,), first, _ = training_stages(jobs)
    for job in (scaffold, *first):
        assert train_block(job)
    cut = train_blocks(capture, blocks, jobs, trainer=lambda jobs: ())
    whole = train_blocks(capture, blocks, jobs)
    assert whole.finished and not cut.finished
    for job in jobs:
        copies = read_copies(job)
        assert {0, 1} <= set(copies.owners[copies.visits > 0])
    assert whole.train_psnr > cut.train_psnr + 0.3
