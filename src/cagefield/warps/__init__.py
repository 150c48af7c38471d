"""Maps between deformed space (where rays live) and canonical space (where the field was trained).

Notation: V^c canonical inner cage, V deformed inner cage, V^o outer cage, phi the inner map V -> V^c,
phi' the shell map V^o \\ V -> V^o \\ V^c; p a point, J the Jacobian of the map at p. Everything here is the
float64 reference, vectorized over points [N,3]; `kernels.trilinear_hex`, `kernels.lattice` and
`kernels.flow_shell` have the same maps for one sample in a kernel, `kernels.edit_maps` puts them together,
and `device_stack` packs a stack of edits for it.

One method per file; `cagefield.edits.shells` builds a continuous edit's shell.
"""

from __future__ import annotations

from cagefield.warps.cage_maps import flow_between, inner_map_between, reach_between
from cagefield.warps.control_point_velocity import ControlPointVelocity
from cagefield.warps.falloff import FALLOFFS, Falloff
from cagefield.warps.flow_shell import FlowShell
from cagefield.warps.free_form import FreeFormFlow, Velocity
from cagefield.warps.interfaces import InnerMap, Mapped, NoInnerMap, Shell, Warp
from cagefield.warps.lattice_shell import LatticeShell
from cagefield.warps.mesh_shell import MeshShell
from cagefield.warps.trilinear_shell import TrilinearShell

__all__ = [
    "FALLOFFS",
    "ControlPointVelocity",
    "Falloff",
    "FlowShell",
    "FreeFormFlow",
    "InnerMap",
    "LatticeShell",
    "Mapped",
    "MeshShell",
    "NoInnerMap",
    "Shell",
    "TrilinearShell",
    "Velocity",
    "Warp",
    "flow_between",
    "inner_map_between",
    "reach_between",
]
