"""Content of a USD stage of splats: prims, their attributes, time codes and the camera.

A prim ParticleField3DGaussianSplat of N splats has the attributes positions [N,3], orientations [N] (unit
quaternions), scales [N,3] (linear), opacities [N] in [0, 1] and radiance:sphericalHarmonicsCoefficients
[N (L+1)^2, 3], those of a splat one after the other, of degree 0 first, as in 3DGS: color = 1/2 + sum.
Stages are written with y up, in the axes "rub", and a unit of one meter. Frame n of an animation has the time
code n; `timeCodesPerSecond` is its frame rate.

Source: OpenUSD 26.03, UsdVol, ParticleField3DGaussianSplat and the API schemas built into it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.fields.splat_field import Offset
from cagefield.formats.splats.axes import Axes
from cagefield.formats.splats.splat_table import SplatBatch, SplatTable
from cagefield.typing import Array, Float32

USD_AXES: Axes = "rub"
PRIM_TYPE = "ParticleField3DGaussianSplat"
ROOT_NAME, CAMERA_NAME = "World", "camera"
SH_COEFFICIENTS, SH_DEGREE = "radiance:sphericalHarmonicsCoefficients", "radiance:sphericalHarmonicsDegree"
EXTENT_SIGMAS = 3.0
"""Distance from a mean to the border of its splat in a prim's extent, in standard deviations."""

APERTURE_MM = 24.0
"""Vertical aperture of cameras, in USD's tenths of a unit; their focal length says the field of view."""


@dataclass(frozen=True)
class Column:
    """Attribute of splats: name, USD's array type, floats per element, values [n,width] of a batch."""

    name: str
    type_name: str
    width: int
    values: Callable[[SplatBatch], Float32]


def _unit_quaternions(batch: SplatBatch) -> Float32:
    values = batch.quaternions.astype(np.float64)
    return (values / np.linalg.norm(values, axis=1, keepdims=True)).astype(np.float32)


COLUMNS = (
    Column("positions", "point3f[]", 3, lambda batch: batch.means.astype(np.float32)),
    Column("orientations", "quatf[]", 4, _unit_quaternions),
    Column("scales", "float3[]", 3, lambda batch: np.exp(batch.log_scales.astype(np.float64)).astype("f4")),
    Column("opacities", "float[]", 1, lambda batch: batch.opacities.astype(np.float32)[:, None]),
    Column(SH_COEFFICIENTS, "float3[]", 3, lambda batch: batch.sh.astype(np.float32).reshape(-1, 3)),
)
"""Attributes of a prim; orientations are (w, x, y, z)."""


@dataclass(frozen=True)
class Pose:
    """Camera at a time code: camera-to-world [4,4] in the stage's axes, focal length in tenths of a unit."""

    matrix: Array
    focal_length: float


@dataclass(frozen=True)
class StageInfo:
    """Values of a stage beside its splats.

    `names` are the prims' names, `offsets` their translations. `fps` is None for a stage without time codes.
    Prims whose number is in `still` have their splats of the first frame, without time samples.
    `camera` has a pose for each frame, or none; `aspect` is width over height.
    """

    names: tuple[str, ...]
    sh_degree: int
    offsets: tuple[Offset, ...]
    fps: float | None = None
    frames: int = 1
    camera: tuple[Pose, ...] = ()
    aspect: float = 1.0
    still: frozenset[int] = frozenset()

    def time_code(self, prim: int, frame: int) -> int | None:
        """Time code of a prim's splats in a frame; None for values without time samples."""
        return None if self.fps is None or prim in self.still else frame

    def is_written(self, prim: int, frame: int) -> bool:
        """Whether a prim has values of its own in a frame."""
        return frame == 0 or self.time_code(prim, frame) is not None

    @classmethod
    def from_table(cls, name: str, table: SplatTable) -> StageInfo:
        """Stage of one table without time codes."""
        return cls(prim_names([name]), table.sh_degree, (table.offset,))


Frame = Sequence[SplatTable | None]
"""Table of each prim at a time code, in the stage's axes; None where a prim has no splats then."""


class ExtentBounds:
    """Box of the splats of a prim at a time code."""

    def __init__(self) -> None:
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)

    def add(self, batch: SplatBatch) -> None:
        """Grow by the splats of a batch."""
        if len(batch):
            reach = EXTENT_SIGMAS * np.exp(batch.log_scales.astype(np.float64).max(axis=1, keepdims=True))
            self._low = np.minimum(self._low, (batch.means - reach).min(axis=0))
            self._high = np.maximum(self._high, (batch.means + reach).max(axis=0))

    def rows(self) -> Float32:
        """Lower and upper corner [2,3]; [0,3] without splats."""
        if not np.isfinite(self._low).all():
            return np.zeros((0, 3), np.float32)
        return np.stack([self._low, self._high]).astype(np.float32)


def prim_names(names: Iterable[str]) -> tuple[str, ...]:
    """Valid and unique USD identifiers of names."""
    result: list[str] = []
    for name in names:
        base = re.sub(r"[^A-Za-z0-9_]", "_", name) or "splats"
        base = f"_{base}" if base[0].isdigit() else base
        found, number = base, 2
        while found in (*result, CAMERA_NAME):
            found, number = f"{base}_{number}", number + 1
        result.append(found)
    return tuple(result)


def camera_pose(camera: Camera, to_stage: Array) -> Pose:
    """Pose of a camera; `to_stage` [3,3] is rotation times scale from its world to the stage's axes."""
    matrix = np.eye(4)
    matrix[:3, :3] = to_stage @ camera.c2w[:3, :3] / np.cbrt(np.linalg.det(to_stage))
    matrix[:3, 3] = to_stage @ camera.c2w[:3, 3]
    return Pose(matrix, APERTURE_MM * camera.fy / camera.height)


def no_splats(sh_degree: int) -> SplatBatch:
    """Batch without splats."""
    empty: Callable[..., NDArray[np.float32]] = lambda *shape: np.zeros((0, *shape), np.float32)  # noqa: E731
    return SplatBatch(empty(3), empty(3), empty(4), empty(), empty((sh_degree + 1) ** 2, 3))
