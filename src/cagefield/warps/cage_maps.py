"""The maps of a pair of cages by the kind of the inner cage.

A cage that is no hexahedron registers its own:

    @flow_between.register
    def _(inner: ControlPoints, deformed: Cage, outer: Cage, falloff: Falloff) -> Shell: ...
"""

from __future__ import annotations

from functools import singledispatch

from cagefield.geometry.cage import Cage
from cagefield.typing import Array
from cagefield.warps.falloff import Falloff
from cagefield.warps.flow_shell import FlowShell
from cagefield.warps.hexahedron_map import HexahedronMap
from cagefield.warps.interfaces import InnerMap, Shell


@singledispatch
def flow_between(inner: Cage, deformed: Cage, outer: Cage, falloff: Falloff) -> Shell:
    """The flow in an outer cage whose inner cage goes from `inner` to `deformed`."""
    return FlowShell(inner, deformed, outer, falloff)


@singledispatch
def inner_map_between(inner: Cage, deformed: Cage) -> InnerMap:
    """The exact map of the deformed inner cage onto the canonical one, where it has one."""
    return HexahedronMap(inner, deformed)


@singledispatch
def reach_between(inner: Cage, deformed: Cage) -> Array | None:
    """Box [2,3] (min, max) of everything that goes along with the inner cage on its way.

    None for cages whose reach only an outer cage limits.
    """
    return None
