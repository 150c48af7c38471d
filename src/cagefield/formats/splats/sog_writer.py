"""Writer of splats as SOG of version 2; `sog` documents the images.

Scales, colors and harmonics are quantized by codebooks: cluster centers in one dimension (Lloyd), and for
harmonics a palette of cluster centers in 3K dimensions (k-means on a sample of the splats).
"""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from cagefield.files.atomic import replaced_file
from cagefield.formats.splats.detection import META
from cagefield.formats.splats.sog import PALETTE_WIDTH_CENTROIDS
from cagefield.formats.splats.splat_table import OnProgress, SplatTable
from cagefield.typing import AnyArray, Float32

MAX_SAMPLE_SPLATS = 1 << 18
"""Maximum number of splats that codebooks and palettes are computed from."""

PALETTE_SIZE_RANGE = (1024, 1 << 16)
"""Minimum and maximum number of centroids of harmonics."""

MAX_MULTIPLICATIONS = 3e11
"""Maximum number of multiplications of the assignment to a palette; it bounds the palette's size."""

KMEANS_ROUNDS = 10
"""Number of k-means iterations."""

_OTHERS = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])


def write_sog(path: Path, table: SplatTable, on_progress: OnProgress = lambda _: None) -> None:
    """Write the splats as one .sog file, complete or not at all."""
    contents = sog_files(table, on_progress)
    with replaced_file(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_STORED) as archive:
        for name, content in contents.items():
            # A fixed date makes files of equal splats equal.
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), content)
    on_progress(1.0)


def sog_files(table: SplatTable, on_progress: OnProgress = lambda _: None) -> dict[str, bytes]:
    """Files of a SOG by name, meta.json first: the content of a .sog, or of a folder.

    Splats are in the order of the table's sorted batches.
    """
    count = table.count
    low, high = _limits(table)
    scale_book, color_book, palette, codes = _codebooks(table)
    on_progress(0.3)
    size = _image_size(count)
    means_l, means_u, scales = (np.zeros((size[0] * size[1], 3), np.uint8) for _ in range(3))
    quats, sh0 = (np.zeros((size[0] * size[1], 4), np.uint8) for _ in range(2))
    labels = np.zeros((size[0] * size[1], 3), np.uint8)
    first = 0
    for batch in table.sorted_batches():
        here = slice(first, first + len(batch))
        share = (_signed_log(batch.means) - low) / np.where(high > low, high - low, 1.0)
        whole = np.clip(np.round(share * 65535.0), 0, 65535).astype(np.uint16)
        means_l[here], means_u[here] = whole & 255, whole >> 8
        scales[here] = _nearest_codes(batch.log_scales, scale_book)
        quats[here] = _encode_smallest_three(batch.quaternions)
        sh0[here, :3] = _nearest_codes(batch.sh[:, 0], color_book)
        sh0[here, 3] = np.clip(np.round(batch.opacities * 255.0), 0, 255)
        if palette is not None:
            label = _nearest_centers(batch.sh[:, 1:].reshape(len(batch), -1).astype(np.float32), palette)
            labels[here, 0], labels[here, 1] = label & 255, label >> 8
        first += len(batch)
        on_progress(0.3 + 0.5 * first / count)
    images = {"means_l.webp": means_l, "means_u.webp": means_u, "scales.webp": scales}
    images |= {"quats.webp": quats, "sh0.webp": sh0}
    meta: dict[str, Any] = {
        "version": 2,
        "asset": {"generator": "cagefield"},
        "count": count,
        "antialias": table.antialiased,
        "means": {"mins": low.tolist(), "maxs": high.tolist(), "files": ["means_l.webp", "means_u.webp"]},
        "scales": {"codebook": scale_book.tolist(), "files": ["scales.webp"]},
        "quats": {"files": ["quats.webp"]},
        "sh0": {"codebook": color_book.tolist(), "files": ["sh0.webp"]},
    }
    contents = {}
    if palette is not None and codes is not None:
        files = ["shN_centroids.webp", "shN_labels.webp"]
        bands = int(np.sqrt(palette.shape[1] // 3 + 1)) - 1
        book = {"count": len(palette), "bands": bands, "codebook": codes.tolist(), "files": files}
        meta["shN"] = book
        contents[files[0]] = _webp(_centroid_image(palette, codes))
        images[files[1]] = labels
    for name, pixels in images.items():
        contents[name] = _webp(pixels.reshape(*size, -1))
    on_progress(0.95)
    return {META: json.dumps(meta).encode(), **contents}


def _signed_log(values: AnyArray) -> AnyArray:
    wide = values.astype(np.float64)
    return np.asarray(np.sign(wide) * np.log1p(np.abs(wide)))


def _limits(table: SplatTable) -> tuple[AnyArray, AnyArray]:
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for batch in table.batches():
        low, high = np.minimum(low, batch.means.min(axis=0)), np.maximum(high, batch.means.max(axis=0))
    return _signed_log(low), _signed_log(high)


def _image_size(count: int) -> tuple[int, int]:
    """(height, width) of the images, multiples of 4."""
    width = int(np.ceil(np.sqrt(count) / 4)) * 4
    return int(np.ceil(count / width / 4)) * 4, width


def _codebooks(table: SplatTable) -> tuple[AnyArray, AnyArray, Float32 | None, AnyArray | None]:
    """(codebook of scales, codebook of colors, palette [P,3K] of harmonics or None, its codebook)."""
    rng, stride = np.random.default_rng(0), max(1, table.count // MAX_SAMPLE_SPLATS)
    parts = [batch.take(slice(None, None, stride)) for batch in table.batches()]
    scales = np.concatenate([part.log_scales for part in parts])
    colors = np.concatenate([part.sh[:, 0] for part in parts])
    above = (table.sh_degree + 1) ** 2 - 1
    books = build_codebook(scales), build_codebook(colors)
    if not above:
        return *books, None, None
    rest = np.concatenate([part.sh[:, 1:].reshape(len(part), -1) for part in parts]).astype(np.float32)
    fits = MAX_MULTIPLICATIONS / (table.count * 3 * above)
    target_size = int(2 ** np.floor(np.log2(np.clip(min(fits, len(rest) / 4), *PALETTE_SIZE_RANGE))))
    palette = kmeans(rest[rng.permutation(len(rest))], min(target_size, len(rest)))
    codes = build_codebook(palette)
    return *books, palette, codes


def build_codebook(values: AnyArray, size: int = 256, rounds: int = 20) -> AnyArray:
    """Codebook of `size` ascending values that quantizes the values [...]; Lloyd's algorithm."""
    ordered = np.sort(values.reshape(-1).astype(np.float64))
    sums = np.concatenate([[0.0], np.cumsum(ordered)])
    spread = np.linspace(ordered[0], ordered[-1], size)
    book = np.sort(0.5 * (np.quantile(ordered, (np.arange(size) + 0.5) / size) + spread))
    for _ in range(rounds):
        edges = np.searchsorted(ordered, 0.5 * (book[1:] + book[:-1]))
        edges = np.concatenate([[0], edges, [len(ordered)]])
        count = np.diff(edges)
        mean = np.diff(sums[edges]) / np.maximum(count, 1)
        book = np.sort(np.where(count > 0, mean, book))
    return book.astype(np.float32).astype(np.float64)


def _nearest_codes(values: AnyArray, book: AnyArray) -> NDArray[np.uint8]:
    return np.searchsorted(0.5 * (book[1:] + book[:-1]), values.astype(np.float64)).astype(np.uint8)


def kmeans(rows: Float32, count: int) -> Float32:
    """Cluster centers [count,D] of rows [N,D], initialized with the first rows."""
    centers = rows[:count].copy()
    for _ in range(KMEANS_ROUNDS):
        label = _nearest_centers(rows, centers)
        sizes = np.bincount(label, minlength=count)
        order = np.argsort(label, kind="stable")
        starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])
        used = np.flatnonzero(sizes)
        sums = np.add.reduceat(rows[order].astype(np.float64), starts[used], axis=0)
        centers[used] = sums / sizes[used, None]
    return centers


def _nearest_centers(rows: Float32, centers: Float32) -> NDArray[np.int64]:
    """Index [N] of the nearest center of each row."""
    half = 0.5 * (centers**2).sum(axis=1)
    step = max(1, (1 << 24) // len(centers))
    return np.concatenate(
        [(half - rows[n : n + step] @ centers.T).argmin(axis=1) for n in range(0, len(rows), step)]
        or [np.zeros(0, np.int64)]
    )


def _centroid_image(palette: Float32, codes: AnyArray) -> NDArray[np.uint8]:
    above = palette.shape[1] // 3
    height = -(-len(palette) // PALETTE_WIDTH_CENTROIDS)
    pixels = np.zeros((height * PALETTE_WIDTH_CENTROIDS, above, 3), np.uint8)
    pixels[: len(palette)] = _nearest_codes(palette, codes).reshape(-1, above, 3)
    return pixels.reshape(height, PALETTE_WIDTH_CENTROIDS * above, 3)


def _encode_smallest_three(quaternions: AnyArray) -> NDArray[np.uint8]:
    q = quaternions.astype(np.float64)
    largest = np.abs(q).argmax(axis=1)
    q = q * np.where(np.take_along_axis(q, largest[:, None], axis=1) < 0.0, -1.0, 1.0)
    others = np.take_along_axis(q, _OTHERS[largest], axis=1)
    pixels = np.clip(np.round((others / np.sqrt(2.0) + 0.5) * 255.0), 0, 255)
    return np.concatenate([pixels, 252.0 + largest[:, None]], axis=1).astype(np.uint8)


def _webp(pixels: NDArray[np.uint8]) -> bytes:
    out = io.BytesIO()
    # `exact` preserves colors of pixels with opacity 0.
    Image.fromarray(pixels).save(out, "WEBP", lossless=True, quality=60, method=3, exact=True)
    return out.getvalue()
