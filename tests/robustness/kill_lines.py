"""Commands that are killed, given by their command lines: most of them over an old result of their own."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

from benchmarks.captures.street import write_street
from kill_checks import (
    demo_problem,
    file_problem,
    glb_problem,
    json_problem,
    old_problem,
    page_folder_problem,
    photos_problem,
    picture_problem,
    ply_problem,
    published_problem,
    scene_problem,
    table_problem,
    trained_problem,
)
from kill_command import Check, Command, Make, cli, put_scene, put_splats, renamed
from kill_points import Say
from torch_files import write_checkpoints

from cagefield import Scene
from cagefield.formats.splats.splat_files import write_splats
from plenoctree_files import plenoctree_arrays, write_plenoctree
from splat_scenes import ball_of_splats


def _line(words: str, make: Make, check: Check) -> Command:
    """A command by its words, `{}` is its folder. --overwrite is said too."""

    def work(folder: Path, say: Say) -> None:
        cli(*(word.replace("{}", str(folder)) for word in words.split()), "--overwrite")
        say(1)

    return Command(make, work, check)


def _with_old_file(ending: str) -> Make:
    """Splats, and a file of other splats where the new one is to be."""

    def make(folder: Path) -> None:
        put_splats(folder)
        write_splats(ball_of_splats(30), folder / f"out{ending}")

    return make


def _with_old_bytes(name: str, make: Make = put_scene) -> Make:
    """Copies of the files of `make` and of another run of the command."""

    def made(folder: Path) -> None:
        make(folder)
        shutil.copyfile(_old(name), folder / name)

    return made


_OLD_LINES = {
    "mesh.glb": "export {}/scene -o {}/mesh.glb --as mesh",
    "mesh.ply": "export {}/scene -o {}/mesh.ply --as mesh",
    "points.ply": "export {}/scene -o {}/points.ply --as points --splats 300",
    "fitted.ply": "export {}/scene -o {}/fitted.ply --steps 2 --splats 100",
    "grids.png": "bench grids -o {}/grids.png --methods trilinear",
    "speed.json": "bench speed {}/scene -o {}/speed.json --size 24 --cameras 1 --rounds 1",
    "curve.csv": "bench training {}/made -o {}/curve.csv --steps 3 --resolution 16 --scene-out {}/new",
    "edits.md": (
        "bench edits -o {}/edits.md --scenes chair --edits lean_back --views 3 --size 16 --test-views 1 "
        "--steps 3 --resolution 16 --exact-size 16 --exact-views 1 --no-methods --workdir {}/work"
    ),
    "captures.md": (
        "bench captures room-chair -o {}/captures.md --room-views 8 --room-size 48 --steps 2 --splats 100 "
        "--workdir {}/work"
    ),
    "published": (
        "bench publish {}/published --edits lean_back --methods trilinear --views 3 --size 16 --test-views 1 "
        "--steps 3 --resolution 16 --exact-size 16 --exact-views 1 --workdir {}/work"
    ),
    "one.png": "render {}/scene -o {}/one.png --views 0 --size 24",
    "out": "export {}/scene -o {}/out --as page --embed",
    "made": "make-scene chair -o {}/made --views 2 --test-views 1 --size 16",
    "room": "make-scene room-chair -o {}/room --views 8 --size 48",
    "demo": "demo -o {}/demo --views 3 --size 32 --steps 3 --resolution 16 --frames 2",
}


@cache
def _old_folder(name: str) -> tempfile.TemporaryDirectory[str]:
    """A folder with what one of `_OLD_LINES` writes; made once, by another process."""
    folder = tempfile.TemporaryDirectory(prefix="cagefield-old-")
    put_scene(Path(folder.name))
    words = [word.replace("{}", folder.name) for word in _OLD_LINES[name].split()]
    subprocess.run([sys.executable, "-m", "cagefield", *words], check=True, capture_output=True)
    return folder


def _old(name: str) -> Path:
    return Path(_old_folder(name).name) / name


def _over_old_file(name: str, check: Check) -> Command:
    return _line(_OLD_LINES[name], _with_old_bytes(name), old_problem(name, check))


def _over_old_folder(name: str, check: Check) -> Command:
    def make(folder: Path) -> None:
        put_scene(folder)
        shutil.copytree(_old(name), folder / name)
        (folder / name / "notes.txt").write_text("mine")

    return _line(_OLD_LINES[name], make, old_problem(f"{name}/notes.txt", check))


def _torch_file(name: str) -> Make:
    """A scene to be replaced, and a checkpoint of another program's."""

    def make(folder: Path) -> None:
        put_scene(folder)
        shutil.copyfile(Path(_checkpoints().name) / name, folder / name)

    return make


@cache
def _checkpoints() -> tempfile.TemporaryDirectory[str]:
    folder = tempfile.TemporaryDirectory(prefix="cagefield-checkpoints-")
    write_checkpoints(Path(folder.name))
    return folder


def _imported(name: str, options: str = "") -> Command:
    words = f"import {{}}/{name} -o {{}}/scene {options}"
    return _line(words, _torch_file(name), lambda folder, said: scene_problem(folder, 0))


def _put_plenoctree(folder: Path) -> None:
    put_scene(folder)
    write_plenoctree(folder / "a.npz", plenoctree_arrays())


def _trained(field: str) -> Command:
    """A few steps, a checkpoint after each of them; goes on from there where there is one."""

    def make(folder: Path) -> None:
        put_scene(folder)
        shutil.copytree(_old("made"), folder / "photos")

    def work(folder: Path, say: Say) -> None:
        from cagefield.training import loop

        loop._checkpoint_interval_seconds = lambda saved: 0.0
        resumed = (folder / "new.training").is_file()
        words = f"train {folder}/photos -o {folder}/new --field {field} --steps 4 --resolution 16"
        cli(*words.split(), "--resume" if resumed else "--overwrite")
        say(1)

    return Command(make, work, trained_problem)


def _put_street(folder: Path) -> None:
    put_scene(folder)
    write_street(folder / "street", photos=12, size=96, length=5.0)


def _train_blocks(folder: Path, say: Say) -> None:
    """Scaffold, two blocks and their refinements, a checkpoint after each step; goes on from there."""
    from cagefield.training import loop

    loop._checkpoint_interval_seconds = lambda saved: 0.0
    resumed = (folder / "new.blocks").is_dir()
    words = f"train {folder}/street -o {folder}/new --blocks 2 --steps 8 --splats 100 --keep-poses"
    cli(*words.split(), "--resume" if resumed else "--overwrite")
    say(1)


_SPLATS = (".compressed.ply", ".sog", ".splat", ".glb")
_BAKING = "--resolution 16 --compare 0"


def _files(words: str, endings: tuple[str, ...]) -> dict[str, Command]:
    def check(ending: str) -> Check:
        return old_problem(f"out{ending}", file_problem(ending))

    return {
        f"{words.split()[0]} {ending}": _line(f"{words}{ending}", _with_old_file(ending), check(ending))
        for ending in endings
    }


def _appended_problem(folder: Path, said: int) -> str | None:
    """Fault of the scene: not readable, or without the edit."""
    found = scene_problem(folder, 0)
    if found is None and said >= 1 and not len(Scene.open(folder / "scene").edits):
        found = "lost: the edit"
    return found


def _make_curve(folder: Path) -> None:
    """Photos, a curve, and the scene that came of it."""
    put_scene(folder)
    shutil.copytree(_old("made"), folder / "made")
    _old_curve()
    for name in ("curve.csv", "curve.md"):
        shutil.copyfile(Path(_old_curve().name) / name, folder / name)
    shutil.copytree(Path(_old_curve().name) / "new", folder / "new")


@cache
def _old_curve() -> tempfile.TemporaryDirectory[str]:
    folder = tempfile.TemporaryDirectory(prefix="cagefield-old-")
    shutil.copytree(_old("made"), Path(folder.name) / "made")
    words = [word.replace("{}", folder.name) for word in _OLD_LINES["curve.csv"].split()]
    subprocess.run([sys.executable, "-m", "cagefield", *words], check=True, capture_output=True)
    return folder


def _curve_problem(folder: Path, said: int) -> str | None:
    """Fault of a curve, its table or its scene."""
    if not (folder / "curve.csv").read_text().startswith("seconds,"):
        return "unreadable: the curve is cut off"
    return table_problem("curve.md")(folder, said) or scene_problem(folder, 0, "new")


_pages = _over_old_folder("out", page_folder_problem("out"))
_photos = _over_old_folder("made", photos_problem("made"))
_published = _over_old_folder("published", published_problem("published"))
_demo = _over_old_folder("demo", demo_problem)

LINES: dict[str, Command] = {
    **_files("export {}/scene -o {}/out", _SPLATS),
    **_files("convert {}/x.ply {}/out", (".ply", *_SPLATS)),
    "edit --append": _line("edit {}/scene {}/e.yaml --append", put_scene, _appended_problem),
    "bench grids": _over_old_file("grids.png", picture_problem("grids.png")),
}
"""Commands that write without kernels."""

SLOW_LINES: dict[str, Command] = {
    "train, voxels": _trained("voxel"),
    "train, splats": _trained("splat"),
    "train, nerf": _trained("nerf"),
    "train, blocks": Command(_put_street, _train_blocks, trained_problem),
    "import .tar": _imported("a.tar", _BAKING),
    "import .ckpt, nerf": _imported("a.ckpt", _BAKING),
    "import .npz": _line(
        f"import {{}}/a.npz -o {{}}/scene {_BAKING}",
        _put_plenoctree,
        lambda folder, said: scene_problem(folder, 0),
    ),
    "import .ckpt, splats": _imported("s.ckpt"),
    "export, a mesh .ply": _over_old_file("mesh.ply", ply_problem("mesh.ply")),
    "export, a mesh .glb": _over_old_file("mesh.glb", glb_problem("mesh.glb")),
    "export, points": _over_old_file("points.ply", ply_problem("points.ply")),
    "export, fitted splats": _over_old_file("fitted.ply", ply_problem("fitted.ply")),
    "export --embed": _pages,
    "export --embed, renames": renamed(_pages, "out"),
    "make-scene, renames": renamed(_photos, "made"),
    "make-scene, a room": _over_old_folder("room", photos_problem("room")),
    "render .png": _over_old_file("one.png", picture_problem("one.png")),
    "bench edits": _over_old_file("edits.md", table_problem("edits.md")),
    "bench publish": _published,
    "bench publish, renames": renamed(_published, "published"),
    "bench captures": _over_old_file("captures.md", table_problem("captures.md")),
    "bench training": _line(_OLD_LINES["curve.csv"], _make_curve, old_problem("curve.csv", _curve_problem)),
    "bench speed": _over_old_file("speed.json", json_problem("speed.json")),
    "demo": _demo,
    "demo, renames": renamed(_demo, "demo"),
}
"""Commands with kernels, or PyTorch: in new processes."""
