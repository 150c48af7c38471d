"""Data sets: posed photos from transforms.json, LLFF and COLMAP; poses by structure from motion."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
