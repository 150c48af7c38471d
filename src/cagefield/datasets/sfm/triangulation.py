"""Sparse points of posed photos: SIFT features, matches that the poses allow, triangulation by COLMAP.

The poses are taken as they are: nothing but the points moves. They may be off by a little: a match counts
where its features lie within `MAX_ERROR` pixels of each other's epipolar line, a track where its point is
reprojected within that.

Notation: o_i, d_i are a camera's position and the unit world direction of a feature. A match of d_i and d_j
is allowed where n = d_i x (o_j - o_i), made unit, has |n . d_j| (the sine of the angle between d_j and the
epipolar plane) small, both ways round.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image
from scipy.ndimage import binary_erosion

from cagefield.cameras import lenses
from cagefield.cameras.camera import Camera
from cagefield.datasets.sfm import features
from cagefield.datasets.sfm.features import OnProgress, Photo
from cagefield.datasets.sfm.matching import match
from cagefield.datasets.sfm.pose_alignment import Similarity
from cagefield.datasets.views import SparsePoints, View
from cagefield.files.temporary_folders import TemporaryFolder

FloatArray = npt.NDArray[np.float64]

LONGER_SIDE = 1000
"""Photos are shrunk to this many pixels for features."""

MAX_ERROR = 4.0
"""Pixels of the shrunk photos by which features may miss epipolar lines and reprojected points."""

MOST_PAIRS = 1000
"""Photos of which more pairs than these look the same way are paired with their nearest alone."""

LEAST_NEIGHBOURS = 12

FEW = 1000
"""Fewer points than these are made again with tracks of two photos."""

_EDGE = 3  # pixels beside a cut-out's outline in which its features are not of its surface
_FLIP = np.array([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class ShrunkPhoto:
    """A photo as features are found in it: its camera at that size, its share of the whole photo's size."""

    view: View
    camera: Camera
    scale: float
    pixels: npt.NDArray[np.uint8]


def triangulate(
    views: Sequence[View], *, on_progress: OnProgress | None = None, seed: int = 0
) -> SparsePoints | None:
    """Points that at least two of the posed `views` see; None where there are none.

    `errors` are in pixels of the whole photos. The same views and seed give the same points.

    Raises DatasetError where pycolmap is missing, or a photo cannot be read.
    """
    pycolmap = features.engine()
    if len(views) < 2:
        return None
    with TemporaryFolder("points") as folder:
        shrunk, names = shrink_views(views, folder, on_progress)
        database = folder / "database.db"
        center, scale = normalization([one.camera for one in shrunk])
        cameras = [_colmap_camera(pycolmap, one.camera) for one in shrunk]
        features.create_database(database, cameras, [Photo(n, i) for i, n in enumerate(names)])
        count = 4096 if len(views) <= 150 else 2048
        extract_features(database, folder, names, count, features.share(on_progress, 0.05, 0.45))
        pairs = nearest_pairs([one.camera for one in shrunk])
        match(
            database,
            names,
            pairs,
            verify=False,
            seed=seed,
            on_progress=features.share(on_progress, 0.45, 0.95),
        )
        keypoints = _allow_matches(pycolmap, database, shrunk)
        numbers = list(range(len(views)))
        model = posed_model(pycolmap, cameras, numbers, shrunk, names, center, scale)
        to_world = Similarity(scale, np.eye(3), center)
        points = None
        for least in (3, 2):
            found = triangulated(
                pycolmap, model, database, folder, f"sparse-{least}", MAX_ERROR, least_photos=least, seed=seed
            )
            points = collect_points(found, shrunk, keypoints, to_world)
            if points is not None and len(points) >= FEW:
                break
        features.share(on_progress, 0.0, 1.0)(1.0, f"{0 if points is None else len(points)} points")
        return points


def nearest_pairs(cameras: Sequence[Camera]) -> list[tuple[int, int]]:
    """Pairs (i, j), i < j, of cameras that may see the same: they look less than 90 degrees apart.

    Where these are more than `MOST_PAIRS`, each camera keeps its nearest, by the angle between the axes over
    45 degrees plus the distance over the cameras' spread: half of its share in order, and of the following
    ones every second, which have more parallax.
    """
    origins = np.stack([camera.origin for camera in cameras])
    forward = np.stack([camera.forward for camera in cameras])
    spread = float(np.median(np.linalg.norm(origins - origins.mean(axis=0), axis=1))) or 1.0
    angle = np.degrees(np.arccos(np.clip(forward @ forward.T, -1.0, 1.0)))
    distance = np.linalg.norm(origins[:, None] - origins[None], axis=2) / spread
    wide = np.array([camera.model == "opencv_fisheye" for camera in cameras])
    allowed = (angle < 90.0) | (wide[:, None] & wide[None])
    np.fill_diagonal(allowed, False)
    if np.count_nonzero(allowed) // 2 <= MOST_PAIRS:
        first, second = np.nonzero(np.triu(allowed))
        return list(zip(first.tolist(), second.tolist(), strict=True))
    score = np.where(allowed, angle / 45.0 + distance, np.inf)
    count = max(LEAST_NEIGHBOURS, 2 * MOST_PAIRS // len(cameras))
    ranks = [*range(count // 2), *range(count // 2, count // 2 + 2 * (count - count // 2), 2)]
    pairs = set()
    for i in range(len(cameras)):
        order = np.argsort(score[i], kind="stable")
        for j in order[[rank for rank in ranks if rank < len(cameras)]].tolist():
            if np.isfinite(score[i, j]):
                pairs.add((min(i, j), max(i, j)))
    return sorted(pairs)


def shrink_views(
    views: Sequence[View], folder: Path, on_progress: OnProgress | None, square: bool = False
) -> tuple[list[ShrunkPhoto], list[str]]:
    """Photos shrunk into `folder`/colmap, masks in `folder`/masks, and the names of their files.

    With `square` their height is changed so that both focal lengths are equal.
    """
    (folder / "colmap").mkdir()
    (folder / "masks").mkdir()
    names = [f"{index:06}.png" for index in range(len(views))]
    shrunk = []
    for index, (view, name) in enumerate(zip(views, names, strict=True)):
        shrunk.append(_shrink(view, folder, name, square))
        features.share(on_progress, 0.0, 0.05)((index + 1) / len(views), "photos")
    return shrunk, names


def extract_features(
    database: Path, folder: Path, names: Sequence[str], count: int, on_progress: OnProgress
) -> None:
    """At most `count` features of each of the photos that `shrink_views` wrote into `folder`."""
    masks = folder / "masks"
    features.extract(
        database,
        folder / "colmap",
        names,
        features=count,
        longer_side=LONGER_SIDE,
        masks=masks if any(masks.iterdir()) else None,
        on_progress=on_progress,
    )


def _shrink(view: View, folder: Path, name: str, square: bool) -> ShrunkPhoto:
    """The photo, shrunk, in `folder`/colmap; its mask in `folder`/masks where it is a cut-out or masked."""
    whole = view.whole()
    pixels, valid = whole.load(), whole.valid_pixels()
    height, width = pixels.shape[:2]
    scale = min(1.0, LONGER_SIDE / max(width, height))
    aspect = whole.camera.fx / whole.camera.fy if square else 1.0
    size = max(1, round(width * scale)), max(1, round(height * scale * aspect))
    used = np.ones((height, width), bool) if valid is None else valid
    if pixels.shape[2] == 4:
        used = used & (pixels[..., 3] > 127)
    if not used.all():
        mask = Image.fromarray(used).convert("L").resize(size, Image.Resampling.BOX)
        inside = binary_erosion(np.asarray(mask) > 127, iterations=_EDGE, border_value=True)
        Image.fromarray(np.where(inside, 255, 0).astype(np.uint8)).save(folder / "masks" / f"{name}.png")
    if pixels.shape[2] == 4:
        alpha = pixels[..., 3:].astype(np.float32) / 255.0
        pixels = np.rint(pixels[..., :3] * alpha + 127.0 * (1.0 - alpha)).astype(np.uint8)
    picture = Image.fromarray(pixels)
    if picture.size != size:
        picture = picture.resize(size, Image.Resampling.BOX)
    picture.save(folder / "colmap" / name, compress_level=1)
    return ShrunkPhoto(view, whole.camera.resized(*size), size[0] / width, np.asarray(picture))


def normalization(cameras: Sequence[Camera]) -> tuple[FloatArray, float]:
    """The middle [3] of the cameras, and their median distance to it."""
    origins = np.stack([camera.origin for camera in cameras])
    centre = origins.mean(axis=0)
    return centre, float(np.median(np.linalg.norm(origins - centre, axis=1))) or 1.0


def _colmap_camera(pycolmap: Any, camera: Camera) -> Any:
    """The COLMAP camera of a lens; an opencv lens becomes a pinhole, and its features are undistorted."""
    intrinsics = [camera.fx, camera.fy, camera.cx, camera.cy]
    model, params = "PINHOLE", intrinsics
    if camera.model == "opencv_fisheye":
        model, params = "OPENCV_FISHEYE", [*intrinsics, *camera.distortion]
    made = pycolmap.Camera(model=model, width=camera.width, height=camera.height, params=params)
    made.has_prior_focal_length = True
    return made


def _allow_matches(pycolmap: Any, path: Path, shrunk: Sequence[ShrunkPhoto]) -> list[FloatArray]:
    """Writes the matches that the poses allow as verified ones, and undistorted features.

    Returns each photo's features [K,2] where they are in the shrunk photo.
    """
    keypoints: list[FloatArray] = []
    directions: list[FloatArray] = []
    with features.opened(path) as database:
        for index, one in enumerate(shrunk, start=1):
            camera = one.camera
            found = (
                np.asarray(database.read_keypoints(index), dtype=np.float64)[:, :2]
                if database.exists_keypoints(index)
                else np.zeros((0, 2))
            )
            image = (found - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
            local, seen = lenses.unproject(image, camera.model, camera.distortion)
            world = local * _FLIP @ camera.c2w[:3, :3].T
            directions.append(np.where(seen[:, None], world, np.nan))
            keypoints.append(found)
            if camera.model == "opencv" and len(found):
                flat = local[:, :2] / local[:, 2:] * (camera.fx, camera.fy) + (camera.cx, camera.cy)
                database.update_keypoints(index, flat.astype(np.float32))
        for pair, matches in zip(*database.read_all_matches(), strict=True):
            first, second = (number - 1 for number in pycolmap.pair_id_to_image_pair(pair))
            kept = matches[_allowed(shrunk, directions, first, second, matches)]
            if len(kept) < 8:
                continue
            geometry = pycolmap.TwoViewGeometry(
                config=pycolmap.TwoViewGeometryConfiguration.CALIBRATED, inlier_matches=kept
            )
            database.write_two_view_geometry(first + 1, second + 1, geometry)
    return keypoints


def _allowed(
    shrunk: Sequence[ShrunkPhoto], directions: Sequence[FloatArray], first: int, second: int, matches: Any
) -> npt.NDArray[np.bool_]:
    """Which matches [K,2] lie within MAX_ERROR pixels of each other's epipolar planes."""
    baseline = shrunk[second].camera.origin - shrunk[first].camera.origin
    one, other = directions[first][matches[:, 0]], directions[second][matches[:, 1]]
    kept = np.ones(len(matches), dtype=bool)
    for a, b, index in ((one, other, second), (other, one, first)):
        normal = np.cross(a, baseline)
        length = np.linalg.norm(normal, axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            sine = np.abs(np.einsum("ni,ni->n", normal, b)) / length
            kept &= sine * shrunk[index].camera.fx <= MAX_ERROR
    return kept


def posed_model(
    pycolmap: Any,
    cameras: Sequence[Any],
    numbers: Sequence[int],
    shrunk: Sequence[ShrunkPhoto],
    names: Sequence[str],
    center: FloatArray,
    scale: float,
) -> Any:
    """A reconstruction with the known poses, the cameras' middle at the origin, `scale` the unit.

    Photo n has the camera `cameras[numbers[n]]`.
    """
    model = pycolmap.Reconstruction()
    for camera in cameras:
        model.add_camera_with_trivial_rig(camera)
    for index, (number, one, name) in enumerate(zip(numbers, shrunk, names, strict=True), start=1):
        rotation, _ = _nearest_rotation(one.camera.c2w[:3, :3] * _FLIP)
        origin = (one.camera.origin - center) / scale
        rigid = pycolmap.Rigid3d(pycolmap.Rotation3d(rotation.T), -rotation.T @ origin)
        image = pycolmap.Image(name=name, camera_id=number + 1, image_id=index)
        model.add_image_with_trivial_frame(image, rigid)
    return model


def _nearest_rotation(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The rotation [3,3] nearest to `matrix`, and its singular values."""
    left, values, right = np.linalg.svd(matrix)
    return left @ right, values


def triangulated(
    pycolmap: Any,
    model: Any,
    database: Path,
    folder: Path,
    name: str,
    bound: float,
    *,
    least_photos: int,
    seed: int,
) -> Any:
    """The model with points of tracks of `least_photos` or more, reprojected within `bound` pixels.

    Its files are written to `folder`/`name`. Poses and intrinsics stay.
    """
    options = pycolmap.IncrementalPipelineOptions(
        min_num_matches=8, extract_colors=False, random_seed=seed, fix_existing_frames=True
    )
    angle = bound / MAX_ERROR  # degrees: a pixel of a shrunk photo is a tenth of one or less
    options.triangulation.ignore_two_view_tracks = least_photos > 2
    options.triangulation.random_seed = seed
    options.triangulation.create_max_angle_error = angle
    options.triangulation.continue_max_angle_error = angle
    options.triangulation.merge_max_reproj_error = bound
    options.triangulation.complete_max_reproj_error = bound
    options.mapper.filter_max_reproj_error = bound
    out = folder / name
    out.mkdir()
    return features.call(
        pycolmap.triangulate_points,
        model,
        database,
        folder / "colmap",
        out,
        clear_points=True,
        options=options,
        refine_intrinsics=False,
    )


def collect_points(
    model: Any, shrunk: Sequence[ShrunkPhoto], keypoints: Sequence[FloatArray] | None, to_world: Similarity
) -> SparsePoints | None:
    """The model's points in the data set's world, with colors and errors of the photos that see them.

    `keypoints` [K,2] of each photo are where its features are in the shrunk photo; None takes the model's.
    """
    positions, rgb, seen_by, errors = [], [], [], []
    for _, point in sorted(model.points3D.items()):
        seen = {element.image_id - 1: element.point2D_idx for element in point.track.elements}
        if len(seen) < 2 or not np.isfinite(point.xyz).all() or np.abs(point.xyz).max() > 1e4:
            continue
        colors = []
        for photo, row in seen.items():
            at = model.image(photo + 1).point2D(row).xy if keypoints is None else keypoints[photo][row]
            colors.append(_pixel(shrunk[photo].pixels, at))
        positions.append(np.asarray(point.xyz))
        rgb.append(np.rint(np.mean(colors, axis=0)))
        seen_by.append(frozenset(shrunk[photo].view.name for photo in seen))
        errors.append(point.error / np.mean([shrunk[photo].scale for photo in seen]))
    if not positions:
        return None
    return SparsePoints(
        to_world.moved(np.array(positions)),
        np.array(rgb, dtype=np.uint8),
        tuple(seen_by),
        np.array(errors, dtype=np.float32),
    )


def _pixel(pixels: npt.NDArray[np.uint8], position: FloatArray) -> FloatArray:
    row = min(max(int(position[1]), 0), pixels.shape[0] - 1)
    column = min(max(int(position[0]), 0), pixels.shape[1] - 1)
    return pixels[row, column].astype(np.float64)
