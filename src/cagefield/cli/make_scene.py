"""`cagefield make-scene`: photos of a built-in scene, alone or in a room."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import tyro

from cagefield.cli.options import SEEDS, Flag, Output, check_folder, check_number, progress_bar
from cagefield.errors import CagefieldError
from cagefield.files.safe_open import real_path

_MARK = "transforms_train.json"
_OWN = (_MARK, "transforms_test.json", "transforms_val.json", "train", "test", "val")
_CAPTURE_MARK = "transforms.json"


@dataclass(frozen=True)
class MakeScene:
    """Photos of a built-in scene with their cameras: alone on white in NeRF-synthetic layout, or in a room as
    a phone takes them, with transforms.json and sparse points."""

    name: tyro.conf.Positional[str]
    """digger, chair, microphone or plant; room-digger, room-chair, room-microphone or room-plant, also with
    training photos that disagree, by names after plus signs: person, backdrop, flash, exposure, balance."""
    out: Output
    """Folder for the photos."""
    views: int | None = None
    """Number of training photos, 100 if left out; of a room that of all photos, 48 to 96 as the room asks."""
    size: int | None = None
    """Width and height in pixels, 400 if left out; of a room's photos the longer side, 640."""
    test_views: int | None = None
    """Number of test photos; a quarter of the training photos if left out. A room's are every 8th."""
    seed: int = 0
    """Where the cameras stand."""
    depth: Literal["all", "test", "none"] = "test"
    """Whose depth to write too: NAME_depth.npy (depth/NAME.npy), distances along the rays."""
    no_points: Flag = False
    """A room without sparse points."""
    overwrite: Flag = False
    """Replace photos that an earlier call wrote there."""

    def run(self) -> None:
        """Renders the photos and says where they are."""
        check_number("--seed", self.seed, *SEEDS)
        for name, value, high in (("views", self.views, 100_000), ("test-views", self.test_views, 100_000),
                                  ("size", self.size, 8192)):  # fmt: skip
            check_number(f"--{name}", value, 1, high)
        from cagefield.procedural import is_capture

        parts = self._capture() if is_capture(self.name) else self._scene()
        print(f"photos of {self.name} (parts: {', '.join(parts)}) in {self.out}")

    def _scene(self) -> tuple[str, ...]:
        """Writes the photos of a scene alone; the names of its parts."""
        from cagefield.files.atomic import replaced_folder
        from cagefield.procedural import make_scene, procedural_scene

        scene = procedural_scene(self.name)
        if self.no_points:
            raise CagefieldError(f"--no-points is for rooms; {self.name} has no sparse points")
        check_folder(self.out, self.overwrite, _MARK)
        with (
            replaced_folder(real_path(self.out), _OWN) as draft,
            progress_bar("Photos") as move,
        ):
            make_scene(
                self.name,
                draft,
                views=100 if self.views is None else self.views,
                size=400 if self.size is None else self.size,
                test_views=self.test_views,
                seed=self.seed,
                depth=self.depth,
                scene=scene,
                progress=lambda done, total: move(done, total, f"{done}/{total}"),
            )
        return scene.part_names

    def _capture(self) -> tuple[str, ...]:
        """Writes the capture of a room; the names of its parts."""
        from cagefield.files.atomic import replaced_folder
        from cagefield.procedural import capture, make_capture
        from cagefield.procedural.capture_writer import CAPTURE_FILES

        if self.test_views is not None:
            raise CagefieldError(
                "--test-views is for scenes alone; of a room's photos `cagefield train` holds out every 8th"
            )
        scene = capture(self.name).scene
        check_folder(self.out, self.overwrite, _CAPTURE_MARK)
        with (
            replaced_folder(real_path(self.out), CAPTURE_FILES) as draft,
            progress_bar("Photos") as move,
        ):
            make_capture(
                self.name,
                draft,
                views=self.views,
                size=self.size,
                seed=self.seed,
                depth=self.depth,
                points=not self.no_points,
                scene=scene,
                progress=lambda done, total: move(done, total, f"{done}/{total}"),
            )
        return scene.part_names
