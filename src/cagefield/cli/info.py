"""`cagefield info`: contents of a scene folder or a data set."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

if TYPE_CHECKING:
    from cagefield.fields.external.external_field import ExternalField
    from cagefield.fields.nerf_field import NerfField
    from cagefield.fields.splat_field import SplatField
    from cagefield.fields.voxel_field import VoxelField


@dataclass(frozen=True)
class Info:
    """Contents of a scene: field, cameras, edits and whether they can be evaluated; or of a data set."""

    scene: tyro.conf.Positional[Path]
    """Scene folder, or a data set."""
    masks: Path | None = None
    """Folder of masks of the data set's photos, NAME.png for the photo NAME."""

    def run(self) -> None:
        """Prints one line per fact."""
        from cagefield.cli.align import describe_alignment
        from cagefield.cli.dataset_report import describe_world
        from cagefield.cli.report import describe_edits
        from cagefield.fields.splat_field import SplatField
        from cagefield.scene.scene import Scene
        from cagefield.scene.scene_files import is_scene

        if not is_scene(self.scene) and _is_dataset(self.scene):
            from cagefield.cli.dataset_report import describe_dataset
            from cagefield.cli.poses import verified
            from cagefield.datasets import load_dataset

            dataset = load_dataset(self.scene, downscale=1, masks=self.masks)
            print("\n".join(describe_dataset(dataset)), flush=True)
            verified(dataset, correct=False)
            return
        scene = Scene.open(self.scene)
        field = scene.field
        megabytes = sum(file.stat().st_size for file in self.scene.iterdir() if file.is_file()) / 1e6
        print(f"scene       {self.scene} (version {scene.version}, {megabytes:.1f} MB)")
        content, details = _splats(field) if isinstance(field, SplatField) else _voxels(field)
        kind = "unbounded, box of interest" if field.unbounded else "box"
        size = " x ".join(f"{edge:.4g}" for edge in field.bounds[1] - field.bounds[0])
        print(f"field       {content}")
        print(f"            {kind} {size} around {_point(field.center)}")
        print(f"            {details}, color SH degree {field.sh_degree}")
        if scene.removal is not None:
            deleted = scene.removal.selection
            noun = "splats" if isinstance(field, SplatField) else "cells"
            print(f"deleted     {deleted.count} of {deleted.total} {noun} (`cagefield select --restore`)")
        if scene.original is not None:
            print("\n".join(_original(scene.original)))
        background = "none" if scene.background is None else _point(scene.background)
        print(f"background  {background}")
        for split, cameras in scene.cameras.items():
            sizes = sorted({f"{camera.width}x{camera.height}" for camera in cameras})
            print(f"cameras     {split}: {len(cameras)} {', '.join(sizes)}".rstrip())
        if world := describe_world(scene.source_to_world):
            print(f"world       {world}; export --source-coordinates undoes it")
        if scene.alignment:
            print("\n".join(describe_alignment(scene.alignment, scene)))
        if scene.gains:
            low, high = (choose(map(choose, scene.gains)) for choose in (min, max))
            print(f"exposure    gains of {len(scene.gains)} training photos, from {low:.3f} to {high:.3f}")
        for line in describe_edits(scene):
            print(f"edits       {line}")


def _is_dataset(path: Path) -> bool:
    """Whether there is a file of cameras: anything else is reported as a scene."""
    from cagefield.datasets.colmap.colmap_model import find_model
    from cagefield.datasets.llff import POSES_FILE
    from cagefield.datasets.transforms.transforms_json_dataset import camera_file

    if not path.is_dir():
        return path.is_file()
    return camera_file(path) is not None or (path / POSES_FILE).is_file() or find_model(path) is not None


def _original(original: NerfField | ExternalField) -> list[str]:
    """Lines about the field that the voxels were baked from."""
    from cagefield.fields.nerf_field import NerfField

    if not isinstance(original, NerfField):
        return [f"original    {original.describe()}"]
    space = "NDC" if original.ndc else f"depth {original.near:.4g} to {original.far:.4g}"
    return [
        f"original    NeRF: coarse {original.coarse}; fine {original.fine or 'none'}",
        f"            {original.samples[0]} + {original.samples[1]} samples a ray, {space}",
    ]


def _voxels(field: VoxelField) -> tuple[str, str]:
    """(contents, resolution) of a voxel field, as text."""
    nx, ny, nz = field.resolution
    stored = len(field.vertices)
    share = stored / (nx * ny * nz)
    return (
        f"{nx} x {ny} x {nz} voxels, {stored} stored ({share:.1%})",
        f"voxel edge {max(field.voxel_size):.4g}",
    )


def _splats(field: SplatField) -> tuple[str, str]:
    """(contents, resolution) of a splat field, as text."""
    arrays = (field.means, field.log_scales, field.quaternions, field.opacities, field.sh)
    megabytes = sum(array.nbytes for array in arrays) / 1e6
    offset = f", without the offset {', '.join(f'{v:.15g}' for v in field.offset)}" * any(field.offset)
    filtered = ", discs" if field.discs else ", antialiased" if field.antialiased else ""
    return (
        f"{len(field)} splats ({megabytes:.1f} MB in memory){filtered}{offset}",
        f"splat width {field.sample_spacing:.4g}",
    )


def _point(values: object) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in values) + ")"  # type: ignore[attr-defined]
