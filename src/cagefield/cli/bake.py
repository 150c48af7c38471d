"""`cagefield bake`: the voxels of a scene, from its splats or anew from the original field that it holds."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from cagefield.cli.options import Baking, BakingOptions, Device, Flag, OptionalOutput, progress_bar
from cagefield.errors import CagefieldError
from cagefield.files.safe_open import real_path

if TYPE_CHECKING:
    from cagefield.cameras.camera import Camera
    from cagefield.fields.external.external_field import ExternalField
    from cagefield.fields.nerf_field import NerfField
    from cagefield.fields.splat_field import SplatField
    from cagefield.scene.scene import Scene


@dataclass(frozen=True)
class Bake:
    """Bake a scene's splats, or its original NeRF, into voxels."""

    scene: tyro.conf.Positional[Path]
    """Scene folder, from `cagefield import` or `cagefield train --field splat` or nerf."""
    out: OptionalOutput = None
    """New scene folder, needed for splats, which stay where they are; left out, the scene itself is changed,
    which needs --overwrite."""
    baking: Baking = field(default_factory=BakingOptions)
    device: Device = "auto"
    overwrite: Flag = False
    """Replace the scene that is there."""

    def run(self) -> None:
        """Bakes, writes the scene, prints the PSNR between the two fields."""
        from cagefield.compute import devices
        from cagefield.fields.splat_field import SplatField
        from cagefield.scene.scene import Scene
        from cagefield.scene.scene_files import check_destination

        destination = self.out or self.scene
        if self.out is None and not self.overwrite:
            raise CagefieldError(
                f"without -o the scene {self.scene} itself would change; give -o NEW_SCENE, or --overwrite"
            )
        scene = Scene.open(self.scene)
        splats = scene.field if isinstance(scene.field, SplatField) else None
        original = scene.original if splats is None else splats
        if original is None:
            raise CagefieldError(
                f"scene {self.scene} holds no original field to bake, only voxels; import a checkpoint or "
                "train with --field splat or nerf"
            )
        if splats is not None and real_path(destination) == real_path(self.scene):
            raise CagefieldError(
                f"voxels in the place of the splats of {self.scene} would lose them; give -o NEW_SCENE"
            )
        check_destination(destination, self.overwrite)
        devices.start(self.device)
        baked, figures = bake_scene(
            original,
            scene.cameras,
            scene.background,
            self.baking,
            unbounded=scene.field.unbounded,
        )
        dataclasses.replace(scene, field=baked.field).save(destination, overwrite=self.overwrite)
        print(f"{figures}\nscene written to {destination}")


def bake_scene(
    original: NerfField | ExternalField | SplatField,
    cameras: Mapping[str, tuple[Camera, ...]],
    background: tuple[float, float, float] | None,
    options: BakingOptions,
    *,
    unbounded: bool = False,
) -> tuple[Scene, str]:
    """The scene of a field's or splats' voxels, with a progress bar on stderr, and a line of figures.

    Of an `unbounded` one the region that the cameras see is baked.
    """
    import time
    from typing import cast

    from cagefield.fields.splat_field import SplatField
    from cagefield.fields.voxel_field import VoxelField
    from cagefield.rendering.bake_fidelity import agreement
    from cagefield.scene.scene import Scene

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
    seconds, voxels = time.perf_counter() - began, cast(VoxelField, scene.field)
    nx, ny, nz = voxels.resolution
    line = f"baked {nx} x {ny} x {nz} voxels, {len(voxels.vertices)} stored, in {seconds:.0f} s"
    seen = cameras.get("test") or next((group for group in cameras.values() if group), ())
    if seen:
        some = seen[:: max(1, len(seen) // options.compare)][: options.compare] if options.compare else ()
        if some:
            found = agreement(original, voxels, some, background)
            against = "splats" if isinstance(original, SplatField) else "original"
            line += f"; PSNR of the voxels against the {against} {found:.2f} dB ({len(some)} views)"
    return scene, line
