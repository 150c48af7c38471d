"""The edits of a scene of splats along its camera path, as a page shows them, and how exactly."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.keyframes import Keyframe, Timeline
from cagefield.completion.patch_stages import PatchStage
from cagefield.completion.patcher import Patcher
from cagefield.edits import EditStack, PreparedStack
from cagefield.fields.splat_field import SplatField
from cagefield.pages.page_splat_path import SPLAT_BYTES, SplatPathState, encode_page_splat_path
from cagefield.pages.path_states import (
    MOST_STATES,
    PathEdits,
    in_application_order,
    parts_at,
    stack_at,
    state_times,
)
from cagefield.rendering.splats.raster_splats import changed_splats
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.rendering.splats.splitting import Split, split_of

BUDGET = 48 << 20
"""Bytes of splats that move, before they are deflated to about a sixth. Where all states would take more,
splats that the edits bend or cut are not split; where that is too much too, there are fewer states."""

LEAST_STATES = 8


def splat_path_edits(
    splats: SplatField | SplatSet,
    edits: EditStack,
    keys: Sequence[Keyframe],
    loop: bool,
    patcher: Patcher,
    *,
    preserve_opacity: bool = True,
    on_progress: Callable[[float], None] = lambda done: None,
) -> PathEdits | None:
    """As `path_states.path_edits`, of splats: the error is of their means."""
    if len(keys) < 2:
        return None

    edits, keys = in_application_order(edits, keys)
    on_way = patcher.prepare(edits.edits, stage=PatchStage.INPAINTED)
    whole = patcher.prepare(edits.edits, relight_continuous=False)
    # With all that is pasted, also in states without it.
    splats = SplatSet.from_field(splats).with_pastes(whole)
    field = splats.field

    # Split for the whole edits, once, so that the same splats are on their way in all states.
    split: Split | None = split_of(splats, whole)

    def state(stack: PreparedStack) -> SplatPathState:
        changed = changed_splats(splats, stack, preserve_opacity=preserve_opacity, split=split)
        return SplatPathState.build(field, changed, split)

    line = Timeline(keys, loop=loop)
    wanted = state_times(line, edits, MOST_STATES)
    if wanted is None:
        return None
    size = SPLAT_BYTES * max(1, len(state(whole).sources))
    if split is not None and size * len(wanted) > BUDGET:
        split = None
        size = SPLAT_BYTES * max(1, len(state(whole).sources))
    times = state_times(line, edits, int(np.clip(BUDGET // size, LEAST_STATES, MOST_STATES)))
    assert times is not None  # the path moves edits, see above
    knots = [parts_at(line, edits, t) for t in times]
    unique = list(dict.fromkeys(knots))
    middles = [k for k in range(len(knots) - 1) if knots[k] != knots[k + 1]]
    total, states = len(unique) + len(middles), {}
    for parts in unique:
        states[parts] = state(stack_at(whole, parts, on_way=on_way))
        on_progress(len(states) / total)
    errors: list[NDArray[np.float64]] = []
    for done, k in enumerate(middles, start=len(unique) + 1):
        one, other = states[knots[k]], states[knots[k + 1]]
        there = parts_at(line, edits, 0.5 * (times[k] + times[k + 1]))
        middle = state(stack_at(whole, there, on_way=on_way))
        errors.append(_off(middle, one, other))
        on_progress(done / total)
    last = next((n for n, parts in enumerate(unique) if all(part == 1.0 for part in parts)), None)
    data = encode_page_splat_path(
        field, times, [unique.index(parts) for parts in knots], list(states.values()), last
    )
    off = np.concatenate([*errors, np.zeros(1)])
    error = float(off.mean()), float(np.percentile(off, 99))
    return PathEdits(data, len(unique), None, error, split is not None)


def _off(middle: SplatPathState, one: SplatPathState, other: SplatPathState) -> NDArray[np.float64]:
    """How far means half-way between two states are from those of that moment, of splats that all have."""
    keys = [_keys(state.sources) for state in (middle, one, other)]
    common = np.intersect1d(np.intersect1d(keys[0], keys[1]), keys[2])
    there, a, b = (
        state.means[np.searchsorted(key, common)]
        for state, key in zip((middle, one, other), keys, strict=True)
    )
    return np.asarray(np.linalg.norm(0.5 * (a + b) - there, axis=1), np.float64)


def _keys(sources: NDArray[np.int32]) -> NDArray[np.int64]:
    """Rising numbers [M] of rising sources, which also say how many of the same one are before each."""
    before = np.arange(len(sources)) - np.searchsorted(sources, sources)
    return sources.astype(np.int64) << 32 | before
