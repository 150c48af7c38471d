"""Sparse points of posed photos: SIFT features, matches that the poses allow, triangulation by COLMAP.

The poses are fixed: only the points are estimated. Small pose errors are tolerated: a match counts where its
features lie within MAX_ERROR_PIXELS of each other's epipolar line, a track where its point is reprojected
within MAX_ERROR_PIXELS.

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
from cagefield.datasets.views import SparsePoints, View
from cagefield.files.temporary_folders import TemporaryFolder
from cagefield.geometry.point_alignment import Similarity

FloatArray = npt.NDArray[np.float64]

TRIANGULATION_SIDE_PIXELS = 1000
"""Longer side to which photos are shrunk for feature extraction."""

MAX_ERROR_PIXELS = 4.0
"""Maximum distance of features from epipolar lines and reprojected points, pixels of the shrunk photos."""

MAX_TRIANGULATION_PAIRS = 1000
"""Maximum number of pairs with similar viewing directions; of more, each photo keeps its nearest."""

MIN_NEIGHBORS = 12

MIN_TRIANGULATED_POINTS = 1000
"""Minimum number of points; fewer are triangulated again with tracks of two photos."""

_EDGE_PIXELS = 3  # pixels beside a cut-out's outline in which its features are not of its surface
_OPENGL_TO_OPENCV = np.array([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class ShrunkPhoto:
    """Photo at the size of feature extraction: its camera at that size, and that size over the whole
    photo's.
    """

    view: View
    camera: Camera
    scale: float
    pixels: npt.NDArray[np.uint8]


def triangulate(
    views: Sequence[View], *, on_progress: OnProgress | None = None, seed: int = 0
) -> SparsePoints | None:
    """Sparse points that at least two of the posed `views` see; None where there are none.

    `errors` are in pixels of the whole photos. The result is determined by views and seed.

    Raises DatasetError where pycolmap is missing, or a photo cannot be read.
    """
    pycolmap = features.import_pycolmap()
    if len(views) < 2:
        return None
    with TemporaryFolder("points") as folder:
        shrunk, names = shrink_views(views, folder, on_progress)
        database = folder / "database.db"
        center, scale = normalization([one.camera for one in shrunk])
        cameras = [_build_camera(pycolmap, one.camera) for one in shrunk]
        features.create_database(database, cameras, [Photo(n, i) for i, n in enumerate(names)])
        count = 4096 if len(views) <= 150 else 2048
        extract_features(database, folder, names, count, features.scale_progress(on_progress, 0.05, 0.45))
        pairs = nearest_pairs([one.camera for one in shrunk])
        match(
            database,
            names,
            pairs,
            verify=False,
            seed=seed,
            on_progress=features.scale_progress(on_progress, 0.45, 0.95),
        )
        keypoints = _allow_matches(pycolmap, database, shrunk)
        numbers = list(range(len(views)))
        model = posed_model(pycolmap, cameras, numbers, shrunk, names, center, scale)
        to_world = Similarity(scale, np.eye(3), center)
        points = None
        for min_photos in (3, 2):
            triangulated = triangulate_tracks(
                pycolmap,
                model,
                database,
                folder,
                f"sparse-{min_photos}",
                MAX_ERROR_PIXELS,
                min_photos=min_photos,
                seed=seed,
            )
            points = collect_points(triangulated, shrunk, keypoints, to_world)
            if points is not None and len(points) >= MIN_TRIANGULATED_POINTS:
                break
        features.scale_progress(on_progress, 0.0, 1.0)(1.0, f"{0 if points is None else len(points)} points")
        return points


def nearest_pairs(cameras: Sequence[Camera]) -> list[tuple[int, int]]:
    """Pairs (i, j), i < j, of cameras that may overlap: their viewing directions are less than 90 degrees
    apart.

    Where there are more than `MAX_TRIANGULATION_PAIRS`, each camera keeps its nearest, by the angle between
    the axes over 45 degrees plus the distance over the cameras' spread: half of its share in order, and of
    the following cameras every second, which have more parallax.
    """
    origins = np.stack([camera.origin for camera in cameras])
    forward = np.stack([camera.forward for camera in cameras])
    spread = float(np.median(np.linalg.norm(origins - origins.mean(axis=0), axis=1))) or 1.0
    angle = np.degrees(np.arccos(np.clip(forward @ forward.T, -1.0, 1.0)))
    distance = np.linalg.norm(origins[:, None] - origins[None], axis=2) / spread
    is_fisheye = np.array([camera.model == "opencv_fisheye" for camera in cameras])
    allowed = (angle < 90.0) | (is_fisheye[:, None] & is_fisheye[None])
    np.fill_diagonal(allowed, False)
    if np.count_nonzero(allowed) // 2 <= MAX_TRIANGULATION_PAIRS:
        first, second = np.nonzero(np.triu(allowed))
        return list(zip(first.tolist(), second.tolist(), strict=True))
    score = np.where(allowed, angle / 45.0 + distance, np.inf)
    count = max(MIN_NEIGHBORS, 2 * MAX_TRIANGULATION_PAIRS // len(cameras))
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
    """(shrunk photos, names of their files): photos in `folder`/colmap, masks in `folder`/masks.

    With `square` their height is changed so that both focal lengths are equal.
    """
    (folder / "colmap").mkdir()
    (folder / "masks").mkdir()
    names = [f"{index:06}.png" for index in range(len(views))]
    shrunk = []
    for index, (view, name) in enumerate(zip(views, names, strict=True)):
        shrunk.append(_shrink(view, folder, name, square))
        features.scale_progress(on_progress, 0.0, 0.05)((index + 1) / len(views), "photos")
    return shrunk, names


def extract_features(
    database: Path, folder: Path, names: Sequence[str], count: int, on_progress: OnProgress
) -> None:
    """Extract at most `count` features of each of the photos that `shrink_views` wrote to `folder`."""
    masks = folder / "masks"
    features.extract(
        database,
        folder / "colmap",
        names,
        features=count,
        longer_side=TRIANGULATION_SIDE_PIXELS,
        masks=masks if any(masks.iterdir()) else None,
        on_progress=on_progress,
    )


def _shrink(view: View, folder: Path, name: str, square: bool) -> ShrunkPhoto:
    """Shrunk photo, written to `folder`/colmap; its mask in `folder`/masks where it is a cut-out or
    masked.
    """
    full_size = view.whole()
    pixels, valid = full_size.load(), full_size.valid_pixels()
    height, width = pixels.shape[:2]
    scale = min(1.0, TRIANGULATION_SIDE_PIXELS / max(width, height))
    aspect = full_size.camera.fx / full_size.camera.fy if square else 1.0
    size = max(1, round(width * scale)), max(1, round(height * scale * aspect))
    is_valid = np.ones((height, width), bool) if valid is None else valid
    if pixels.shape[2] == 4:
        is_valid = is_valid & (pixels[..., 3] > 127)
    if not is_valid.all():
        mask = Image.fromarray(is_valid).convert("L").resize(size, Image.Resampling.BOX)
        inside = binary_erosion(np.asarray(mask) > 127, iterations=_EDGE_PIXELS, border_value=True)
        Image.fromarray(np.where(inside, 255, 0).astype(np.uint8)).save(folder / "masks" / f"{name}.png")
    if pixels.shape[2] == 4:
        alpha = pixels[..., 3:].astype(np.float32) / 255.0
        pixels = np.rint(pixels[..., :3] * alpha + 127.0 * (1.0 - alpha)).astype(np.uint8)
    image = Image.fromarray(pixels)
    if image.size != size:
        image = image.resize(size, Image.Resampling.BOX)
    image.save(folder / "colmap" / name, compress_level=1)
    return ShrunkPhoto(view, full_size.camera.resized(*size), size[0] / width, np.asarray(image))


def normalization(cameras: Sequence[Camera]) -> tuple[FloatArray, float]:
    """(mean position [3] of the cameras, their median distance to it)."""
    origins = np.stack([camera.origin for camera in cameras])
    center = origins.mean(axis=0)
    return center, float(np.median(np.linalg.norm(origins - center, axis=1))) or 1.0


def _build_camera(pycolmap: Any, camera: Camera) -> Any:
    """COLMAP camera of a lens; an opencv lens becomes a pinhole, and its features are undistorted."""
    intrinsics = [camera.fx, camera.fy, camera.cx, camera.cy]
    model, params = "PINHOLE", intrinsics
    if camera.model == "opencv_fisheye":
        model, params = "OPENCV_FISHEYE", [*intrinsics, *camera.distortion]
    colmap_camera = pycolmap.Camera(model=model, width=camera.width, height=camera.height, params=params)
    colmap_camera.has_prior_focal_length = True
    return colmap_camera


def _allow_matches(pycolmap: Any, path: Path, shrunk: Sequence[ShrunkPhoto]) -> list[FloatArray]:
    """Write the matches that agree with the poses as verified ones, and undistorted features.

    Returns each photo's features [K,2] in pixels of the shrunk photo.
    """
    keypoints: list[FloatArray] = []
    directions: list[FloatArray] = []
    with features.open_database(path) as database:
        for index, one in enumerate(shrunk, start=1):
            camera = one.camera
            pixels = (
                np.asarray(database.read_keypoints(index), dtype=np.float64)[:, :2]
                if database.exists_keypoints(index)
                else np.zeros((0, 2))
            )
            image = (pixels - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
            local, is_visible = lenses.unproject(image, camera.model, camera.distortion)
            world = local * _OPENGL_TO_OPENCV @ camera.c2w[:3, :3].T
            directions.append(np.where(is_visible[:, None], world, np.nan))
            keypoints.append(pixels)
            if camera.model == "opencv" and len(pixels):
                undistorted = local[:, :2] / local[:, 2:] * (camera.fx, camera.fy) + (camera.cx, camera.cy)
                database.update_keypoints(index, undistorted.astype(np.float32))
        for pair, matches in zip(*database.read_all_matches(), strict=True):
            first, second = (number - 1 for number in pycolmap.pair_id_to_image_pair(pair))
            allowed_matches = matches[_is_allowed(shrunk, directions, first, second, matches)]
            if len(allowed_matches) < 8:
                continue
            geometry = pycolmap.TwoViewGeometry(
                config=pycolmap.TwoViewGeometryConfiguration.CALIBRATED, inlier_matches=allowed_matches
            )
            database.write_two_view_geometry(first + 1, second + 1, geometry)
    return keypoints


def _is_allowed(
    shrunk: Sequence[ShrunkPhoto], directions: Sequence[FloatArray], first: int, second: int, matches: Any
) -> npt.NDArray[np.bool_]:
    """Mask [K] of the matches [K,2] within MAX_ERROR_PIXELS of each other's epipolar planes."""
    baseline = shrunk[second].camera.origin - shrunk[first].camera.origin
    one, other = directions[first][matches[:, 0]], directions[second][matches[:, 1]]
    is_allowed = np.ones(len(matches), dtype=bool)
    for a, b, index in ((one, other, second), (other, one, first)):
        normal = np.cross(a, baseline)
        length = np.linalg.norm(normal, axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            sine = np.abs(np.einsum("ni,ni->n", normal, b)) / length
            is_allowed &= sine * shrunk[index].camera.fx <= MAX_ERROR_PIXELS
    return is_allowed


def posed_model(
    pycolmap: Any,
    cameras: Sequence[Any],
    numbers: Sequence[int],
    shrunk: Sequence[ShrunkPhoto],
    names: Sequence[str],
    center: FloatArray,
    scale: float,
) -> Any:
    """Reconstruction with the known poses, in units of `scale` and with `center` as its origin.

    Photo n has the camera `cameras[numbers[n]]`.
    """
    model = pycolmap.Reconstruction()
    for camera in cameras:
        model.add_camera_with_trivial_rig(camera)
    for index, (number, one, name) in enumerate(zip(numbers, shrunk, names, strict=True), start=1):
        rotation, _ = _nearest_rotation(one.camera.c2w[:3, :3] * _OPENGL_TO_OPENCV)
        origin = (one.camera.origin - center) / scale
        rigid = pycolmap.Rigid3d(pycolmap.Rotation3d(rotation.T), -rotation.T @ origin)
        image = pycolmap.Image(name=name, camera_id=number + 1, image_id=index)
        model.add_image_with_trivial_frame(image, rigid)
    return model


def _nearest_rotation(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(rotation [3,3] nearest to `matrix`, singular values of `matrix`)."""
    left, values, right = np.linalg.svd(matrix)
    return left @ right, values


def triangulate_tracks(
    pycolmap: Any,
    model: Any,
    database: Path,
    folder: Path,
    name: str,
    bound: float,
    *,
    min_photos: int,
    seed: int,
) -> Any:
    """Model with points of tracks of `min_photos` or more, with reprojection errors within `bound` pixels.

    Its files are written to `folder`/`name`. Poses and intrinsics are unchanged.
    """
    options = pycolmap.IncrementalPipelineOptions(
        min_num_matches=8, extract_colors=False, random_seed=seed, fix_existing_frames=True
    )
    angle = bound / MAX_ERROR_PIXELS  # degrees: a pixel of a shrunk photo is a tenth of one or less
    options.triangulation.ignore_two_view_tracks = min_photos > 2
    options.triangulation.random_seed = seed
    options.triangulation.create_max_angle_error = angle
    options.triangulation.continue_max_angle_error = angle
    options.triangulation.merge_max_reproj_error = bound
    options.triangulation.complete_max_reproj_error = bound
    options.mapper.filter_max_reproj_error = bound
    out = folder / name
    out.mkdir()
    return features.call_cancellable(
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
    """Points of the model in the data set's world, with colors and errors from the photos that see them.

    `keypoints` [K,2] of each photo are its features in the shrunk photo; None takes the model's.
    """
    positions, rgb, seen_by, errors = [], [], [], []
    for _, point in sorted(model.points3D.items()):
        feature_rows = {element.image_id - 1: element.point2D_idx for element in point.track.elements}
        if len(feature_rows) < 2 or not np.isfinite(point.xyz).all() or np.abs(point.xyz).max() > 1e4:
            continue
        colors = []
        for photo, row in feature_rows.items():
            pixel = model.image(photo + 1).point2D(row).xy if keypoints is None else keypoints[photo][row]
            colors.append(_pixel(shrunk[photo].pixels, pixel))
        positions.append(np.asarray(point.xyz))
        rgb.append(np.rint(np.mean(colors, axis=0)))
        seen_by.append(frozenset(shrunk[photo].view.name for photo in feature_rows))
        errors.append(point.error / np.mean([shrunk[photo].scale for photo in feature_rows]))
    if not positions:
        return None
    return SparsePoints(
        to_world.transform_points(np.array(positions)),
        np.array(rgb, dtype=np.uint8),
        tuple(seen_by),
        np.array(errors, dtype=np.float32),
    )


def _pixel(pixels: npt.NDArray[np.uint8], position: FloatArray) -> FloatArray:
    row = min(max(int(position[1]), 0), pixels.shape[0] - 1)
    column = min(max(int(position[0]), 0), pixels.shape[1] - 1)
    return pixels[row, column].astype(np.float64)
