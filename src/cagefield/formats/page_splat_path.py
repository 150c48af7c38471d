"""The edits of a page of splats along its camera path: states, and straight ways from one to the next.

    times        [S] float32, seconds from the path's begin, rising
    states       [S] uint16, the state at each of these times; a state that comes again is stored once
    hidden.k     [ceil(N / 8)] uint8, as in `page_splat_edits`
    sources.k    [M] int32, rising. Entry n of the header's `hidden` and `sources` says which of them
                 state n has
    means.n      [2, 3, M] uint8, high bytes first, of 65535 (mean - low) / (high - low), in deformed space
                 less the field's centre; `low` and `high` are the header's, for all states
    rotations.n, scales.n, opacities.n   as in `page_splats`, of what the splats are there
    turns.n      [2, 3, M] uint8, as in `page_splat_edits`

Between two states, the k-th splat of a source has the mean of the k-th ones' means and covariances: splats
follow chords of their ways. What one of the states alone has is shown on its half of the way. The header's
`whole` is the state in which the edits have gone all the way, for which a page has their own file; -1 where
none is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.fields.splat import SplatField
from cagefield.formats.page_file import pack
from cagefield.formats.page_splats import SCALES, byte_pairs, encode_rotations, encode_shapes, page_order
from cagefield.quaternions import quaternions_of
from cagefield.rendering.deformed_splats import ChangedSplats
from cagefield.typing import Float32

MAGIC, VERSION = b"cagesppa", 1

SPLAT_BYTES = 26
"""Bytes of a splat in a state, before they are deflated, beside its source."""


@dataclass(frozen=True)
class SplatPathState:
    """What edits change at one moment: hidden [ceil(N/8)] and sources [M] as in the file; means [M,3]
    less the field's centre, covariances [M,6], opacities [M] and turns [M,4] (w, x, y, z)."""

    hidden: NDArray[np.uint8]
    sources: NDArray[np.int32]
    means: NDArray[np.float64]
    covariances: Float32
    opacities: Float32
    turns: NDArray[np.float64]

    @classmethod
    def of(cls, field: SplatField, changed: ChangedSplats) -> SplatPathState:
        """The state of what edits change of a field."""
        order = page_order(field)
        place = np.empty(len(order), np.int32)
        place[order] = np.arange(len(order), dtype=np.int32)
        sources = place[changed.sources]
        rows = np.argsort(sources, kind="stable")
        splats = changed.splats
        turns = np.eye(3)[None] if splats.rotations is None else splats.rotations
        return cls(
            np.packbits(changed.hidden[order], bitorder="little"),
            sources[rows],
            splats.means[rows].astype(np.float64) - field.center,
            splats.covariances[rows],
            splats.opacities[rows],
            np.broadcast_to(quaternions_of(turns), (len(splats), 4))[rows],
        )


def encode_page_splat_path(
    field: SplatField,
    times: Sequence[float],
    order: Sequence[int],
    states: Sequence[SplatPathState],
    whole: int | None,
) -> bytes:
    """The file of `states`, of which number `order[k]` is shown at `times[k]`."""
    arrays: dict[str, NDArray[Any]] = {
        "times": np.asarray(times, np.float32),
        "states": np.asarray(order, np.uint16),
    }
    held: dict[str, list[int]] = {"hidden": [], "sources": []}
    for name, numbers in held.items():
        known: dict[bytes, int] = {}
        for state in states:
            array = getattr(state, name)
            number = known.setdefault(array.tobytes(), len(known))
            arrays.setdefault(f"{name}.{number}", array)
            numbers.append(number)
    every = np.concatenate([state.means for state in states])
    low = every.min(axis=0) if len(every) else np.zeros(3)
    size = np.maximum(np.ptp(every, axis=0) if len(every) else np.ones(3), 1e-12)
    for n, state in enumerate(states):
        arrays[f"means.{n}"] = byte_pairs(np.round(65535.0 * (state.means - low) / size).T)
        log_scales, axes = axes_of(state.covariances)
        shapes = encode_shapes(quaternions_of(axes), log_scales, state.opacities)
        arrays.update({f"{name}.{n}": part for name, part in shapes.items()})
        arrays[f"turns.{n}"] = encode_rotations(state.turns, bits=15)
    header = {
        "count": len(field),
        "changed": [len(state.sources) for state in states],
        **held,
        "low": low.tolist(),
        "high": (low + size).tolist(),
        "log_scales": list(SCALES),
        "whole": -1 if whole is None else whole,
    }
    return pack(MAGIC, VERSION, header, arrays)


def axes_of(covariances: Float32) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(logarithms of standard deviations [M,3], rotations [M,3,3] to their axes) of covariances [M,6]."""
    full = covariances[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3).astype(np.float64)
    variances, axes = np.linalg.eigh(full)
    axes[:, :, 2] *= np.linalg.det(axes)[:, None]
    return 0.5 * np.log(np.maximum(variances, 1e-30)), axes
