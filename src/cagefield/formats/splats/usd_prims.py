"""Prims of Gaussian splats of USD files, read by usd-core; see `usd_stage` and, for the process, `usd`.

All prims ParticleField3DGaussianSplat that the stage shows are read, instances too, each under its transform.
Stages with z up are turned by a quarter turn about x; coordinates are scaled by `metersPerUnit` where the
file states one, to meters. Without a time code the first frame counts: `startTimeCode`, else the first
sample. Attributes of half precision (positionsh) stand in for missing ones of single precision. A stage may
refer to files in its own folder, never outside of it.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.errors import FieldError
from cagefield.fields import sh as spherical_harmonics
from cagefield.files.memory import memory_shortage
from cagefield.files.safe_open import check_regular, real_path
from cagefield.formats.splats.splat_table import BATCH_SPLATS, SplatBatch
from cagefield.formats.splats.transform import transform_splats
from cagefield.formats.splats.usd_library import import_usd, message_of, quiet_usd
from cagefield.formats.splats.usd_stage import PRIM_TYPE, SH_COEFFICIENTS, SH_DEGREE
from cagefield.typing import AnyArray, Array

MAX_USD_LAYERS = 200
"""Maximum number of files of a stage."""

MAX_SPLATS = 1 << 31
_Z_UP = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""Quarter turn about x that takes z to y."""

_CONTAINERS = ("", "Xform", "Scope", "Camera", PRIM_TYPE)


@dataclass(frozen=True, eq=False)
class UsdSplats:
    """Splats of a prim: values of its attributes, and its matrix [4,4] to the source's axes and units."""

    means: AnyArray
    quaternions: AnyArray | None
    scales: AnyArray | None
    opacities: AnyArray | None
    sh: AnyArray
    matrix: Array

    @property
    def sh_degree(self) -> int:
        return int(np.sqrt(self.sh.shape[1])) - 1

    def batches(self) -> Iterator[SplatBatch]:
        for first in range(0, len(self.means), BATCH_SPLATS):
            rows = slice(first, first + BATCH_SPLATS)
            means = self.means[rows]
            scales = np.ones((len(means), 3)) if self.scales is None else self.scales[rows]
            with np.errstate(divide="ignore", invalid="ignore"):
                log_scales = np.log(scales.astype(np.float64))
            quaternions = np.tile([1.0, 0.0, 0.0, 0.0], (len(means), 1))
            if self.quaternions is not None:  # in the library's memory x, y, z come first
                quaternions = self.quaternions[rows][:, [3, 0, 1, 2]]
            opacities = np.ones(len(means)) if self.opacities is None else self.opacities[rows]
            batch = SplatBatch(means, log_scales, quaternions, opacities, self.sh[rows])
            yield transform_splats(batch, self.matrix)


def read_usd_splats(path: Path, time_code: float | None = None) -> list[UsdSplats]:
    """Splats of a USD file at a time code; warnings name its unit, up axis, time samples and ignored content.

    Raises:
        FieldError: no usd-core, no USD, no splats, a damaged file, or a reference outside of its folder.
    """
    usd = import_usd(path, "is read")
    with quiet_usd(usd):
        try:
            return _prims(usd, path, time_code)
        except FieldError:
            raise
        except (usd.Tf.ErrorException, RuntimeError) as error:
            raise damaged_usd(path, message_of(error)) from None
        except (ValueError, TypeError, IndexError, OverflowError, np.linalg.LinAlgError) as error:
            raise damaged_usd(path, " ".join(str(error).split())[:160] or type(error).__name__) from None


def damaged_usd(path: Path, why: str) -> FieldError:
    """Error of a file that cannot be read."""
    return FieldError(f"{path}: no USD of splats that can be read: {why}; copy or export it again")


def _prims(usd: Any, path: Path, time_code: float | None) -> list[UsdSplats]:
    layer = _layer(usd, path)
    _check_references(usd, path, layer)
    stage = usd.Usd.Stage.Open(layer, load=usd.Usd.Stage.LoadAll)
    time = _time(usd, path, stage, time_code)
    to_source = _stage_matrix(usd, path, stage)
    transforms = usd.UsdGeom.XformCache(time)
    ignored = dict[str, int]()
    parts = list[UsdSplats]()
    samples = 0
    for prim in stage.Traverse(usd.Usd.TraverseInstanceProxies()):
        kind = str(prim.GetTypeName())
        if kind != PRIM_TYPE:
            if kind not in _CONTAINERS:
                ignored[f"prims {kind:.40}"] = ignored.get(f"prims {kind:.40}", 0) + 1
            continue
        if prim.HasAuthoredMetadata("clips"):
            raise FieldError(f"{path}: {prim.GetPath()} has value clips, which are not read; flatten it")
        if usd.UsdGeom.Imageable(prim).ComputeVisibility(time) == "invisible":
            ignored["invisible prims of splats"] = ignored.get("invisible prims of splats", 0) + 1
            continue
        matrix = np.array(transforms.GetLocalToWorldTransform(prim)).T
        part = _part(path, prim, time, to_source @ matrix)
        samples = max(samples, *(attribute.GetNumTimeSamples() for attribute in prim.GetAttributes()))
        if len(part.means):
            parts.append(part)
    if not parts:
        found = ", ".join(f"{count} {name}" for name, count in ignored.items())
        raise FieldError(
            f"{path}: a USD without splats to be read ({found or 'no prims'}); it takes {PRIM_TYPE}"
        )
    if samples > 1 and time_code is None:
        warnings.warn(
            f"{path}: its splats have {samples} time samples; those of the first are read", stacklevel=3
        )
    if ignored:
        said = ", ".join(f"{count} {name}" for name, count in ignored.items())
        warnings.warn(f"{path}: left out: {said:.300}", stacklevel=3)
    count = sum(len(part.means) for part in parts)
    if count > MAX_SPLATS:
        raise damaged_usd(path, f"its instances are {count} splats, at most {MAX_SPLATS} are read")
    return parts


def _layer(usd: Any, path: Path) -> Any:
    """Layer of a file as it is now; a layer of an earlier file of its name is reloaded."""
    layer = usd.Sdf.Layer.FindOrOpen(str(path))
    if layer is None:
        raise damaged_usd(path, "the USD library cannot open it")
    layer.Reload()
    return layer


def _check_references(usd: Any, path: Path, layer: Any) -> None:
    """Pass where all files that a layer is composed of are regular ones of its own folder.

    Raises:
        FieldError: another one, a missing one, or too many.
    """
    folder = real_path(path).parent
    pending, known = [layer], {layer.identifier}
    while pending:
        current = pending.pop()
        for asset in current.GetCompositionAssetDependencies():
            name = current.ComputeAbsolutePath(asset)
            if name in known:
                continue
            known.add(name)
            package = name.split("[", 1)[0].split(":SDF_FORMAT_ARGS", 1)[0]
            file = real_path(folder / package)
            if not file.is_relative_to(folder):
                raise FieldError(f"{path}: it refers to {asset!s:.80}, outside of its folder; flatten it")
            if len(known) > MAX_USD_LAYERS:
                raise FieldError(f"{path}: it refers to more than {MAX_USD_LAYERS} files; flatten it")
            try:
                check_regular(file)
            except OSError as error:
                raise FieldError(
                    f"{path}: it refers to {asset!s:.80}, which cannot be read "
                    f"({error.strerror or error}); put it there or flatten it"
                ) from None
            found = usd.Sdf.Layer.FindOrOpen(name)
            if found is None:
                raise FieldError(f"{path}: it refers to {asset!s:.80}, no USD that can be read; flatten it")
            pending.append(found)


def _time(usd: Any, path: Path, stage: Any, time_code: float | None) -> Any:
    if time_code is None:
        if stage.HasAuthoredTimeCodeRange():
            return usd.Usd.TimeCode(stage.GetStartTimeCode())
        return usd.Usd.TimeCode.EarliestTime()
    low, high = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    if stage.HasAuthoredTimeCodeRange() and not low <= time_code <= high:
        raise FieldError(f"{path}: it has no time code {time_code:g}; give one from {low:g} to {high:g}")
    return usd.Usd.TimeCode(time_code)


def _stage_matrix(usd: Any, path: Path, stage: Any) -> Array:
    """Matrix [4,4] from the stage's axes and units to y up and meters; a warning names both."""
    matrix = np.eye(4)
    if str(usd.UsdGeom.GetStageUpAxis(stage)) == "Z":
        matrix = _Z_UP.copy()
        warnings.warn(f"{path}: z is up; its splats are turned by a quarter turn about x", stacklevel=4)
    unit = float(usd.UsdGeom.GetStageMetersPerUnit(stage))
    if not usd.UsdGeom.StageHasAuthoredMetersPerUnit(stage) or unit == 1.0:
        return matrix
    if not 1e-12 < unit < 1e12:
        raise FieldError(f"{path}: its metersPerUnit is {unit:g}; it must be a length, such as 1 or 0.01")
    warnings.warn(f"{path}: its unit is {unit:g} m; its splats are scaled to meters", stacklevel=4)
    return np.diag([unit, unit, unit, 1.0]) @ matrix


def _part(path: Path, prim: Any, time: Any, matrix: Array) -> UsdSplats:
    """Values of a prim's attributes, of equal numbers of splats."""

    def values(name: str, width: int) -> AnyArray | None:
        for suffix in ("", "h"):
            found = prim.GetAttribute(name + suffix).Get(time) if prim.HasAttribute(name + suffix) else None
            if found is not None and len(found):
                rows = np.asarray(found)
                return rows.reshape(-1, width) if width > 1 else rows.reshape(-1)
        return None

    name = prim.GetPath()
    means = values("positions", 3)
    if means is None:
        means = np.zeros((0, 3), np.float32)
    count = len(means)
    if (lacking := memory_shortage(4 * count)) is not None:
        raise FieldError(f"{path}: its splats are too many: {lacking}")
    quaternions, scales, opacities = values("orientations", 4), values("scales", 3), values("opacities", 1)
    for attribute, rows in (("orientations", quaternions), ("scales", scales), ("opacities", opacities)):
        if rows is not None and len(rows) != count:
            raise ValueError(f"{name} has {count} positions and {len(rows)} {attribute}")
    if not np.isfinite(matrix).all():
        raise ValueError(f"the transform of {name} has no numbers")
    return UsdSplats(means, quaternions, scales, opacities, _harmonics(prim, time, values, count), matrix)


def _harmonics(prim: Any, time: Any, values: Any, count: int) -> AnyArray:
    """Harmonics [n,K,3]; of the display color where there are none, else gray."""
    sh = values(SH_COEFFICIENTS, 3)
    if sh is not None:
        degree = int(prim.GetAttribute(SH_DEGREE).Get())
        if not 0 <= degree <= 20 or len(sh) != count * (degree + 1) ** 2:
            raise ValueError(
                f"{prim.GetPath()} has {count} positions and {len(sh)} harmonics of degree {degree}"
            )
        return np.asarray(sh.reshape(count, (degree + 1) ** 2, 3))
    colors = values("primvars:displayColor", 3)
    if colors is None or len(colors) not in (1, count):
        colors = np.full((1, 3), 0.5)
    rgb = np.broadcast_to(colors, (count, 3))
    return ((rgb - 0.5) / spherical_harmonics.C0)[:, None]
