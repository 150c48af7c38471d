"""`cagefield export`: a scene, its edits baked in, as a file that other programs read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from cagefield.cli.options import Axes, Device, Flag, Output, check_file, progress_bar, stages
from cagefield.errors import CagefieldError

if TYPE_CHECKING:
    from cagefield.cages import Cage
    from cagefield.fields.splat import SplatField
    from cagefield.scene import Scene

What = Literal["splats", "mesh", "points"]


@dataclass(frozen=True)
class Export:
    """Write a scene, its edits baked in, as splats, a mesh or points.

    Splats of a scene of splats are its own; to voxels they are fitted, which takes --minutes.
    """

    scene: tyro.conf.Positional[Path]
    """Scene folder."""
    out: Output
    """Splats: .ply, .compressed.ply, .spz, .sog, .splat or .glb; a mesh: .ply or .glb; points: .ply."""
    what: Annotated[What, tyro.conf.arg(name="as")] = "splats"
    """What to write."""
    selection: str | None = None
    """Only what a cage holds: an edit's name (its inner cage, where the edit has taken it), an edit file, or
    a cage such as '{center: [0, 0, 1], size: 2}'."""
    axes: Axes | None = None
    """Axes of a file of splats: where x, y and z point, right or left, up or down, front or back; left out,
    those of its format. Coordinates of the scene count as rdf, those of 3DGS' .ply."""
    splats: int | None = None
    """Most splats that are fitted, or points; left out, as many as the pictures' detail and the time allow,
    300,000 at most."""
    minutes: float = 2.0
    """How long to fit splats to voxels."""
    steps: int | None = None
    """Fit this many steps instead: on a CPU that gives the same splats each time."""
    resolution: int | None = None
    """Voxels along a mesh's longest axis; left out, the field's own."""
    device: Device = "auto"
    overwrite: Flag = False
    """Replace the file that is there."""

    def run(self) -> None:
        """Bakes or fits, writes; prints what is in the file."""
        self._check()
        from cagefield import devices
        from cagefield.exporting import cages_of
        from cagefield.scene import Scene

        scene = Scene.open(self.scene)
        cages = () if self.selection is None else cages_of(self.selection, scene.edits)
        devices.start(self.device)
        write = {"splats": self._splats, "mesh": self._mesh, "points": self._points}[self.what]
        print(f"{write(scene, cages)}\nwritten to {self.out}")

    def _check(self) -> None:
        """Refuses what cannot be written before anything is computed."""
        from cagefield.formats.mesh_files import MESH_SUFFIXES
        from cagefield.formats.splat_files import writer_of

        check_file(self.out, self.overwrite)
        suffix = self.out.suffix.lower()
        if self.what == "splats":
            writer_of(self.out)
        elif self.axes is not None:
            raise CagefieldError("--axes are for splats; leave them out for a mesh or points")
        if self.what == "mesh" and suffix not in MESH_SUFFIXES:
            raise CagefieldError(f"{self.out}: a mesh is written as .ply or .glb; give such a name")
        if self.what == "points" and suffix != ".ply":
            raise CagefieldError(f"{self.out}: points are written as .ply; give such a name")
        if self.splats is not None and not 100 <= self.splats <= 10**7:
            raise CagefieldError(f"--splats is {self.splats}; it must be from 100 to 10000000")

    def _splats(self, scene: Scene, cages: tuple[Cage, ...]) -> str:
        """Writes splats; a line of figures."""
        from cagefield.exporting import baked, inside
        from cagefield.fields.splat import SplatField
        from cagefield.formats.splat_files import write_splats

        if isinstance(scene.field, SplatField):
            splats, figures = baked(scene), "edits baked in" if scene.edits.active else "without edits"
        else:
            splats, figures = self._fitted(scene)
        if cages:
            splats = splats.take(inside(cages, splats.means))
        write_splats(splats, self.out, self.axes)
        return f"{len(splats)} splats, SH degree {splats.sh_degree}; {figures}"

    def _fitted(self, scene: Scene) -> tuple[SplatField, str]:
        """Splats fitted to voxels, and how well."""
        from cagefield.exporting import fitted_splats
        from cagefield.training.splat_config import SplatConfig

        config = SplatConfig(
            steps=SplatConfig.steps if self.steps is None else self.steps,
            minutes=self.minutes if self.steps is None else None,
            splats=self.splats,
            sh_degree=scene.field.sh_degree,
            dropout=0.0,
        )
        with stages() as move:
            result = fitted_splats(scene, config, move)
        line = f"fitted {result.seconds:.0f} s; PSNR against the voxels {result.train_psnr:.2f} dB"
        if result.test_psnr == result.test_psnr:
            line += f", from cameras that were held out {result.test_psnr:.2f} dB"
        if not result.finished:
            line += "; stopped early"
        return result.field, line

    def _mesh(self, scene: Scene, cages: tuple[Cage, ...]) -> str:
        """Writes a mesh; a line of figures."""
        from cagefield.exporting import inside, scene_mesh, scene_up
        from cagefield.formats.mesh_files import write_mesh

        with progress_bar("Meshing") as move:
            mesh = scene_mesh(scene, self.resolution, lambda done: move(done, 1.0, ""))
        if cages:
            mesh = mesh.kept(inside(cages, mesh.positions))
        write_mesh(self.out, mesh, scene_up(scene))
        return f"{len(mesh.faces)} triangles, {len(mesh.positions)} vertices with colours"

    def _points(self, scene: Scene, cages: tuple[Cage, ...]) -> str:
        """Writes points; a line of figures."""
        from cagefield.exporting import MOST_SPLATS, inside, scene_points
        from cagefield.formats.mesh_files import write_points

        with stages() as move:
            points = scene_points(scene, self.splats or MOST_SPLATS, move)
        if cages:
            import numpy as np

            points = points.take(np.flatnonzero(inside(cages, points.positions)))
        write_points(self.out, points.positions, points.rgb, points.normals)
        return f"{len(points)} points with normals and colours"
