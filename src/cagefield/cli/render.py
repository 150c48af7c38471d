"""`cagefield render`: pictures or a video of a scene."""

from __future__ import annotations

from collections.abc import Iterator
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
    from cagefield.cli.pictures import Pictures
    from cagefield.scene.scene import Scene


@dataclass(frozen=True)
class Render:
    """Pictures or a video of a scene: its test views, an orbit, or a nerfstudio camera path."""

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
    overwrite: Flag = False
    """Replace files that are there."""

    def run(self) -> None:
        """Renders and writes; prints where the result is."""
        self._check_options()
        video, single = self.out.suffix.lower() == ".mp4", self.out.suffix.lower() == ".png"
        (check_file if video or single else check_folder)(self.out, self.overwrite)
        if single:
            for end in ["_depth.png", "_depth.npy"] * self.depth + ["_normals.png"] * self.normals:
                check_file(self.out.with_name(self.out.stem + end), self.overwrite)

        from cagefield.cli.pictures import in_one_row, write_pictures
        from cagefield.compute import devices
        from cagefield.files.atomic import merged_folder
        from cagefield.images.image_files import write_video
        from cagefield.scene.scene import Scene

        scene = Scene.open(self.scene)
        cameras, fps = self._cameras(scene)
        if single and len(cameras) != 1:
            raise CagefieldError(
                f"{self.out} is one picture, the views are {len(cameras)}; give a folder or --views"
            )
        devices.start(self.device)
        pictures = track(self._pictures(scene, cameras), len(cameras), "Rendering")
        if video:
            write_video(self.out, (in_one_row(picture) for picture in pictures), fps)
        elif single:
            for picture in pictures:
                write_pictures(self.out.with_suffix(""), picture)
        else:
            digits = max(4, len(str(len(cameras) - 1)))
            with merged_folder(self.out) as folder:
                for index, picture in enumerate(pictures):
                    write_pictures(folder / f"{index:0{digits}d}", picture)
        count = f"{len(cameras)} picture{'s' if len(cameras) > 1 else ''}"
        print(f"{count} in {self.out}")

    def _check_options(self) -> None:
        from cagefield.cameras.camera_paths import MAX_FPS, MIN_FPS

        if not 0 <= self.turntable <= 100_000:
            raise CagefieldError(
                f"--turntable is {self.turntable!s:.20}; give the number of pictures, 1 to 100000"
            )
        if self.turntable and self.camera_path:
            raise CagefieldError("--turntable and --camera-path exclude each other; give one of them")
        if self.dataparser_transforms and not self.camera_path:
            raise CagefieldError("--dataparser-transforms belongs to --camera-path; give both or neither")
        if self.compare and self.unedited:
            raise CagefieldError("--compare and --unedited exclude each other; give one of them")
        if self.fps is not None and not MIN_FPS <= self.fps <= MAX_FPS:
            raise CagefieldError(f"--fps is {self.fps}; give a number from {MIN_FPS:g} to {MAX_FPS:g}")
        background = parse_background(self.background)
        if background == "none" and (self.compare or self.out.suffix.lower() == ".mp4"):
            raise CagefieldError(
                "--background none makes transparent PNGs; give a colour for --compare or a video"
            )

    def _cameras(self, scene: Scene) -> tuple[list[Camera], float]:
        """The cameras to render, at their final size, and the frame rate."""
        from cagefield.cameras.camera_paths import load_camera_path, orbit

        fps = 24.0
        if self.camera_path:
            path = load_camera_path(self.camera_path, self.dataparser_transforms)
            cameras, fps = path.cameras, path.fps
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

    def _pictures(self, scene: Scene, cameras: list[Camera]) -> Iterator[Pictures]:
        """Per camera: end of the file name -> picture."""
        from cagefield.cli.pictures import DepthScale, pictures_of
        from cagefield.edits import EditStack

        background = parse_background(self.background)
        unedited = scene.with_edits(EditStack([]))
        shown = [unedited, scene] if self.compare else [unedited] if self.unedited else [scene]
        scale: DepthScale | None = None
        for camera in cameras:
            frames = [
                one.render(camera, background=background, normals=self.normals, exact=self.exact)
                for one in shown
            ]
            if self.depth and scale is None:
                scale = DepthScale.fitted([frame.depth for frame in frames])
            yield pictures_of(frames, scale)
