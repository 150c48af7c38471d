"""`cagefield make-scene`: photos of a built-in scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import tyro

from cagefield.cli.options import Flag, Output, check_folder, progress_bar

_MARK = "transforms_train.json"
_OWN = (_MARK, "transforms_test.json", "transforms_val.json", "train", "test", "val")


@dataclass(frozen=True)
class MakeScene:
    """Photos of a built-in scene with their cameras, in NeRF-synthetic layout."""

    name: tyro.conf.Positional[str]
    """digger, chair, microphone or plant."""
    out: Output
    """Folder for the photos."""
    views: int = 100
    """Number of training photos."""
    size: int = 400
    """Width and height in pixels."""
    test_views: int | None = None
    """Number of test photos; a quarter of the training photos if left out."""
    seed: int = 0
    """Where the cameras stand."""
    depth: Literal["all", "test", "none"] = "test"
    """Whose depth to write too: NAME_depth.npy, distances along the rays."""
    overwrite: Flag = False
    """Replace photos that an earlier call wrote there."""

    def run(self) -> None:
        """Renders the photos and says where they are."""
        from cagefield.datasets.procedural import make_scene, procedural_scene
        from cagefield.folders import replaced_folder

        scene = procedural_scene(self.name)
        check_folder(self.out, self.overwrite, _MARK)
        with (
            replaced_folder(self.out.resolve(), _OWN) as draft,
            progress_bar("Photos") as move,
        ):
            make_scene(
                self.name,
                draft,
                views=self.views,
                size=self.size,
                test_views=self.test_views,
                seed=self.seed,
                depth=self.depth,
                scene=scene,
                progress=lambda done, total: move(done, total, f"{done}/{total}"),
            )
        print(f"photos of {self.name} (parts: {', '.join(scene.part_names)}) in {self.out}")
