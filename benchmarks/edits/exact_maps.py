"""The exact map of an edit stack for many samples: by the kernel where there is one, which is float32."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import Continuous, EditStack
from cagefield.edits.device_stack import DeviceStack
from cagefield.rendering.reference_renderer import PointMap
from cagefield.typing import Array

_WITH_KERNEL = ("flow", "trilinear")


@dataclass(frozen=True)
class KernelSamples:
    """Samples in canonical space, as `CanonicalSamples` without the Jacobian."""

    points: NDArray[np.float32]
    viewdirs: NDArray[np.float32]
    stretch: NDArray[np.float32]
    layer: NDArray[np.int32]


@dataclass(frozen=True)
class KernelMap:
    """The map of a stack without lattices, evaluated by the renderer's kernel."""

    edits: EditStack

    @property
    def bounds(self) -> Array:
        """The box [2,3] outside which nothing is changed."""
        return self.edits.bounds

    @property
    def boxes(self) -> Array:
        """Boxes [B,2,3] outside all of which nothing is changed."""
        return self.edits.boxes

    @cached_property
    def _packed(self) -> DeviceStack:
        return DeviceStack.from_stack(self.edits)

    def to_canonical(self, points: NDArray[Any], viewdirs: NDArray[Any] | None = None) -> KernelSamples:
        """Canonical samples of deformed points [N,3] and unit view directions [N,3] (+z where left out)."""
        p = np.asarray(points, np.float32)
        d = np.broadcast_to(np.array([0, 0, 1], np.float32), p.shape) if viewdirs is None else viewdirs
        points, along, stretch, places = self._packed.to_canonical(p, np.asarray(d, np.float32))
        return KernelSamples(points, along, stretch, np.minimum(places, 0))


class BoxedMap(PointMap, Protocol):
    """A point map that knows the boxes [B,2,3] outside all of which nothing is changed."""

    @property
    def boxes(self) -> Array: ...


def exact(edits: EditStack) -> BoxedMap:
    """The stack's map without its lattices, by the kernel where all its shells have one."""
    stack = EditStack(edit.without_lattice() for edit in edits)
    shells = {edit.shell.name for edit in stack.active if isinstance(edit, Continuous)}
    return KernelMap(stack) if shells <= set(_WITH_KERNEL) else stack
