"""cagefield: edit the geometry of a captured radiance field with two nested cages.

The names below are imported on first use: `import cagefield` stays quick and loads no compute runtime.
"""

from __future__ import annotations

import importlib
import os
from typing import TYPE_CHECKING

from cagefield import renamed_modules

__version__ = "0.1.0"

# Quadrants prints a line about itself when it is imported, which kernel modules do.
os.environ.setdefault("ENABLE_QUADRANTS_HEADER_PRINT", "0")

renamed_modules.install()

if TYPE_CHECKING:
    from cagefield.cameras.camera import Camera as Camera
    from cagefield.cameras.camera import turntable as turntable
    from cagefield.datasets.dataset_loader import Dataset as Dataset
    from cagefield.datasets.dataset_loader import load_dataset as load_dataset
    from cagefield.edits import Edit as Edit
    from cagefield.edits import EditStack as EditStack
    from cagefield.edits.edit_files import load_edits as load_edits
    from cagefield.edits.edit_files import save_edits as save_edits
    from cagefield.errors import CagefieldError as CagefieldError
    from cagefield.fields.baking import bake as bake
    from cagefield.fields.nerf_field import NerfField as NerfField
    from cagefield.fields.protocol import Field as Field
    from cagefield.fields.splat_field import SplatField as SplatField
    from cagefield.fields.voxel_field import VoxelField as VoxelField
    from cagefield.geometry.cage import Cage as Cage
    from cagefield.images.render_result import RenderResult as RenderResult
    from cagefield.rendering.reference_renderer import render_sampled as render_sampled
    from cagefield.rendering.voxels.voxel_renderer import Renderer as Renderer
    from cagefield.scene.scene import Scene as Scene

__all__ = [
    "Cage",
    "CagefieldError",
    "Camera",
    "Dataset",
    "Edit",
    "EditStack",
    "Field",
    "NerfField",
    "RenderResult",
    "Renderer",
    "Scene",
    "SplatField",
    "VoxelField",
    "__version__",
    "bake",
    "load_dataset",
    "load_edits",
    "render_sampled",
    "save_edits",
    "turntable",
]

_HOME = {
    "Cage": "cagefield.geometry.cage",
    "CagefieldError": "cagefield.errors",
    "Camera": "cagefield.cameras.camera",
    "Dataset": "cagefield.datasets.dataset_loader",
    "Edit": "cagefield.edits",
    "EditStack": "cagefield.edits",
    "Field": "cagefield.fields.protocol",
    "RenderResult": "cagefield.images.render_result",
    "NerfField": "cagefield.fields.nerf_field",
    "Renderer": "cagefield.rendering.voxels.voxel_renderer",
    "Scene": "cagefield.scene.scene",
    "SplatField": "cagefield.fields.splat_field",
    "VoxelField": "cagefield.fields.voxel_field",
    "bake": "cagefield.fields.baking",
    "load_dataset": "cagefield.datasets.dataset_loader",
    "load_edits": "cagefield.edits.edit_files",
    "render_sampled": "cagefield.rendering.reference_renderer",
    "save_edits": "cagefield.edits.edit_files",
    "turntable": "cagefield.cameras.camera",
}


def __getattr__(name: str) -> object:
    """The exported object `name`, imported from its own module the first time it is asked for."""
    if name == "Frame":
        renamed_modules.warn_renamed("cagefield.Frame", "cagefield.RenderResult")
        return __getattr__("RenderResult")
    if name not in _HOME:
        raise AttributeError(f"module 'cagefield' has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The module's public names, loaded or not."""
    return sorted({"__version__", *_HOME})
