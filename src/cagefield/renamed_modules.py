"""Modules and classes by their names in 0.1: those work until 0.3, with a warning that says the new one."""

from __future__ import annotations

import importlib
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

RENAMED = {
    "cagefield.datasets.nerf_worlds": "cagefield.datasets.nerf_normalization",
    "cagefield.fields.seen": "cagefield.fields.frusta",
    "cagefield.folders": "cagefield.files.atomic",
    "cagefield.hexahedron": "cagefield.geometry.hexahedron",
    "cagefield.rendering.agreement": "cagefield.rendering.bake_fidelity",
    "cagefield.rendering.deformed_occupancy": "cagefield.rendering.voxels.occupancy_deformed",
    "cagefield.rendering.edited_ray": "cagefield.rendering.voxels.kernels.edited_ray",
    "cagefield.rendering.frame": "cagefield.images.render_result",
    "cagefield.rendering.jumping_occupancy": "cagefield.rendering.voxels.occupancy_discontinuous",
    "cagefield.rendering.links": "cagefield.rendering.voxels.drag_occupancy",
    "cagefield.rendering.march": "cagefield.rendering.voxels.kernels.march",
    "cagefield.rendering.reach": "cagefield.rendering.voxels.kernels.occupancy_queries",
    "cagefield.rendering.sampled": "cagefield.rendering.reference_renderer",
    "cagefield.rendering.smooth_occupancy": "cagefield.rendering.voxels.occupancy_continuous",
    "cagefield.rendering.traverse": "cagefield.rendering.voxels.kernels.ray_grid",
    "cagefield.training.filling": "cagefield.training.voxels.inpainting",
    "cagefield.training.march_kernel": "cagefield.training.voxels.kernels.training_march",
    "cagefield.training.records": "cagefield.training.voxels.kernels.accumulators",
    "cagefield.training.running": "cagefield.training.loop",
    "cagefield.training.specks": "cagefield.training.voxels.floater_removal",
    "cagefield.training.unseen": "cagefield.training.voxels.vertex_visibility",
    "cagefield.training.update_kernels": "cagefield.training.voxels.kernels.gauss_newton_voxels",
    "cagefield.warps.bends": "cagefield.warps.trilinear_bend",
    "cagefield.warps.edit_device": "cagefield.edits.device.kernels.edit_maps",
    "cagefield.warps.extended": "cagefield.warps.extended_coordinates",
    "cagefield.warps.flow_device": "cagefield.warps.kernels.flow_shell",
    "cagefield.warps.flow_lanes": "cagefield.warps.kernels.flow_velocity_simd",
    "cagefield.warps.flow_motion": "cagefield.warps.cage_motion",
    "cagefield.warps.hexahedron": "cagefield.warps.hexahedron_map",
    "cagefield.warps.hexahedron_device": "cagefield.edits.device.kernels.hexahedron",
    "cagefield.warps.inverting": "cagefield.warps.newton_inverse",
    "cagefield.warps.joined": "cagefield.edits.device.buffer_pool",
    "cagefield.warps.kept": "cagefield.compute.identity_memo",
    "cagefield.warps.lattice_device": "cagefield.edits.device.kernels.lattice",
    "cagefield.warps.maps": "cagefield.warps.interfaces",
    "cagefield.warps.rows": "cagefield.edits.device.packing",
}
"""The new name of each module that had another."""


class _Finder(MetaPathFinder):
    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname not in RENAMED:
            return None
        return ModuleSpec(fullname, _Alias(RENAMED[fullname]))


class _Alias(Loader):
    """Hands out the module of the new name: both names are one object."""

    def __init__(self, name: str) -> None:
        self._name = name

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        module = importlib.import_module(self._name)
        self._spec = module.__spec__
        # Frames of the import system do not count: the line shown is the one with the import.
        warn_renamed(spec.name, self._name, stacklevel=3)
        return module

    def exec_module(self, module: ModuleType) -> None:
        module.__spec__ = self._spec


def warn_renamed(old: str, new: str, stacklevel: int = 3) -> None:
    """Warns that a name is an old one."""
    warnings.warn(f"{old} is now {new}; the old name goes in 0.3", DeprecationWarning, stacklevel=stacklevel)


def old_names(module: str, renamed: Mapping[str, object]) -> Callable[[str], object]:
    """The `__getattr__` of a module, by which classes are found under their old names."""

    def find(name: str) -> object:
        if name not in renamed:
            raise AttributeError(f"module '{module}' has no attribute {name!r}")
        found = renamed[name]
        warn_renamed(f"{module}.{name}", f"{module}.{getattr(found, '__name__', name)}")
        return found

    return find


def install() -> None:
    """Has Python find the modules by their old names, too."""
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.append(_Finder())
