"""Files of a scene folder and their readers; `scene` states the layout."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from cagefield.cameras.camera import Camera
from cagefield.errors import CagefieldError, SceneError
from cagefield.fields.external.external_field import ExternalField
from cagefield.fields.external.external_file import EXTERNAL_KINDS, load_external, save_external
from cagefield.fields.field_files import read_field_kind
from cagefield.fields.nerf_field import NerfField
from cagefield.fields.nerf_file import load_nerf, save_nerf
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.files import json_text
from cagefield.files.atomic import check_writable, recover_folder
from cagefield.files.safe_open import (
    FileState,
    UnreadableError,
    check_regular,
    file_state,
    read_text,
    real_path,
)
from cagefield.images.render_result import background_rgb
from cagefield.scene.alignment import Alignment

FORMAT = "cagefield-scene"
VERSION = 1

FIELD, EDITS, CAMERAS, MANIFEST = "field.safetensors", "edits.yaml", "cameras.json", "scene.json"
ORIGINAL, REMOVED = "original.safetensors", "removed.json"
FILES = (FIELD, ORIGINAL, REMOVED, EDITS, CAMERAS, MANIFEST)


def check_destination(path: Path | str, overwrite: bool) -> Path:
    """The resolved folder that a scene may be written to: new, empty, or a scene to be replaced.

    Called before a long training, so that its result has a place to go.

    Raises:
        SceneError: something is there that may not be replaced.
        OSError: nothing can be written there.
    """
    target = real_path(path)
    recover(target)
    if target.exists() and not target.is_dir():
        raise SceneError(f"{path} is a file; give a new folder for the scene")
    if target.exists() and any(target.iterdir()):
        if not is_scene(target):
            raise SceneError(
                f"{path} is a folder that holds no scene and is left as it is; give a new folder"
            )
        if not overwrite:
            raise SceneError(
                f"scene {path} exists already; give a new folder, or --overwrite (overwrite=True)"
            )
    check_writable(target)
    return target


def recover(folder: Path) -> None:
    """Puts a scene back that a program left under another name when it was ended while it replaced it.

    Says so in a warning. A scene that is there, and a folder that none was at, stay as they are.
    """
    recover_folder(real_path(folder), is_scene)


def is_scene(path: Path | str) -> bool:
    """True where `path` is a folder with the manifest of a scene, of any version."""
    try:
        document = json_text.loads(read_text(Path(path) / MANIFEST))
    except (OSError, ValueError):
        return False
    return isinstance(document, dict) and document.get("format") == FORMAT


def field_states(folder: Path | str) -> tuple[FileState, FileState, FileState]:
    """Of the field, the original and the cameras, which programs that edit a scene leave as they are.

    Others than they were: the scene was replaced.
    """
    field, original, cameras = (file_state(Path(folder) / name) for name in (FIELD, ORIGINAL, CAMERAS))
    return field, original, cameras


def check_part(path: Path) -> None:
    """Check that a file of a scene is readable. Raises SceneError that names the obstacle."""
    cure = "copy it back or train the scene again"
    try:
        check_regular(path)
    except (FileNotFoundError, NotADirectoryError):
        raise SceneError(f"{path} is missing; {cure}") from None
    except IsADirectoryError:
        raise SceneError(f"{path} is a folder, not a file; {cure}") from None
    except UnreadableError as error:
        raise SceneError(f"{path}: {error}") from None
    except OSError as error:
        raise SceneError(f"{path} cannot be read ({error.strerror}); {cure}") from None


class Manifest(NamedTuple):
    """Values of a manifest; gains and source_to_world (None without) are unchecked."""

    background: tuple[float, float, float] | None
    gains: Any
    preserve_opacity: bool
    source_to_world: Any
    alignment: Alignment


def read_manifest(folder: Path) -> Manifest:
    """The values of a scene's manifest. Raises SceneError where it is missing, damaged or newer."""
    path = folder / MANIFEST
    if not path.exists():
        raise SceneError(
            f"folder {folder} holds no {MANIFEST}: it is not a scene; give the folder of a scene"
        )
    check_part(path)
    document = _read_json(path)
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
    except SceneError as error:
        raise SceneError(f"{path}: {error}; correct or remove the entry in the file") from None
    gains = document.get("gains", ())
    return Manifest(background, gains, opacity, document.get("source_to_world"), alignment)


def read_field(path: Path) -> VoxelField | SplatField:
    """The field in a file, of the kind that its header names.

    Raises:
        FieldError: the file is missing, damaged, of a kind that scenes do not hold or of a newer version.
    """
    kind = read_field_kind(path)
    if kind == "SplatField":
        return SplatField.load(path)
    return VoxelField.load(path)


def read_original(path: Path) -> NerfField | ExternalField:
    """The field that a scene's voxels were baked from, of the kind that the file's header names.

    Raises:
        FieldError: the file is damaged, of a kind that is not read or of a newer version.
    """
    kind = read_field_kind(path)
    return load_external(path, kind) if kind in EXTERNAL_KINDS else load_nerf(path)


def save_original(field: NerfField | ExternalField, path: Path) -> None:
    """Writes the field that a scene's voxels were baked from."""
    if isinstance(field, ExternalField):
        save_external(field, path)
    else:
        save_nerf(field, path)


def read_cameras(path: Path) -> dict[str, tuple[Camera, ...]]:
    cameras: dict[str, tuple[Camera, ...]] = {}
    for split, members in _read_json(path).items():
        if not isinstance(members, list):
            raise SceneError(f'{path}: "{split}" must be a list of cameras; write the scene again')
        read = []
        for index, member in enumerate(members):
            try:
                read.append(Camera.from_dict(member))
            except (CagefieldError, KeyError, TypeError, AttributeError) as error:
                raise SceneError(f"{path}: {split}[{index}] is no camera: {error!s:.200}") from error
        cameras[split] = tuple(read)
    return cameras


def write_json(document: Mapping[str, object], path: Path) -> None:
    path.write_text(json.dumps(document, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _read_json(path: Path) -> dict[str, Any]:
    try:
        document = json_text.loads(read_text(path))
    except (ValueError, OSError) as error:
        raise SceneError(f"{path} is not readable JSON ({error}); copy it back or train again") from error
    if not isinstance(document, dict):
        raise SceneError(f"{path} must hold a JSON object; copy it back or train again")
    return document
