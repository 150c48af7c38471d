"""What the options of an edit may be, and which of them go together."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from cagefield.geometry.cage import Cage
from cagefield.warps import FALLOFFS, SHELLS

Adjustment: TypeAlias = Literal["continuous", "discrete"]


@dataclass(frozen=True)
class Clone:
    """A way to fill: V^c shows what is in the source cage, blended at its rim. The cage stays as it is."""

    source: Cage


Fill: TypeAlias = Literal["surroundings", "none"] | Clone


@dataclass(frozen=True)
class CastShadow:
    """A way to relight: contact shadows go along, and those of a light in the direction [3], by hand."""

    direction: tuple[float, float, float]


Relight: TypeAlias = Literal["occlusion", "shadow", "none"] | CastShadow

FILLS: tuple[str, ...] = ("surroundings", "none")
RELIGHTS: tuple[str, ...] = ("occlusion", "shadow", "none")

FEATHER, MOST_FEATHER = 2.0, 8.0
"""Voxels of a seam that blend, where nothing else is said, and at most.

Of eight moves and copies in four scenes, widths of 1, 2 and 3 lose .03, .09 and .11 dB less in the mean than
a hard edge, on the pixels that they change.
"""

LATTICE_RANGE = (2, 512)
MOST_NODES = 512**3
"""Lattice nodes of all edits together, of 32 bytes each: one lattice of 512, or eight of 256."""


def problem_of_lattices(lattices: Iterable[int | None]) -> str | None:
    """Why the lattices of edits that are shown together are too large, and the cure; None where not."""
    nodes = sum(lattice**3 for lattice in lattices if lattice is not None)
    if nodes <= MOST_NODES:
        return None
    return (
        f"the edits' lattices have {nodes / 1e6:.0f} million nodes together, at most {MOST_NODES / 1e6:.0f}"
        " million are kept; give them lower resolutions"
    )


def problem_of_options(
    adjustment: str,
    shell: str,
    *,
    has_outer: bool,
    has_operations: bool,
    keep_source: bool,
    deleted: bool,
    fading: tuple[str, float],
    lattice: int | None,
    surroundings: tuple[str | Clone, str | CastShadow, float],
) -> str | None:
    """What is wrong with an edit's options, and the cure; None where they go together.

    `fading` is (falloff, width), `surroundings` (fill, relight, feather). See
    `cagefield.edits.edit.Edit` for what each of them means.
    """
    if adjustment not in ("continuous", "discrete"):
        return f'adjustment must be "continuous" or "discrete", got "{adjustment!s:.40}"'
    if shell not in SHELLS:
        return f'shell must be one of {", ".join(SHELLS)}, got "{shell!s:.40}"'
    for name, value, known in zip(("fill", "relight"), surroundings[:2], (FILLS, RELIGHTS), strict=True):
        if value not in known and not isinstance(value, Clone if name == "fill" else CastShadow):
            return f'{name} must be one of {", ".join(known)}, got "{value!s:.40}"'
    if isinstance(surroundings[1], CastShadow):
        size = sum(value * value for value in surroundings[1].direction)
        if not (len(surroundings[1].direction) == 3 and 0.0 < size < float("inf")):
            return (
                f"the direction to a light must be three numbers, not all 0, got {surroundings[1].direction}"
            )
    if not 0.0 <= surroundings[2] <= MOST_FEATHER:
        return f"feather must be 0 (a hard edge) to {MOST_FEATHER:g} voxels, got {surroundings[2]!r}"
    if adjustment == "continuous":
        if not has_outer:
            return (
                "a continuous edit needs an outer cage; give one (inner.grown(margin), say) or use"
                ' adjustment="discrete"'
            )
        if keep_source or deleted:
            return f'{"deleted" if deleted else "keep_source"} needs adjustment="discrete"'
    if deleted and (has_operations or keep_source):
        return "a delete has no operations and keeps no source"
    return _problem_of_falloff(adjustment, shell, *fading) or _problem_of_lattice(lattice)


def _problem_of_falloff(adjustment: str, shell: str, falloff: str, width: float) -> str | None:
    if falloff not in FALLOFFS:
        return f'falloff must be one of {", ".join(FALLOFFS)}, got "{falloff!s:.40}"'
    if not 0.0 < width <= 1.0:
        return f"width must be above 0 and at most 1 (the whole shell), got {width!r}"
    fades = adjustment == "continuous" and shell == "flow"
    for name, value, default in (("falloff", falloff, "smooth"), ("width", width, 1.0)):
        if value != default and not fades:
            other = "discrete edit" if adjustment == "discrete" else f"{shell} shell"
            return (
                f'{name} is an option of the flow shell, and a {other} has none; set shell="flow" (and'
                f' adjustment="continuous") or leave {name} out'
            )
    return None


def _problem_of_lattice(lattice: int | None) -> str | None:
    low, high = LATTICE_RANGE
    if lattice is None or (
        isinstance(lattice, int) and not isinstance(lattice, bool) and low <= lattice <= high
    ):
        return None
    return (
        f"lattice must be None (exact) or a whole number of nodes per axis from {low} to {high}"
        f" (64, 128 or 256, say), got {lattice!r}"
    )
