"""Training of radiance fields: voxels, splats and NeRFs from posed photos; figures of test views."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
