"""`cagefield demo`: the whole chain on a built-in scene."""

from __future__ import annotations

import dataclasses
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from cagefield.cli.edit_preparation import prepare_edits
from cagefield.cli.options import Device, Flag, Output, check_folder, check_number, progress_bar, track
from cagefield.files.safe_open import real_path

if TYPE_CHECKING:
    from cagefield.scene.scene import Scene

_OWN = (
    "photos", "scene", "edited", "edits.yaml",
    "before.png", "after.png", "before_after.png", "turntable.mp4",
)  # fmt: skip
_EYE, _TARGET, _FOV_X = (1.6, -3.5, 1.3), (0.05, 0.0, 0.13), 0.62
"""Where before.png and after.png are taken from: radians, world units."""
_PICTURE_SIZE, _VIDEO_SIZE = 480, 256
"""Width and height of these pictures, and of each half of the video, in pixels."""


@dataclasses.dataclass(frozen=True)
class Demo:
    """Photograph the built-in digger, train a field, raise its arm; pictures before and after."""

    out: Output = Path("cagefield-demo")
    """Folder for the results."""
    views: int = 50
    """Number of training photos."""
    size: int = 320
    """Width and height of the photos in pixels."""
    steps: int = 1200
    """Number of training steps."""
    resolution: int = 160
    """Voxels along the longest axis at the end."""
    frames: int = 36
    """Number of pictures in the turntable video."""
    device: Device = "auto"
    overwrite: Flag = False
    """Replace the results of an earlier call."""

    def run(self) -> None:
        """Runs the chain and says where the results are."""
        from cagefield.files.atomic import replaced_folder
        from cagefield.training.voxels.voxel_config import VoxelConfig

        for name, value, high in (("views", self.views, 10_000), ("size", self.size, 4096),
                                  ("frames", self.frames, 10_000)):  # fmt: skip
            check_number(f"--{name}", value, 1, high)
        VoxelConfig(steps=self.steps, resolution=self.resolution, sh_degree=1)  # refused at once
        check_folder(self.out, self.overwrite, "before_after.png")
        began = time.perf_counter()
        with replaced_folder(real_path(self.out), _OWN) as folder:
            with _timed("photos of the digger"):
                self._photograph(folder / "photos")
            with _timed("training"):
                scene, figures = self._train(folder)
            with _timed("edit"):
                edited = self._edit(scene, folder)
            with _timed("pictures"):
                self._render(scene, edited, folder)
        print(f"done in {time.perf_counter() - began:.0f} s; {figures}")
        for name, what in (
            ("before.png, after.png", "the digger, and with its arm raised"),
            ("before_after.png", "both side by side"),
            ("turntable.mp4", "once round the two"),
            ("edits.yaml", "the edit: change it and run `cagefield edit SCENE EDITS -o NEW`"),
            ("scene/, edited/", "the scene folders, for `cagefield render` and `cagefield info`"),
            ("photos/", "what the field was trained on"),
        ):
            print(f"  {self.out}/{name:24} {what}")
        prepare_edits(self.out / "edited")
        self._offer()

    def _offer(self) -> None:
        """Says how the result is edited by hand and, in a terminal, offers to begin."""
        from cagefield.cli.view import View

        scene = self.out / "edited"
        print(f"edit it by hand, in the browser: cagefield view {scene}", flush=True)
        if (
            sys.stdin.isatty()
            and sys.stdout.isatty()
            and input("open it now? [y/N] ").strip().lower() in ("y", "yes")
        ):
            View(scene, device=self.device).run()

    def _photograph(self, folder: Path) -> None:
        from cagefield.procedural import make_scene

        with progress_bar("Photos") as move:
            make_scene(
                "digger",
                folder,
                views=self.views,
                size=self.size,
                test_views=5,
                progress=lambda done, total: move(done, total, f"{done}/{total}"),
            )

    def _train(self, folder: Path) -> tuple[Scene, str]:
        from cagefield.cli.train import summary, train_scene
        from cagefield.compute import devices
        from cagefield.datasets import load_dataset
        from cagefield.training.voxels.voxel_config import VoxelConfig

        devices.start(self.device)
        dataset = load_dataset(folder / "photos")
        scene, result = train_scene(
            dataset, VoxelConfig(steps=self.steps, resolution=self.resolution, sh_degree=1)
        )
        scene.save(folder / "scene")
        return scene, summary(result)

    def _edit(self, scene: Scene, folder: Path) -> Scene:
        from importlib.resources import files

        from cagefield.edits.edit_files import load_edits

        text = files("cagefield").joinpath("examples").joinpath("digger.yaml").read_text(encoding="utf-8")
        (folder / "edits.yaml").write_text(text, encoding="utf-8")
        edited = scene.with_edits(load_edits(folder / "edits.yaml"))
        edited.save(folder / "edited")
        return edited

    def _render(self, scene: Scene, edited: Scene, folder: Path) -> None:
        from cagefield.cameras.camera import Camera
        from cagefield.cameras.camera_paths import orbit
        from cagefield.images.image_files import side_by_side, write_png, write_video

        camera = Camera.look_at(_EYE, _TARGET, width=_PICTURE_SIZE, height=_PICTURE_SIZE, fov_x=_FOV_X)
        before, after = (one.render(camera).rgb8() for one in (scene, edited))
        write_png(folder / "before.png", before)
        write_png(folder / "after.png", after)
        write_png(folder / "before_after.png", side_by_side(before, after))
        path = orbit(scene.cameras["train"], self.frames, width=_VIDEO_SIZE, height=_VIDEO_SIZE)
        pictures = (
            side_by_side(scene.render(camera).rgb8(), edited.render(camera).rgb8())
            for camera in track(path, len(path), "Turntable")
        )
        write_video(folder / "turntable.mp4", pictures, fps=12)


@contextmanager
def _timed(what: str) -> Iterator[None]:
    """Print the name of a step and its seconds."""
    began = time.perf_counter()
    yield
    print(f"{what}: {time.perf_counter() - began:.0f} s", flush=True)
