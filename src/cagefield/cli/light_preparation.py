"""Light of a new scene, computed where the scene is made: the first edit in the editor finds it ready."""

from __future__ import annotations

import time
from pathlib import Path

MAX_SECONDS = 30.0
"""Time after which the light is left to the editor, which computes it beside its first pictures; 0: at
once."""


class _OutOfTimeError(Exception):
    """The light took too long."""


def prepare_light(path: Path) -> None:
    """Compute the light of the scene in a folder, as relighting needs it, into the user's cache.

    Prints whether it is there. A NeRF has none before it is baked. Ctrl-C, an error, and too little memory
    leave the light to the editor: the scene is written by then.
    """
    from cagefield.compute import devices
    from cagefield.errors import CagefieldError
    from cagefield.fields.splat_field import SplatField
    from cagefield.fields.voxel_field import VoxelField
    from cagefield.scene.scene import Scene

    if MAX_SECONDS <= 0.0:
        return
    scene = Scene.open(path)
    if not isinstance(scene.field, (VoxelField, SplatField)):
        return
    began = time.monotonic()

    def proceed() -> None:
        if time.monotonic() > began + MAX_SECONDS:
            raise _OutOfTimeError

    print("preparing light for edits; Ctrl-C leaves it to the editor", flush=True)
    devices.start()
    try:
        scene.patcher.warm(proceed=proceed)
        print(f"light ready after {time.monotonic() - began:.1f} s")
    except (_OutOfTimeError, KeyboardInterrupt, CagefieldError, MemoryError):
        print("light left to the editor, which computes it beside its first pictures")
