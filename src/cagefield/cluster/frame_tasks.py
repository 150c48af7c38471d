"""Frame tasks: a camera of a scene to the files of a frame, in a worker's process.

A worker that sees the folder of the result writes the files there, each whole; another returns their
contents, and the client writes them. A process keeps the scene that it opened last.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from cagefield.cluster.scene_archive import SceneSource
from cagefield.errors import CagefieldError
from cagefield.files.atomic import replaced_file
from cagefield.files.temporary_folders import TemporaryFolder
from cagefield.images.pictures import DepthScale, Pictures, write_pictures
from cagefield.scene.frames import FrameOptions, FrameRenderer

if TYPE_CHECKING:
    from cagefield.cameras.camera import Camera


@dataclass(frozen=True)
class FrameJob:
    """All that frames of one command share.

    `mark` is the name of a file in `folder`: a worker that finds it there sees the client's folder.
    """

    source: SceneSource
    options: FrameOptions
    device: str
    folder: Path
    mark: str


@dataclass(frozen=True)
class FrameResult:
    """Depth scale of a frame if it has one, contents of its files by end of the name that the client has to
    write, and the message of an error that another try would repeat, "" without."""

    scale: DepthScale | None = None
    contents: dict[str, bytes] = field(default_factory=dict)
    error: str = ""


_opened: dict[tuple[str, FrameOptions], FrameRenderer] = {}
"""Renderer of the scene that this process opened last, by digest and options."""


def render_frame(job: FrameJob, camera: Camera, name: str, scale: DepthScale | None) -> FrameResult:
    """Renders and writes the files of the frame `name`; a missing depth scale is fitted to this frame."""
    try:
        pictures, scale = _renderer(job).pictures(camera, scale)
    except CagefieldError as error:
        return FrameResult(error=str(error))
    if (job.folder / job.mark).is_file():
        write_pictures(job.folder / name, pictures)
        return FrameResult(scale)
    return FrameResult(scale, _encoded(pictures))


def fit_depth_scale(job: FrameJob, camera: Camera) -> FrameResult:
    """The depth scale of a camera's frame, which is not written."""
    try:
        return FrameResult(_renderer(job).depth_scale(camera))
    except CagefieldError as error:
        return FrameResult(error=str(error))


def write_contents(stem: Path, result: FrameResult) -> None:
    """Writes the files that a worker returned, each whole."""
    for end, content in result.contents.items():
        with replaced_file(stem.with_name(stem.name + end)) as temporary:
            temporary.write_bytes(content)


def _renderer(job: FrameJob) -> FrameRenderer:
    from cagefield.compute import devices
    from cagefield.scene.scene import Scene

    key = (job.source.digest, job.options)
    if key not in _opened:
        devices.start(job.device)
        _opened.clear()
        _opened[key] = FrameRenderer(Scene.open(job.source.find()), job.options)
    return _opened[key]


def _encoded(pictures: Pictures) -> dict[str, bytes]:
    with TemporaryFolder("cluster") as folder:
        write_pictures(folder / "frame", pictures)
        return {end: (folder / f"frame{end}").read_bytes() for end in pictures}
