"""Files of a scene folder and their readers; `scene` states the layout."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

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
    for split, members in read_json(path).items():
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


def read_json(path: Path) -> dict[str, Any]:
    try:
        document = json_text.loads(read_text(path))
    except (ValueError, OSError) as error:
        raise SceneError(f"{path} is not readable JSON ({error}); copy it back or train again") from error
    if not isinstance(document, dict):
        raise SceneError(f"{path} must hold a JSON object; copy it back or train again")
    return document
