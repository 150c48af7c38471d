"""A scene of voxels as one HTML file: the field, its edits, a viewer; it needs no server and no network."""

from __future__ import annotations

import base64
import html
import json
import math
import re
from importlib.resources import files
from typing import Any

import numpy as np

from cagefield.cameras import Camera, turntable
from cagefield.errors import CagefieldError
from cagefield.exporting import FOV_X, scene_up
from cagefield.fields.voxel import VoxelField
from cagefield.formats.page_edits import encode_page_edits, for_pages
from cagefield.formats.page_field import encode_page_field
from cagefield.keyframes import Keyframe, stills
from cagefield.rendering.renderer import Renderer
from cagefield.scene import Scene

_HERE = files("cagefield.exporting")

STILLS_A_SECOND = 12.0
"""Of the camera path; between two of them the page goes straight."""


def scene_page(
    scene: Scene, title: str, keys: tuple[Keyframe, ...] = (), *, loop: bool = False, step: float = 0.5
) -> str:
    """The text of an HTML file that shows an edited scene of voxels, with the camera path of `keys`.

    Parts of edits that keys name are not shown: edits have gone all the way. `step` is the distance between
    samples in voxels.

    Raises:
        CagefieldError: the scene holds splats.
        EditError: edits that cannot be evaluated, or more than a page takes.
    """
    field = scene.field
    if not isinstance(field, VoxelField):
        raise CagefieldError(
            "the scene holds splats; a page shows voxels: write the splats as .ply, .spz or .sog instead"
        )
    renderer = Renderer(field, for_pages(scene.edits), preserve_opacity=scene.preserve_opacity)
    header = {
        "start": _view(_start(scene)),
        "up": scene_up(scene).tolist(),
        "centre": field.center.tolist(),
        "background": None if scene.background is None else list(scene.background),
        "path": _path(keys, loop),
    }
    parts = {
        "TITLE": html.escape(title),
        # Of a script's text only "</" has a meaning to the page.
        "SCENE": json.dumps(header, allow_nan=False).replace("<", "\\u003c"),
        "FIELD": _embedded("field", encode_page_field(field, step=step, background=scene.background)),
        "EDITS": _embedded("edits", encode_page_edits(renderer)) if scene.edits.active else "",
        "VIEWER": (_HERE / "viewer" / "viewer.js").read_text(encoding="utf-8"),
    }
    page = (_HERE / "page.html").read_text(encoding="utf-8")
    return re.sub("@([A-Z]+)@", lambda found: parts[found[1]], page)


def _embedded(name: str, data: bytes) -> str:
    return f'<script type="text/plain" id="{name}">{base64.b64encode(data).decode()}</script>'


def _start(scene: Scene) -> Camera:
    """The first test camera, or any, or one in front of a scene without cameras."""
    for split in ("test", "val", "train"):
        if scene.cameras.get(split):
            return scene.cameras[split][0]
    bounds = scene.field.bounds
    radius = 0.6 * float(np.linalg.norm(bounds[1] - bounds[0])) / math.sin(0.5 * FOV_X)
    return turntable(
        bounds.mean(axis=0), radius, 1, elevation=0.3, up=scene_up(scene), width=400, height=400, fov_x=FOV_X
    )[0]


def _view(camera: Camera) -> dict[str, Any]:
    """A camera's pose, and the field of view of its shorter side, which the window's shorter side has."""
    least = min(camera.width / camera.fx, camera.height / camera.fy)
    return {"c2w": camera.c2w.ravel().tolist(), "fov_y_deg": math.degrees(2.0 * math.atan(0.5 * least))}


def _path(keys: tuple[Keyframe, ...], loop: bool) -> dict[str, Any] | None:
    if len(keys) < 2:
        return None
    pictures = stills(keys, loop=loop, fps=STILLS_A_SECOND, width=100, height=100)
    seconds = sum(key.seconds for key in (keys if loop else keys[:-1]))
    return {"stills": [_view(still.camera) for still in pictures], "seconds": seconds, "loop": loop}
