"""Values of a scene as its folder has them, read from it and written to it; `scene` states the layout."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.edits import EditStack
from cagefield.edits.edit_files import dump_edits, load_edits
from cagefield.errors import CagefieldError, SceneError
from cagefield.fields.external.external_field import ExternalField
from cagefield.fields.nerf_field import NerfField
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.scene.manifest import read_manifest
from cagefield.scene.removed_elements import Removal, dump_removed, read_removed, without_removed
from cagefield.scene.scene_files import (
    CAMERAS,
    EDITS,
    FIELD,
    ORIGINAL,
    REMOVED,
    check_part,
    read_cameras,
    read_field,
    read_original,
    recover,
    save_original,
    write_json,
)


def read_scene(folder: Path, whole: bool) -> dict[str, Any]:
    """Arguments of `Scene` from its folder: all but the folder itself, unchecked where `Scene` checks them.

    The field is without the elements that were deleted in the editor, `whole` with them.

    Raises:
        SceneError: the folder or one of its files is missing, damaged or of a newer version.
    """
    recover(folder)
    if not folder.is_dir():
        if folder.exists():
            raise SceneError(
                f"scene {folder} is a file, not a folder; give the folder that `cagefield train -o` wrote, "
                "or `cagefield import -o` of a file of splats"
            )
        raise SceneError(f"scene {folder} does not exist; give the folder that `cagefield train -o` wrote")
    manifest = read_manifest(folder)
    for name in (FIELD, CAMERAS, EDITS):
        check_part(folder / name)
    cameras = read_cameras(folder / CAMERAS)
    edits = load_edits(folder / EDITS, check=False, mend=True)
    field, removed = read_field(folder / FIELD), None if whole else read_removed(folder)
    removal = None
    if removed is not None:
        try:
            removal, field = Removal(field, removed), without_removed(field, removed)
        except CagefieldError as error:
            cure = "remove the file to restore all elements"
            raise SceneError(f"{folder / REMOVED}: {error!s:.200}; {cure}") from None
    original = read_original(folder / ORIGINAL) if (folder / ORIGINAL).exists() else None
    values = manifest._asdict()
    if manifest.source_to_world is None:
        values["source_to_world"] = np.eye(4)
    return dict(values, field=field, edits=edits, cameras=cameras, original=original, removal=removal)


def write_scene(
    folder: Path,
    field: VoxelField | SplatField,
    removal: Removal | None,
    original: NerfField | ExternalField | None,
    edits: EditStack,
    cameras: Mapping[str, tuple[Camera, ...]],
) -> None:
    """Writes the files of a scene but for its manifest into a folder; the whole field where there is a
    removal."""
    (field if removal is None else removal.field).save(folder / FIELD)
    if removal is not None:
        (folder / REMOVED).write_text(dump_removed(removal.selection), encoding="utf-8")
    if original is not None:
        save_original(original, folder / ORIGINAL)
    (folder / EDITS).write_text(dump_edits(edits), encoding="utf-8")
    write_json(
        {split: [camera.to_dict() for camera in members] for split, members in cameras.items()},
        folder / CAMERAS,
    )
