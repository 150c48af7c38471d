"""The exact map of an edit stack for many samples: by the kernel where there is one, which is float32."""

from __future__ import annotations

from cagefield.edits import Continuous, EditStack, KernelMap, SpaceMap

_WITH_KERNEL = ("flow", "trilinear")


def exact(edits: EditStack) -> SpaceMap:
    """The stack's map without its lattices, by the kernel where all its shells have one."""
    stack = EditStack(edit.without_lattice() for edit in edits)
    shells = {edit.shell.name for edit in stack.active if isinstance(edit, Continuous)}
    return KernelMap(stack) if shells <= set(_WITH_KERNEL) else stack
