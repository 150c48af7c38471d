"""Fields of other programs: their own pictures against ours, and edits exact against baked, in one table.

    python -m benchmarks.imported.external_fields DATA GENUINE... -o benchmarks/results/external_fields.md

GENUINE are checkpoints from `train_tensorf` and `train_nerfacto` with their pictures beside
them (.npz of rgb [V,H,W,3]: the first test views of DATA). Columns: the file; its first view by the authors'
code against ours, every fourth pixel each way; one continuous and one discrete edit, exact against the baked
voxels at SIZE x SIZE, with the processor time of one exact and one baked picture; the process's peak memory.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.common.machine import cpu_model
from cagefield.cameras.camera import Camera
from cagefield.datasets import load_dataset
from cagefield.edits import Edit, EditStack
from cagefield.fields.voxel_field import VoxelField
from cagefield.formats.external.checkpoint import ExternalCheckpoint
from cagefield.formats.external.read_external import read_external
from cagefield.geometry.cage import Cage
from cagefield.images.metrics import psnr
from cagefield.images.render_result import RenderResult
from cagefield.scene.import_external import cameras_of
from cagefield.scene.scene import Scene

STRIDE, SIZE, BAKED = 4, 48, 96
"""Pixels between two that are compared with the authors'; width of edited pictures; baked voxels."""

HEADER = (
    "| file | size | authors' pictures | continuous | exact, baked | discrete | exact, baked | peak |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- |"
)


def main() -> None:
    """Prints a row for each checkpoint, and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("-o", "--out", type=Path)
    options = parser.parse_args()
    dataset = load_dataset(options.data)
    rows = []
    for path in options.files:
        found = read_external(path)
        if found is None:
            raise SystemExit(f"{path} is no field of another program")
        cameras = cameras_of(found, dataset)["test"]
        scene = scene_of(found, cameras)
        columns = [
            f"{path.stem}: {found.description}",
            f"{path.stat().st_size / 1e3:.0f} kB",
            f"{against_authors(path, scene, cameras[0]):.1f} dB",
            *edited(scene, cameras[0].resized(SIZE, SIZE)),
            f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3:.0f} MB",
        ]
        rows.append("| " + " | ".join(columns) + " |")
        print(rows[-1], flush=True)
    if options.out is not None:
        heading = f"# Fields of other programs\n\n{cpu_model()}; processor time\n\n"
        options.out.write_text(heading + "\n".join([HEADER, *rows]) + "\n", encoding="utf-8")


def scene_of(found: ExternalCheckpoint, cameras: tuple[Camera, ...]) -> Scene:
    """The scene that `cagefield import` makes, of BAKED voxels where they are baked."""
    if isinstance(found.field, VoxelField):
        return Scene(found.field, cameras={"test": cameras}, background=found.background)
    return Scene.baked(found.field, {"test": cameras}, found.background, resolution=BAKED)


def against_authors(path: Path, scene: Scene, camera: Camera) -> float:
    """PSNR in dB of the first view's pixels by the authors' code against ours."""
    beside = path.with_name(f"{path.stem}_pictures.npz")
    theirs = np.load(beside if beside.exists() else path.with_suffix(".npz"))["rgb"][0]
    if scene.original is None:
        ours = scene.render(camera, background="white", exact=True).rgb
        return psnr(np.clip(ours, 0, 1), theirs)
    from cagefield.fields.external.external_field import ExternalField
    from cagefield.rendering.external.external_renderer import trace_external
    from cagefield.rendering.nerf.nerf_renderer import Rays

    field = scene.original
    if not isinstance(field, ExternalField):
        raise TypeError(f"{type(field).__name__} is no ExternalField")
    i, j = (values.ravel() for values in np.mgrid[: camera.height : STRIDE, : camera.width : STRIDE])
    rays = Rays.from_camera(camera, field.torch.device, np.stack([j, i], axis=1))
    rgb, opacity, _ = (values.cpu().numpy() for values in trace_external(field, rays))
    return psnr(np.clip(rgb + 1.0 - opacity[:, None], 0, 1), theirs[i, j])


def edited(scene: Scene, camera: Camera) -> list[str]:
    """Of one continuous and one discrete edit of the box's upper half: PSNR, and seconds of both pictures."""
    low, high = scene.field.bounds
    size, center = high - low, 0.5 * (low + high)
    middle = center + np.array([0.0, 0.0, 0.1 * size[2]])
    upper = Cage.box(center + np.array([0.0, 0.0, 0.25 * size[2]]), size * np.array([1.0, 1.0, 0.5]))
    by = 0.12 * size[2] * np.array([1.0, 0.0, 0.6])
    edits = (
        Edit.continuous(upper, Cage.box(middle, 2.2 * size)).translate(by),
        Edit.move(upper).translate(2.0 * by),
    )
    columns = []
    for edit in edits:
        moved = scene.with_edits(EditStack([edit]))
        exact, slow = timed(lambda moved=moved: moved.render(camera, background="white", exact=True))
        moved.render(camera, background="white")  # compiles
        baked, fast = timed(lambda moved=moved: moved.render(camera, background="white"))
        columns += [
            f"{psnr(np.clip(exact.rgb, 0, 1), np.clip(baked.rgb, 0, 1)):.1f} dB",
            f"{slow:.2f} s, {fast:.3f} s",
        ]
    return columns


def timed(work: Callable[[], RenderResult]) -> tuple[RenderResult, float]:
    """(picture, processor seconds)."""
    began = time.process_time()
    return work(), time.process_time() - began


if __name__ == "__main__":
    main()
