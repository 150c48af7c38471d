"""The edits of a page of splats along its camera path: states, and straight ways from one to the next.

    times        [S] float32, seconds from the path's begin, rising
    states       [S] uint16, the state at each of these times; a state that comes again is stored once
    hidden.k     [ceil(N / 8)] uint8, as in `page_splat_edits`
    sources.k    [M] int32, rising: the splats whose colors the state's splats have
    rotations.k, scales.k   as in `page_splats`: canonical shapes, before the edits
    opacities.k  [2, M] uint8, as there
    gains.k      [M] int32, or [4, M], as in `page_splat_edits`
    moves.n      [2, 12, M] uint8, high bytes first: of state n, three rows of means, three of turns, six of
                 stretches

Entry n of the header's `hidden`, `sources`, `rotations`, `scales`, `opacities` and `gains` says which of them
state n has.

Of the rows of moves, means are low + step q, in deformed space less the field's center, with the header's
`low` and `step`, which all states share. Turns are as in `page_splats.encode_orthogonals`. Stretches are
1 + STRETCH (q - 32768) on the diagonal, STRETCH (q - 32768) beside it: xx, xy, xz, yy, yz, zz. With a turn R,
a stretch S and the canonical covariance C, J = R S is the map's Jacobian and R S C S R^T the splat's
covariance there. The file has the differences of the numbers q to those of the state before, if it has the
same splats (entry n of the header's `after`, or -1), else q. They are modulo 65536 and folded: 0, -1, 1, -2,
... are 0, 1, 2, 3, ...

Between two states, the k-th splat of a source has the mean of the k-th ones' means and covariances: splats
follow chords of their ways. Splats of only one of the states are shown on its half of the way. The header's
`whole` is the state in which the edits have gone all the way, for which a page has their own file; -1 where
none is.

Bytes a splat, of 8 states of a capture of 152,746 splats in the middle of which half is turned: 17.2 with a
covariance in each state, 5.2 like this.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cagefield.fields.splat_field import SplatField
from cagefield.pages.page_file import pack
from cagefield.pages.page_splat_edits import gains_of
from cagefield.pages.page_splats import (
    OFF,
    ROTATION_BITS,
    SCALES,
    byte_pairs,
    encode_orthogonals,
    encode_shapes,
    from_byte_pairs,
    page_order,
)
from cagefield.rendering.splats.raster_splats import ChangedSplats
from cagefield.typing import Float32

if TYPE_CHECKING:
    from cagefield.rendering.splats.splitting import Split

MAGIC, VERSION = b"cagesppa", 2

SPLAT_BYTES = 24
"""Bytes of a splat in a state, before they are deflated, beside its source and its shape."""

STRETCH = 1.0 / 256.0
"""How finely stretches are told: half a step is a fifth of a percent, as of the scales of splats."""


@dataclass(frozen=True)
class SplatPathState:
    """Difference that edits make at one moment: hidden [ceil(N/8)] and sources [M] as in the file.

    Of each splat: means [M,3], less the field's center; turns and stretches [M,3,3], R and
    S of the map's Jacobian R S; its own shape, quaternions [M,4] and log_scales [M,3]; opacities [M]; encoded
    gains [M] or [4,M].
    """

    hidden: NDArray[np.uint8]
    sources: NDArray[np.int32]
    means: NDArray[np.float64]
    turns: NDArray[np.float64]
    stretches: NDArray[np.float64]
    quaternions: Float32
    log_scales: Float32
    opacities: Float32
    gains: NDArray[np.int32]

    @classmethod
    def build(cls, field: SplatField, changed: ChangedSplats, split: Split | None) -> SplatPathState:
        """State of the difference that edits make to a field, with its `split` splats."""
        order = page_order(field)
        place = np.empty(len(order), np.int32)
        place[order] = np.arange(len(order), dtype=np.int32)
        sources = place[changed.sources]
        rows = np.lexsort((changed.rows, sources))
        splats = changed.splats
        turns = np.eye(3)[None] if splats.rotations is None else splats.rotations.astype(np.float64)
        turns = np.broadcast_to(turns, (len(splats), 3, 3))[rows]
        stretches = turns.transpose(0, 2, 1) @ changed.jacobian[rows]
        fields = [field] if split is None else [field, split.children.field]
        made_of = changed.rows[rows]
        return cls(
            np.packbits(changed.hidden[order], bitorder="little"),
            sources[rows],
            splats.means[rows].astype(np.float64) - field.center,
            turns,
            0.5 * (stretches + stretches.transpose(0, 2, 1)),
            np.concatenate([each.quaternions for each in fields])[made_of],
            np.concatenate([each.log_scales for each in fields])[made_of],
            splats.opacities[rows],
            gains_of(changed)[..., rows],
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
    shared: dict[str, list[int]] = {}
    known: dict[tuple[str, bytes], int] = {}
    every = np.concatenate([state.means for state in states])
    low = every.min(axis=0) if len(every) else np.zeros(3)
    size = float(np.ptp(every, axis=0).max()) if len(every) else 0.0
    # Half as fine as splats at rest may be; sixteen bits at most.
    step = max(0.5 * OFF * float(np.linalg.norm(field.half_size)), size / 65535.0)
    after, before = [], None
    for n, state in enumerate(states):
        shapes = encode_shapes(state.quaternions, state.log_scales, state.opacities)
        lists: dict[str, NDArray[Any]] = {
            "hidden": state.hidden,
            "sources": state.sources,
            **shapes,
            "gains": state.gains,
        }
        for name, array in lists.items():
            numbers = shared.setdefault(name, [])
            number = known.setdefault((name, array.tobytes()), len(set(numbers)))
            arrays.setdefault(f"{name}.{number}", array)
            numbers.append(number)
        codes = _moves(state, low, step)
        same = n > 0 and all(
            shared[name][n] == shared[name][n - 1] for name in ("sources", "rotations", "scales")
        )
        after.append(n - 1 if same else -1)
        arrays[f"moves.{n}"] = byte_pairs(_folded(codes - before if same and before is not None else codes))
        before = codes
    header = {
        "count": len(field),
        "changed": [len(state.sources) for state in states],
        **shared,
        "after": after,
        "low": low.tolist(),
        "step": step,
        "stretch": STRETCH,
        "log_scales": list(SCALES),
        "whole": -1 if whole is None else whole,
    }
    return pack(MAGIC, VERSION, header, arrays)


def _moves(state: SplatPathState, low: NDArray[np.float64], step: float) -> NDArray[np.int64]:
    """The numbers q [12,M] of a state's means, turns and stretches."""
    means = np.round((state.means - low) / step)
    turns = from_byte_pairs(encode_orthogonals(state.turns, bits=ROTATION_BITS))
    six = (state.stretches - np.eye(3)).reshape(-1, 9)[:, [0, 1, 2, 4, 5, 8]]
    stretches = np.clip(32768 + np.round(six / STRETCH), 0, 65535)
    return np.concatenate([means.T, turns, stretches.T]).astype(np.int64)


def _folded(numbers: NDArray[np.int64]) -> NDArray[np.int64]:
    """Numbers modulo 65536, those nearest to 0 first: 0, -1, 1, -2, ... are 0, 1, 2, 3, ..."""
    near = (numbers + 32768) % 65536 - 32768
    return np.where(near < 0, -2 * near - 1, 2 * near)
