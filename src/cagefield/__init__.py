"""cagefield: edit the geometry of a captured radiance field with two nested cages.

Public names are listed in `__init__.pyi` and imported on first use: `import cagefield` loads no numpy and no
compute runtime.
"""

import os

import lazy_loader

__version__ = "0.1.0"

# Quadrants prints a line about itself at its import, by kernel modules.
os.environ.setdefault("ENABLE_QUADRANTS_HEADER_PRINT", "0")

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
