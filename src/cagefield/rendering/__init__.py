"""Renderers of fields through edits: voxels, splats, NeRFs, and a reference renderer of any field."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
