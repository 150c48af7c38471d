"""`cagefield export`: a scene, its edits baked in, as a file that other programs read, or as a page."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from cagefield.cli.options import (
    Axes,
    Device,
    Flag,
    Output,
    SpzVersion,
    Up,
    check_file,
    progress_bar,
    stages,
)
from cagefield.errors import CagefieldError
from cagefield.files.safe_open import real_path

if TYPE_CHECKING:
    from cagefield.fields.splat_field import SplatField
    from cagefield.geometry.cage import Cage
    from cagefield.scene.scene import Scene
    from cagefield.typing import Array

What = Literal["splats", "mesh", "points", "page"]


@dataclass(frozen=True)
class Export:
    """Write a scene, its edits baked in, as splats, a mesh or points, or as a page that shows it.

    Splats of a scene of splats are its own; to voxels they are fitted, which takes --minutes.
    """

    scene: tyro.conf.Positional[Path]
    """Scene folder."""
    out: Output
    """Splats: .ply, .compressed.ply, .spz, .sog, .splat, .glb, .usda, .usdc or .usdz; FOLDER/lod-meta.json
    is a streamed SOG with levels of detail; a mesh: .ply or .glb; points: .ply; a page that any browser opens
    without a server: .html; with --embed a folder. A name with %04d, such as frame_%04d.ply: a file of splats
    for each frame of the camera path."""
    what: Annotated[What, tyro.conf.arg(name="as")] = "splats"
    """Kind of file; a file that ends in .html is a page."""
    embed: Flag = False
    """A page as a folder for a web site, to be shown in an <iframe>: its field is a file of its own, which
    shows coarsely while it loads."""
    levels: Flag = False
    """With --embed, of splats: levels of detail. A coarse level shows first, and details come where the
    camera looks. Edits are baked in."""
    budget: int | None = None
    """With --levels: most splats that a page holds at a time; details that it has not shown for longest give
    way. Left out, as many as the browser's GPU has room for."""
    selection: str | None = None
    """Only a cage's content: an edit's name (its inner cage, where the edit has taken it), an edit file, or
    a cage such as '{center: [0, 0, 1], size: 2}'."""
    axes: Axes | None = None
    """Axes of a file of splats: where x, y and z point, right or left, up or down, front or back; left out,
    those of its format."""
    up: Up | None = None
    """Which way is up in the scene, where its cameras do not say: splats are turned to stand upright in the
    file's axes. y-down turns nothing: coordinates of the scene count as those of 3DGS' .ply."""
    source_coordinates: Flag = False
    """Coordinates of the reconstruction that the photos' poses came from, before the scene was leveled, moved
    or scaled (COLMAP's; nerfstudio's before applied_transform)."""
    camera_path: Path | None = None
    """Camera path whose keyframes move the edits: time samples of a USD file, or the files of a sequence;
    a sequence takes the scene's own if left out."""
    fps: float = 24.0
    """Frames per second along the camera path."""
    add: tuple[Path, ...] = ()
    """Further scenes of splats in a USD file, each a prim of its own."""
    spz_version: SpzVersion | None = None
    """Version of an .spz file; left out, 3, which Spark opens, too."""
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
    """Replace the file that is there; of a sequence those of its frames, which are kept otherwise."""

    def run(self) -> None:
        """Bake or fit, write, and print the contents of the file."""
        from cagefield.exporting.sequences import is_sequence

        if self.what == "splats" and not self.embed and is_sequence(self.out):
            return self._sequence()
        if self.embed or self.out.suffix.lower() == ".html":
            return self._page()
        if self.levels or self.budget is not None:
            raise CagefieldError(
                "--levels and --budget are for a page; give --embed and the name of a folder"
            )
        self._check()
        from cagefield.compute import devices
        from cagefield.exporting import cages_of

        scene = self._opened(self.scene)
        if self.camera_path is not None or self.add or (_is_usd(self.out) and _pastes(scene)):
            return self._stage(scene)
        cages = () if self.selection is None else cages_of(self.selection, scene.edits)
        devices.start(self.device)
        write = {"splats": self._splats, "mesh": self._mesh, "points": self._points}[self.what]
        print(f"{write(scene, cages)}\nwritten to {self.out}")

    def _page(self) -> None:
        """Check the options of a page, and write it."""
        from cagefield.cli.export_page import export_page

        if self.what not in ("splats", "page"):
            raise CagefieldError(f"{self.out}: {self.what} are not written as a page; give another name")
        if self.selection is not None or self.axes is not None:
            raise CagefieldError("a page shows the whole scene; leave out --selection and --axes")
        if self.source_coordinates:
            raise CagefieldError("a page shows the scene's coordinates; leave out --source-coordinates")
        if self.camera_path is not None or self.add:
            raise CagefieldError(
                "a page shows the scene's own camera path; leave out --camera-path and --add"
            )
        if self.levels and not self.embed:
            raise CagefieldError(
                "--levels writes files beside the page; give --embed and the name of a folder"
            )
        if self.budget is not None and not self.levels:
            raise CagefieldError("--budget is for levels of detail; give --levels, too")
        if self.embed and self.out.suffix.lower() == ".html":
            raise CagefieldError(f"{self.out}: --embed writes a folder; give a name without .html")
        export_page(
            self.scene,
            self.out,
            self.device,
            embed=self.embed,
            levels=self.levels,
            budget=self.budget,
            overwrite=self.overwrite,
        )

    def _sequence(self) -> None:
        """Write a file of splats for each frame, and print how many."""
        from cagefield.compute import devices
        from cagefield.exporting.path_frames import CameraPath
        from cagefield.exporting.sequences import frame_file, write_sequence
        from cagefield.files.atomic import check_writable

        if self.selection is not None or self.source_coordinates or self.add:
            raise CagefieldError(
                "a sequence has all splats of one scene, upright; leave out --selection, "
                "--source-coordinates and --add"
            )
        check_writable(frame_file(self.out, 0))
        own = self.scene / "camera_path.json"
        if self.camera_path is None and self.scene.is_dir() and not own.exists():
            raise CagefieldError(
                f"{self.scene} has no camera path whose frames a sequence could be; give --camera-path, or "
                "make one in the editor"
            )
        path = CameraPath.load(self.camera_path or own, self.fps)
        scene = self._opened(self.scene)
        devices.start(self.device)
        with progress_bar("Frames") as move:
            written, kept = write_sequence(
                scene,
                path,
                self.out,
                self._up(scene),
                axes=self.axes,
                spz_version=self.spz_version,
                overwrite=self.overwrite,
                on_progress=lambda done, note: move(done, 1.0, note),
            )
        again = f"; {kept} were there and are kept (--overwrite replaces them)" if kept else ""
        print(f"{written + kept} frames of splats, {written} written{again}\nin {self.out}")

    def _stage(self, scene: Scene) -> None:
        """Write scenes, their pastes and their edits along a camera path as USD, and print the contents."""
        from cagefield.compute import devices
        from cagefield.exporting.path_frames import CameraPath
        from cagefield.exporting.usd_scenes import StageScene, write_scenes_usd

        if not _is_usd(self.out):
            raise CagefieldError(
                f"{self.out}: --camera-path and --add are for .usda, .usdc and .usdz; give such a name, "
                "or one with %04d for a sequence"
            )
        if self.selection is not None or self.source_coordinates or self.axes is not None:
            raise CagefieldError(
                "a USD of several prims or frames has all splats, upright, y up; leave out --selection, "
                "--source-coordinates and --axes"
            )
        path = None if self.camera_path is None else CameraPath.load(self.camera_path, self.fps)
        folders = [self.scene, *self.add]
        opened = [scene, *map(self._opened, self.add)]
        devices.start(self.device)
        with progress_bar("Splats") as move:
            info = write_scenes_usd(
                self.out,
                [
                    StageScene(real_path(folder).name, one, self._up(one))
                    for folder, one in zip(folders, opened, strict=True)
                ],
                path,
                on_progress=lambda done: move(done, 1.0, ""),
            )
        times = "" if info.fps is None else f", {info.frames} time samples at {info.fps:g} frames per second"
        print(f"prims: {', '.join(info.names)}; SH degree {info.sh_degree}{times}\nwritten to {self.out}")

    def _opened(self, folder: Path) -> Scene:
        """The scene of a folder; --up replaces its own up direction."""
        from cagefield.scene.alignment import Alignment
        from cagefield.scene.scene import Scene

        scene = Scene.open(folder)
        if self.up is None or scene.alignment.up is None:
            return scene
        return replace(scene, alignment=Alignment(scene.alignment.meters_per_unit))

    def _up(self, scene: Scene) -> Array:
        """Direction [3] that is up in a scene."""
        from cagefield.scene.import_splats import axis_of

        return scene.up if self.up is None else axis_of(self.up)

    def _check(self) -> None:
        """Check the options before anything is computed."""
        from cagefield.formats.mesh_files import MESH_SUFFIXES
        from cagefield.formats.splats.splat_files import find_writer

        check_file(self.out, self.overwrite)
        suffix = self.out.suffix.lower()
        if self.what == "page":
            raise CagefieldError(f"{self.out}: a page is written as .html; give such a name")
        if self.source_coordinates and self.up is not None:
            raise CagefieldError("--source-coordinates turns nothing upright; leave out --up")
        if self.what == "splats":
            find_writer(self.out, self.spz_version)
        elif (self.axes, self.up, self.spz_version) != (None, None, None):
            raise CagefieldError(
                "--axes, --up and --spz-version are for splats; leave them out for a mesh or points"
            )
        if self.what == "mesh" and suffix not in MESH_SUFFIXES:
            raise CagefieldError(f"{self.out}: a mesh is written as .ply or .glb; give such a name")
        if self.what == "points" and suffix != ".ply":
            raise CagefieldError(f"{self.out}: points are written as .ply; give such a name")
        if self.splats is not None and not 100 <= self.splats <= 10**7:
            raise CagefieldError(f"--splats is {self.splats}; it must be from 100 to 10000000")

    def _splats(self, scene: Scene, cages: tuple[Cage, ...]) -> str:
        """Writes splats; a line of figures."""
        from cagefield.exporting import edited_splats, inside, upright
        from cagefield.exporting.similarity import aligned_splats, transform_field, world_to_source
        from cagefield.fields.splat_field import SplatField
        from cagefield.scene.import_splats import nearest_up

        if isinstance(scene.field, SplatField):
            splats = edited_splats(scene)
            figures = "edits baked in" if scene.edits.active else "without edits"
        else:
            splats, figures = self._fitted(scene)
        if cages:
            splats = splats.take(inside(cages, splats.means))
        line = f"{len(splats)} splats, SH degree {splats.sh_degree}; {figures}"
        if self.source_coordinates:
            moved = transform_field(splats, world_to_source(scene))
            return f"{line}{self._write(moved)}\nin the coordinates of the reconstruction"
        up = self._up(scene)
        aligned = aligned_splats(splats, scene)
        turned = upright(aligned, up)
        line += self._write(turned) + _aligned(scene)
        if turned is not aligned:
            line += f"\nturned upright from {nearest_up(up)}; --up y-down keeps the scene's coordinates"
        return line

    def _write(self, splats: SplatField) -> str:
        """Writes splats in the file's axes; its levels of detail in words, empty without any."""
        from cagefield.cli.options import levels_and_bytes
        from cagefield.formats.splats.splat_files import write_splats

        with progress_bar("Splats") as move:
            write_splats(
                splats, self.out, self.axes, lambda done: move(done, 1.0, ""), spz_version=self.spz_version
            )
        return levels_and_bytes(self.out)[0]

    def _fitted(self, scene: Scene) -> tuple[SplatField, str]:
        """Splats fitted to voxels, and how well."""
        from cagefield.exporting import fitted_splats
        from cagefield.training.splats.splat_config import SplatConfig

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
        from cagefield.exporting import inside, scene_mesh
        from cagefield.exporting.similarity import transform_mesh, world_to_aligned, world_to_source
        from cagefield.formats.mesh_files import write_mesh

        with progress_bar("Meshing") as move:
            mesh = scene_mesh(scene, self.resolution, lambda done: move(done, 1.0, ""))
        if cages:
            mesh = mesh.select_vertices(inside(cages, mesh.positions))
        up, offset = scene.up, scene.offset
        if self.source_coordinates:
            back = world_to_source(scene)
            up = back[:3, :3] @ up
            mesh, offset = transform_mesh(mesh, back)
        elif scene.alignment:
            mesh, offset = transform_mesh(mesh, world_to_aligned(scene))
        write_mesh(self.out, mesh, up, offset=offset)
        aligned = "" if self.source_coordinates else _aligned(scene)
        return f"{len(mesh.faces)} triangles, {len(mesh.positions)} vertices with colors{aligned}"

    def _points(self, scene: Scene, cages: tuple[Cage, ...]) -> str:
        """Writes points; a line of figures."""
        from cagefield.exporting import MAX_FITTED_SPLATS, inside, scene_points
        from cagefield.exporting.similarity import transform_points, world_to_aligned, world_to_source
        from cagefield.formats.mesh_files import write_points

        with stages() as move:
            points = scene_points(scene, self.splats or MAX_FITTED_SPLATS, move)
        if cages:
            import numpy as np

            points = points.take(np.flatnonzero(inside(cages, points.positions)))
        offset = scene.offset
        if self.source_coordinates:
            points, offset = transform_points(points, world_to_source(scene))
        elif scene.alignment:
            points, offset = transform_points(points, world_to_aligned(scene))
        write_points(self.out, points.positions, points.rgb, points.normals, offset=offset)
        aligned = "" if self.source_coordinates else _aligned(scene)
        return f"{len(points)} points with normals and colors{aligned}"


def _aligned(scene: Scene) -> str:
    """A line of figures of the scene's alignment, after a line break; empty without any."""
    scale, up = scene.alignment.meters_per_unit, scene.alignment.up
    parts = [] if scale is None else [f"in meters ({scale:.6g} m per unit of the scene)"]
    parts += [] if up is None else ["leveled by the scene's up direction"]
    return "\n" * bool(parts) + ", ".join(parts)


def _is_usd(path: Path) -> bool:
    from cagefield.formats.splats.usd_writer import USD_SUFFIXES

    return path.suffix.lower() in USD_SUFFIXES


def _pastes(scene: Scene) -> bool:
    """Whether a scene of splats has splats of other scenes."""
    from cagefield.edits import Paste
    from cagefield.fields.splat_field import SplatField

    return isinstance(scene.field, SplatField) and any(
        isinstance(edit, Paste) and edit.enabled for edit in scene.edits
    )
