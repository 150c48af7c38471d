"""`cagefield render`: pictures or a video of a scene."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from cagefield.cli.options import (
    Device,
    Flag,
    Output,
    check_file,
    check_folder,
    parse_background,
    parse_size,
    track,
)
from cagefield.errors import CagefieldError

if TYPE_CHECKING:
    from cagefield.cameras.camera import Camera
    from cagefield.cli.frame_files import FrameFiles
    from cagefield.scene.frames import FrameOptions
    from cagefield.scene.scene import Scene


@dataclass(frozen=True)
class Render:
    """Pictures or a video of a scene: its test views, an orbit, a camera path, or a tour of its hotspots."""

    scene: tyro.conf.Positional[Path]
    """Scene folder."""
    out: Output
    """Folder for numbered PNGs, or one .mp4, or one .png for a single view."""
    split: str = "test"
    """Whose cameras: test, train or val."""
    views: tuple[int, ...] = ()
    """Only these cameras of the split, by index; all if left out."""
    turntable: int = 0
    """Number of pictures on an orbit around the cameras' common target, instead of the split's cameras."""
    camera_path: Path | None = None
    """nerfstudio camera-path JSON, instead of the split's cameras."""
    hotspots: float | None = None
    """Tour of the scene's hotspots, with a stop of so many seconds at each, in place of the cameras."""
    dataparser_transforms: Path | None = None
    """nerfstudio's dataparser_transforms.json, to bring its camera path back into the data set's space."""
    size: str | None = None
    """WIDTHxHEIGHT, or the longer side alone; the cameras' own size if left out."""
    background: str | None = None
    """white, black, none (transparent PNGs) or r,g,b from 0 to 1; the scene's own if left out."""
    depth: Flag = False
    """Depth too, near is bright: NAME_depth.png, distances in NAME_depth.npy; in a video beside it."""
    normals: Flag = False
    """Normals too, (n + 1) / 2 as rgb, world space: NAME_normals.png; in a video beside it."""
    compare: Flag = False
    """Side by side: the scene before its edits, and after."""
    unedited: Flag = False
    """Leave the scene's edits out."""
    exact: Flag = False
    """Every edit exact at every sample, of the original NeRF where the scene has one; minutes a picture."""
    fps: float | None = None
    """Pictures a second in a video: 24, or the rate of the camera path."""
    device: Device = "auto"
    frames: str | None = None
    """FIRST-LAST: only these of all the pictures, numbered as among all; for arrays of jobs."""
    keep: Flag = False
    """Go on: pictures that are in the folder stay, the others are added. Of a video they are in NAME_frames.
    Scene and options must be those of the first run; sizes are checked."""
    cluster: str | None = None
    """Render on a cluster of dask.distributed: a number of local workers, tcp://HOST:PORT, tls://HOST:PORT,
    or a scheduler file."""
    cluster_tls: tuple[Path, Path, Path] | None = None
    """CA CERT KEY: PEM files for the connections to and in the cluster."""
    overwrite: Flag = False
    """Replace files that are there."""

    def run(self) -> None:
        """Renders and writes; prints where the result is."""
        self._check_options()
        video, single = self.out.suffix.lower() == ".mp4", self.out.suffix.lower() == ".png"
        if video or single:
            check_file(self.out, self.overwrite)
        else:
            check_folder(self.out, self.overwrite or self.keep)
        if single:
            for end in ["_depth.png", "_depth.npy"] * self.depth + ["_normals.png"] * self.normals:
                check_file(self.out.with_name(self.out.stem + end), self.overwrite)

        from cagefield.cli.frame_files import FrameFiles, parse_frames
        from cagefield.images.pictures import write_pictures
        from cagefield.scene.frames import FrameRenderer
        from cagefield.scene.scene import Scene

        if self.cluster is not None:
            from cagefield.cluster.connection import check_installed, parse_cluster

            parse_cluster(self.cluster)
            check_installed()
        scene = Scene.open(self.scene)
        cameras, fps = self._cameras(scene)
        if single and len(cameras) != 1:
            raise CagefieldError(
                f"{self.out} is one picture, the views are {len(cameras)}; give a folder or --views"
            )
        files = FrameFiles(cameras, parse_frames(self.frames, len(cameras)), self._options().ends)
        if video:
            self._write_video(scene, files, fps)
        elif single:
            self._start_device()
            write_pictures(
                self.out.with_suffix(""), FrameRenderer(scene, self._options()).pictures(cameras[0], None)[0]
            )
        else:
            self._write_folder(scene, files)
        count = f"{len(files.frames)} picture{'s' if len(files.frames) != 1 else ''}"
        print(f"{count} in {self.out}" + (f", {files.kept} of them kept" if self.keep else ""))

    def _write_folder(self, scene: Scene, files: FrameFiles) -> None:
        from contextlib import nullcontext

        from cagefield.files.atomic import merged_folder

        with nullcontext(self.out) if self.keep else merged_folder(self.out) as folder:
            self._write_frames(scene, files, folder)

    def _write_video(self, scene: Scene, files: FrameFiles, fps: float) -> None:
        """Encodes frames as they are rendered; those of a cluster, or to be kept, from their files."""
        from cagefield.cli.frame_files import frames_folder
        from cagefield.images.image_files import write_video
        from cagefield.images.pictures import in_one_row
        from cagefield.scene.frames import FrameRenderer

        if not self.keep and self.cluster is None:
            self._start_device()
            rendered = FrameRenderer(scene, self._options()).sequence(files.selected)
            pictures = track(rendered, len(files.frames), "Rendering")
            write_video(self.out, (in_one_row(picture) for picture in pictures), fps)
            return
        with frames_folder(self.out, self.keep) as folder:
            self._write_frames(scene, files, folder)
            write_video(self.out, (in_one_row(picture) for picture in files.read(folder)), fps)

    def _write_frames(self, scene: Scene, files: FrameFiles, folder: Path) -> None:
        """Writes the frames that are to be rendered, here or on the cluster."""
        from cagefield.scene.frames import FrameRenderer

        wanted = files.missing(folder) if self.keep else files.frames
        if not wanted:
            return
        if self.cluster is None:
            self._start_device()
            renderer = FrameRenderer(scene, self._options())
            for _ in track(files.render(renderer, wanted, folder), len(wanted), "Rendering"):
                pass
            return
        from cagefield.cluster.connection import TlsFiles, parse_cluster
        from cagefield.cluster.frame_cluster import open_frame_cluster

        tls = TlsFiles(*self.cluster_tls) if self.cluster_tls else None
        with open_frame_cluster(
            parse_cluster(self.cluster), scene, self._options(), folder, device=self.device, tls=tls
        ) as cluster:
            for _ in track(files.render_on(cluster, wanted, folder), len(wanted), "Rendering"):
                pass

    def _start_device(self) -> None:
        from cagefield.compute import devices

        devices.start(self.device)

    def _options(self) -> FrameOptions:
        from cagefield.scene.frames import FrameOptions

        return FrameOptions(
            parse_background(self.background),
            self.depth,
            self.normals,
            self.compare,
            self.unedited,
            self.exact,
        )

    def _check_options(self) -> None:
        from cagefield.cameras.camera_paths import MAX_FPS, MIN_FPS

        if not 0 <= self.turntable <= 100_000:
            raise CagefieldError(
                f"--turntable is {self.turntable!s:.20}; give the number of pictures, 1 to 100000"
            )
        if sum((self.turntable > 0, self.camera_path is not None, self.hotspots is not None)) > 1:
            raise CagefieldError(
                "--turntable, --camera-path and --hotspots exclude each other; give one of them"
            )
        if self.dataparser_transforms and not self.camera_path:
            raise CagefieldError("--dataparser-transforms belongs to --camera-path; give both or neither")
        if self.compare and self.unedited:
            raise CagefieldError("--compare and --unedited exclude each other; give one of them")
        if self.keep and self.overwrite:
            raise CagefieldError("--keep and --overwrite exclude each other; give one of them")
        if self.cluster_tls and self.cluster is None:
            raise CagefieldError("--cluster-tls belongs to --cluster; give both or neither")
        if self.out.suffix.lower() == ".png" and (self.keep or self.frames or self.cluster is not None):
            raise CagefieldError(
                f"--keep, --frames and --cluster are for several pictures, {self.out} is one; give a folder"
            )
        if self.fps is not None and not MIN_FPS <= self.fps <= MAX_FPS:
            raise CagefieldError(f"--fps is {self.fps}; give a number from {MIN_FPS:g} to {MAX_FPS:g}")
        background = parse_background(self.background)
        if background == "none" and (self.compare or self.out.suffix.lower() == ".mp4"):
            raise CagefieldError(
                "--background none makes transparent PNGs; give a color for --compare or a video"
            )

    def _cameras(self, scene: Scene) -> tuple[list[Camera], float]:
        """The cameras to render, at their final size, and the frame rate."""
        from cagefield.cameras.camera_paths import load_camera_path, orbit

        fps = 24.0
        if self.camera_path:
            path = load_camera_path(self.camera_path, self.dataparser_transforms)
            cameras, fps = path.cameras, path.fps
        elif self.hotspots is not None:
            return self._tour(scene, self.hotspots)
        elif self.turntable:
            seen = scene.cameras.get("train") or next((c for c in scene.cameras.values() if c), ())
            if not seen:
                raise CagefieldError(f"scene {self.scene} has no cameras to orbit with; give --camera-path")
            width, height = parse_size(self.size, seen[0].width, seen[0].height)
            return list(orbit(seen, self.turntable, width=width, height=height)), self.fps or fps
        else:
            cameras = self._split_cameras(scene)
        if self.size is None:
            return list(cameras), self.fps or fps
        return [c.resized(*parse_size(self.size, c.width, c.height)) for c in cameras], self.fps or fps

    def _tour(self, scene: Scene, stop_seconds: float) -> tuple[list[Camera], float]:
        """Cameras of the tour of the hotspots, and the frame rate."""
        from cagefield.scene.hotspot_motion import visible_hotspots
        from cagefield.scene.hotspot_tour import tour_cameras

        first, fps = scene.first_camera, self.fps or 24.0
        width, height = parse_size(self.size, first.width, first.height)
        hotspots = visible_hotspots(scene)
        cameras = tour_cameras(
            hotspots, first, scene.up, stop_seconds=stop_seconds, fps=fps, width=width, height=height
        )
        return list(cameras), fps

    def _split_cameras(self, scene: Scene) -> tuple[Camera, ...]:
        cameras = scene.cameras.get(self.split, ())
        if not cameras:
            known = ", ".join(f"{name} ({len(c)})" for name, c in scene.cameras.items() if c) or "none"
            raise CagefieldError(
                f"scene {self.scene} has no {self.split!r} cameras, it has {known}; give --split"
            )
        for index in self.views:
            if not 0 <= index < len(cameras):
                raise CagefieldError(
                    f"--views {index} is out of range; {self.split} views go from 0 to {len(cameras) - 1}"
                )
        return tuple(cameras[index] for index in self.views) or cameras
