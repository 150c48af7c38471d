"""`cagefield export` of a page that any browser shows: a file, or with `--embed` a folder."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from cagefield.cli.options import Device, check_file, check_folder, progress_bar
from cagefield.files.safe_open import real_path

if TYPE_CHECKING:
    from cagefield.pages.path_states import PathEdits
    from cagefield.scene.scene import Scene

LARGE_PAGE_BYTES = 25e6
"""Bytes of a page from which on a line warns."""


def export_page(
    folder: Path,
    out: Path,
    device: Device,
    *,
    embed: bool,
    levels: bool,
    overwrite: bool,
    budget: int | None = None,
) -> None:
    """Write a page of the scene in `folder`, and print its contents.

    Args:
        embed: whether `out` is a folder, whose field is a file of its own.
        levels: whether splats have levels of detail.
        budget: maximum number of splats that a page with levels holds at a time.

    Raises:
        CagefieldError: no scene, or a file that is there without `overwrite`.
    """
    from cagefield.cameras.keyframe_files import load_keys
    from cagefield.compute import devices
    from cagefield.files.atomic import replaced_file
    from cagefield.pages.scene_page import INDEX, SCRIPT, ScenePage, write_folder
    from cagefield.scene.scene import Scene

    if embed:
        check_folder(out, overwrite, SCRIPT)
    else:
        check_file(out, overwrite)
    scene = Scene.open(folder)
    devices.start(device)
    path = folder / "camera_path.json"
    keys, loop = load_keys(path) if path.exists() else ((), False)
    with progress_bar("Levels of detail" if levels else "Edits along the path") as move:
        page = ScenePage.build(
            scene,
            real_path(folder).name,
            keys,
            loop=loop,
            levels=levels,
            budget=budget,
            on_progress=lambda done: move(done, 1.0, ""),
        )
    if embed:
        written = page.folder()
        write_folder(out, written)
        size = sum(map(len, written.values()))
    else:
        text = page.one_file()
        size = len(text)
        with replaced_file(out, parents=False) as draft:
            draft.write_text(text, encoding="utf-8")
    edits = len(scene.edits.active)
    shown = f"{edits} edit{'s' * (edits != 1)}, " if edits else "no edits, "
    way = f"a camera path of {len(keys)} keys" if len(keys) > 1 else "no camera path"
    print(f"a page of {size / 1e6:.1f} MB: {shown}{way}")
    if page.nodes:
        first = size - sum(map(len, page.nodes.values()))
        print(
            f"levels of detail: {first / 1e6:.1f} MB until the first picture, {len(page.nodes)} nodes; "
            "edits baked in"
        )
    if size > LARGE_PAGE_BYTES and not page.nodes:
        warnings.warn(
            f"the page has {size / 1e6:.0f} MB, more than the {LARGE_PAGE_BYTES / 1e6:.0f} that most "
            "sites and phones take well; a smaller field, or fewer splats, make a smaller one",
            stacklevel=2,
        )
    if page.along is not None:
        print(_along(page.along, scene))
    print(f"written to {out}")
    if embed:
        name = real_path(out).name
        print(f'<iframe src="{name}/{INDEX}" width="800" height="600" style="border: 0"></iframe>')


def _along(along: PathEdits, scene: Scene) -> str:
    """A line of figures of the edits along the path."""
    states = f"edits along the path: {along.states} states, "
    size = f"{len(along.data) / 1e6:.1f} MB; between two states "
    if along.nodes is None:
        whole = "" if along.split else "; on the way none is split where an edit bends or cuts it"
        extent = 2.0 * float(scene.field.half_size.max())
        mean, most = (100.0 * error / extent for error in along.error)
        return (
            f"{states}{size}splats are {mean:.2g}% of the scene's size beside the edits of that moment "
            f"in the mean, {most:.2g}% for 99% of them{whole}"
        )
    mean, most = (error / scene.field.sample_spacing for error in along.error)
    return (
        f"{states}lattices of {along.nodes}^3 nodes, {size}they are {mean:.2g} voxels beside the edits of "
        f"that moment in the mean, {most:.2g} at 99% of the points"
    )
