"""Faults of files after a kill: not readable, not all there, or not what was promised.

Each check takes the folder of the work, and the last number that it said before it was killed, -1 for none.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from cagefield import Scene

Check = Callable[[Path, int], "str | None"]


def scene_problem(folder: Path, said: int, name: str = "scene") -> str | None:
    """Fault of the scene: not readable, the user's file gone, or another one than promised."""
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
    """Fault of a scene that may not be there yet."""
    if said < 1 and not (folder / "new").exists():
        return scene_problem(folder, 0)
    return scene_problem(folder, said, "new") or scene_problem(folder, 0)


def file_problem(ending: str) -> Check:
    def problem(folder: Path, said: int) -> str | None:
        from cagefield.formats.splats.splat_files import read_splats

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
    if said >= 1 and ((folder / "new.training").exists() or (folder / "new.blocks").exists()):
        return "lost: the training's end, its checkpoint is still there"
    return None


def pictures_problem(folder: Path, said: int) -> str | None:
    """Fault of pictures that replace old ones of 4 x 4 pixels: each is old, or new and 32 pixels wide."""
    from cagefield.images.image_files import read_image

    out = folder / "out"
    if not (out / "mine" / "notes.txt").is_file():
        return "lost: the user's file"
    pictures = sorted(out.glob("[0-9]*.png"))
    if len(pictures) != 3:
        return f"lost: {3 - len(pictures)} pictures"
    try:
        sizes = {max(read_image(picture).shape[:2]) for picture in pictures}
    except Exception as error:
        return f"unreadable: {error}"
    is_whole = sizes == {32} if said >= 1 else sizes <= {4, 32}
    return None if is_whole else f"lost: pictures {sorted(sizes)} pixels wide"


def video_problem(folder: Path, said: int) -> str | None:
    import imageio.v3 as imageio

    if not (folder / "out.mp4").exists():
        return "lost: the video" if said >= 1 else None
    try:
        count = len(imageio.imread(folder / "out.mp4"))
    except Exception as error:
        return f"unreadable: {error}"
    return None if count == 6 else f"unreadable: {count} frames of 6"


def old_problem(name: str, check: Check) -> Check:
    """Fault of a file or folder that has replaced an older one: it must be there, whatever was said."""

    def problem(folder: Path, said: int) -> str | None:
        return check(folder, 1) if (folder / name).exists() else f"lost: {name}"

    return problem


def glb_problem(name: str) -> Check:
    def problem(folder: Path, said: int) -> str | None:
        file = folder / name
        if not file.exists():
            return "lost: the file" if said >= 1 else None
        content = file.read_bytes()
        whole = content[:4] == b"glTF" and int.from_bytes(content[8:12], "little") == len(content)
        return None if whole else "unreadable: the file is cut off"

    return problem


def _read_with(name: str, read: Callable[[Path], object]) -> Check:
    def problem(folder: Path, said: int) -> str | None:
        try:
            read(folder / name)
        except Exception as error:
            return f"unreadable: {error}"
        return None

    return problem


def ply_problem(name: str) -> Check:
    from cagefield.files.ply import read_ply

    return _read_with(name, read_ply)


def picture_problem(name: str) -> Check:
    from cagefield.images.image_files import read_image

    return _read_with(name, read_image)


def json_problem(name: str) -> Check:
    return _read_with(name, lambda path: json.loads(path.read_text()))


def table_problem(name: str) -> Check:
    """A table in Markdown: whole lines, some of them rows."""

    def read(path: Path) -> None:
        text = path.read_text()
        if not text.endswith("\n") or text.count("\n|") < 3:
            raise ValueError("the table is cut off")

    return _read_with(name, read)


def page_folder_problem(name: str) -> Check:
    """A page in a folder: whole scripts and what they load."""

    def read(folder: Path) -> None:
        names = {file.name for file in folder.iterdir()}
        page = (folder / "index.html").read_text()
        if not page.rstrip().endswith("</html>") or len(names) < 4:
            raise ValueError(f"the page is cut off, {sorted(names)}")

    return _read_with(name, read)


def published_problem(name: str) -> Check:
    """A published benchmark: the table of its pictures, by its own script."""

    def read(folder: Path) -> None:
        from benchmarks.edits.publication import load_script

        script = load_script(folder / "evaluate.py")
        rows = script.table(root=folder)
        if rows != json.loads((folder / "table.json").read_text()):
            raise ValueError("the table is of other pictures")
        if script.markdown(rows) != (folder / "table.md").read_text():
            raise ValueError("the table is cut off")

    return _read_with(name, read)


def photos_problem(name: str) -> Check:
    def problem(folder: Path, said: int) -> str | None:
        from cagefield import datasets
        from cagefield.images.image_files import read_image

        out = folder / name
        if said < 1 and not any(
            (out / mark).exists() for mark in ("transforms_train.json", "transforms.json")
        ):
            return None
        try:
            found = datasets.load_dataset(out)
            for view in (*found.train, *found.test):
                read_image(view.image_path)
        except Exception as error:
            return f"unreadable: {error}"
        return None

    return problem


def demo_problem(folder: Path, said: int) -> str | None:
    """Fault of the results of `demo`: scenes, photos, pictures, the video of 2 frames."""
    import imageio.v3 as imageio

    from cagefield.edits import load_edits
    from cagefield.images.image_files import read_image

    out = folder / "demo"
    try:
        Scene.open(out / "scene")
        if len(Scene.open(out / "edited").edits) != len(load_edits(out / "edits.yaml")):
            return "lost: edits of the demo"
        for name in ("before", "after", "before_after"):
            read_image(out / f"{name}.png")
        if len(imageio.imread(out / "turntable.mp4")) != 2:
            return "unreadable: the video is cut off"
    except Exception as error:
        return f"unreadable: {error}"
    return photos_problem("demo/photos")(folder, 1)


def posed_problem(folder: Path, said: int) -> str | None:
    """Fault of the transforms.json, of which an old one was there: not whole, or a file gone."""
    from cagefield import datasets

    data = folder / "data"
    if not (data / "notes.txt").is_file():
        return "lost: the user's file"
    try:
        found = datasets.load_dataset(data, holdout=0)
        views = {view.name: view for view in (*found.train, *found.test, *found.val)}
        for view in views.values():
            view.load()
    except Exception as error:
        return f"unreadable: {error}"
    return None if len(views) == 5 else f"lost: {5 - len(views)} photos of 5"


def poses_problem(folder: Path, said: int) -> str | None:
    """Fault of the data set, of which an old one was there: not whole, or the user's file gone."""
    from cagefield import datasets
    from cagefield.datasets.colmap.colmap_files import check_complete
    from cagefield.images.image_files import read_image

    data = folder / "data"
    if not (data / "notes.txt").is_file():
        return "lost: the user's file"
    try:
        check_complete(data / "sparse" / "0")
        views = datasets.load_dataset(data, holdout=0).train
        for view in views:
            read_image(view.image_path)
    except Exception as error:
        return f"unreadable: {error}"
    return None if len(views) == 4 else f"lost: {4 - len(views)} photos of 4"
