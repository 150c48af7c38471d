"""Frames of a scene: the pictures of one camera, before and after the edits, with depth and normals."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from cagefield.edits import EditStack
from cagefield.images.pictures import DepthScale, Pictures, pictures_of

if TYPE_CHECKING:
    from cagefield.cameras.camera import Camera
    from cagefield.images.render_result import RenderResult
    from cagefield.scene.scene import Scene


@dataclass(frozen=True)
class FrameOptions:
    """Contents of a frame's pictures; `compare` puts the scene before its edits beside the edited one."""

    background: str | tuple[float, float, float] = "scene"
    depth: bool = False
    normals: bool = False
    compare: bool = False
    unedited: bool = False
    exact: bool = False

    @property
    def ends(self) -> tuple[str, ...]:
        """Ends of the names of a frame's files."""
        depth, normals = ("_depth.png", "_depth.npy") * self.depth, ("_normals.png",) * self.normals
        return (".png", *depth, *normals)


class FrameRenderer:
    """Renderer of a scene's frames with the same options."""

    def __init__(self, scene: Scene, options: FrameOptions) -> None:
        self.scene, self.options = scene, options

    def pictures(self, camera: Camera, scale: DepthScale | None) -> tuple[Pictures, DepthScale | None]:
        """End of the file name -> picture, and the depth scale.

        A missing scale is fitted to this frame where the options have depth; None without depth.
        """
        frames = self._render(camera)
        if not self.options.depth:
            scale = None
        elif scale is None:
            scale = DepthScale.fitted([frame.depth for frame in frames])
        return pictures_of(frames, scale), scale

    def sequence(self, cameras: Iterable[Camera]) -> Iterator[Pictures]:
        """Pictures of each camera, with the depth scale of the first."""
        scale: DepthScale | None = None
        for camera in cameras:
            pictures, scale = self.pictures(camera, scale)
            yield pictures

    def depth_scale(self, camera: Camera) -> DepthScale:
        """The depth scale fitted to the frame of a camera."""
        return DepthScale.fitted([frame.depth for frame in self._render(camera)])

    def _render(self, camera: Camera) -> list[RenderResult]:
        options = self.options
        return [
            scene.render(camera, background=options.background, normals=options.normals, exact=options.exact)
            for scene in self._shown
        ]

    @cached_property
    def _shown(self) -> list[Scene]:
        options = self.options
        if not options.compare and not options.unedited:
            return [self.scene]
        unedited = self.scene.with_edits(EditStack([]))
        return [unedited, self.scene] if options.compare else [unedited]
