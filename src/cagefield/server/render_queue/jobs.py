"""Background jobs: the test views as pictures, or the camera path as a video. One picture at a time, whenever
no page waits for one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cagefield.cameras.camera import Camera
from cagefield.cameras.keyframes import Still, stills
from cagefield.errors import CagefieldError
from cagefield.images.video import is_cagefield_video
from cagefield.server.editor.document import Document
from cagefield.server.editor.path_edits import edits_at_time
from cagefield.server.protocol.common import JobKind
from cagefield.server.render_worker.job_files import MARK
from cagefield.server.render_worker.tasks import FrameTask, Shown, values_of


@dataclass
class Job:
    """A background job: its content, destination and progress. Its edits are those of its start."""

    number: int
    what: JobKind
    out: Path
    fps: float
    stills: tuple[Still, ...]
    document: Document
    done: int = 0

    @property
    def total(self) -> int:
        """Number of pictures."""
        return len(self.stills)

    def task(self, number: int, generation: int) -> FrameTask:
        """The next picture. Raises CagefieldError where its edits, blended as they are there, fail."""
        still = self.stills[self.done]
        edits = edits_at_time(self.document, still.parts)
        shown = Shown(values_of(edits), self.document.preserve_opacity, removed=self.document.removed)
        return FrameTask(
            number,
            self.number,
            self.done,
            self.total,
            self.what,
            str(self.out),
            self.fps,
            shown,
            still,
            generation,
        )


def test_views(
    number: int,
    document: Document,
    cameras: tuple[Camera, ...],
    out: Path,
    size: tuple[int, int],
    overwrite: bool,
) -> Job:
    """The job that renders a scene's test cameras, or others in their place, to numbered PNGs in a folder.

    `size` is the largest (width, height); each camera keeps its shape.
    """
    if not cameras:
        raise CagefieldError("the scene has no cameras to render from; record a camera path instead")
    if out.exists() and not out.is_dir():
        raise CagefieldError(f"{out} is a file; give a folder for the pictures")
    if out.is_dir() and any(out.iterdir()):
        if not overwrite:
            raise CagefieldError(f"folder {out} is not empty; give a new one, or choose to overwrite")
        if not (out / MARK).is_file():
            raise CagefieldError(
                f"folder {out} holds what no editor rendered, and is left as it is; give a new one"
            )
    found = tuple(Still(_within(camera, size), {}) for camera in cameras)
    return Job(number, "test_views", out, 24.0, found, document)


def camera_path(
    number: int, document: Document, out: Path, size: tuple[int, int], fps: float, overwrite: bool
) -> Job:
    """The job that renders the camera path to a video."""
    if out.suffix.lower() != ".mp4":
        raise CagefieldError(f"{out}: a video's name ends in .mp4")
    if out.is_dir():
        raise CagefieldError(f"{out} is a folder; give the name of a video, ending in .mp4")
    if out.exists() and not overwrite:
        raise CagefieldError(f"{out} exists already; give another name, or choose to overwrite")
    if out.exists() and not is_cagefield_video(out):
        raise CagefieldError(f"{out} is a video that cagefield did not make, and stays; give another name")
    found = stills(document.keys, loop=document.loop, fps=fps, width=size[0], height=size[1])
    return Job(number, "camera_path", out, fps, found, document)


def _within(camera: Camera, size: tuple[int, int]) -> Camera:
    scale = min(size[0] / camera.width, size[1] / camera.height)
    return camera.resized(max(1, round(camera.width * scale)), max(1, round(camera.height * scale)))
