"""Frames of an animated edit: the splats of a scene at each frame of its camera path.

Edits are done to the parts that the path's keyframes give them (`cameras.keyframes`): a frame is the scene
with these edits, baked as `edited_splats` bakes it. One frame is in memory at a time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from cagefield.cameras.camera_paths import MAX_FPS, MIN_FPS
from cagefield.cameras.keyframe_files import load_keys
from cagefield.cameras.keyframes import Keyframe, Still, stills
from cagefield.edits import Edit, EditStack
from cagefield.edits.partial_edit import partial_edit
from cagefield.errors import CagefieldError, EditError
from cagefield.exporting import edited_splats
from cagefield.fields.splat_field import SplatField
from cagefield.scene.scene import Scene

IMAGE_SIZE = (1600, 900)
"""Width and height, pixels, that the cameras of frames have."""


@dataclass(frozen=True)
class CameraPath:
    """Keyframes, whether the path is a loop, and frames per second.

    Raises:
        CagefieldError: a frame rate out of range.
    """

    keys: Sequence[Keyframe]
    loop: bool = False
    fps: float = 24.0

    def __post_init__(self) -> None:
        if not MIN_FPS <= self.fps <= MAX_FPS:
            raise CagefieldError(f"--fps is {self.fps}; give a number from {MIN_FPS:g} to {MAX_FPS:g}")

    @classmethod
    def load(cls, path: Path, fps: float = 24.0) -> CameraPath:
        """Path of a camera-path file. Raises CameraError for a damaged one, or one without keyframes."""
        keys, loop = load_keys(path)
        return cls(keys, loop, fps)

    def stills(self) -> tuple[Still, ...]:
        """Camera and parts of the edits at each frame. Raises CameraError for a path without keys."""
        width, height = IMAGE_SIZE
        return stills(self.keys, loop=self.loop, fps=self.fps, width=width, height=height)


def edits_at(edits: EditStack, parts: Mapping[int, float]) -> EditStack:
    """Edits at their parts, by their numbers from 1; those that show nothing there are left out.

    Raises:
        EditError: an edit that is not possible at its part.
    """
    result: list[Edit] = []
    for number, edit in enumerate(edits, 1):
        part = parts.get(number, 1.0)
        try:
            there = partial_edit(edit, part) if edit.enabled else edit
            if there is None or not there.changes_anything:
                continue
            if there.enabled and there is not edit:
                there.check()
        except EditError as error:
            raise EditError(
                f"the camera path shows edit {number} at {part:.0%} of its way: {error}"
            ) from None
        result.append(there)
    return EditStack(result)


def scene_at(scene: Scene, parts: Mapping[int, float]) -> Scene:
    """Scene with its edits at their parts. Raises as `edits_at`."""
    return scene.with_edits(edits_at(scene.edits, parts))


def splats_at(scene: Scene, parts: Mapping[int, float]) -> SplatField:
    """Edited splats of a scene at parts of its edits. Raises as `edits_at` and `edited_splats`."""
    return edited_splats(scene_at(scene, parts))
