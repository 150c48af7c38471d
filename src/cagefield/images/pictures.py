"""Frames as files: color, depth and normals, before and after side by side."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cagefield.files.atomic import replaced_file
from cagefield.images.image_files import read_image, side_by_side, write_png
from cagefield.images.render_result import RenderResult
from cagefield.typing import AnyArray

Pictures = dict[str, AnyArray]


@dataclass(frozen=True)
class DepthScale:
    """Gray levels for distances: white at `near`, black at `far`, linear in the inverse distance."""

    near: float
    far: float

    @classmethod
    def fitted(cls, depths: Sequence[AnyArray]) -> DepthScale:
        """The scale that spreads the finite distances, their nearest and farthest hundredth left out."""
        finite = np.concatenate([depth[np.isfinite(depth)] for depth in depths])
        if finite.size == 0:
            return cls(1.0, 2.0)
        near, far = np.percentile(finite, (1.0, 99.0))
        near = max(float(near), 1e-6)
        return cls(near, max(float(far), 1.01 * near))

    def picture(self, depth: AnyArray) -> AnyArray:
        """Gray picture [H,W,3] in [0,1]; black where nothing is seen."""
        inverse = 1.0 / np.maximum(depth, 1e-6)
        gray = (inverse - 1.0 / self.far) / (1.0 / self.near - 1.0 / self.far)
        return np.repeat(np.clip(gray, 0.0, 1.0)[..., None], 3, axis=-1)


def pictures_of(frames: Sequence[RenderResult], depth_scale: DepthScale | None = None) -> Pictures:
    """End of the file name -> picture: the frames side by side, and their depth and normals if any.

    A single frame over nothing becomes an RGBA picture.
    """
    if len(frames) == 1 and frames[0].background is None:
        pictures: Pictures = {".png": frames[0].rgba8()}
    else:
        pictures = {".png": side_by_side(*(frame.rgb8() for frame in frames))}
    if depth_scale is not None:
        pictures["_depth.png"] = side_by_side(*(depth_scale.picture(frame.depth) for frame in frames))
        pictures["_depth.npy"] = np.concatenate([frame.depth for frame in frames], axis=1)
    normals = [frame.normals for frame in frames if frame.normals is not None]
    if normals:
        pictures["_normals.png"] = side_by_side(*(0.5 * (normal + 1.0) for normal in normals))
    return pictures


def in_one_row(pictures: Pictures) -> AnyArray:
    """The pictures beside one another, for a video."""
    return side_by_side(*(picture for end, picture in pictures.items() if end.endswith(".png")))


def write_pictures(stem: Path, pictures: Pictures) -> None:
    """Writes each picture as `stem` with its end."""
    for end, picture in pictures.items():
        path = stem.with_name(stem.name + end)
        if end.endswith(".npy"):
            with replaced_file(path) as temporary, temporary.open("wb") as file:
                np.save(file, picture)
        else:
            write_png(path, picture)


def read_pictures(stem: Path, ends: Iterable[str]) -> Pictures:
    """The pictures of a frame that `write_pictures` wrote, without its arrays, as uint8.

    Raises DatasetError for a file that is missing or damaged.
    """
    return {end: read_image(stem.with_name(stem.name + end)) for end in ends if end.endswith(".png")}


def has_pictures(stem: Path, ends: Iterable[str]) -> bool:
    """Whether all files of a frame are there; each was written whole."""
    return all(stem.with_name(stem.name + end).is_file() for end in ends)
