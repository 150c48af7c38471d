"""A VoxelField as the page's GPU draws it: 8 bits a color coefficient, half floats of density, deflated.

A file holds levels, each the whole field: a coarse one without view dependence, which is there soon, and the
full one. Of a level there are, with n vertices an axis and bricks of B^3 *vertices* (brick b holds the
vertices B b ... B b + B - 1):

    bricks     [ceil(n/B)...] uint8, 1 where the brick holds a vertex
    masks      [bricks, B^3 / 8] uint8, the vertices that are stored; bit v of a brick, z fastest, is bit
               v mod 8 of byte v / 8
    occupancy  [bx, by, bz] uint16, the codes of `rendering.voxels.occupancy`, which rays leap by
    density    [2, M] uint8, low and high bytes of float16 numbers: density in 1 / `unit`, the header's
    sh         [K, 3, M] uint8, each row the differences (mod 256) of q = 128 + round(c / steps[k]) from one
               vertex to the next; the first from 128

Vertices come brick by brick, z fastest inside. One without density in any of the 8 cells around it is left
out: no picture shows it. One that is not stored has density 0 and q = 128, which is exactly gray.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.weak_memo import memoized_weakly
from cagefield.errors import FieldError
from cagefield.fields.voxel_field import VoxelField
from cagefield.pages.page_file import byte_planes, from_byte_planes, pack, unpack
from cagefield.rendering.voxels.occupancy import of_field
from cagefield.typing import Float32

MAGIC, VERSION = b"cagepage", 1

BRICK = 8
"""Vertices along a brick's edge, and cells of the GPU's bricks; see `benchmarks/results/page_pictures.md`."""

COARSE = 64
"""Vertices along the longest axis of the coarse level: 0.1 to 0.5 MB."""

FINEST = 0.03
"""Smallest step of a color coefficient. Of a digger of a million vertices, degree 2:

    step                 range / 127    0.025    0.04    0.06
    bytes a vertex       15.0           11.1     9.0     7.2
    PSNR of pictures     68             62       58      54
"""

HALF_MAX = 65504.0

Level = tuple[dict[str, Any], dict[str, NDArray[Any]]]


@dataclass(frozen=True)
class PageField:
    """Contents of a page's field file: the levels of a field from coarse to full, and its display options.

    `step` is the distance between samples in voxels; background None is nothing behind the scene.
    """

    levels: tuple[VoxelField, ...]
    step: float
    background: tuple[float, float, float] | None

    @property
    def field(self) -> VoxelField:
        """The full level."""
        return self.levels[-1]


def encode_page_field(
    field: VoxelField, *, step: float = 0.5, background: tuple[float, float, float] | None = (1.0, 1.0, 1.0)
) -> bytes:
    """The file of a field. Raises FieldError for a field without density."""
    if not (field.density > 0.0).any():
        raise FieldError("the field is empty: it has no density to show; train it longer or prune less")
    fields = [field] if max(field.resolution) <= COARSE else [coarse_field(field, COARSE), field]
    levels, arrays = [], {}
    for number, each in enumerate(fields):
        header, parts = _encode_level(each)
        levels.append(header)
        arrays.update({f"{number}.{name}": part for name, part in parts.items()})
    header = {
        "bounds": field.bounds.tolist(),
        "contracted": field.contracted,
        "step": step,
        "background": None if background is None else list(background),
        "brick": BRICK,
        "levels": levels,
    }
    return pack(MAGIC, VERSION, header, arrays)


def decode_page_field(data: bytes) -> PageField:
    """Decoded file, with numbers as the page has them.

    Raises:
        FieldError: the file is of another kind or version, truncated or garbled.
    """
    header, arrays = unpack(data, MAGIC, VERSION, "a field for pages")
    try:
        if header["brick"] != BRICK:
            raise FieldError(f"bricks of {header['brick']} vertices, expected {BRICK}; write the file again")
        levels = tuple(
            _decode_level(level, header, {name: arrays[f"{number}.{name}"] for name in _PARTS})
            for number, level in enumerate(header["levels"])
        )
        background = header["background"]
        found = PageField(levels, float(header["step"]), None if background is None else tuple(background))
    except FieldError:
        raise
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise FieldError("a garbled field for pages; write it again") from error
    if not levels:
        raise FieldError("a field for pages without levels; write it again")
    return found


def coarse_field(field: VoxelField, longest: int) -> VoxelField:
    """The field on a grid of `longest` vertices along its longest axis, SH degree 0.

    Each vertex has the mean density of the vertices around it, so that optical depth is kept, and their
    color, weighted with density.
    """
    old = np.array(field.resolution)
    new = np.maximum(np.round((old - 1) * ((longest - 1) / (old.max() - 1))).astype(int) + 1, 2)
    ratio = (new - 1) / (old - 1)
    dense = field.density > 0.0
    fine = np.stack(np.unravel_index(field.vertices[dense], field.resolution), axis=1)
    at = np.floor(fine * ratio + 0.5).astype(int)
    places, slots = np.unique(np.ravel_multi_index(tuple(at.T), tuple(new)), return_inverse=True)
    weights = field.density[dense].astype(np.float64)
    density = np.bincount(slots, weights)
    sh = np.stack(
        [np.bincount(slots, weights * field.sh[dense, 0, channel]) / density for channel in range(3)], axis=1
    )
    return VoxelField(
        field.bounds,
        (int(new[0]), int(new[1]), int(new[2])),
        places,
        (density * ratio.prod()).astype(np.float32),
        sh[:, None].astype(np.float32),
        field.contracted,
    )


_PARTS = ("bricks", "masks", "occupancy", "density", "sh")


def _encode_level(field: VoxelField) -> Level:
    steps = steps_of(field)
    shown = _shown(field)
    parts = encode_vertices(
        field.vertices[shown],
        field.resolution,
        quantized_density(field.density[shown], field),
        quantized_colors(field.sh[shown], field),
    )
    codes = of_field(field).codes.astype(np.uint16)
    header = {
        "resolution": list(field.resolution),
        "vertices": parts["density"].shape[1],
        "unit": unit_of(field),
        "steps": [float(s) for s in steps],
        "dims": list(codes.shape),
    }
    return header, {
        "bricks": parts["bricks"],
        "masks": parts["masks"],
        "occupancy": codes,
        "density": parts["density"],
        "sh": parts["sh"],
    }


def unit_of(field: VoxelField) -> float:
    """Density of 1 in a field's file, in world units: one over the shortest edge of its voxels."""
    return 1.0 / float(field.voxel_size.min())


@memoized_weakly
def steps_of(field: VoxelField) -> Float32:
    """Steps [K] of a field's color coefficients, of which 127 reach the largest that a picture shows."""
    largest = np.abs(field.sh[_shown(field)]).max(axis=(0, 2), initial=0.0)
    return np.maximum(largest / 127.0, FINEST).astype(np.float32)


def quantized_density(density: Float32, field: VoxelField) -> NDArray[np.float16]:
    """Densities [M] as the file of a field has them."""
    return np.clip(density / unit_of(field), -HALF_MAX, HALF_MAX).astype(np.float16)


def quantized_colors(sh: Float32, field: VoxelField) -> NDArray[np.uint8]:
    """Coefficients [M,K,3] as the file of a field has them; those beyond its 127 steps are cut off."""
    whole = 128 + np.round(sh / steps_of(field)[:, None])
    return np.clip(whole, 0, 255).astype(np.uint8)


def encode_vertices(
    vertices: NDArray[np.int64],
    resolution: tuple[int, int, int],
    density: NDArray[np.float16],
    sh: NDArray[np.uint8],
) -> dict[str, NDArray[Any]]:
    """The arrays `bricks`, `masks`, `density` and `sh` of vertices of a grid.

    vertices [M]: linear indices, rising; density [M] and sh [M,K,3] quantized.
    """
    flat = np.zeros(int(np.prod(resolution)), bool)
    flat[vertices] = True
    order, masks = _in_bricks(flat, resolution)
    held = masks.any(axis=1)
    slot = np.searchsorted(vertices, order)
    return {
        "bricks": held.reshape(_bricks(resolution)).astype(np.uint8),
        "masks": np.packbits(masks[held], axis=1, bitorder="little"),
        "density": byte_planes(density[slot]),
        "sh": np.diff(sh[slot].transpose(1, 2, 0), axis=2, prepend=np.uint8(128)),
    }


def _decode_level(
    level: dict[str, Any], header: dict[str, Any], parts: dict[str, NDArray[Any]]
) -> VoxelField:
    resolution = tuple(int(n) for n in level["resolution"])
    if len(resolution) != 3 or not 2 <= min(resolution) <= max(resolution) <= 2048:
        raise FieldError(f"resolution {resolution} must be 3 numbers from 2 to 2048; write the file again")
    bricks = _bricks(resolution)
    held = parts["bricks"].reshape(bricks) > 0
    bits = np.unpackbits(parts["masks"], axis=1, bitorder="little").astype(bool)
    if bits.shape != (int(held.sum()), BRICK**3):
        raise FieldError("the masks do not fit the bricks of a field for pages; write it again")
    brick, local = np.nonzero(bits)
    corner = np.argwhere(held)[brick] * BRICK
    at = corner + np.stack(np.unravel_index(local, (BRICK,) * 3), axis=1)
    vertices = np.ravel_multi_index(tuple(at.T), resolution)
    half = from_byte_planes(parts["density"]).astype(np.float32)
    whole = np.cumsum(parts["sh"], axis=2, dtype=np.uint8) + np.uint8(128)
    steps = np.asarray(level["steps"], np.float32)
    sh = (whole.astype(np.float32) - 128.0) * steps[:, None, None]
    order = np.argsort(vertices)
    return VoxelField(
        np.asarray(header["bounds"], np.float64),
        (resolution[0], resolution[1], resolution[2]),
        vertices[order],
        (half * np.float32(level["unit"]))[order],
        np.ascontiguousarray(sh.transpose(2, 0, 1))[order],
        bool(header["contracted"]),
    )


def _shown(field: VoxelField) -> NDArray[np.bool_]:
    """Which stored vertices [M] have density in one of the 8 cells around them."""
    near = np.zeros(field.resolution, bool)
    near.reshape(-1)[field.vertices[field.density > 0.0]] = True
    # A cell with density makes all of its vertices count: within one step along each axis.
    for axis in range(3):
        grown = near.copy()
        to, off = [slice(None)] * 3, [slice(None)] * 3
        to[axis], off[axis] = slice(1, None), slice(None, -1)
        grown[tuple(to)] |= near[tuple(off)]
        grown[tuple(off)] |= near[tuple(to)]
        near = grown
    return np.asarray(near.reshape(-1)[field.vertices])


def _bricks(resolution: tuple[int, ...]) -> tuple[int, ...]:
    """Bricks along each axis."""
    return tuple(-(-n // BRICK) for n in resolution)


def _in_bricks(flat: NDArray[np.bool_], resolution: tuple[int, int, int]) -> tuple[NDArray[np.int64], Any]:
    """(linear indices [M] of the set vertices brick by brick, masks [bricks, B^3])."""
    bx, by, bz = _bricks(resolution)
    full = np.zeros((bx * BRICK, by * BRICK, bz * BRICK), bool)
    full[: resolution[0], : resolution[1], : resolution[2]] = flat.reshape(resolution)
    split = full.reshape(bx, BRICK, by, BRICK, bz, BRICK).transpose(0, 2, 4, 1, 3, 5)
    masks = np.ascontiguousarray(split).reshape(-1, BRICK**3)
    brick, local = np.nonzero(masks)
    corner = np.stack(np.unravel_index(brick, (bx, by, bz)), axis=1) * BRICK
    at = corner + np.stack(np.unravel_index(local, (BRICK,) * 3), axis=1)
    return np.ravel_multi_index(tuple(at.T), resolution), masks
