"""What is wrong with files after a kill: not readable, not all there, or not what was promised.

Each check takes the folder of the work, and the last number that it said before it was killed, -1 for none.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from cagefield import Scene


def scene_problem(folder: Path, said: int, name: str = "scene") -> str | None:
    """What is wrong with the scene: not readable, the user's file gone, or not what was promised."""
    try:
        scene = Scene.open(folder / name)
    except Exception as error:
        return f"unreadable: {error}"
    if name == "scene" and not (folder / name / "notes.txt").is_file():
        return "lost: the user's file"
    if (
        said >= 1
        and (folder / "x.ply").is_file() is False
        and [edit.name for edit in scene.edits] != ["moved"]
    ):
        return "lost: the edit"
    return None


def new_problem(folder: Path, said: int) -> str | None:
    """The same of a scene that may not be there yet."""
    if said < 1 and not (folder / "new").exists():
        return scene_problem(folder, 0)
    return scene_problem(folder, said, "new") or scene_problem(folder, 0)


def file_problem(ending: str) -> Callable[[Path, int], str | None]:
    def problem(folder: Path, said: int) -> str | None:
        from cagefield.formats.splat_files import read_splats

        out = folder / f"out{ending}"
        if not out.exists():
            return "lost: the file" if said >= 1 else None
        try:
            if ending != ".html":
                read_splats(out)
            elif not out.read_text().rstrip().endswith("</html>"):
                return "unreadable: the page is cut off"
        except Exception as error:
            return f"unreadable: {error}"
        return None

    return problem


def trained_problem(folder: Path, said: int) -> str | None:
    if said < 1 and not (folder / "new").exists():
        return None
    try:
        Scene.open(folder / "new")
    except Exception as error:
        return f"unreadable: {error}"
    return None


def pictures_problem(folder: Path, said: int) -> str | None:
    from cagefield.rendering.images import read_image

    pictures = sorted((folder / "out").glob("[0-9]*.png"))
    if said >= 1 and len(pictures) != 3:
        return f"lost: {3 - len(pictures)} pictures"
    try:
        for picture in pictures:
            read_image(picture)
    except Exception as error:
        return f"unreadable: {error}"
    return None


def video_problem(folder: Path, said: int) -> str | None:
    import imageio.v3 as imageio

    if not (folder / "out.mp4").exists():
        return "lost: the video" if said >= 1 else None
    try:
        count = len(imageio.imread(folder / "out.mp4"))
    except Exception as error:
        return f"unreadable: {error}"
    return None if count == 6 else f"unreadable: {count} frames of 6"


def mesh_problem(folder: Path, said: int) -> str | None:
    file = folder / "mesh.glb"
    if not file.exists():
        return "lost: the file" if said >= 1 else None
    content = file.read_bytes()
    whole = content[:4] == b"glTF" and int.from_bytes(content[8:12], "little") == len(content)
    return None if whole else "unreadable: the file is cut off"


def photos_problem(folder: Path, said: int) -> str | None:
    from cagefield import datasets

    out = folder / "out"
    if said < 1 and not (out / "transforms_train.json").exists():
        return None
    try:
        datasets.load_dataset(out)
    except Exception as error:
        return f"unreadable: {error}"
    return None


def poses_problem(folder: Path, said: int) -> str | None:
    """What is wrong with the data set, of which an old one was there: not whole, or the user's file gone."""
    from cagefield import datasets
    from cagefield.datasets.colmap_files import check_whole
    from cagefield.rendering.images import read_image

    data = folder / "data"
    if not (data / "notes.txt").is_file():
        return "lost: the user's file"
    try:
        check_whole(data / "sparse" / "0")
        views = datasets.load_dataset(data, holdout=0).train
        for view in views:
            read_image(view.image_path)
    except Exception as error:
        return f"unreadable: {error}"
    return None if len(views) == 4 else f"lost: {4 - len(views)} photos of 4"
