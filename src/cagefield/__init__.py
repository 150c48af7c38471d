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
    from cagefield.cages import Cage as Cage
    from cagefield.cameras import Camera as Camera
    from cagefield.cameras import turntable as turntable
    from cagefield.datasets.dataset import Dataset as Dataset
    from cagefield.datasets.dataset import load_dataset as load_dataset
    from cagefield.edits import Edit as Edit
    from cagefield.edits import EditStack as EditStack
    from cagefield.edits.files import load_edits as load_edits
    from cagefield.edits.files import save_edits as save_edits
    from cagefield.errors import CagefieldError as CagefieldError
    from cagefield.fields.baking import bake as bake
    from cagefield.fields.nerf import NerfField as NerfField
    from cagefield.fields.protocol import Field as Field
    from cagefield.fields.splat import SplatField as SplatField
    from cagefield.fields.voxel import VoxelField as VoxelField
    from cagefield.rendering.reference_renderer import render_sampled as render_sampled
    from cagefield.rendering.render_result import RenderResult as RenderResult
    from cagefield.rendering.renderer import Renderer as Renderer
    from cagefield.scene import Scene as Scene

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
    "Cage": "cagefield.cages",
    "CagefieldError": "cagefield.errors",
    "Camera": "cagefield.cameras",
    "Dataset": "cagefield.datasets.dataset",
    "Edit": "cagefield.edits",
    "EditStack": "cagefield.edits",
    "Field": "cagefield.fields.protocol",
    "RenderResult": "cagefield.rendering.render_result",
    "NerfField": "cagefield.fields.nerf",
    "Renderer": "cagefield.rendering.renderer",
    "Scene": "cagefield.scene",
    "SplatField": "cagefield.fields.splat",
    "VoxelField": "cagefield.fields.voxel",
    "bake": "cagefield.fields.baking",
    "load_dataset": "cagefield.datasets.dataset",
    "load_edits": "cagefield.edits.files",
    "render_sampled": "cagefield.rendering.reference_renderer",
    "save_edits": "cagefield.edits.files",
    "turntable": "cagefield.cameras",
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
