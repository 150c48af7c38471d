"""PlenOctree: an octree whose leaves hold one density and one set of color coefficients each.

Notation: x = offset + scale p is in [0,1]^3 in the tree's box. Node n has 2 x 2 x 2 slots; child[n,i,j,k] is
0 for a leaf, else the distance to the child's index. A leaf with the values (k, sigma) gives

    sigma(p) = max(0, sigma) per world unit,   rgb(p, d) = sigmoid(Y(d) . k), or sigmoid(k) for "RGBA"

Rays are cut at the planes of the finest level, so that each segment lies in one leaf and the sums are exact
where nothing is edited; svox itself steps 1e-3 of the box too far at each leaf.

Source: Yu et al., "PlenOctrees" (2021), section 3; layout of github.com/sxyu/svox, svox/svox.py (save), and
its rt_kernel.cu (trace_ray).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.external.external_field import ExternalField, frozen_array, whole_number

if TYPE_CHECKING:
    from cagefield.fields.external.torch_field import TorchField

MAX_TREE_LEVELS = 12
"""Maximum depth of a tree: 4,096 leaves along an edge; the authors' largest have 9 or 10."""


@dataclass(frozen=True, eq=False)
class PlenOctreeField(ExternalField):
    """PlenOctree (canonical space, world units).

    Attributes:
        child: [M,2,2,2] int32 distances to the children's indices, 0 for leaves.
        data: [M,2,2,2,3 B + 1] float16 color coefficients of each channel in turn, and density.
        scale, offset: [3] map to the tree's unit cube.
        terms: B, number of spherical harmonics (1, 4, 9, 16, 25), or 0 for one color per leaf ("RGBA").

    Raises:
        FieldError: arrays that do not fit each other, children out of range, shared or too deep.
    """

    child: NDArray[np.int32]
    data: NDArray[np.float16]
    scale: NDArray[np.float64]
    offset: NDArray[np.float64]
    terms: int = 9

    KIND: ClassVar[str] = "PlenOctreeField"

    def __post_init__(self) -> None:
        def fix(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        terms = whole_number("terms", self.terms, 0, 25)
        if terms not in (0, 1, 4, 9, 16, 25):
            raise FieldError(f"terms is {terms}; expected 1, 4, 9, 16 or 25 spherical harmonics, 0 for RGBA")
        fix("terms", terms)
        fix("child", frozen_array("child", self.child, np.int32, (None, 2, 2, 2)))
        width = 3 * max(1, terms) + 1
        fix("data", frozen_array("data", self.data, np.float16, (len(self.child), 2, 2, 2, width)))
        for name in ("scale", "offset"):
            fix(name, frozen_array(name, getattr(self, name), np.float64, (3,)))
        if not (self.scale > 1e-9).all():
            raise FieldError(f"invradius3 must be above 0, got {self.scale.tolist()}")
        self.depth  # noqa: B018  checks the children

    @cached_property
    def depth(self) -> int:
        """Number of levels: leaves of the last are 2^-depth of the box."""
        flat = self.child.reshape(len(self.child), 8).astype(np.int64)
        visited = np.zeros(len(flat), bool)
        nodes, depth = np.zeros(1, np.int64), 0
        while len(nodes):
            depth += 1
            if depth > MAX_TREE_LEVELS:
                raise FieldError(f"the tree has more than {MAX_TREE_LEVELS} levels; it may be damaged")
            visited[nodes] = True
            steps = flat[nodes]
            children = (nodes[:, None] + steps)[steps != 0]
            if len(children) and (children.min() < 0 or children.max() >= len(flat)):
                raise FieldError(f"child points outside the {len(flat)} nodes; the file may be damaged")
            if visited[children].any() or len(np.unique(children)) < len(children):
                raise FieldError("a node has two parents; the file may be damaged")
            nodes = children
        return depth

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Corners [2,3] of the tree's box."""
        return np.stack([-self.offset / self.scale, (1.0 - self.offset) / self.scale])

    def describe(self) -> str:
        """Depth, nodes and format."""
        shown = f"SH degree {round(self.terms**0.5) - 1}" if self.terms else "one color per leaf"
        return f"PlenOctree: {len(self.child)} nodes, {self.depth} levels, {shown}"

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Children, values and map by name."""
        return {"child": self.child, "data": self.data, "scale": self.scale, "offset": self.offset}

    def options(self) -> dict[str, Any]:
        """Number of harmonics."""
        return {"terms": self.terms}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]], options: Mapping[str, Any]) -> PlenOctreeField:
        """Field of the values of `arrays` and `options`. Raises FieldError where they do not fit."""
        names = ("child", "data", "scale", "offset")
        if missing := [name for name in names if name not in arrays]:
            raise FieldError(f"tensor missing: {missing[0]}")
        child, data, scale, offset = (arrays[name] for name in names)
        return cls(child, data, scale, offset, terms=options["terms"])

    def _torch_field(self) -> TorchField:
        from cagefield.fields.external.plenoctree_torch import TorchPlenOctree

        return TorchPlenOctree(self.child, self.data, self.scale, self.offset, self.terms, self.depth)
