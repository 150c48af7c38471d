"""Numbered pictures of a sequence of cameras in a folder: which are wanted, there, or to be rendered.

Depth has the gray levels of the sequence's first camera in all pictures, also where that one is kept or not
among the wanted ones.
"""

from __future__ import annotations

import re
import shutil
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from cagefield.errors import CagefieldError
from cagefield.files.stale_files import hidden_name
from cagefield.images.pictures import DepthScale, Pictures, has_pictures, read_pictures, write_pictures

if TYPE_CHECKING:
    from cagefield.cameras.camera import Camera
    from cagefield.cluster.frame_cluster import FrameCluster
    from cagefield.scene.frames import FrameRenderer


def parse_frames(text: str | None, count: int) -> range:
    """The indices of "FIRST-LAST" or of one number, among `count` pictures; all of them for None.

    Raises CagefieldError for another text, or an index that is out of range.
    """
    if text is None:
        return range(count)
    found = re.fullmatch(r"([0-9]{1,9})(?:-([0-9]{1,9}))?", text)
    if found is None:
        raise CagefieldError(f"--frames {text[:40]!r} is no range; give FIRST-LAST, such as 0-9")
    first = int(found[1])
    last = first if found[2] is None else int(found[2])
    if not first <= last < count:
        raise CagefieldError(f"--frames {text} is out of range; pictures go from 0 to {count - 1}")
    return range(first, last + 1)


class FrameFiles:
    """The wanted `frames`, by index, of a sequence of cameras, and their files, by end of the name."""

    def __init__(self, cameras: Sequence[Camera], frames: range, ends: Sequence[str]) -> None:
        self.cameras, self.frames, self.ends = cameras, frames, ends
        self.kept = 0
        self._digits = max(4, len(str(len(cameras) - 1)))

    @property
    def selected(self) -> list[Camera]:
        """Cameras of the wanted frames."""
        return [self.cameras[index] for index in self.frames]

    def name(self, index: int) -> str:
        """Beginning of the names of a frame's files."""
        return f"{index:0{self._digits}d}"

    def missing(self, folder: Path) -> list[int]:
        """Indices of the wanted frames that are not complete in the folder; the others count as `kept`.

        Raises CagefieldError for a picture that does not have its camera's height.
        """
        missing = [i for i in self.frames if not has_pictures(folder / self.name(i), self.ends)]
        for index in sorted(set(self.frames) - set(missing)):
            path, height = folder / f"{self.name(index)}.png", self.cameras[index].height
            try:
                with Image.open(path) as image:
                    size = image.size
            except OSError:
                raise CagefieldError(f"{path} is no picture; remove it, and --keep renders it") from None
            if size[1] != height:
                raise CagefieldError(
                    f"{path} is {size[1]} pixels high, not {height}; --keep needs the first options"
                )
        self.kept = len(self.frames) - len(missing)
        return missing

    def read(self, folder: Path) -> Iterator[Pictures]:
        """The pictures of the wanted frames, in their order."""
        return (read_pictures(folder / self.name(index), self.ends) for index in self.frames)

    def render(self, renderer: FrameRenderer, indices: Sequence[int], folder: Path) -> Iterator[int]:
        """Renders and writes frames in this process; the index of each that is done."""
        scale = self._kept_scale(folder) if indices[0] else None
        if "_depth.npy" in self.ends and scale is None and indices[0]:
            scale = renderer.depth_scale(self.cameras[0])
        for index in indices:
            pictures, scale = renderer.pictures(self.cameras[index], scale)
            write_pictures(folder / self.name(index), pictures)
            yield index

    def render_on(self, cluster: FrameCluster, indices: Sequence[int], folder: Path) -> Iterator[str]:
        """Renders and writes frames on a cluster; the name of each that is done, in any order."""
        names = {self.name(index): self.cameras[index] for index in indices}
        scale = self._kept_scale(folder) if indices[0] else None
        if "_depth.npy" in self.ends and scale is None:
            if indices[0]:
                scale = cluster.depth_scale(self.cameras[0])
            else:  # the others wait for the first one's scale
                first = self.name(0)
                for name, scale in cluster.render({first: names.pop(first)}):  # noqa: B007
                    yield name
        for name, _ in cluster.render(names, scale):
            yield name

    def _kept_scale(self, folder: Path) -> DepthScale | None:
        """The depth scale of the first frame where its distances are in the folder, else None."""
        path = folder / f"{self.name(0)}_depth.npy"
        if "_depth.npy" not in self.ends or not path.is_file():
            return None
        try:
            return DepthScale.fitted([np.load(path, allow_pickle=False)])
        except (OSError, ValueError, EOFError):
            raise CagefieldError(f"{path} holds no distances; remove it, and --keep renders it") from None


@contextmanager
def frames_folder(video: Path, keep: bool) -> Iterator[Path]:
    """Folder of a video's frames beside it: NAME_frames, which stays, with `keep`; else a temporary one.

    After a failure pictures of a temporary folder become NAME_frames, for `--keep`, unless that is there.
    """
    kept = video.with_name(f"{video.stem}_frames")
    if keep:
        yield kept
        return
    folder = video.absolute().with_name(hidden_name(video.with_suffix(""), "new"))
    try:
        yield folder
    except BaseException:
        count = sum(path.stem.isdigit() for path in folder.glob("*.png"))
        if count and not kept.exists():
            folder.rename(kept)
            pictures = "1 picture stays" if count == 1 else f"{count} pictures stay"
            warnings.warn(f"{pictures} in {kept}; go on with --keep", stacklevel=4)
        raise
    finally:
        shutil.rmtree(folder, ignore_errors=True)
