"""`cagefield bake`: the voxel field of a scene, anew from the original field that it holds."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from cagefield.cli.options import Baking, BakingOptions, Device, Flag, OptionalOutput, progress_bar
from cagefield.errors import CagefieldError

if TYPE_CHECKING:
    from cagefield.cameras import Camera
    from cagefield.fields.nerf import NerfField
    from cagefield.scene import Scene


@dataclass(frozen=True)
class Bake:
    """Bake a scene's original field (a NeRF) into the voxels that are edited interactively."""

    scene: tyro.conf.Positional[Path]
    """Scene folder, from `cagefield import` or `cagefield train --field nerf`."""
    out: OptionalOutput = None
    """New scene folder; left out, the scene itself is changed, which needs --overwrite."""
    baking: Baking = field(default_factory=BakingOptions)
    device: Device = "auto"
    overwrite: Flag = False
    """Replace the scene that is there."""

    def run(self) -> None:
        """Bakes, writes the scene, prints the PSNR between the two fields."""
        from cagefield import devices
        from cagefield.scene import Scene
        from cagefield.scene_files import check_destination

        destination = self.out or self.scene
        if self.out is None and not self.overwrite:
            raise CagefieldError(
                f"without -o the scene {self.scene} itself would change; give -o NEW_SCENE, or --overwrite"
            )
        scene = Scene.open(self.scene)
        if scene.original is None:
            raise CagefieldError(
                f"scene {self.scene} holds no original field to bake, only voxels; import a checkpoint or "
                "train with --field nerf"
            )
        check_destination(destination, self.overwrite)
        devices.start(self.device)
        baked, figures = bake_scene(
            scene.original,
            scene.cameras,
            scene.background,
            self.baking,
            unbounded=scene.field.contracted,
        )
        dataclasses.replace(scene, field=baked.field).save(destination, overwrite=self.overwrite)
        print(f"{figures}\nscene written to {destination}")


def bake_scene(
    original: NerfField,
    cameras: Mapping[str, tuple[Camera, ...]],
    background: tuple[float, float, float] | None,
    options: BakingOptions,
    *,
    unbounded: bool = False,
) -> tuple[Scene, str]:
    """The scene of a NeRF baked into voxels, with a progress bar on stderr, and a line of figures.

    Of an `unbounded` one what the cameras see is baked.
    """
    import time

    from cagefield.rendering.agreement import agreement
    from cagefield.scene import Scene

    began = time.perf_counter()
    with progress_bar("Baking") as move:
        scene = Scene.baked(
            original,
            cameras,
            background,
            resolution=options.resolution,
            sh_degree=options.sh_degree,
            unbounded=unbounded,
            on_progress=lambda done: move(done, 1.0, ""),
        )
    seconds, voxels = time.perf_counter() - began, scene.field
    nx, ny, nz = voxels.resolution
    line = f"baked {nx} x {ny} x {nz} voxels, {len(voxels.vertices)} stored, in {seconds:.0f} s"
    seen = cameras.get("test") or next((group for group in cameras.values() if group), ())
    if seen:
        some = seen[:: max(1, len(seen) // options.compare)][: options.compare] if options.compare else ()
        if some:
            found = agreement(original, voxels, some, background or (1.0, 1.0, 1.0))
            line += f"; PSNR of the voxels against the original {found:.2f} dB ({len(some)} views)"
    return scene, line
