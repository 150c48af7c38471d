"""`cagefield import`: splats or a radiance field of another program as a scene."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import tyro

from cagefield.cli.edit_preparation import prepare_edits
from cagefield.cli.options import Axes, Baking, BakingOptions, Device, Flag, Output, Up
from cagefield.errors import CagefieldError

if TYPE_CHECKING:
    from cagefield.datasets import Dataset
    from cagefield.formats.external.checkpoint import ExternalCheckpoint
    from cagefield.scene.scene import Scene

Unbounded = Literal["auto", "on", "off"]


@dataclass(frozen=True)
class ImportField:
    """Read a splat file (.ply, .spz, .sog, .splat, .ksplat, .glb, .gltf, USD) or a checkpoint: a scene.

    Splats stay splats and keep the file's coordinates, in the axes of PLY; a NeRF is baked into voxels.
    """

    file: tyro.conf.Positional[Path]
    """Splats, or a checkpoint of splatfacto, nerfacto, nerf-pytorch, TensoRF, Instant-NGP, svox2, svox or
    SVRaster."""
    out: Output
    """Scene folder."""
    data: Path | None = None
    """Data set it was trained on: its cameras become the scene's; cameras all around if left out."""
    up: Up = "y-down"
    """Which way splats are turned, where --data is left out: most files have y pointing down."""
    axes: Axes | None = None
    """Where x, y and z of the file point, such as rdf (right, down, front); left out, as its format says."""
    time_code: float | None = None
    """Time code of a USD file with time samples; left out, the first."""
    unbounded: Unbounded = "auto"
    """Splats far away are surroundings: auto where they are much farther than most."""
    config: Path | None = None
    """Config of a NeRF's training; args.txt, config.txt or config.yml beside the checkpoint if left out."""
    fov_deg: float | None = None
    """Horizontal field of view of a NeRF's forward-facing photos, where --data is left out."""
    data_scale: float | None = None
    """Factor of the data set's camera positions in the training of svox2 (scene_scale), 2/3 if left out."""
    downscale: int | None = None
    """Shrink the data set's photos by this factor; left out, until their longer side is 800 or less."""
    baking: Baking = field(default_factory=BakingOptions)
    device: Device = "auto"
    overwrite: Flag = False
    """Replace the scene that is there."""

    def run(self) -> None:
        """Read, bake where necessary, write, and print the contents."""
        from cagefield.formats.external.instant_ngp import is_instant_ngp
        from cagefield.formats.splats.open_splats import holds_splats
        from cagefield.scene.scene_files import check_destination

        check_destination(self.out, self.overwrite)
        if self.fov_deg is not None and not 1.0 <= self.fov_deg <= 170.0:
            raise CagefieldError(f"--fov-deg is {self.fov_deg}; it must be from 1 to 170")
        self._check_file()
        if not is_instant_ngp(self.file) and holds_splats(self.file):
            scene, lines = self._splats()
        else:
            scene, lines = self._field()
        scene.save(self.out, overwrite=self.overwrite)
        print(f"{lines}\nscene written to {self.out}", flush=True)
        prepare_edits(self.out)

    def _check_file(self) -> None:
        """Raises CagefieldError for a config, and for a folder without splats, naming a checkpoint in it."""
        from cagefield.formats.splats.detection import is_splat_folder

        if self.file.suffix.lower() in (".yml", ".yaml"):
            raise CagefieldError(f"{self.file}: a config; give the checkpoint of its training, step-*.ckpt")
        if self.file.is_dir() and not is_splat_folder(self.file):
            patterns = ("step-*.ckpt", "*/step-*.ckpt", "*.th", "*.tar", "*_model.pt", "*.ingp", "ckpt.npz")
            found = [path for pattern in patterns for path in sorted(self.file.glob(pattern))[-1:]]
            named = f", such as {found[0]}" if found else ""
            raise CagefieldError(
                f"{self.file}: a folder without meta.json or lod-meta.json; give a file of splats or a "
                f"checkpoint{named}"
            )

    def _splats(self) -> tuple[Scene, str]:
        """The scene of a splat file, and a text report of its contents."""
        from cagefield.formats.splats.splat_files import read_splats
        from cagefield.scene.import_splats import import_splats
        from cagefield.scene.scene import Scene

        if self.config is not None or self.fov_deg is not None:
            raise CagefieldError("--config and --fov-deg are for NeRFs; leave them out for splats")
        self._check_data_scale(False)
        imported = import_splats(
            read_splats(self.file, self.axes, time_code=self.time_code),
            self.up,
            dataset=self._dataset(),
            unbounded={"auto": None, "on": True, "off": False}[self.unbounded],
        )
        splats = imported.field
        size = " x ".join(f"{edge:.4g}" for edge in splats.bounds[1] - splats.bounds[0])
        around = " and surroundings" if splats.unbounded else ""
        trained = ", discs" if splats.discs else ", trained antialiased" if splats.antialiased else ""
        count = sum(len(group) for group in imported.cameras.values())
        cameras = f"{count} cameras" + ("" if self.data else f" all around, {self.up}")
        if any(splats.offset):
            around += ", without the offset " + ", ".join(f"{value:.15g}" for value in splats.offset)
        line = f"{len(splats)} splats, SH degree {splats.sh_degree}{trained}; box {size}{around}; {cameras}"
        return Scene(splats, cameras=imported.cameras, background=imported.background), line

    def _field(self) -> tuple[Scene, str]:
        """The scene of a checkpoint that holds no splats, and a text report of its contents."""
        from cagefield.formats.external.read_external import read_external

        if self.up != "y-down" or self.unbounded != "auto" or self.axes is not None:
            raise CagefieldError("--up, --axes and --unbounded are for splats; leave them out for a NeRF")
        if self.time_code is not None:
            raise CagefieldError("--time-code is for splats of a USD file; leave it out for a NeRF")
        found = read_external(self.file, self.config)
        return self._nerf() if found is None else self._external(found)

    def _external(self, found: ExternalCheckpoint) -> tuple[Scene, str]:
        """The scene of another program's checkpoint: voxels, or its field baked into voxels."""
        from cagefield.cli.bake import bake_scene
        from cagefield.compute import devices
        from cagefield.fields.voxel_field import VoxelField
        from cagefield.scene.import_external import cameras_of, with_data_scale
        from cagefield.scene.scene import Scene

        if self.fov_deg is not None:
            raise CagefieldError("--fov-deg is for a nerf-pytorch trained in NDC; leave it out here")
        self._check_data_scale(isinstance(found.field, VoxelField))
        if self.data_scale is not None:
            found = with_data_scale(found, self.data_scale)
        cameras = cameras_of(found, self._dataset())
        lines = [found.description, *found.notes]
        if isinstance(found.field, VoxelField):
            return Scene(found.field, cameras=cameras, background=found.background), "\n".join(lines)
        devices.start(self.device)
        scene, figures = bake_scene(
            found.field, cameras, found.background, self.baking, unbounded=found.field.unbounded
        )
        return scene, "\n".join([*lines, figures])

    def _nerf(self) -> tuple[Scene, str]:
        """The baked scene of a nerf-pytorch checkpoint, and a text report of its contents."""
        from cagefield.cli.bake import bake_scene
        from cagefield.compute import devices
        from cagefield.formats.nerf.nerf_pytorch import read_checkpoint
        from cagefield.formats.nerf.nerf_pytorch_config import SamplingSettings, find_config, read_config
        from cagefield.scene.import_nerf_pytorch import import_nerf

        self._check_data_scale(False)
        found = read_checkpoint(self.file)
        config = self.config or find_config(self.file)
        settings = SamplingSettings() if config is None else read_config(config)
        fov = None if self.fov_deg is None else math.radians(self.fov_deg)
        imported = import_nerf(found, settings, self._dataset(), fov)
        devices.start(self.device)
        scene, figures = bake_scene(
            imported.field,
            imported.cameras,
            imported.background,
            self.baking,
            unbounded=imported.field.ndc is not None,
        )
        sampling = f"sampling: {config if config else 'no config found, as for Blender scenes'}"
        return scene, f"{found}\n{sampling}\n{figures}"

    def _check_data_scale(self, is_svox2: bool) -> None:
        if self.data_scale is not None and not is_svox2:
            raise CagefieldError("--data-scale is for a grid of svox2; leave it out here")

    def _dataset(self) -> Dataset | None:
        from cagefield.datasets import load_dataset

        return None if self.data is None else load_dataset(self.data, downscale=self.downscale)
