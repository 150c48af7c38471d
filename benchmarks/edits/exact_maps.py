"""The exact map of an edit stack for many samples: by the kernel where there is one, which is float32."""

from __future__ import annotations

from cagefield.edits import Continuous, EditStack, KernelMap, SpaceMap

_WITH_KERNEL = ("flow", "trilinear")


def exact(edits: EditStack) -> SpaceMap:
    """The stack's map without its lattices, by the kernel where all its shells have one.

    Kernels have no exact map of lattices of control points and of points on their own: that is in float64.
    """
    stack = EditStack(edit.without_lattice() for edit in edits)
    continuous = [edit for edit in stack.active if isinstance(edit, Continuous)]
    in_kernel = all(edit.shell.name in _WITH_KERNEL and edit.inner.is_hexahedron for edit in continuous)
    return KernelMap(stack) if in_kernel else stack
