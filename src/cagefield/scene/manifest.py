"""Manifest of a scene folder, `scene.json`; `scene` states its entries."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cagefield.errors import CagefieldError, SceneError
from cagefield.files.atomic import replaced_file
from cagefield.files.stale_files import remove_leftovers
from cagefield.images.render_result import background_rgb
from cagefield.scene.alignment import Alignment
from cagefield.scene.hotspots import Hotspot, hotspots_from_value
from cagefield.scene.scene_files import FORMAT, MANIFEST, VERSION, check_part, read_json, write_json
from cagefield.typing import Array

MAX_CONDITION = 1e9
"""Condition number of the linear part of `source_to_world`, from which on it counts as singular."""


class Manifest(NamedTuple):
    """Values of a manifest; as read, gains and source_to_world (None without) are unchecked."""

    background: tuple[float, float, float] | None
    gains: Any
    preserve_opacity: bool
    source_to_world: Any
    alignment: Alignment
    hotspots: tuple[Hotspot, ...] = ()


def read_manifest(folder: Path) -> Manifest:
    """The values of a scene's manifest. Raises SceneError where it is missing, damaged or newer."""
    path = folder / MANIFEST
    if not path.exists():
        raise SceneError(
            f"folder {folder} holds no {MANIFEST}: it is not a scene; give the folder of a scene"
        )
    check_part(path)
    document = read_json(path)
    if document.get("format") != FORMAT:
        raise SceneError(
            f'{path}: format is {document.get("format")!r:.60}, expected "{FORMAT}"; give a scene folder'
        )
    version = document.get("version")
    if not isinstance(version, int) or isinstance(version, bool) or version < 1:
        raise SceneError(f"{path}: version is {version!r:.40}, expected a whole number from 1 to {VERSION}")
    if version > VERSION:
        raise SceneError(
            f"{path}: version is {version}, this cagefield reads up to {VERSION}; upgrade cagefield"
        )
    opacity = document.get("preserve_opacity", True)
    if not isinstance(opacity, bool):
        raise SceneError(f"{path}: preserve_opacity is {opacity!r:.40}; it must be true or false")
    try:
        background = background_rgb(document.get("background"))
    except (CagefieldError, TypeError, ValueError) as error:
        raise SceneError(f"{path}: {error!s:.200}") from None
    try:
        alignment = Alignment.from_value(document.get("alignment", {}))
        hotspots = hotspots_from_value(document.get("hotspots", []))
    except SceneError as error:
        raise SceneError(f"{path}: {error}; correct or remove the entry in the file") from None
    gains = document.get("gains", ())
    return Manifest(background, gains, opacity, document.get("source_to_world"), alignment, hotspots)


def manifest_document(manifest: Manifest) -> Mapping[str, object]:
    """Entries of a manifest; those that say nothing are left out."""
    document: dict[str, object] = {
        "format": FORMAT,
        "version": VERSION,
        "background": manifest.background,
    }
    if manifest.gains:
        document["gains"] = manifest.gains
    if not manifest.preserve_opacity:
        document["preserve_opacity"] = False
    if not np.array_equal(manifest.source_to_world, np.eye(4)):
        document["source_to_world"] = manifest.source_to_world.tolist()
    if manifest.alignment:
        document["alignment"] = manifest.alignment.to_dict()
    if manifest.hotspots:
        document["hotspots"] = [hotspot.to_dict() for hotspot in manifest.hotspots]
    return document


@contextmanager
def manifest_draft(folder: Path, manifest: Manifest) -> Iterator[None]:
    """The manifest is written when the context begins and takes its place in the folder when it ends."""
    remove_leftovers(folder / MANIFEST)
    with replaced_file(folder / MANIFEST, parents=False) as draft:
        write_json(manifest_document(manifest), draft)
        yield


def checked_gains(values: Any, count: int) -> tuple[tuple[float, float, float], ...]:
    """The gains as tuples, none or `count` of them."""
    try:
        gains = tuple((float(r), float(g), float(b)) for r, g, b in values)
    except (TypeError, ValueError):
        raise SceneError(f"gains must be a list of [r, g, b], got {values!r}") from None
    if gains and len(gains) != count:
        raise SceneError(f"{len(gains)} gains for {count} train cameras; give each one, or none")
    for index, gain in enumerate(gains):
        if not all(0.0 < channel < math.inf for channel in gain):
            raise SceneError(f"gains[{index}] is {list(gain)}; each must be a number above 0")
    return gains


def checked_affine(values: Any) -> Array:
    """The matrix [4,4] of an affine map that has an inverse, read-only."""
    try:
        matrix = np.array(values, np.float64)
    except (TypeError, ValueError, OverflowError):
        matrix = np.empty(0)
    fits = matrix.shape == (4, 4) and bool(np.isfinite(matrix).all())
    if not fits or (matrix[3] != (0, 0, 0, 1)).any() or not np.linalg.cond(matrix[:3, :3]) < MAX_CONDITION:
        raise SceneError(
            "source_to_world must be 4 rows of 4 finite numbers, an affine map with an inverse, got "
            f"{values!r:.80}"
        )
    matrix.setflags(write=False)
    return matrix
