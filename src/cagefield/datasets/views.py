"""Posed photos: one photo with its camera (`View`), and a capture of them (`Dataset`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from cagefield.cameras.camera import Camera
from cagefield.datasets.masks import read_mask, resample_mask, shrink_mask
from cagefield.datasets.notices import warn
from cagefield.datasets.photos import read_header, read_photo
from cagefield.datasets.undistortion import SourceLens
from cagefield.errors import DatasetError

FloatArray = npt.NDArray[np.float64]

MAX_NAMES_SHOWN = 100
"""Maximum number of files or frames that one warning names."""


@dataclass(frozen=True)
class PhotoMask:
    """An image file that excludes pixels of a photo from features, training and figures.

    `excluded` "black": 8-bit values below 128 (nerfstudio's and COLMAP's convention); "white": every pixel
    that is not zero (Instant-NGP's dynamic masks).
    """

    path: Path
    excluded: Literal["black", "white"] = "black"


@dataclass(frozen=True)
class View:
    """Posed photo: `camera` belongs to the image that `load` returns, shrunk by `downscale`.

    Where `source` is given the photo has another lens than the camera: it is resampled at load.
    """

    name: str
    camera: Camera
    image_path: Path
    downscale: int = 1
    mask: PhotoMask | None = None
    source: SourceLens | None = None

    def load(self) -> npt.NDArray[np.uint8]:
        """Pixels uint8 [H,W,3], or [H,W,4] with straight alpha, box-filtered to the camera's size.

        Raises DatasetError where the file cannot be read or has another size than it had when the data set
        was opened.
        """
        pixels = read_photo(self.image_path, self.downscale)
        if self.source is not None:
            return self.source.resample(pixels, self.camera, self._shrunk_size())
        if pixels.shape[:2] != (self.camera.height, self.camera.width):
            raise DatasetError(
                f"{self.image_path}: {pixels.shape[1]}x{pixels.shape[0]} pixels after shrinking by "
                f"{self.downscale}, the camera has {self.camera.width}x{self.camera.height}; reopen it"
            )
        return pixels

    def valid_pixels(self) -> npt.NDArray[np.bool_] | None:
        """Valid pixels [H,W] of the image of `load`; None where all pixels are valid.

        A mask of another size than the photo is resampled by nearest neighbors; a shrunk pixel is valid where
        all pixels of the photo in it are, so that no excluded color is in its mean. In a resampled photo a
        pixel is valid where its nearest pixel of the photo is.

        Raises DatasetError where the mask cannot be read or has another aspect than the photo.
        """
        valid = None
        if self.mask is not None:
            header = read_header(self.image_path)
            valid = read_mask(self.mask.path, self.mask.excluded)
            valid = resample_mask(valid, header.width, header.height, self.mask.path)
            valid = shrink_mask(valid, self.downscale)
        if self.source is not None:
            valid = self.source.resample_mask(valid, self.camera, self._shrunk_size())
        return None if valid is None or valid.all() else valid

    def downscaled(self, factor: int) -> View:
        """View of the photo shrunk by a further `factor`."""
        return replace(self, camera=self.camera.downscaled(factor), downscale=self.downscale * factor)

    def whole(self) -> View:
        """View of the photo at full size: all pixels of its file, and their camera.

        Raises DatasetError where the file cannot be read.
        """
        factor, camera = self.downscale, self.camera
        if factor == 1:
            return self
        if self.source is None:
            header = read_header(self.image_path)
            width, height = header.width, header.height
        else:
            width, height = camera.width * factor, camera.height * factor
        fx, fy, cx, cy = (factor * value for value in (camera.fx, camera.fy, camera.cx, camera.cy))
        full = replace(camera, width=width, height=height, fx=fx, fy=fy, cx=cx, cy=cy)
        return replace(self, camera=full, downscale=1)

    def _shrunk_size(self) -> tuple[float, float]:
        """Width and height of the whole photo in shrunk pixels: fractions where rows or columns are left
        over.
        """
        header = read_header(self.image_path)
        return header.width / self.downscale, header.height / self.downscale


def _identity() -> FloatArray:
    return np.eye(4)


@dataclass(frozen=True, eq=False)
class SparsePoints:
    """Sparse points of a reconstruction, in the data set's world, and the photos that see each of them.

    Attributes:
        positions: [M,3] float64, world units.
        rgb: [M,3] uint8.
        seen_by: for each point the names of the views (`View.name`) that see it; empty where unknown.
        errors: [M] float32, mean reprojection error in pixels of the full-size photos; NaN where unknown.
    """

    positions: FloatArray
    rgb: npt.NDArray[np.uint8]
    seen_by: tuple[frozenset[str], ...] = ()
    errors: npt.NDArray[np.float32] | None = None

    def __len__(self) -> int:
        return len(self.positions)

    def __post_init__(self) -> None:
        positions, rgb = np.array(self.positions, np.float64), np.array(self.rgb, np.uint8)
        if positions.ndim != 2 or positions.shape[1:] != (3,) or not np.isfinite(positions).all():
            raise DatasetError(f"points must be [M,3] finite positions, got {list(positions.shape)}")
        if rgb.shape != positions.shape:
            raise DatasetError(f"points' rgb must be {list(positions.shape)}, got {list(rgb.shape)}")
        if self.seen_by and len(self.seen_by) != len(positions):
            raise DatasetError(f"seen_by names {len(self.seen_by)} points of {len(positions)}")
        arrays: dict[str, npt.NDArray[Any]] = {"positions": positions, "rgb": rgb}
        if self.errors is not None:
            arrays["errors"] = np.array(self.errors, np.float32)
            if arrays["errors"].shape != (len(positions),):
                raise DatasetError(
                    f"points' errors must be [{len(positions)}], got {list(arrays['errors'].shape)}"
                )
        for name, array in arrays.items():
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def take(self, rows: npt.NDArray[Any]) -> SparsePoints:
        """Points of these rows, or of the rows where a mask is True."""
        index = np.arange(len(self))[rows]
        return SparsePoints(
            self.positions[index],
            self.rgb[index],
            tuple(self.seen_by[i] for i in index) if self.seen_by else (),
            None if self.errors is None else self.errors[index],
        )


@dataclass(frozen=True, eq=False)
class Dataset:
    """Capture: posed photos for training, testing and validation, and the modeled region of space.

    `bounds` [2,3] (min, max in world units) is the box that holds the whole scene, or, where `unbounded`, the
    cube of interest: the inner box of a contraction. `white_background` says that the photos are cut-outs
    (RGBA), composited on white by convention. `source_to_world` [4,4] maps the coordinates of the
    reconstruction that the files came from to this data set's world: the leveling rotation for LLFF and
    COLMAP, nerfstudio's `applied_transform` (already in the poses of its files), else the identity. `depths`
    are the nearest and the farthest depth of content along the cameras' axes, None where unknown. `points`
    are the reconstruction's, None where it has none. `offset` is the vector subtracted from the file's
    coordinates where these are far from the origin (see `far_origin`); `source_to_world` includes it.
    """

    name: str
    path: Path
    train: tuple[View, ...]
    test: tuple[View, ...]
    val: tuple[View, ...]
    unbounded: bool
    bounds: FloatArray
    white_background: bool
    source_to_world: FloatArray = field(default_factory=_identity)
    depths: tuple[float, float] | None = None
    points: SparsePoints | None = None
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name, shape in (("bounds", (2, 3)), ("source_to_world", (4, 4))):
            array = np.array(getattr(self, name), dtype=np.float64)
            if array.shape != shape or not np.isfinite(array).all():
                raise DatasetError(f"{name} must be {list(shape)} finite numbers, got {array.tolist()}")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if not np.all(self.bounds[0] < self.bounds[1]):
            raise DatasetError(f"bounds must grow from bounds[0] to bounds[1], got {self.bounds.tolist()}")
        if self.depths is not None and not 0.0 < self.depths[0] < self.depths[1] < np.inf:
            raise DatasetError(f"depths must be 0 < nearest < farthest, got {self.depths}")
        if not self.train:
            raise DatasetError(f"{self.path}: no training views; check the split")


def check_holdout(every: int) -> None:
    """Accept 0 and whole numbers from 2. Raises DatasetError for anything else."""
    if isinstance(every, bool) or int(every) != every or every < 0 or every == 1:
        raise DatasetError(f"holdout must be 0 (no test views) or a whole number from 2, got {every}")


def hold_out(views: Sequence[View], every: int) -> tuple[tuple[View, ...], tuple[View, ...]]:
    """(training views, test views): sorted by name, the first photo and each `every`-th after it test; 0 is
    none.

    All views of a photo (a panorama's faces) are held out together. A single photo trains.
    """
    ordered = sorted(views, key=lambda view: view.name)
    number = {photo: i for i, photo in enumerate(dict.fromkeys(view.image_path for view in ordered))}
    if every == 0 or len(number) == 1:
        return tuple(ordered), ()
    is_test = [number[view.image_path] % every == 0 for view in ordered]
    parts = list(zip(ordered, is_test, strict=True))
    return tuple(v for v, test in parts if not test), tuple(v for v, test in parts if test)


def join_names(names: Sequence[str]) -> str:
    """Comma-separated names, at most MAX_NAMES_SHOWN of them."""
    more = f" and {len(names) - MAX_NAMES_SHOWN} more" if len(names) > MAX_NAMES_SHOWN else ""
    return ", ".join(names[:MAX_NAMES_SHOWN]) + more


def report_missing(path: Path, missing: Sequence[str], total: int) -> None:
    """Warn once, by count and name, of frames whose photo is missing.

    Raises DatasetError where no frame is left.
    """
    if not missing:
        return
    if len(missing) == total:
        raise DatasetError(
            f"{path}: none of the photos of its {total} frames is there; put them where "
            f"the file says: {join_names(missing)}"
        )
    warn(
        f"{path}: {len(missing)} of {total} frames are left out, their photos are missing: "
        f"{join_names(missing)}"
    )


def report_unposed(path: Path, names: Sequence[str], total: int) -> None:
    """Warn once, by count and name, of frames without a pose or with one that is not finite.

    Raises DatasetError where no frame is left.
    """
    if not names:
        return
    if len(names) == total:
        raise DatasetError(f"{path}: none of its {total} frames has a finite pose; find the poses again")
    warn(
        f"{path}: {len(names)} of {total} frames are left out, they have no finite pose: {join_names(names)}"
    )
