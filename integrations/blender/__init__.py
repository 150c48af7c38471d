# SPDX-License-Identifier: GPL-3.0-or-later
"""cagefield for Blender: splats deformed by two nested cages.

The add-on imports bpy, numpy and the standard library. A process of cagefield (`worker.py`), started with
the interpreter of the preferences, has the splats and the mathematics.
"""

from . import live, operators, panel, properties

bl_info = {
    "name": "cagefield",
    "author": "cagefield contributors",
    "version": (0, 1, 0),
    "blender": (5, 0, 0),
    "location": "3D View > Sidebar > cagefield",
    "description": "Deform Gaussian splats with two nested cages",
    "category": "Object",
}

_PARTS = (properties, operators, panel, live)


def register() -> None:
    """Adds the classes, properties and handlers of the add-on."""
    for part in _PARTS:
        part.register()


def unregister() -> None:
    """Removes them, and ends the process of cagefield."""
    for part in reversed(_PARTS):
        part.unregister()
