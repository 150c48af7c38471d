"""One training of a capture against blocks: PSNR, peak memory, pictures across the borders.

    python -m benchmarks.captures.street STREET
    python -m benchmarks.captures.compare_blocks STREET -o FOLDER [--blocks 4] [--steps-per-photo 20]
        [--processes 1] [--seed 0]

Poses are verified as `cagefield train` does. Both get as many steps for each photo; the scaffold, each block
and each refinement in a process of its own, so many at a time. FOLDER gets a Markdown row for each,
figures.md, and pictures of test views that see points of several cores: photo, one training, blocks, and
their difference, four times as strong around gray. A command that is given again goes on; remove the folder
to measure anew. Processor time is the sum over all processes, peak memory that of the largest.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common.machine import cpu_model
from cagefield.compute import devices
from cagefield.datasets import load_dataset
from cagefield.datasets.sfm.pose_verification import poses_cache_folder, verify_poses
from cagefield.datasets.sfm.sparse_points import points_cache_folder, starting_points
from cagefield.datasets.views import Dataset, View
from cagefield.fields.splat_field import SplatField
from cagefield.images.image_files import side_by_side, write_png
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.training.splats.block_jobs import BlockJob, read_block
from cagefield.training.splats.blocks import Block, divide, left_out, visible_points
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.train_blocks import (
    plan_blocks,
    train_block,
    train_blocks,
    training_stages,
)

HEADER = (
    "| capture | training | photos of each block | splats | steps | processor time | test PSNR | corrected "
    "| SSIM | peak memory |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
)
PICTURES = 4


def main() -> None:
    """Prints and writes the rows, and the pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("capture", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--blocks", type=int, default=4)
    parser.add_argument("--steps-per-photo", type=int, default=20)
    parser.add_argument("--splats", type=int)
    parser.add_argument("--downscale", type=int)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rows = []
    for count in (1, options.blocks):
        kept = options.out / f"row-{count}.md"
        if not kept.exists():
            for stage, size in enumerate((1, count, count) if count > 1 else (1,)):
                with multiprocessing.get_context("spawn").Pool(options.processes, maxtasksperchild=1) as pool:
                    jobs = [(options, count, stage, number) for number in range(size)]
                    pool.starmap(train_one, jobs, chunksize=1)
                    pool.close()
                    pool.join()  # terminated, pycolmap's handler prints a stack trace
            kept.write_text(measure(options, count) + "\n", encoding="utf-8")
        rows.append(kept.read_text(encoding="utf-8").rstrip("\n"))
        print(rows[-1], flush=True)
    text = f"{cpu_model()}; {options.steps_per_photo} steps for each photo\n\n{HEADER}\n" + "\n".join(rows)
    (options.out / "figures.md").write_text(text + "\n", encoding="utf-8")
    draw(options)


def load(options: Any) -> Dataset:
    """The capture with verified poses, as `cagefield train` takes it; found once, then cached."""
    dataset = load_dataset(options.capture, downscale=options.downscale)
    return verify_poses(dataset, cache=poses_cache_folder()).dataset


def plan(options: Any, count: int) -> tuple[Dataset, tuple[Block, ...], tuple[BlockJob, ...]]:
    """The capture with the blocks and the trainings of a comparison."""
    devices.start("cpu")
    dataset = load(options)
    config = SplatConfig(
        steps=options.steps_per_photo * len(dataset.train), splats=options.splats, seed=options.seed
    )
    return dataset, *plan_blocks(dataset, config, count, options.out / f"blocks-{count}")


def train_one(options: Any, count: int, stage: int, number: int) -> None:
    """Trains one of a stage's trainings, and adds its processor time and peak memory to a file."""
    job = training_stages(plan(options, count)[2])[stage][number]
    if read_block(job) is not None:
        return
    train_block(job)
    used = resource.getrusage(resource.RUSAGE_SELF)
    row = f"{used.ru_utime + used.ru_stime:.1f} {used.ru_maxrss / 1e3:.0f}\n"
    with job.path(".usage").open("a", encoding="utf-8") as file:
        file.write(row)


def measure(options: Any, count: int) -> str:
    """The row of a training in `count` finished blocks; its field is kept in the folder."""
    dataset, blocks, jobs = plan(options, count)
    for block, job in zip(blocks, jobs, strict=True):
        print(f"{job.name} of {count}: {block.describe()}", flush=True)
    result = train_blocks(dataset, blocks, jobs)
    result.field.save(options.out / f"field-{count}.safetensors")
    usage = [np.loadtxt(path, ndmin=2) for path in jobs[0].folder.glob("*.usage")]
    seconds, memory = np.concatenate(usage).T
    photos = ", ".join(str(len(block.photos)) for block in blocks)
    lost = len(left_out(dataset, blocks))
    columns = (
        options.capture.name,
        "one" if count == 1 else f"{count} blocks",
        photos + (f" ({lost} of {len(dataset.train)} in none)" if lost else ""),
        f"{len(result.field)}",
        f"{result.steps}",
        f"{seconds.sum():.0f} s",
        f"{result.test.psnr:.2f} dB",
        f"{result.test.corrected:.2f} dB",
        f"{result.test.ssim:.3f}",
        f"{memory.max():.0f} MB",
    )
    return "| " + " | ".join(columns) + " |"


def draw(options: Any) -> None:
    """Writes the pictures of the test views that see the most points on both sides of a border."""
    dataset = load(options)
    points = starting_points(dataset, points_cache_folder())
    if points is None:
        raise SystemExit("the capture has no points")
    blocks = divide(dataset, points, options.blocks)
    fields = [SplatField.load(options.out / f"field-{count}.safetensors") for count in (1, options.blocks)]
    positions = (dataset.points or points).positions
    seen = visible_points(dataset.test, dataset.points or points).toarray().astype(bool)
    for view, _ in sorted(
        zip(dataset.test, seen, strict=True), key=lambda pair: -_both_sides(blocks, positions[pair[1]])
    )[:PICTURES]:
        _write(options.out / f"{Path(view.name).stem}.png", view, fields)


def _both_sides(blocks: tuple[Block, ...], positions: np.ndarray) -> float:
    """Second largest number of the points [M,3] in one core."""
    return float(sorted(block.contains(positions).sum() for block in blocks)[-2])


def _write(path: Path, view: View, fields: list[SplatField]) -> None:
    pictures = [view.load()[..., :3].astype(np.float32) / 255.0]
    for field in fields:
        frame = SplatRenderer(field).render(view.camera, background="black")
        if frame is None:
            raise RuntimeError("the rendering was stopped")
        pictures.append(np.clip(frame.rgb, 0.0, 1.0))
    difference = np.clip(0.5 + 4.0 * (pictures[2] - pictures[1]), 0.0, 1.0)
    write_png(path, side_by_side(*pictures, difference))
    print(path)


if __name__ == "__main__":
    main()
