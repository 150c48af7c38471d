"""Difference that edits make to a page's splats: hidden ones, and new ones as the rasterizer draws them.

The page keeps the splats that it has loaded (`page_splats`) and lays these over them. With N splats of the
field, in the page's order, and M that come (moved ones, copies, the children of split ones):

    hidden       [ceil(N / 8)] uint8, bit n mod 8 of byte n / 8 is set where splat n is not shown as it is
    sources      [M] int32, the splat whose colors splat m has
    means        [M, 3] float32, in deformed space, less the field's center
    covariances  [M, 6] float32: xx, xy, xz, yy, yz, zz
    opacities    [2, M] uint8, high bytes first, of 65535 o
    gains        [M] int32: factors of the red, green and blue of a source's color, see
                 `encode_gains`; or, where an edit grades colors, [4, M], matrices: see `encode_colors`
    turns        [2, 3, M] uint8, see `page_splats.encode_orthogonals`: R; colors are those of the source
                 seen along R^T d

Where the header says `packed`, sources rise, and in the place of means and covariances there are `chunks`,
`means`, `rotations` and `scales` as in `page_splats`, of the splats' axes in deformed space: half the bytes,
for a file that is kept.

A whole difference to the field without edits is sent each time, so that the newest is right after any
earlier one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.quaternions import quaternions_from_matrices
from cagefield.pages.page_file import LEVEL, QUICK_LEVEL, pack, unpack
from cagefield.pages.page_splats import (
    CHUNK,
    ROTATION_BITS,
    SCALES,
    byte_pairs,
    decode_means,
    decode_rotations,
    decode_shapes,
    encode_means,
    encode_orthogonals,
    encode_shapes,
    from_byte_pairs,
    page_order,
)
from cagefield.rendering.splats.raster_splats import ChangedSplats, covariances_of
from cagefield.typing import Float32

MAGIC, VERSION = b"cagesped", 2


@dataclass(frozen=True)
class PageSplatEdits:
    """Decoded file: hidden [N], sources [M], means [M,3] less the center, covariances [M,6], opacities
    [M], turns [M,4] (w, x, y, z), gains [M,3]; colors [M,3,3] in place of gains where an edit grades them;
    mirrored [M], True where the orthogonal matrix is minus that of the turn."""

    hidden: NDArray[np.bool_]
    sources: NDArray[np.int32]
    means: Float32
    covariances: Float32
    opacities: Float32
    turns: Float32
    gains: Float32
    colors: Float32 | None = None
    mirrored: NDArray[np.bool_] | None = None


def encode_page_splat_edits(field: SplatField, changed: ChangedSplats, *, packed: bool = False) -> bytes:
    """File of the difference that edits make to a field."""
    order = page_order(field)
    place = np.empty(len(order), np.int32)
    place[order] = np.arange(len(order), dtype=np.int32)
    splats, sources = changed.splats, place[changed.sources]
    packed = packed and len(splats) > 0
    rows = np.argsort(sources, kind="stable") if packed else slice(None)
    turns = np.eye(3)[None] if splats.rotations is None else splats.rotations
    header = {"count": len(field), "changed": len(splats), "packed": packed, "log_scales": list(SCALES)}
    arrays: dict[str, NDArray[Any]] = {
        "hidden": np.packbits(changed.hidden[order], bitorder="little"),
        "sources": sources[rows],
    }
    if packed:
        arrays["chunks"], arrays["means"] = encode_means(splats.means[rows], field.center, field)
        log_scales, axes = axes_of(splats.covariances[rows])
        arrays.update(encode_shapes(quaternions_from_matrices(axes), log_scales, splats.opacities[rows]))
    else:
        arrays["means"] = (splats.means.astype(np.float64) - field.center).astype(np.float32)
        arrays["covariances"] = splats.covariances
        arrays["opacities"] = byte_pairs(np.round(65535.0 * splats.opacities.astype(np.float64)))
    orthogonals = np.broadcast_to(turns, (len(splats), 3, 3))[rows]
    arrays["turns"] = encode_orthogonals(orthogonals, bits=ROTATION_BITS if packed else 15)
    arrays["gains"] = gains_of(changed)[..., rows]
    return pack(MAGIC, VERSION, header, arrays, level=LEVEL if packed else QUICK_LEVEL)


def axes_of(covariances: Float32) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(logarithms of standard deviations [M,3], rotations [M,3,3] to their axes) of covariances [M,6]."""
    full = covariances[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3).astype(np.float64)
    variances, axes = np.linalg.eigh(full)
    axes[:, :, 2] *= np.linalg.det(axes)[:, None]
    return 0.5 * np.log(np.maximum(variances, 1e-30)), axes


GAIN_STEP = 1.0 / 128.0
"""Of the base-2 logarithm of a gain: half a percent."""


def gains_of(changed: ChangedSplats) -> NDArray[np.int32]:
    """The encoded gains [M] of changed splats, or their matrices [4,M] where an edit grades colors."""
    gains = np.ones((len(changed.sources), 3), np.float32) if changed.gains is None else changed.gains
    return encode_gains(gains) if changed.colors is None else encode_colors(changed.colors * gains[:, None])


def encode_gains(gains: Float32) -> NDArray[np.int32]:
    """Gains [M,3] as [M]: 10 bits each, red the lowest, of 512 + log2(gain) / GAIN_STEP."""
    codes = np.clip(512 + np.round(np.log2(np.maximum(gains, 1e-6)) / GAIN_STEP), 0, 1023).astype(np.int32)
    return np.asarray(codes[:, 0] | codes[:, 1] << np.int32(10) | codes[:, 2] << np.int32(20))


def decode_gains(codes: NDArray[np.int32]) -> Float32:
    """Gains [M,3] from codes of `encode_gains`."""
    parts = codes[:, None] >> np.array([0, 10, 20], np.int32) & np.int32(1023)
    return np.asarray(np.exp2((parts.astype(np.float32) - 512.0) * GAIN_STEP), np.float32)


COLOR_RANGES = np.array([0.0, 2.0, 8.0, 32.0])
"""Largest entry of an encoded color matrix, for the values 1 to 3 of its two highest bits."""


def encode_colors(matrices: Float32) -> NDArray[np.int32]:
    """Color matrices [M,3,3] as [4,M]: nine entries q = 8192 + 8191 m / range, 14 bits each.

    Row by row, word n has entries 2 n (bits 0 to 13) and 2 n + 1 (14 to 27). The last entry has its bits 0
    to 3 in bits 28 to 31 of word 1, 4 to 7 in those of word 2, 8 to 11 in those of word 3, and 12 and 13 in
    bits 28 and 29 of word 0, whose bits 30 and 31 say which of COLOR_RANGES is the range; gains have 0
    there.
    """
    m = matrices.reshape(-1, 9).astype(np.float64)
    largest = np.abs(m).max(axis=1, initial=0.0)
    kind = np.clip(np.searchsorted(COLOR_RANGES, largest), 1, 3)
    q = np.round(8192 + 8191 * m / COLOR_RANGES[kind][:, None])
    q = np.clip(q, 0, 16383).astype(np.uint32)
    words = [q[:, 2 * n] | q[:, 2 * n + 1] << np.uint32(14) for n in range(4)]
    words[0] |= q[:, 8] >> np.uint32(12) << np.uint32(28) | kind.astype(np.uint32) << np.uint32(30)
    for n in range(1, 4):
        words[n] |= (q[:, 8] >> np.uint32(4 * (n - 1)) & np.uint32(15)) << np.uint32(28)
    return np.stack(words).view(np.int32)


def decode_colors(codes: NDArray[np.int32]) -> Float32:
    """Color matrices [M,3,3] from codes [4,M] of `encode_colors`."""
    words = np.ascontiguousarray(codes).view(np.uint32)
    q = np.empty((words.shape[1], 9), np.uint32)
    q[:, 0:8:2], q[:, 1:8:2] = (words & 16383).T, (words >> 14 & 16383).T
    last = [words[0] >> 28 & 3, *(words[n] >> 28 for n in (3, 2, 1))]
    q[:, 8] = last[0] << 12 | last[1] << 8 | last[2] << 4 | last[3]
    size = COLOR_RANGES[words[0] >> 30][:, None]
    return np.asarray((q.astype(np.float64) - 8192) / 8191 * size, np.float32).reshape(-1, 3, 3)


def decode_page_splat_edits(data: bytes) -> PageSplatEdits:
    """Decoded file, with numbers as the page has them.

    Raises:
        FieldError: the file is of another kind or version, truncated or garbled.
    """
    header, arrays = unpack(data, MAGIC, VERSION, "edits of splats for pages")
    try:
        count, changed, packed = int(header["count"]), int(header["changed"]), bool(header["packed"])
        shapes: dict[str, tuple[int, ...]] = {
            "hidden": (-(-count // 8),),
            "sources": (changed,),
            "means": (len(arrays["means"]), 3, changed) if packed else (changed, 3),
            "opacities": (2, changed),
            "turns": (2, 3, changed),
            "gains": (4, changed) if arrays["gains"].ndim == 2 else (changed,),
        }
        if packed:
            pairs, chunks = (2, 3, changed), (-(-changed // CHUNK), 2, 3)
            shapes.update({"chunks": chunks, "rotations": pairs, "scales": pairs})
        else:
            shapes["covariances"] = (changed, 6)
        parts: dict[str, Any] = {name: arrays[name] for name in shapes}
    except (ValueError, KeyError, TypeError) as error:
        raise FieldError("garbled edits of splats for pages; write them again") from error
    if any(parts[name].shape != shape for name, shape in shapes.items()):
        raise FieldError("arrays of edits of splats for pages do not fit each other; write them again")
    if changed and not (parts["sources"].min() >= 0 and parts["sources"].max() < count):
        raise FieldError(f"sources of edits of splats must be 0 to {count - 1}; write them again")
    opacities = (from_byte_pairs(parts["opacities"]) / 65535.0).astype(np.float32)
    if packed:
        parts["means"] = decode_means(parts["chunks"], parts["means"], np.zeros(3))
        log_scales, quaternions, opacities = decode_shapes(parts)
        parts["covariances"] = covariances_of(quaternions, log_scales)
    return PageSplatEdits(
        np.unpackbits(parts["hidden"], count=count, bitorder="little").astype(bool),
        parts["sources"],
        parts["means"],
        parts["covariances"],
        opacities,
        decode_rotations(parts["turns"]),
        decode_gains(parts["gains"]) if parts["gains"].ndim == 1 else np.ones((changed, 3), np.float32),
        decode_colors(parts["gains"]) if parts["gains"].ndim == 2 else None,
        parts["turns"][0, 2] >= 128,
    )
