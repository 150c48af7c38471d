"""Photographs of procedural scenes on disk, in the layout of the NeRF-synthetic data sets.

transforms_{train,val,test}.json   camera_angle_x, aabb, frames: file_path, transform_matrix (OpenGL c2w)
{train,val,test}/r_0.png ...       RGBA, straight alpha
test/r_0_depth.npy ...             float32 [H,W], distance along the ray in world units, inf off the surface;
                                   in the other splits only where it is asked for
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.errors import DatasetError
from cagefield.files.atomic import recover_folder, replaced_folder
from cagefield.files.safe_open import real_path
from cagefield.images.image_files import write_png
from cagefield.images.render_result import RenderResult
from cagefield.procedural.builtin_scenes import procedural_scene
from cagefield.procedural.scene import ProceduralScene

FOV_X_RAD = 0.6911112
CAMERA_DISTANCE = 4.0
MAX_ELEVATION_DEG = 80.0
"""Elevation of the highest camera."""

DepthViews = Literal["all", "test", "none"]
"""Splits whose depth is written."""

_SPLITS = ("train", "val", "test")


def viewpoints(
    count: int, size: int, *, lowest: float = 0.0, seed: int = 0, split: str = "train"
) -> tuple[Camera, ...]:
    """`count` square cameras on a sphere of radius 4 about the origin, all looking at it.

    Elevations run from `lowest` to HIGHEST degrees, uniform in area; every beginning of the sequence is
    spread evenly too. Splits and seeds shift the sequence, so that their views differ.
    Source: Roberts, "The unreasonable effectiveness of quasirandom sequences" (R2 sequence).
    """
    start = np.random.RandomState([seed, _SPLITS.index(split)]).uniform(size=2)
    steps = np.array([0.7548776662466927, 0.5698402909980532])
    fractions = np.mod(start + np.arange(count)[:, None] * steps, 1.0)
    low, high = np.sin(np.radians([lowest, MAX_ELEVATION_DEG]))
    cameras = []
    for azimuth, height in zip(
        2 * np.pi * fractions[:, 0], low + (high - low) * fractions[:, 1], strict=True
    ):
        ring = np.sqrt(1 - height**2)
        eye = CAMERA_DISTANCE * np.array([ring * np.cos(azimuth), ring * np.sin(azimuth), height])
        cameras.append(Camera.look_at(eye, (0, 0, 0), width=size, height=size, fov_x=FOV_X_RAD))
    return tuple(cameras)


def render_views(
    scene: ProceduralScene, cameras: Iterable[Camera], *, supersample: int = 2
) -> Iterator[RenderResult]:
    """Images of a scene without background, in order."""
    for camera in cameras:
        yield scene.photograph(camera, supersample=supersample)


def make_scene(
    name: str,
    out_dir: str | os.PathLike[str],
    *,
    views: int = 100,
    size: int = 400,
    test_views: int | None = None,
    seed: int = 0,
    depth: DepthViews = "test",
    scene: ProceduralScene | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Folder with photographs of a built-in scene (or of `scene`, whatever its name), written as a whole.

    views     training views; test_views (default: a quarter of them, at least 4) are other views; a fifth of
              those, at least 1, again elsewhere, are the val split
    depth     the views whose depth is written: all, those of the test split, or none (depth has 4 bytes a
              pixel, about ten times its photo's size)
    progress  called with (views done, views in all) after each view

    Raises SceneError for an unknown name, DatasetError for impossible sizes, an unknown `depth` and a folder
    that is not empty.
    """
    scene = procedural_scene(name) if scene is None else scene
    tests = max(views // 4, 4) if test_views is None else test_views
    for field, number in (("views", views), ("size", size), ("test_views", tests)):
        if number < 1:
            raise DatasetError(f"{field} must be at least 1, not {number}")
    if depth not in get_args(DepthViews):
        raise DatasetError(f"depth must be one of {', '.join(get_args(DepthViews))}, not {depth!r}")
    target = real_path(out_dir)
    recover_folder(target, Path.is_dir)
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise DatasetError(f"{target} is not empty; give another folder or remove it first")

    counts = {"train": views, "val": max(tests // 5, 1), "test": tests}
    done = 0
    with replaced_folder(target, ()) as draft:
        for split, count in counts.items():
            cameras = viewpoints(count, size, lowest=scene.lowest, seed=seed, split=split)
            (draft / split).mkdir()
            for index, frame in enumerate(render_views(scene, cameras)):
                write_png(draft / split / f"r_{index}.png", frame.rgba8())
                if depth in ("all", split):
                    np.save(draft / split / f"r_{index}_depth.npy", frame.depth)
                done += 1
                if progress is not None:
                    progress(done, sum(counts.values()))
            text = json.dumps(_transforms(scene, cameras, split), indent=1)
            (draft / f"transforms_{split}.json").write_text(text)
    return target


def _transforms(scene: ProceduralScene, cameras: Iterable[Camera], split: str) -> dict[str, object]:
    frames = [
        {"file_path": f"./{split}/r_{index}", "transform_matrix": camera.c2w.tolist()}
        for index, camera in enumerate(cameras)
    ]
    margin = 0.05
    low, high = scene.bounds
    return {
        "camera_angle_x": FOV_X_RAD,
        "aabb": [(low - margin).round(4).tolist(), (high + margin).round(4).tolist()],
        "frames": frames,
    }
