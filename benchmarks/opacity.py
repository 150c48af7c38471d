"""Whether stretched content should keep its opacity: both choices against scenes with parts really scaled.

    python -m benchmarks.opacity WORKDIR --steps 6000 [-o benchmarks/results/opacity.md]
    python -m benchmarks.opacity WORKDIR --field splat --steps 600 --size 200 --no-continuous
        -o benchmarks/results/opacity_splats.md

WORKDIR is the work folder of `cagefield bench edits`; its fields of that many steps are used, or trained.
Only edits that change lengths can tell: whole scenes and parts that stand free are scaled, alike on all axes
and not, and the truth is the scene built so, with the light it was photographed with. The built-in continuous
edits follow, whose truth is the scene photographed through the exact map.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from benchmarks.common.cases import CASES, chosen
from benchmarks.common.figures import changed_pixels, mean_psnr, pooled_psnr, supersampled
from benchmarks.common.machine import Machine
from benchmarks.common.tables import Table, number, write_text
from benchmarks.common.workbench import Settings, Workbench
from benchmarks.edits import compare_shells
from cagefield.cameras.camera import Camera
from cagefield.compute import devices
from cagefield.edits import Edit, EditStack
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import Cage
from cagefield.procedural import procedural_scene
from cagefield.rendering.renderers import renderer_of
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.voxels.voxel_config import VoxelConfig
from cagefield.typing import AnyArray

Factors = tuple[float, float, float]

WHOLE: tuple[tuple[str, Factors], ...] = tuple(
    (name, factors)
    for name in ("digger", "chair", "microphone", "plant")
    for factors in ((0.5, 0.5, 0.5), (0.7, 0.7, 0.7), (1.0, 1.0, 0.5), (1.15, 1.15, 1.15))
)
"""Scene, factors along the world's axes: all of it is scaled about its center."""

STANDING: tuple[tuple[str, str, str, Factors], ...] = (
    ("digger", "move_cone", "cone", (0.6, 0.6, 0.6)),
    ("digger", "move_cone", "cone", (1.4, 1.4, 1.4)),
    ("digger", "move_cone", "cone", (1.0, 1.0, 1.8)),
    ("plant", "move_pinecone", "pinecone", (0.6, 0.6, 0.6)),
    ("plant", "move_pinecone", "pinecone", (1.4, 1.4, 1.4)),
    ("plant", "move_pinecone", "pinecone", (1.0, 1.0, 1.6)),
    ("chair", "copy_cushion", "cushion", (1.0, 1.0, 1.5)),
)
"""Scene, case whose cage is used, part, factors: the part is scaled about the middle of its cage's floor."""


CONTINUOUS = "Continuous edits: against photos of the scene through the exact map."


PRESERVED = {
    "voxel": "Preserved: density times |J d|, which keeps the optical depth along a ray, however stretched.",
    "splat": "Preserved: opacities o as they are; else 1 - (1 - o)^(|det J|^(1/3)). Gained, finer: of "
    "pictures drawn with 4x4 pixels for each, where the pixels' blur does not widen splats.",
}

FINER = 4
"""Pixels along the edge of one, for splats: blur widens those drawn smaller than they were trained."""


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("workdir", type=Path)
    parser.add_argument("-o", "--out", type=Path, default=Path("benchmarks/results/opacity.md"))
    parser.add_argument("--field", choices=("voxel", "splat"), default="voxel")
    parser.add_argument("--size", type=int, default=400, help="of the photos")
    parser.add_argument("--steps", type=int, default=6000, help="of the fields' training")
    parser.add_argument("--views", type=int, default=6)
    parser.add_argument("--scenes", nargs="*", default=("digger", "chair", "microphone", "plant"))
    parser.add_argument("--no-continuous", action="store_true", help="leave out the continuous edits")
    options = parser.parse_args()
    devices.start()
    splats = options.field == "splat"
    config = SplatConfig(steps=options.steps) if splats else VoxelConfig(steps=options.steps)
    bench = Workbench(Settings(size=options.size, config=config), options.workdir.resolve())
    rows = [*scaled(bench, options.scenes, options.views)]
    discrete = len(rows)
    if not options.no_continuous:
        rows += continuous(bench, options.scenes)
    gains = [float(row[7]) for row in rows]
    means = [f"scaled parts and scenes: {np.mean(gains[:discrete]):.2f} dB"]
    if splats:
        means[0] += f", finer {np.mean([float(row[8]) for row in rows]):.2f} dB"
    means += [f"continuous edits: {np.mean(gains[discrete:]):.2f} dB"] if rows[discrete:] else []
    table = Table(
        "Opacity of splats, scaled or kept" if splats else "Density as it is, or times |J d|",
        ("scene", "what", "factors", "PSNR", "there", "PSNR preserved", "there preserved", "gained")
        + (("gained, finer",) if splats else ()),
        tuple(rows),
        (
            f"{PRESERVED[options.field]} PSNR (dB): mean of {options.views} test views, against photos of "
            "the scene built with its parts so scaled and lit as they were; there: on the pixels that the "
            "edit changes.",
            *([] if options.no_continuous else [CONTINUOUS]),
            f"Gained on average by preserving: {'; '.join(means)}.",
            f"Fields: {options.field}s, {options.steps} steps, photos of {options.size}x{options.size}.",
            f"Machine: {Machine.here()}",
            f"Command: `python -m benchmarks.opacity {options.workdir.name} --field {options.field} "
            f"--steps {options.steps} --size {options.size} --views {options.views} "
            f"--scenes {' '.join(options.scenes)}"
            f"{' --no-continuous' if options.no_continuous else ''}`",
        ),
        names=3,
    )
    write_text(options.out, table.markdown())


def scaled(bench: Workbench, scenes: Sequence[str], views: int) -> Iterator[tuple[str, ...]]:
    """A row for each scaled scene and part."""
    for name, factors in WHOLE:
        if name not in scenes:
            continue
        model = procedural_scene(name)
        center, size = model.part_box(model.part_names, 0.05)
        yield _scaled(bench, views, name, model.part_names, Cage.box(center, size), center, factors)
    for name, case, part, factors in STANDING:
        if name not in scenes:
            continue
        (edit,) = chosen([name], [case])[0].edits
        floor = edit.inner.corners[:4].mean(axis=0)
        yield _scaled(bench, views, name, (part,), edit.inner, floor, factors)


def _scaled(
    bench: Workbench,
    views: int,
    name: str,
    parts: tuple[str, ...],
    cage: Cage,
    pivot: np.ndarray,
    factors: Factors,
) -> tuple[str, ...]:
    cameras = bench.scene(name).cameras["test"][:views]
    model = procedural_scene(name)
    moved = model.move(parts, scale=factors, pivot=pivot).with_modeled_light()
    # The edit scales about the cage's center; what remains takes that to where scaling about the pivot does.
    shift = (1.0 - np.array(factors)) * (pivot - cage.center)
    edit = Edit.move(cage).scale(factors).translate(shift)
    truth = np.stack([moved.photograph(camera, background="white").rgb8() for camera in cameras])
    what = "all" if len(parts) > 1 else parts[0]
    same = "x".join(f"{f:g}" for f in factors)
    before = bench.modeled(name, cameras)
    return _row(bench, name, what, same, EditStack([edit]), cameras, before, truth)


def continuous(bench: Workbench, scenes: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """A row for each continuous edit."""
    size = bench.settings.exact_size
    for case in CASES:
        if case.kind != "continuous" or case.scene not in scenes:
            continue
        known = bench.scene(case.scene).cameras["test"][: bench.settings.exact_views]
        cameras = tuple(camera.resized(size, size) for camera in known)
        before = bench.mapped(case.scene, None, cameras)
        truth = bench.mapped(case.scene, case.edits, cameras)
        name = case.name.replace("_", " ")
        yield _row(
            bench, case.scene, name, "continuous", case.edits, cameras, before, truth, compare_shells.FINER
        )


def _row(
    bench: Workbench,
    name: str,
    what: str,
    factors: str,
    edits: EditStack,
    cameras: tuple[Camera, ...],
    before: AnyArray,
    truth: AnyArray,
    rays: int = 1,
) -> tuple[str, ...]:
    there = changed_pixels(before, truth)
    field, figures, finer = bench.scene(name).field, [], []
    for preserve in (False, True):
        renderer = renderer_of(field, edits, preserve_opacity=preserve)
        shown = np.stack([_shown(renderer, camera, rays) for camera in cameras])
        figures += [mean_psnr(shown, truth), pooled_psnr(shown, truth, there)]
        if isinstance(field, SplatField):
            finer.append(mean_psnr(np.stack([_shown(renderer, camera, FINER) for camera in cameras]), truth))
    row = (name, what, factors, *map(number, figures), number(figures[2] - figures[0]))
    if finer:
        row += (number(finer[1] - finer[0]),)
    print(*row, flush=True)
    return row


def _shown(renderer: VoxelRenderer | SplatRenderer, camera: Camera, finer: int) -> AnyArray:
    """A picture over white of 8 bits, drawn with `finer` x `finer` pixels for each."""
    rgb = supersampled(lambda large: renderer.render(large, background="white").rgb, camera, finer)
    return np.round(rgb * 255.0).astype(np.uint8)


if __name__ == "__main__":
    main()
