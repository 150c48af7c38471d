"""A scene as a page, one file or a folder: voxels or splats, their edits along a camera path, a viewer."""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import html
import json
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.cameras.keyframes import Keyframe, Still, stills
from cagefield.edits import EditStack
from cagefield.errors import CagefieldError
from cagefield.exporting import edited_splats
from cagefield.files.atomic import recover_folder, replaced_folder
from cagefield.pages.page_edits import encode_page_edits, for_pages
from cagefield.pages.page_field import encode_page_field
from cagefield.pages.page_file import bytes_until
from cagefield.pages.page_hotspots import hotspot_entries
from cagefield.pages.page_nodes import NODE_NAME, encode_page_nodes
from cagefield.pages.page_splat_edits import encode_page_splat_edits
from cagefield.pages.page_splats import encode_page_splats
from cagefield.pages.path_states import PathEdits, path_edits
from cagefield.pages.splat_path_states import splat_path_edits
from cagefield.rendering.splats.raster_splats import changed_splats
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.rendering.splats.splitting import split_of
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from cagefield.scene.scene import Scene

_HERE = files("cagefield.pages")

STILLS_A_SECOND = 12.0
"""Of the camera path; between two of them the page goes straight."""

SCRIPT_PART_BYTES = 3 << 16
"""Bytes of a file in a script of a page: the browser reads on between two."""

INDEX, SCRIPT = "index.html", "viewer.js"
NAMES = {"field": "scene.field", "edits": "scene.edits", "path": "scene.path"}

_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; worker-src blob:; "
ONE_FILE = _POLICY + "script-src 'unsafe-inline'"
FOLDER = _POLICY + "script-src 'self'; connect-src 'self'"


@dataclass(frozen=True)
class ScenePage:
    """Contents of a page: title, header (cameras, background), and files by the names in NAMES.

    `along` has the motion of edits along the path, None without one.
    """

    title: str
    header: Mapping[str, Any]
    files: Mapping[str, bytes]
    along: PathEdits | None
    nodes: Mapping[str, bytes] = dataclasses.field(default_factory=dict)
    """Files of levels of detail by name (`page_nodes`), in the folder form alone."""

    @classmethod
    def build(
        cls,
        scene: Scene,
        title: str,
        keys: tuple[Keyframe, ...] = (),
        *,
        loop: bool = False,
        step: float = 0.5,
        levels: bool = False,
        budget: int | None = None,
        on_progress: Callable[[float], None] = lambda done: None,
    ) -> ScenePage:
        """The page of an edited scene, with the camera path of `keys`.

        `step` is the distance between samples in voxels. With `levels`, splats get levels of detail, for a
        folder (`page_nodes`): edits are baked in, so that the page does not show the scene before them, and
        stand still along the path; the page holds at most `budget` of its splats at a time, if given.
        `on_progress` is told how much is done of the edits along the path, or of the levels.

        Raises:
            CagefieldError: the scene holds discs (2DGS).
            EditError: edits that cannot be evaluated, or more than a page takes.
        """
        nodes: Mapping[str, bytes] = {}
        field = scene.rendered_field
        if levels:
            if not isinstance(field, SplatSet):
                raise CagefieldError(
                    "the scene holds voxels, whose pages have levels already; leave out --levels"
                )
            coarse, nodes = encode_page_nodes(
                edited_splats(scene), background=scene.background, budget=budget, on_progress=on_progress
            )
            found, along = {"field": coarse}, None
        elif isinstance(field, SplatSet):
            found, along = _splat_files(scene, field, keys, loop, on_progress)
        else:
            plain = VoxelRenderer(field, EditStack([]), preserve_opacity=scene.preserve_opacity)
            found = {"field": encode_page_field(field, step=step, background=scene.background)}
            if scene.edits.active:
                found["edits"] = encode_page_edits(plain.with_edits(for_pages(scene.prepared_edits)))
            along = path_edits(plain, scene.edits, keys, loop, scene.patcher, on_progress=on_progress)
        if along is not None:
            found["path"] = along.data
        header: dict[str, Any] = {
            "start": _view(scene.first_camera),
            "up": scene.up.tolist(),
            "center": scene.field.center.tolist(),
            "background": None if scene.background is None else list(scene.background),
            "path": _path(keys, loop),
            "extent": 2.0 * float(np.linalg.norm(scene.field.half_size)),
        }
        # With levels the edits are baked in, and nothing moves along the path.
        if entries := hotspot_entries(scene, () if levels else _stills(keys, loop)):
            header["hotspots"] = entries
        if scene.alignment.meters_per_unit is not None:
            header["meters_per_unit"] = scene.alignment.meters_per_unit
        return cls(title, header, found, along, nodes)

    def one_file(self) -> str:
        """The text of an HTML file that needs neither server nor network.

        The viewer comes first and the coarse level next, so that a browser shows it while the rest is on its
        way.
        """
        if self.nodes:
            raise CagefieldError("levels of detail are files beside a page; write a folder (--embed)")
        field, coarse = self.files["field"], bytes_until(self.files["field"], "1.")
        order = [("field", field[:coarse]), *((n, self.files[n]) for n in ("edits",) if n in self.files)]
        order += [("field", field[coarse:]), *((n, self.files[n]) for n in ("path",) if n in self.files)]
        scripts = [f"<script>{_viewer().decode()}</script>"]
        for name, data in order:
            scripts += [
                _script(name, data[at : at + SCRIPT_PART_BYTES])
                for at in range(0, len(data), SCRIPT_PART_BYTES)
            ]
        scripts += [_script(name, None) for name in self.files]
        entries = {name: {"bytes": len(data)} for name, data in self.files.items()}
        return self._html(ONE_FILE, entries, "\n".join(scripts))

    def folder(self) -> dict[str, bytes]:
        """The files, by name, of a folder for a web site; addresses are relative, and new for new bytes."""
        entries, written = {}, {SCRIPT: _viewer()}
        for name, data in self.files.items():
            written[NAMES[name]] = data
            entries[name] = {"bytes": len(data), "url": _address(NAMES[name], data)}
        written.update(self.nodes)
        entries["field"]["bytes"] = len(self.files["field"]) + sum(map(len, self.nodes.values()))
        script = f'<script src="{_address(SCRIPT, written[SCRIPT])}"></script>'
        written[INDEX] = self._html(FOLDER, entries, script).encode()
        return written

    def _html(self, policy: str, entries: Mapping[str, Any], scripts: str) -> str:
        parts = {
            "POLICY": policy,
            "TITLE": html.escape(self.title),
            # Of a script's text only "</" has a meaning to the page.
            "SCENE": json.dumps({**self.header, "files": entries}, allow_nan=False).replace("<", "\\u003c"),
            "SCRIPTS": scripts,
        }
        page = (_HERE / "page.html").read_text(encoding="utf-8")
        return re.sub("@([A-Z]+)@", lambda found: parts[found[1]], page)


def write_folder(folder: Path, written: Mapping[str, bytes]) -> None:
    """Writes the files of `ScenePage.folder` into a folder, which appears whole, or not at all.

    Other files of an older folder stay.
    """
    recover_folder(folder, lambda left: (left / SCRIPT).is_file())
    former = [path.name for path in folder.glob(f"{NODE_NAME}.*")] if folder.is_dir() else []
    names = {INDEX, SCRIPT, *NAMES.values(), *former, *written}
    with replaced_folder(folder, sorted(names)) as draft:
        for name, data in written.items():
            (draft / name).write_bytes(data)


def _splat_files(
    scene: Scene,
    splats: SplatSet,
    keys: tuple[Keyframe, ...],
    loop: bool,
    on_progress: Callable[[float], None],
) -> tuple[dict[str, bytes], PathEdits | None]:
    """(files by name, edits along the path) of a scene of splats."""
    if splats.field.discs:
        raise CagefieldError(
            "the scene's splats are discs (2DGS), which pages do not draw; "
            "export them as .ply, or render a video"
        )
    preserve_opacity, edits = scene.preserve_opacity, scene.prepared_edits
    splats = splats.with_pastes(edits)
    found = {"field": encode_page_splats(splats, background=scene.background)}
    if edits.steps:
        split = split_of(splats, edits)
        changed = changed_splats(splats, edits, preserve_opacity=preserve_opacity, split=split)
        found["edits"] = encode_page_splat_edits(splats.field, changed, packed=True)
    along = splat_path_edits(
        splats,
        scene.edits,
        keys,
        loop,
        scene.patcher,
        preserve_opacity=preserve_opacity,
        on_progress=on_progress,
    )
    return found, along


def _viewer() -> bytes:
    return (_HERE / "viewer" / SCRIPT).read_bytes()


def _address(name: str, data: bytes) -> str:
    """The name with a query that a browser's cache knows these bytes by."""
    return f"{name}?{hashlib.sha256(data).hexdigest()[:12]}"


def _script(name: str, data: bytes | None) -> str:
    text = "null" if data is None else f'"{base64.b64encode(data).decode()}"'
    return f'<script>cagefieldViewer.take("{name}",{text})</script>'


def _view(camera: Camera) -> dict[str, Any]:
    """A camera's pose, and the field of view of its shorter side, which the window's shorter side has."""
    least = min(camera.width / camera.fx, camera.height / camera.fy)
    return {"c2w": camera.c2w.ravel().tolist(), "fov_y_deg": math.degrees(2.0 * math.atan(0.5 * least))}


def _path(keys: tuple[Keyframe, ...], loop: bool) -> dict[str, Any] | None:
    if len(keys) < 2:
        return None
    pictures = _stills(keys, loop)
    seconds = sum(key.seconds for key in (keys if loop else keys[:-1]))
    return {"stills": [_view(still.camera) for still in pictures], "seconds": seconds, "loop": loop}


def _stills(keys: tuple[Keyframe, ...], loop: bool) -> tuple[Still, ...]:
    """Images of the path between which the page goes straight; none for fewer than two keyframes."""
    if len(keys) < 2:
        return ()
    return stills(keys, loop=loop, fps=STILLS_A_SECOND, width=100, height=100)
