"""Kernels of edits and the light of a new scene, prepared where the scene is made.

The first edit in the editor finds both ready.
"""

from __future__ import annotations

import time
from pathlib import Path

MAX_SECONDS = 30.0
"""Time after which the light is left to the editor, which computes it beside its first pictures; 0: at once,
and the kernels too."""


class _OutOfTimeError(Exception):
    """The light took too long."""


def prepare_edits(path: Path) -> None:
    """Compile kernels of edits and compute the light of the scene in a folder, into the user's cache.

    Kernels are compiled once on a machine; relighting needs the light. Prints whether they are there. A NeRF
    has no light before it is baked. Ctrl-C, an error, and too little memory leave them to the editor: the
    scene is written by then.
    """
    from cagefield.compute import devices
    from cagefield.errors import CagefieldError
    from cagefield.fields.splat_field import SplatField
    from cagefield.fields.voxel_field import VoxelField
    from cagefield.scene.scene import Scene
    from cagefield.server.render_worker.renderer_cache import RendererCache
    from cagefield.server.render_worker.tasks import WarmStage

    if MAX_SECONDS <= 0.0:
        return
    scene = Scene.open(path)
    if not isinstance(scene.field, (VoxelField, SplatField)):
        return
    began = time.monotonic()

    def proceed() -> None:
        if time.monotonic() > compiled + MAX_SECONDS:
            raise _OutOfTimeError

    print("preparing kernels and light for edits; Ctrl-C leaves them to the editor", flush=True)
    devices.start()
    try:
        renderers = RendererCache(scene)
        for stage in WarmStage:
            renderers.warm(stage)
        compiled = time.monotonic()
        scene.patcher.warm(proceed=proceed)
        print(f"kernels and light ready after {time.monotonic() - began:.1f} s")
    except (_OutOfTimeError, KeyboardInterrupt, CagefieldError, MemoryError):
        print("the rest is left to the editor, which prepares it beside its first pictures")
