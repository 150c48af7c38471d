"""Splat files in PLY: the layout of 3D Gaussian splatting's own code, and PlayCanvas' compressed one.

3DGS: an element "vertex" with the columns x y z, f_dc_0..2, f_rest_0..(3K-1) (all of red, then green, then
blue, K = 0, 3, 8, 15 or 24), opacity (logit), scale_0..2 (natural logarithms), rot_0..3 (w x y z, of any
length), in any order, beside others. A file of 2DGS has no scale_2: its splats are flat. red, green, blue (0
to 255) stand in for f_dc. A comment says where the splats were trained with the antialiased filter:
"SplatRenderMode: mip" (Brush) or "antialiased 1" (Postshot).

Compressed: "chunk", one for each 256 splats, with min and max of x y z, of the logarithms of the scales and,
in files of 18 columns, of the colours; "vertex" with packed_position (11, 10, 11 bits), packed_rotation (the
index of the largest component in 2 bits, the other three in 10 each), packed_scale (11, 10, 11) and
packed_color (8 each, opacity last); where there are harmonics, "sh" with f_rest_* in 8 bits each.

Positions, axes and units are the file's.

Source: graphdeco-inria/gaussian-splatting, scene/gaussian_model.py; the PlayCanvas manual, "PLY" and
"Compressed PLY".
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cagefield import sh as spherical_harmonics
from cagefield.atomic_files import replaced_file
from cagefield.errors import FieldError
from cagefield.fields.splat import SplatField
from cagefield.ply import Columns, read_ply
from cagefield.typing import AnyArray

CHUNK = 256
"""Splats that share a chunk of a compressed file."""

LEAST_LOG_SCALE, MOST_LOG_SCALE = -30.0, 30.0
"""Logarithms of scales outside are cut, or, above, make the splat one that cannot be shown."""

FLAT = 1e-3
"""Third scale of a splat of 2DGS, against the smaller of its two."""

_REST = tuple(3 * ((degree + 1) ** 2 - 1) for degree in range(spherical_harmonics.MAX_DEGREE + 1))
"""Columns of harmonics above degree 0, by degree."""
_SHAPE = ("x", "y", "z", "opacity", "scale_0", "scale_1", "rot_0", "rot_1", "rot_2", "rot_3")


def read_splat_ply(path: str | Path) -> SplatField:
    """The splats of a PLY file, 3DGS' layout or compressed.

    Splats with a value that is no number are left out with one warning.

    Raises:
        FieldError: no such file, another kind of PLY, a file that is damaged or holds no splats.
    """
    path = Path(path)
    ply = read_ply(path)
    vertex = ply.elements.get("vertex", {})
    if "packed_position" in vertex:
        read = _unpacked(path, vertex, ply.elements.get("chunk", {}), ply.elements.get("sh", {}))
    else:
        read = _plain(path, vertex)
    means, log_scales, quaternions, opacities, coefficients = read
    log_scales = np.maximum(log_scales, LEAST_LOG_SCALE)
    norm = np.linalg.norm(quaternions, axis=1, keepdims=True)
    # A rotation of length 0 is how some programs write "not turned".
    quaternions = np.where(norm > 0.0, quaternions, (1.0, 0.0, 0.0, 0.0))
    good: NDArray[np.bool_] = np.asarray((log_scales <= MOST_LOG_SCALE).all(axis=1))
    with np.errstate(over="ignore"):
        for values in (means, log_scales, quaternions, opacities, coefficients):
            good &= np.isfinite(values.astype(np.float32)).all(axis=tuple(range(1, values.ndim)))
    if not good.any():
        raise FieldError(f"{path}: it holds no splat that can be shown; export the file again")
    if not good.all():
        bad = np.count_nonzero(~good)
        warnings.warn(f"{path}: {bad} of {len(good)} splats hold no numbers and are left out", stacklevel=2)
    return SplatField(
        means[good],
        log_scales[good],
        quaternions[good],
        opacities[good],
        coefficients[good],
        antialiased=_says_antialiased(ply.comments),
    )


def write_splat_ply(path: str | Path, field: SplatField) -> None:
    """Writes the splats in 3DGS' layout, complete or not at all."""
    rest = np.zeros((len(field), 0)) if field.sh_degree == 0 else field.sh[:, 1:].transpose(0, 2, 1)
    opacity = np.clip(field.opacities.astype(np.float64), 1e-7, 1.0 - 1e-7)
    groups: Sequence[tuple[Sequence[str], AnyArray]] = (
        (("x", "y", "z"), field.means),
        (("nx", "ny", "nz"), np.zeros((len(field), 3))),
        (_names("f_dc_", 3), field.sh[:, 0]),
        (_names("f_rest_", 3 * (field.sh.shape[1] - 1)), rest),
        (("opacity",), np.log(opacity / (1.0 - opacity))),
        (_names("scale_", 3), field.log_scales),
        (_names("rot_", 4), field.quaternions),
    )
    names = [name for group, _ in groups for name in group]
    table = np.concatenate([values.reshape(len(field), -1) for _, values in groups], axis=1)
    header = ["ply", "format binary_little_endian 1.0", "comment written by cagefield"]
    header += ["comment SplatRenderMode: mip"] if field.antialiased else []
    header += [f"element vertex {len(field)}", *(f"property float {name}" for name in names), "end_header"]
    with replaced_file(Path(path)) as temporary:
        temporary.write_bytes("\n".join([*header, ""]).encode() + table.astype("<f4").tobytes())


def _names(stem: str, count: int) -> tuple[str, ...]:
    return tuple(f"{stem}{index}" for index in range(count))


def _plain(path: Path, vertex: Columns) -> tuple[AnyArray, AnyArray, AnyArray, AnyArray, AnyArray]:
    """(means, log scales, quaternions, opacities, harmonics) of 3DGS' layout."""
    dc = _names("f_dc_", 3) if "f_dc_0" in vertex else ("red", "green", "blue")
    missing = [name for name in (*_SHAPE, *dc) if name not in vertex]
    if missing:
        raise FieldError(
            f"{path}: no file of splats, its vertices lack {', '.join(missing)}; a mesh or a point cloud "
            "cannot be imported"
        )
    colour = _stack(vertex, dc)
    if dc[0] == "red":
        colour = (colour / 255.0 - 0.5) / spherical_harmonics.C0
    log_scales = _stack(vertex, ("scale_0", "scale_1"))
    third = _stack(vertex, ("scale_2",)) if "scale_2" in vertex else log_scales.min(1)[:, None] + np.log(FLAT)
    with np.errstate(over="ignore"):
        opacities = 1.0 / (1.0 + np.exp(-_stack(vertex, ("opacity",))[:, 0]))
    return (
        _stack(vertex, ("x", "y", "z")),
        np.concatenate([log_scales, third], axis=1),
        _stack(vertex, _names("rot_", 4)),
        opacities,
        _harmonics(path, colour, vertex),
    )


def _harmonics(path: Path, dc: AnyArray, columns: Columns) -> AnyArray:
    """Coefficients [N,(degree+1)^2,3] of those of degree 0 [N,3] and the columns f_rest_*."""
    count = sum(name.startswith("f_rest_") for name in columns)
    if count not in _REST or any(name not in columns for name in _names("f_rest_", count)):
        raise FieldError(
            f"{path}: it has {count} columns f_rest_*, expected 0, 9, 24, 45 or 72; export it again"
        )
    if not count:
        return dc[:, None]
    rest = _stack(columns, _names("f_rest_", count)).reshape(len(dc), 3, count // 3)
    return np.concatenate([dc[:, None], rest.transpose(0, 2, 1)], axis=1)


def _unpacked(
    path: Path, vertex: Columns, chunk: Columns, harmonics: Columns
) -> tuple[AnyArray, AnyArray, AnyArray, AnyArray, AnyArray]:
    """(means, log scales, quaternions, opacities, harmonics) of a compressed file."""
    packed = ("packed_position", "packed_rotation", "packed_scale", "packed_color")
    limits = [f"{end}_{part}" for part in ("x", "scale_x") for end in ("min", "max")]
    missing = [name for name in packed if name not in vertex] + [name for name in limits if name not in chunk]
    if missing:
        raise FieldError(f"{path}: a compressed file that lacks {', '.join(missing)}; export it again")
    count, chunks = len(vertex["packed_position"]), len(chunk["min_x"])
    if chunks != -(-count // CHUNK):
        raise FieldError(
            f"{path}: {chunks} chunks for {count} splats, expected {-(-count // CHUNK)}; export it again"
        )
    if harmonics and len(next(iter(harmonics.values()))) != count:
        raise FieldError(f"{path}: its harmonics are not those of {count} splats; export it again")
    row = np.arange(count) // CHUNK
    position, rotation, scale, colour = (vertex[name].astype(np.uint32) for name in packed)
    rgba = _bits(colour, (24, 8), (16, 8), (8, 8), (0, 8))
    rgb = _between(chunk, "", "rgb", row, rgba[:, :3]) if "min_r" in chunk else rgba[:, :3]
    rest = {
        name: 8.0 * (np.where(values == 255, 1.0, np.where(values == 0, 0.0, (values + 0.5) / 256.0)) - 0.5)
        for name, values in ((name, values.astype(np.float64)) for name, values in harmonics.items())
    }
    return (
        _between(chunk, "", "xyz", row, _bits(position, (21, 11), (11, 10), (0, 11))),
        _between(chunk, "scale_", "xyz", row, _bits(scale, (21, 11), (11, 10), (0, 11))),
        _smallest_three(rotation),
        rgba[:, 3],
        _harmonics(path, (rgb - 0.5) / spherical_harmonics.C0, rest),
    )


def _bits(values: NDArray[np.uint32], *fields: tuple[int, int]) -> AnyArray:
    """Bit fields (shift, width) of numbers [N] as [N,fields] from 0 to 1."""
    return np.stack(
        [(values >> shift & (1 << width) - 1) / ((1 << width) - 1) for shift, width in fields], axis=1
    )


def _between(chunk: Columns, stem: str, parts: Iterable[str], row: AnyArray, share: AnyArray) -> AnyArray:
    """Values [N,3] at the given shares [N,3] of the way from their chunk's minimum to its maximum.

    A scale of 0 has the logarithm -inf, which is cut first: no value can lie between it and another.
    """
    low, high = (_stack(chunk, [f"{end}_{stem}{part}" for part in parts]) for end in ("min", "max"))
    if stem:
        low, high = (np.maximum(limit, LEAST_LOG_SCALE) for limit in (low, high))
    return low[row] * (1.0 - share) + high[row] * share


def _smallest_three(packed: NDArray[np.uint32]) -> AnyArray:
    """Quaternions [N,4] (w x y z) of three components, sqrt(2) (0..1 - .5), and the index of the largest."""
    others = (_bits(packed, (20, 10), (10, 10), (0, 10)) - 0.5) * np.sqrt(2.0)
    largest = (packed >> 30).astype(np.int64)
    quaternions = np.empty((len(packed), 4))
    places = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])[largest]
    np.put_along_axis(quaternions, places, others, axis=1)
    left = np.sqrt(np.maximum(0.0, 1.0 - (others**2).sum(axis=1)))
    np.put_along_axis(quaternions, largest[:, None], left[:, None], axis=1)
    return quaternions


def _stack(columns: Columns, names: Iterable[str]) -> AnyArray:
    return np.stack([columns[name].astype(np.float64) for name in names], axis=1)


def _says_antialiased(comments: Iterable[str]) -> bool:
    """Whether a comment says that the splats want the antialiased filter."""
    said = {comment.lower().replace(":", " ").replace("=", " ").strip() for comment in comments}
    return any(words.split() in (["splatrendermode", "mip"], ["antialiased", "1"]) for words in said)
