"""A SplatField as the page's GPU draws it: quantized records, deflated, in levels from coarse to fine.

Why a renderer of our own (`web/src/splats`) and not Spark 2.2, which draws splats in three.js: its pictures
are 27 to 50 dB from our rasterizer's, and 40 to 66 dB with every option set like ours
(`benchmarks/results/splat_spark.md`), where ours are 50 to 66; it evaluates color before a splat is moved,
so that edits would show the colors of other directions; it gives no depth, which the editor's lines, cages
and moving pictures need; and its module is 2.7 MB, where ours is 30 kB.

A level is some of the splats, drawn with those before it: splats of the largest area come first, so that the
start of
a file is a coarse image. In a level, splats lie in an order in which neighbors in space are neighbors
(`page_order`), in chunks of CHUNK. With M splats, C chunks and K coefficients a channel, a level has

    chunks     [C, 2, 3] float32, least and largest of the means of a chunk, less the header's `center`
    means      [B, 3, M] uint8, bytes, high ones first, of q: mean = least + (largest - least) q / (256^B - 1)
    rotations  [2, 3, M] uint8, see `encode_rotations`
    scales     [2, 3, M] uint8, of 65535 (log s - low) / (high - low), with the header's `log_scales`
    opacities  [2, M] uint8, of 65535 o
    colors    [2, 3, M] uint8, of 32768 + k0 / step, with the header's `color_step`
    sh         [K - 1, 3, M] uint8, 128 + k / steps[k - 1], with the header's `steps`, from degree 1 on

Where there are two bytes of a number, the high ones come first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.weak_memo import memoized_weakly
from cagefield.errors import FieldError
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.morton import morton_codes
from cagefield.geometry.quaternions import quaternions_from_matrices
from cagefield.pages.page_file import pack, unpack
from cagefield.rendering.splats.rasterizer import near_depth
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.typing import AnyArray, Float32

MAGIC, VERSION = b"cagespla", 1

CHUNK = 256
"""Splats whose means share their bounds."""

FIRST, GROWTH = 32_768, 8
"""Splats of the coarsest level, at most, and how many times as many the next one ends at."""

OFF = 1e-4
"""Means are off by at most this share of their distance from the middle, of half the box's diagonal for those
nearer: a tenth of a pixel of a picture of 800 that shows the box. Two bytes are enough but for fields with
splats far apart."""

ROTATION_BITS, SCALE_BITS, OPACITY_BITS, COLOR_STEP = 12, 12, 10, 1.0 / 256.0
SH_STEP = 0.01
"""How finely a splat is told; SH_STEP is the smallest step of the coefficients from degree 1 on.

PSNR of pictures of 800x600 in dB, and bytes a splat, of a capture of 152,746 splats of degree 0, of 4,721 of
degree 3 and of 1,873 of degree 2, the last with SH_STEP 0.02:

    as it is            71.5, 19.7      55.3, 47.3      60.2, 37.3
    ROTATION_BITS 8     67.7, 18.4                      50.1, 35.6
    SCALE_BITS 8        57.5, 19.6                      51.0, 34.7
    SH_STEP 0.02                        49.7, 41.5
    SH_STEP 0.04                        41.0, 35.7      54.9, 34.8
"""

SCALES = (-20.0, 12.0)
"""Logarithms of standard deviations outside are cut."""


@dataclass(frozen=True)
class PageSplats:
    """Contents of a page's splat file: the splats in the page's order, levels one after the other.

    `ends` [L] are the numbers of splats with which each level ends; background None is nothing behind them.
    """

    field: SplatField
    ends: tuple[int, ...]
    background: tuple[float, float, float] | None


def page_order(field: SplatField) -> NDArray[np.int64]:
    """The rows [N] of a field in the order of its page's file; kept while the field lives."""
    return _layout(field)[0]


def encode_page_splats(
    splats: SplatField | SplatSet, *, background: tuple[float, float, float] | None = (1.0, 1.0, 1.0)
) -> bytes:
    """The file of splats. Raises FieldError for a field without splats, and for one of discs.

    Pasted splats (`SplatSet.with_pastes`) have opacity 0 in it: the file of the edits shows them.
    """
    splats = SplatSet.from_field(splats)
    field = splats.field
    if not len(field):
        raise FieldError("the field is empty: it has no splats to show")
    if field.discs:
        raise FieldError("the server draws this scene: its splats are discs (2DGS), which pages do not draw")
    order, ends = _layout(field)
    center = field.center
    shown = np.where(splats.is_pasted, np.float32(0.0), field.opacities)
    steps = coefficient_steps(field)
    arrays = {}
    for number, (first, end) in enumerate(zip((0, *ends), ends, strict=False)):
        parts = encode_level(field, order[first:end], shown, center, steps, field)
        arrays.update({f"{number}.{name}": part for name, part in parts.items()})
    return pack(MAGIC, VERSION, splat_header(field, center, steps, background, list(ends)), arrays)


def coefficient_steps(field: SplatField) -> NDArray[np.float64]:
    """Steps [K - 1] of the 8-bit values of coefficients from degree 1 on."""
    return np.asarray(np.maximum(np.abs(field.sh[:, 1:]).max(axis=(0, 2), initial=0.0) / 127.0, SH_STEP))


def encode_level(
    field: SplatField,
    rows: NDArray[np.int64],
    opacities: AnyArray,
    center: AnyArray,
    steps: AnyArray,
    whole: SplatField,
) -> dict[str, NDArray[Any]]:
    """Arrays of a level with some rows of a field; means are as exact as those of the `whole` field."""
    chunks, means = encode_means(field.means[rows], center, whole)
    return {
        "chunks": chunks,
        "means": means,
        **encode_shapes(field.quaternions[rows], field.log_scales[rows], opacities[rows]),
        "colors": byte_pairs(np.clip(32768 + np.round(field.sh[rows, 0] / COLOR_STEP), 0, 65535).T),
        "sh": np.clip(128 + np.round(field.sh[rows, 1:] / steps[:, None]), 0, 255)
        .astype(np.uint8)
        .transpose(1, 2, 0),
    }


def splat_header(
    field: SplatField,
    center: AnyArray,
    steps: AnyArray,
    background: tuple[float, float, float] | None,
    levels: list[int],
) -> dict[str, Any]:
    """Header of a file of splats."""
    return {
        "count": len(field),
        "degree": field.sh_degree,
        "antialiased": field.antialiased,
        "bounds": field.bounds.tolist(),
        "center": center.tolist(),
        "near": near_depth(field.bounds),
        "background": None if background is None else list(background),
        "log_scales": list(SCALES),
        "color_step": COLOR_STEP,
        "steps": [float(step) for step in steps],
        "levels": levels,
    }


def decode_page_splats(data: bytes) -> PageSplats:
    """Decoded file, with numbers as the page has them.

    Raises:
        FieldError: the file is of another kind or version, truncated or garbled.
    """
    header, arrays = unpack(data, MAGIC, VERSION, "splats for pages")
    try:
        ends = tuple(int(end) for end in header["levels"])
        levels = [
            _decode_level(header, {name: arrays[f"{number}.{name}"] for name in _PARTS}, end - first)
            for number, (first, end) in enumerate(zip((0, *ends), ends, strict=False))
        ]
        means, log_scales, quaternions, opacities, sh = (
            np.concatenate([level[n] for level in levels]) for n in range(5)
        )
        field = SplatField(
            means,
            log_scales,
            quaternions,
            opacities,
            sh,
            antialiased=bool(header["antialiased"]),
            bounds=np.asarray(header["bounds"], np.float64),
        )
        background = header["background"]
        return PageSplats(field, ends, None if background is None else tuple(background))
    except FieldError:
        raise
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise FieldError("garbled splats for pages; write them again") from error


_PARTS = ("chunks", "means", "rotations", "scales", "opacities", "colors", "sh")


def encode_means(means: AnyArray, center: AnyArray, field: SplatField) -> tuple[Float32, NDArray[np.uint8]]:
    """(chunks [C,2,3], bytes [B,3,M]) of means [M,3]; as many bytes as OFF asks for."""
    local = means.astype(np.float64) - center
    starts = np.arange(0, len(local), CHUNK)
    # Rounded outwards, so that no mean lies outside.
    low = np.nextafter(np.minimum.reduceat(local, starts).astype(np.float32), np.float32(-np.inf))
    high = np.nextafter(np.maximum.reduceat(local, starts).astype(np.float32), np.float32(np.inf))
    own = np.arange(len(local)) // CHUNK
    size = (high.astype(np.float64) - low)[own]
    away = np.maximum(np.linalg.norm(local, axis=1), float(np.linalg.norm(field.half_size)))
    count = 2 if (0.5 * size.max(axis=1) / 65535 <= OFF * away).all() else 3
    whole = np.round((local - low[own]) / size * (256**count - 1)).astype(np.uint32)
    shifts = np.arange(8 * (count - 1), -1, -8, dtype=np.uint32)
    planes = (whole.T[None] >> shifts[:, None, None]).astype(np.uint8)
    return np.stack([low, high], axis=1), planes


def decode_means(chunks: Float32, planes: NDArray[np.uint8], center: AnyArray) -> Float32:
    """Means [M,3] from values of `encode_means`."""
    whole = np.zeros(planes.shape[1:], np.float64)
    for plane in planes:
        whole = 256.0 * whole + plane
    own = np.arange(planes.shape[2]) // CHUNK
    low, high = chunks[own, 0].astype(np.float64), chunks[own, 1].astype(np.float64)
    return np.asarray(low + (high - low) * whole.T / (256.0 ** len(planes) - 1.0) + center, np.float32)


def encode_shapes(
    quaternions: AnyArray, log_scales: AnyArray, opacities: AnyArray
) -> dict[str, NDArray[np.uint8]]:
    """Rotations, scales and opacities of M splats as a level has them."""
    low, high = SCALES
    share = np.clip((log_scales.astype(np.float64) - low) / (high - low), 0.0, 1.0)
    return {
        "rotations": encode_rotations(quaternions),
        "scales": byte_pairs(_rounded(share, SCALE_BITS).T),
        "opacities": byte_pairs(_rounded(opacities.astype(np.float64), OPACITY_BITS)),
    }


def decode_shapes(parts: dict[str, NDArray[Any]]) -> tuple[Float32, Float32, Float32]:
    """(log scales [M,3], quaternions [M,4], opacities [M]) of a level's parts."""
    low, high = SCALES
    scales = low + (high - low) * from_byte_pairs(parts["scales"]).T / 65535.0
    opacities = from_byte_pairs(parts["opacities"]) / 65535.0
    return scales.astype(np.float32), decode_rotations(parts["rotations"]), opacities.astype(np.float32)


def encode_rotations(quaternions: AnyArray, bits: int = ROTATION_BITS) -> NDArray[np.uint8]:
    """Rotations [2,3,M] of unit quaternions [M,4]: the three smaller numbers, with the sign of the largest.

    Each has 15 bits, of which `bits` are used: 16384 + 16383 sqrt(2) c. The highest bits of the first two say
    which one is left out.
    """
    q = np.asarray(quaternions, np.float64)
    left = np.abs(q).argmax(axis=1)
    sign = np.where(np.take_along_axis(q, left[:, None], axis=1) < 0.0, -1.0, 1.0)
    others = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])[left]
    three = np.take_along_axis(q * sign, others, axis=1)
    coarse = 2.0 ** (15 - bits)
    whole = 16384 + coarse * np.round(16383 * np.sqrt(2.0) * three / coarse)
    codes = np.clip(whole, 0, 32767).astype(np.uint16)
    codes[:, 0] |= ((left & 1) << 15).astype(np.uint16)
    codes[:, 1] |= ((left >> 1) << 15).astype(np.uint16)
    return byte_pairs(codes.T)


def encode_orthogonals(matrices: AnyArray, bits: int = ROTATION_BITS) -> NDArray[np.uint8]:
    """Orthogonal matrices [M,3,3] as [2,3,M]: of a reflection O the rotation -O, with the third number's
    highest bit set.
    """
    turned_over = np.linalg.det(matrices) < 0.0
    rotations = np.where(turned_over[:, None, None], -matrices, matrices)
    pairs = encode_rotations(quaternions_from_matrices(rotations), bits)
    pairs[0, 2] |= np.where(turned_over, np.uint8(128), np.uint8(0))
    return pairs


def decode_rotations(pairs: NDArray[np.uint8]) -> Float32:
    """The unit quaternions [M,4] of `encode_rotations`."""
    codes = from_byte_pairs(pairs).astype(np.int64)
    left = (codes[0] >> 15) + 2 * (codes[1] >> 15)
    three = ((codes & 32767).T - 16384.0) / (16383.0 * np.sqrt(2.0))
    q = np.empty((len(left), 4))
    others = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])[left]
    np.put_along_axis(q, others, three, axis=1)
    largest = np.sqrt(np.maximum(0.0, 1.0 - np.square(three).sum(axis=1)))
    np.put_along_axis(q, left[:, None], largest[:, None], axis=1)
    return q.astype(np.float32)


def _decode_level(header: dict[str, Any], parts: dict[str, NDArray[Any]], count: int) -> tuple[AnyArray, ...]:
    shapes = {
        "chunks": (-(-count // CHUNK), 2, 3),
        "means": (len(parts["means"]), 3, count),
        "rotations": (2, 3, count),
        "scales": (2, 3, count),
        "opacities": (2, count),
        "colors": (2, 3, count),
        "sh": ((int(header["degree"]) + 1) ** 2 - 1, 3, count),
    }
    if any(parts[name].shape != shape for name, shape in shapes.items()):
        raise FieldError("arrays of splats for pages do not fit each other; write them again")
    means = decode_means(parts["chunks"], parts["means"], np.asarray(header["center"], np.float64))
    log_scales, quaternions, opacities = decode_shapes(parts)
    first = (from_byte_pairs(parts["colors"]).T - 32768.0) * float(header["color_step"])
    steps = np.asarray(header["steps"], np.float64)
    rest = (parts["sh"].transpose(2, 0, 1).astype(np.float64) - 128.0) * steps[:, None]
    sh = np.concatenate([first[:, None], rest], axis=1).astype(np.float32)
    return means, log_scales, quaternions, opacities, sh


@memoized_weakly
def _layout(field: SplatField) -> tuple[NDArray[np.int64], tuple[int, ...]]:
    """(rows [N] in a page's order, where levels end)."""
    codes = morton_codes(field.means, field.means.min(axis=0), field.means.max(axis=0))
    # The largest coverage comes first: opacity times the area across the thinnest axis.
    two = np.sort(field.log_scales, axis=1)[:, 1:].sum(axis=1)
    first = np.argsort(-(np.log(np.maximum(field.opacities, 1e-6)) + two), kind="stable")
    ends, end = [], FIRST
    while end < len(field):
        ends.append(end)
        end *= GROWTH
    ends.append(len(field))
    parts = [first[start:end] for start, end in zip((0, *ends), ends, strict=False)]
    order = np.concatenate([part[np.argsort(codes[part], kind="stable")] for part in parts])
    order.setflags(write=False)
    return order, tuple(ends)


def _rounded(share: AnyArray, bits: int) -> AnyArray:
    """Shares in [0, 1] as numbers up to 65535, 2^bits different ones."""
    steps = 2**bits - 1
    return np.round(np.round(share * steps) * (65535.0 / steps))


def byte_pairs(whole: AnyArray) -> NDArray[np.uint8]:
    """The high bytes of whole numbers below 65536, and their low ones: [2, ...]."""
    codes = np.ascontiguousarray(whole).astype(np.uint16)
    return np.stack([codes >> 8, codes & 255]).astype(np.uint8)


def from_byte_pairs(planes: NDArray[np.uint8]) -> NDArray[np.float64]:
    """The numbers of `byte_pairs`."""
    return 256.0 * planes[0] + planes[1]
