"""Fields of other programs: their own pictures against ours, and edits exact against baked, in one table.

    python -m benchmarks.imported.external_fields FILES... --data DATA \
        -o benchmarks/results/external_fields.md

FILES are checkpoints of `train_tensorf` and `train_nerfacto`, trained on DATA, and those of
`written_fields`. Pictures by the authors' code lie beside them (.npz of rgb [V,H,W,3]: the first test views
of DATA, or views with their own c2w [V,4,4] and lens [V,6] in the field's world). Columns: the file, and by
whose code it was written; its first view by the authors' code against ours, every fourth pixel each way;
one continuous and one discrete edit, exact against the baked voxels at SIZE x SIZE, with the processor time
of one exact and one baked picture; the peak memory of the file's own process. An svox2 grid is the editor's
voxels, nothing is baked: its exact picture evaluates the edits at every sample.
"""

from __future__ import annotations

import argparse
import multiprocessing
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
from cagefield.rendering.reference_renderer import render_sampled
from cagefield.scene.import_external import cameras_of
from cagefield.scene.scene import Scene

STRIDE, SIZE, BAKED = 4, 32, 64
"""Pixels between two that are compared with the authors'; width of edited pictures; baked voxels."""

HEADER = (
    "| file | size | written by | authors' pictures | continuous | exact, baked | discrete | exact, baked "
    "| peak |\n"
    "| --- | --- | --- | --- | --- | --- | --- | --- | --- |"
)


def main() -> None:
    """Prints a row for each checkpoint, and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--data", type=Path)
    parser.add_argument("-o", "--out", type=Path)
    options = parser.parse_args()
    rows = []
    for path in options.files:
        # A process of its own, so that the peak memory is the file's.
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            rows.append(pool.apply(row, (path, options.data)))
        print(rows[-1], flush=True)
    if options.out is not None:
        heading = (
            f"# Fields of other programs\n\n{cpu_model()}; processor time of one picture of {SIZE} x {SIZE} "
            f"pixels; voxels baked with {BAKED} on the longest axis. Rows ran one after "
            "another, beside other processes (nice 19), so no times by the clock.\n\n"
            "`python -m benchmarks.imported.external_fields FILES... --data DATA -o "
            "benchmarks/results/external_fields.md`; the files by `train_tensorf`, `train_nerfacto` and "
            "`written_fields`.\n\n"
        )
        options.out.write_text(heading + "\n".join([HEADER, *rows]) + "\n", encoding="utf-8")


def row(path: Path, data: Path | None) -> str:
    """The row of one checkpoint."""
    found = read_external(path)
    if found is None:
        raise SystemExit(f"{path} is no field of another program")
    theirs = pictures_of(path)
    own = theirs is not None and "c2w" in theirs
    cameras = cameras_of(found, load_dataset(data) if data is not None and not own else None)["test"]
    if theirs is not None and own:
        fx, fy, cx, cy, width, height = theirs["lens"][0].tolist()
        cameras = (Camera(theirs["c2w"][0], int(width), int(height), fx, fy, cx, cy),)
    scene = scene_of(found, cameras)
    if theirs is None:
        maker, agreement = "an independent writer, no genuine file seen", "none"
    else:
        maker = "authors' code" + (", values not trained" if "untrained" in theirs else ", trained")
        agreement = f"{against_authors(theirs['rgb'][0], scene, cameras[0]):.1f} dB"
    columns = [
        f"`{path.name}`: {found.description}",
        f"{path.stat().st_size / 1e3:.0f} kB",
        maker,
        agreement,
        *edited(scene, cameras[0].resized(SIZE, SIZE)),
        f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3:.0f} MB",
    ]
    return "| " + " | ".join(columns) + " |"


def pictures_of(path: Path) -> dict[str, np.ndarray] | None:
    """Pictures by the authors' code beside a checkpoint, None without."""
    for beside in (path.with_name(f"{path.stem}_pictures.npz"), path.with_suffix(".npz")):
        if beside != path and beside.exists():
            with np.load(beside) as arrays:
                return {name: arrays[name] for name in arrays.files}
    return None


def scene_of(found: ExternalCheckpoint, cameras: tuple[Camera, ...]) -> Scene:
    """The scene that `cagefield import` makes, of BAKED voxels where they are baked."""
    if isinstance(found.field, VoxelField):
        return Scene(found.field, cameras={"test": cameras}, background=found.background)
    return Scene.baked(found.field, {"test": cameras}, found.background, resolution=BAKED)


def against_authors(theirs: np.ndarray, scene: Scene, camera: Camera) -> float:
    """PSNR in dB of the first view's pixels [H,W,3] by the authors' code against ours."""
    if scene.original is None:
        ours = render_sampled(scene.field, camera, samples=400, background="white").rgb
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
