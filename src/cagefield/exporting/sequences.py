"""Sequences of splat files: a file for each frame of an animated edit."""

from __future__ import annotations

import re
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path

from cagefield.cameras.keyframes import Still
from cagefield.errors import CagefieldError
from cagefield.exporting import upright
from cagefield.exporting.path_frames import CameraPath, splats_at
from cagefield.exporting.similarity import aligned_splats
from cagefield.fields.splat_field import SplatField
from cagefield.files.atomic import replaced_file
from cagefield.files.stale_files import remove_unfinished
from cagefield.formats.splats.axes import Axes
from cagefield.formats.splats.splat_files import find_writer, write_splats
from cagefield.formats.splats.spz_writer import Version as SpzVersion
from cagefield.scene.scene import Scene
from cagefield.typing import Array

_NUMBER = re.compile(r"%(0[1-9])?d")


def is_sequence(path: Path) -> bool:
    """Whether a name stands for numbered files, such as frame_%04d.ply."""
    return "%" in path.name


def frame_file(pattern: Path, number: int) -> Path:
    """File of a frame by a name with %d, or such as %04d.

    Raises:
        CagefieldError: a name without it, or with two.
    """
    if pattern.name.count("%") != 1 or not _NUMBER.search(pattern.name):
        raise CagefieldError(f"{pattern}: the name of a sequence has one %d or %04d, such as frame_%04d.ply")
    return pattern.with_name(_NUMBER.sub(lambda found: found.group() % number, pattern.name))


def write_sequence(
    scene: Scene,
    path: CameraPath,
    pattern: Path,
    up: Array,
    *,
    axes: Axes | None = None,
    spz_version: SpzVersion | None = None,
    overwrite: bool = False,
    on_progress: Callable[[float, str], None] = lambda done, note: None,
) -> tuple[int, int]:
    """Write the edited splats of each frame of a path, numbered from 0; (written, kept) numbers of files.

    `pattern` is a name with %d or %04d. Splats are aligned as the scene is, and
    turned upright from `up` [3]. Files that are there are
    kept unless `overwrite` is set: an interrupted export goes on where it ended. Each file is complete or not
    there; unfinished files of ended programs are removed from their folder. Memory holds one frame.

    Raises:
        CagefieldError: a name without number, or a format without writer.
        EditError: an edit that is not possible at a part that the path shows.
    """
    find_writer(pattern, spz_version)
    remove_unfinished(pattern.parent)
    stills = path.stills()
    written = kept = 0
    for number, still in enumerate(stills):
        file = frame_file(pattern, number)
        if file.exists() and not overwrite:
            kept += 1
        else:
            write_splats(_frame_splats(scene, still, up), file, axes, spz_version=spz_version)
            written += 1
        on_progress((number + 1) / len(stills), f"{number + 1}/{len(stills)}")
    return written, kept


def write_sequence_archive(
    scene: Scene,
    path: CameraPath,
    archive: Path,
    pattern: str,
    up: Array,
    *,
    on_progress: Callable[[float], None] = lambda done: None,
) -> int:
    """Write the files of `write_sequence` into one uncompressed zip file; the number of frames.

    `pattern` is the name of its members, with %d or %04d. The archive appears as a whole or not at all.
    Memory holds one frame, the disk the archive and one frame.

    Raises as `write_sequence`.
    """
    stills = path.stills()
    names = [frame_file(Path(pattern), number).name for number in range(len(stills))]
    find_writer(Path(pattern))
    archive.parent.mkdir(parents=True, exist_ok=True)
    with (
        tempfile.TemporaryDirectory(dir=archive.parent) as folder,
        replaced_file(archive) as hidden,
        zipfile.ZipFile(hidden, "w", zipfile.ZIP_STORED) as members,
    ):
        for number, (name, still) in enumerate(zip(names, stills, strict=True)):
            file = Path(folder) / name
            write_splats(_frame_splats(scene, still, up), file)
            members.write(file, name)
            file.unlink()
            on_progress((number + 1) / len(stills))
    return len(stills)


def _frame_splats(scene: Scene, still: Still, up: Array) -> SplatField:
    """Edited splats at a frame, aligned and upright."""
    return upright(aligned_splats(splats_at(scene, still.parts), scene), up)
