"""Captures of the built-in rooms on disk, as a phone and nerfstudio's ns-process-data leave them.

images/frame_00001.jpg ...   photos, no alpha
transforms.json              OPENCV intrinsics, OpenGL c2w in the room's own world
sparse_pc.ply                the sparse points
colmap/sparse/0/*.txt        the same as a COLMAP model, with the photos that see each point
depth/frame_00001.npy ...    float32 [H,W]: true distance along the ray in world units, of every HOLDOUT-th
                             photo from the first on (those that `load_dataset` holds out), or of all
distractors/frame_00002.png  of photos with a person or a backdrop: white where it is seen. Training does not
                             read them; depths are those of the room without
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import get_args

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

from cagefield.cameras.camera import Camera
from cagefield.errors import DatasetError
from cagefield.files.atomic import recover_folder, replaced_folder
from cagefield.files.safe_open import real_path
from cagefield.procedural.captures import capture
from cagefield.procedural.distractors import add_distractors
from cagefield.procedural.flash import FlashLight
from cagefield.procedural.hand_held import develop_photo, exposure_gains, render_image
from cagefield.procedural.scene import ProceduralScene
from cagefield.procedural.tracks import Tracks, simulate_tracks
from cagefield.procedural.variations import Changes, draw_changes
from cagefield.procedural.writer import DepthViews
from cagefield.typing import Float32, Mask

HOLDOUT = 8
JPEG_QUALITY = 95
"""Quality of the photos' JPEG files, 0 to 100."""

CAPTURE_FILES = ("images", "transforms.json", "sparse_pc.ply", "colmap", "depth", "distractors")
"""Names of the files and folders of a capture."""

MIN_PHOTO_SIDE_PIXELS = 32


def make_capture(
    name: str,
    out_dir: str | os.PathLike[str],
    *,
    views: int | None = None,
    size: int | None = None,
    seed: int = 0,
    depth: DepthViews = "test",
    points: bool = True,
    scene: ProceduralScene | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Folder with a capture of a built-in room (or of `scene` from where that capture is taken).

    name      a built-in room, with variations after plus signs (`variations.VARIATIONS`): every HOLDOUT-th
              photo from the first on is as without them
    views     photos in all; size: the longer side in pixels; each as the capture says where left out
    seed      of the cameras, the exposures and the noise
    depth     the photos whose true depth is written: all, those held out, or none
    points    whether sparse points are written
    progress  called with (views done, views in all) after each view

    Raises SceneError for an unknown name, DatasetError for impossible sizes and a folder that is not empty.
    """
    plan = capture(name)
    count = plan.views if views is None else views
    longer_side = max(plan.phone.width, plan.phone.height) if size is None else size
    if count < 2:
        raise DatasetError(f"views must be at least 2, not {count}")
    if longer_side < MIN_PHOTO_SIDE_PIXELS:
        raise DatasetError(f"size must be at least {MIN_PHOTO_SIDE_PIXELS}, not {longer_side}")
    if depth not in get_args(DepthViews):
        raise DatasetError(f"depth must be one of {', '.join(get_args(DepthViews))}, not {depth!r}")
    target = real_path(out_dir)
    recover_folder(target, Path.is_dir)
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise DatasetError(f"{target} is not empty; give another folder or remove it first")
    phone = plan.phone.resized(longer_side)
    cameras = plan.cameras(phone, count, seed)
    scene = plan.scene if scene is None else scene
    names = [f"frame_{index:05d}.jpg" for index in range(1, count + 1)]
    training = [index % HOLDOUT != 0 for index in range(count)]
    changes = draw_changes(plan.variations, scene, cameras, plan.target, training, seed)
    renders, changed_renders = [], []
    for camera, change in zip(cameras, changes, strict=True):
        renders.append(render_image(scene, camera))
        changed_renders.append(_render_changed(scene, camera, change, *renders[-1]))
        if progress is not None:
            progress(len(renders), count)
    rng = np.random.RandomState([seed, 7])
    gains = exposure_gains([rgb for rgb, _ in renders], phone.adapts, rng)
    photos = [
        develop_photo(rgb, gain * change.gains, rng)
        for (rgb, _, _), gain, change in zip(changed_renders, gains, changes, strict=True)
    ]
    depths = [distance for _, distance in renders]
    with replaced_folder(target, ()) as draft:
        (draft / "images").mkdir()
        for file, photo in zip(names, photos, strict=True):
            Image.fromarray(photo).save(draft / "images" / file, quality=JPEG_QUALITY, subsampling=0)
        if depth != "none":
            (draft / "depth").mkdir()
            for index in range(0, count, HOLDOUT if depth == "test" else 1):
                np.save(draft / "depth" / f"{Path(names[index]).stem}.npy", depths[index])
        for file, (_, _, distractor) in zip(names, changed_renders, strict=True):
            if distractor is not None:
                (draft / "distractors").mkdir(exist_ok=True)
                Image.fromarray(distractor).save(draft / "distractors" / f"{Path(file).stem}.png")
        values = _transforms(cameras, names)
        if points:
            tracks = simulate_tracks(
                photos, [distance for _, distance, _ in changed_renders], cameras, seed=seed
            )
            values["ply_file_path"] = "sparse_pc.ply"
            _write_ply(tracks, draft / "sparse_pc.ply")
            write_colmap(tracks, cameras, names, draft / "colmap/sparse/0")
        (draft / "transforms.json").write_text(json.dumps(values, indent=1), encoding="utf-8")
    return target


def _render_changed(
    scene: ProceduralScene, camera: Camera, change: Changes, rgb: Float32, distance: Float32
) -> tuple[Float32, Float32, Mask | None]:
    """(rgb, distance, distractor pixels or None for none) of an image of the scene after its changes."""
    if change.flash:
        scene = scene.with_light(FlashLight(scene.light, camera.origin))
        rgb, distance = render_image(scene, camera)
    if not change.parts:
        return rgb, distance, None
    return add_distractors(scene, change.parts, camera, rgb, distance)


def _transforms(cameras: Sequence[Camera], names: Sequence[str]) -> dict[str, object]:
    """Content of nerfstudio's transforms.json."""
    first = cameras[0]
    k1, k2, p1, p2 = (*first.distortion, 0.0, 0.0, 0.0, 0.0)[:4]
    return {
        "camera_model": "OPENCV",
        **{"w": first.width, "h": first.height, "fl_x": first.fx, "fl_y": first.fy},
        **{"cx": first.cx, "cy": first.cy, "k1": k1, "k2": k2, "p1": p1, "p2": p2},
        "applied_transform": np.eye(4)[:3].tolist(),
        "frames": [
            {
                "file_path": f"images/{name}",
                "transform_matrix": camera.c2w.tolist(),
                "colmap_im_id": index,
            }
            for index, (name, camera) in enumerate(zip(names, cameras, strict=True), start=1)
        ],
    }


def _write_ply(tracks: Tracks, path: Path) -> None:
    """Write nerfstudio's sparse_pc.ply: ASCII positions and colors."""
    header = ["ply", "format ascii 1.0", f"element vertex {len(tracks)}"]
    header += [f"property float {axis}" for axis in "xyz"]
    header += [f"property uint8 {channel}" for channel in ("red", "green", "blue")]
    rows = (
        f"{x:.6f} {y:.6f} {z:.6f} {r} {g} {b}"
        for (x, y, z), (r, g, b) in zip(tracks.positions, tracks.rgb, strict=True)
    )
    path.write_text("\n".join([*header, "end_header", *rows]) + "\n", encoding="utf-8")


def write_colmap(tracks: Tracks, cameras: Sequence[Camera], names: Sequence[str], folder: Path) -> None:
    """Write a COLMAP model as text. Source: COLMAP's documentation, "Output format"."""
    folder.mkdir(parents=True)
    first = cameras[0]
    lens = (*first.distortion, 0.0, 0.0, 0.0, 0.0)[:4]
    numbers = " ".join(repr(float(v)) for v in (first.fx, first.fy, first.cx, first.cy, *lens))
    (folder / "cameras.txt").write_text(
        f"1 OPENCV {first.width} {first.height} {numbers}\n", encoding="utf-8"
    )
    lines = []
    row_in_image = np.zeros(len(tracks.view), int)
    for index, (camera, name) in enumerate(zip(cameras, names, strict=True)):
        rotation = (camera.c2w[:3, :3] * (1.0, -1.0, -1.0)).T
        x, y, z, w = Rotation.from_matrix(rotation).as_quat()
        shift = -rotation @ camera.origin
        lines.append(" ".join([str(index + 1), *(repr(float(v)) for v in (w, x, y, z, *shift)), "1", name]))
        observation_rows = np.flatnonzero(tracks.view == index)
        row_in_image[observation_rows] = np.arange(len(observation_rows))
        lines.append(
            " ".join(
                f"{u:.3f} {v:.3f} {point + 1}"
                for (u, v), point in zip(
                    tracks.pixel[observation_rows], tracks.point[observation_rows], strict=True
                )
            )
        )
    (folder / "images.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    order = np.argsort(tracks.point, kind="stable")
    ends = np.searchsorted(tracks.point[order], np.arange(len(tracks) + 1))
    rows = []
    for index in range(len(tracks)):
        observation_rows = order[ends[index] : ends[index + 1]]
        track = " ".join(
            f"{view + 1} {row}"
            for view, row in zip(tracks.view[observation_rows], row_in_image[observation_rows], strict=True)
        )
        x, y, z = tracks.positions[index]
        r, g, b = tracks.rgb[index]
        rows.append(f"{index + 1} {x:.9g} {y:.9g} {z:.9g} {r} {g} {b} {tracks.errors[index]:.4f} {track}")
    (folder / "points3D.txt").write_text("\n".join(rows) + "\n", encoding="utf-8")
