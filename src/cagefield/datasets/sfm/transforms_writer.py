"""Writer of data sets as nerfstudio's transforms.json, in their own world.

images/...        the photos, linked or copied; resampled photos as PNG
masks/...         black where pixels are excluded, for photos with a mask
sparse_pc.ply     the sparse points
transforms.json   intrinsics of each frame, OpenGL camera-to-world poses, `applied_transform`, the splits
poses.json        the record of a data set written by `cagefield poses`, which alone may be replaced
"""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from PIL import Image

from cagefield.datasets.sfm.features import OnProgress
from cagefield.datasets.views import Dataset, SparsePoints, View
from cagefield.files.atomic import recover_folder, replaced_folder

TRANSFORMS_FILE = "transforms.json"

RECORD_FILE = "poses.json"

WRITTEN_FILES = ("images", "masks", "sparse", "sparse_pc.ply", TRANSFORMS_FILE, RECORD_FILE)
"""Files and folders that `cagefield poses` writes, with a COLMAP model or with transforms.json."""


def write_transforms(dataset: Dataset, target: Path, on_progress: OnProgress | None = None) -> None:
    """Write all views of the data set, at the size at which they were opened, to the folder `target`.

    The folder appears whole or not at all; files of another program in it stay.

    Raises DatasetError where a photo cannot be read, OSError where the folder cannot be written.
    """
    recover_folder(target, lambda folder: (folder / RECORD_FILE).is_file())
    splits = {"train": dataset.train, "test": dataset.test, "val": dataset.val}
    views = {view.name: view for split in splits.values() for view in split}
    with replaced_folder(target, WRITTEN_FILES) as draft:
        frames, paths = [], {}
        for number, name in enumerate(sorted(views), start=1):
            paths[name] = _write_photo(views[name], draft)
            frames.append(_frame(views[name], paths[name], draft))
            if on_progress is not None:
                on_progress(number / len(views), f"{number} of {len(views)} photos")
        values: dict[str, Any] = {
            "camera_model": "OPENCV",
            "applied_transform": dataset.source_to_world[:3].tolist(),
            "frames": frames,
        }
        for split, view_group in splits.items():
            if view_group and len(view_group) < len(views):
                values[f"{split}_filenames"] = [paths[view.name] for view in view_group]
        if dataset.points is not None:
            values["ply_file_path"] = "sparse_pc.ply"
            _write_points(dataset.points, draft / "sparse_pc.ply")
        (draft / TRANSFORMS_FILE).write_text(json.dumps(values, indent=1), encoding="utf-8")
        (draft / RECORD_FILE).write_text(json.dumps({"photos": len(views)}, indent=1), encoding="utf-8")


def _write_photo(view: View, folder: Path) -> str:
    """Write the view's photo to `folder`, as a link where possible, and return its relative path."""
    name = PurePosixPath("images") / PurePosixPath(view.name).name
    relative = PurePosixPath(view.name)
    if not relative.is_absolute() and ".." not in relative.parts:
        parts = relative.parts[1:] if relative.parts[0] == "images" else relative.parts
        name = PurePosixPath("images", *parts)
    resampled = view.source is not None or view.downscale != 1
    name = name.with_suffix(".png" if resampled else view.image_path.suffix)
    file = folder / name
    file.parent.mkdir(parents=True, exist_ok=True)
    if resampled:
        Image.fromarray(view.load()).save(file, compress_level=1)
        return str(name)
    try:
        os.link(view.image_path, file)
    except OSError:
        shutil.copy2(view.image_path, file)
    return str(name)


def _frame(view: View, path: str, folder: Path) -> dict[str, Any]:
    """Frame of transforms.json; the view's mask is written to `folder`."""
    camera = view.camera
    values: dict[str, Any] = {"file_path": path, "w": camera.width, "h": camera.height}
    values |= {"fl_x": camera.fx, "fl_y": camera.fy, "cx": camera.cx, "cy": camera.cy}
    if camera.model == "opencv_fisheye":
        values["camera_model"] = "OPENCV_FISHEYE"
        keys: tuple[str, ...] = ("k1", "k2", "k3", "k4")
    else:
        keys = ("k1", "k2", "p1", "p2", "k3", "k4")
    values |= dict(zip(keys, camera.distortion, strict=False))
    values["transform_matrix"] = camera.c2w.tolist()
    valid = view.valid_pixels()
    if valid is not None:
        mask = (PurePosixPath("masks") / PurePosixPath(path).relative_to("images")).with_suffix(".png")
        (folder / mask).parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(np.where(valid, 255, 0).astype(np.uint8)).save(folder / mask)
        values["mask_path"] = str(mask)
    return values


def _write_points(points: SparsePoints, path: Path) -> None:
    """Write positions (double) and colors as binary PLY."""
    kinds = [("x", "<f8"), ("y", "<f8"), ("z", "<f8"), ("red", "u1"), ("green", "u1"), ("blue", "u1")]
    rows = np.empty(len(points), kinds)
    for column, axis in enumerate("xyz"):
        rows[axis] = points.positions[:, column]
    for column, channel in enumerate(("red", "green", "blue")):
        rows[channel] = points.rgb[:, column]
    names = {"<f8": "double", "u1": "uchar"}
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"]
    header += [f"property {names[kind]} {name}" for name, kind in kinds]
    path.write_bytes("\n".join([*header, "end_header", ""]).encode() + rows.tobytes())
