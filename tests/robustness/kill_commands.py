"""The commands that are killed, what they do, and what is wrong afterwards."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
from kill_checks import (
    file_problem,
    glb_problem,
    new_problem,
    photos_problem,
    pictures_problem,
    posed_problem,
    poses_problem,
    scene_problem,
    trained_problem,
    video_problem,
)
from kill_command import EDITS, Command, cli, put_free_form, put_scene, put_splats, renamed
from kill_exports import EXPORTS, SLOW_EXPORTS
from kill_lines import LINES, SLOW_LINES
from kill_points import Say

from cagefield import Scene
from cagefield.datasets import load_dataset
from cagefield.datasets.sfm.transforms_writer import write_transforms
from cagefield.edits import MovePoint, MovePoints, Twist
from cagefield.geometry.control_points import ControlPoints
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.geometry.mesh_files import read_mesh_cage
from cagefield.images.image_files import write_png
from cagefield.procedural import make_scene
from cagefield.selection.element_selection import Selection
from cagefield.selection.field_elements import elements_of_field
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from posed_photos import photos_alone


def _edit(folder: Path, say: Say) -> None:
    cli("edit", folder / "scene", folder / "e.yaml", "--overwrite")
    say(1)


def _edit_new(folder: Path, say: Say) -> None:
    cli("edit", folder / "scene", folder / "e.yaml", "-o", folder / "new", "--overwrite")
    say(1)


def _import(folder: Path, say: Say) -> None:
    cli("import", folder / "x.ply", "-o", folder / "scene", "--overwrite")
    say(1)


def _export(ending: str) -> Callable[[Path, Say], None]:
    def work(folder: Path, say: Say) -> None:
        out = folder / f"out{ending}"
        cli("export", folder / "scene", "-o", out, *(["--overwrite"] if out.exists() else []))
        say(1)

    return work


def _convert(folder: Path, say: Say) -> None:
    cli(
        "convert",
        folder / "x.ply",
        folder / "out.spz",
        *(["--overwrite"] if (folder / "out.spz").exists() else []),
    )
    say(1)


SESSION_STEPS = 9

CHILD = """  - name: carried
    parent: moved
    adjustment: discrete
    inner: {center: [0, 0, 0], size: 0.3}
    operations: [{translate: [0.2, 0, 0]}]
"""


def _session(folder: Path, say: Say) -> None:
    """An editor: names an edit n, keeps it, and says 2 n; at every third saves it and says 2 n + 1.

    The edit carries another one, and n elements of the field are deleted.
    """
    scene = Scene.open(folder / "scene", whole=True)
    store = SceneStore(scene, folder / "scene")
    store.lock()
    session = Session(store.recovered() or store.document(), scene.field.bounds, scene.field.sample_spacing)
    if not session.document.entries:
        session.load_edits(EDITS + CHILD, False)
    total = len(elements_of_field(scene.field))
    for number in range(1, SESSION_STEPS + 1):
        session.change(session.document.entries[0].id, name=f"n{number}")
        if session.document.removed is not None:
            session.restore_elements()
        session.select_elements("Select", Selection.from_mask(np.arange(total) < number))
        session.remove_elements()
        store.autosave(session)
        say(2 * number)
        if number % 3 == 0:
            store.save(session)
            say(2 * number + 1)
    store.close()


def _session_problem(folder: Path, said: int) -> str | None:
    problem = scene_problem(folder, 0)
    if problem is not None or said < 2:
        return problem
    scene = Scene.open(folder / "scene", whole=True)
    store = SceneStore(scene, folder / "scene")
    document = store.recovered() or store.document()
    names = [entry.edit.name for entry in document.entries]
    if not names or not names[0].startswith("n") or int(names[0][1:]) < said // 2:
        return f"lost: change {said // 2} was kept, {names} is there"
    if document.entries[1].edit.parent != names[0]:
        return f"lost: {names[0]} carries nothing"
    if document.removed is None or f"n{document.removed.count}" != names[0]:
        return f"lost: the deleted elements of {names[0]}"
    return None


def _free_form_problem(folder: Path, said: int) -> str | None:
    """Faults after an edit of free-form shapes, all of which the scene holds itself."""
    problem = scene_problem(folder, 0)
    if problem is not None or said < 1:
        return problem
    edits = list(Scene.open(folder / "scene").edits)
    if [edit.name for edit in edits] != ["lattice", "points", "mesh"]:
        return f"lost: the edits, {[edit.name for edit in edits]} are there"
    mesh = edits[2].inner
    if not isinstance(mesh, MeshCage) or len(mesh.vertices) != 8:
        return "lost: the mesh"
    return None


def _free_form_session(folder: Path, say: Say) -> None:
    """An editor: at step n moves a vertex, moves and twists a lattice, widens the reach of control points,
    keeps them and says 2 n; saves them last and says 1 more."""
    scene = Scene.open(folder / "scene")
    store = SceneStore(scene, folder / "scene")
    store.lock()
    session = Session(store.recovered() or store.document(), scene.field.bounds, scene.field.sample_spacing)
    if not session.document.entries:
        text = (folder / "e.yaml").read_text().replace("file: cube.obj", _mesh_text(folder))
        session.load_edits(text, False)
    lattice, points, mesh = session.document.entries
    before = len(mesh.edit.operations) - 1
    for number in range(1, 4):
        vertex = (before + number) % 7
        session.apply(mesh.id, "field", MovePoint(vertex, (0.0, 0.0, 0.01)))
        session.apply(lattice.id, "field", MovePoints((vertex, 20), (0.0, 0.005, 0.0), 0.3))
        session.apply(lattice.id, "field", Twist("z", 2.0))
        session.point_reach(points.id, _reach(before + number), None)
        store.autosave(session)
        say(2 * number)
    store.save(session)
    say(7)
    store.close()


def _reach(changes: int) -> float:
    """Radius of the control points after so many changes of it."""
    return 0.4 + 0.01 * changes


def _mesh_text(folder: Path) -> str:
    cage = read_mesh_cage(folder / "cube.obj")
    return f"vertices: {cage.vertices.tolist()}, triangles: {cage.triangles.tolist()}"


def _free_form_session_problem(folder: Path, said: int) -> str | None:
    problem = scene_problem(folder, 0)
    if problem is not None or said < 2:
        return problem
    scene = Scene.open(folder / "scene")
    store = SceneStore(scene, folder / "scene")
    entries = (store.recovered() or store.document()).entries
    moves = len(entries[2].edit.operations) - 1 if len(entries) == 3 else -1
    if moves < said // 2:
        return f"lost: {said // 2} moves of vertices were kept, {moves} are there"
    lattice, points = entries[0].edit, entries[1].edit.inner
    if len(lattice.operations) != 1 + 2 * moves or not isinstance(points, ControlPoints):
        return (
            f"lost: {moves} moves and twists of the lattice, {len(lattice.operations)} operations are there"
        )
    if moves and points.radius != _reach(moves):
        return f"lost: the reach after {moves} changes, {points.radius} is there"
    return None


def _save_as(folder: Path, say: Say) -> None:
    scene = Scene.open(folder / "scene", whole=True)
    store = SceneStore(scene, folder / "scene")
    store.lock()
    session = Session(store.document(), scene.field.bounds, scene.field.sample_spacing)
    session.load_edits(EDITS, False)
    store.save_as(session, "new", True)
    say(1)
    store.close()


def _train(folder: Path, say: Say) -> None:
    cli("train", folder / "photos", "-o", folder / "new", "--steps", "4", "--resolution", "16", "--overwrite")
    say(1)


def _make_photos(folder: Path) -> None:
    from cagefield.procedural import make_scene as photograph

    put_scene(folder)
    photograph("chair", folder / "photos", views=4, size=16, test_views=1)


def _make_pictures(folder: Path) -> None:
    """A scene, and pictures of another size with what else the user has there."""
    put_scene(folder)
    (folder / "out" / "mine").mkdir(parents=True)
    for number in range(3):
        write_png(folder / "out" / f"{number:04d}.png", np.full((4, 4, 3), 99, np.uint8))
    (folder / "out" / "mine" / "notes.txt").write_text("mine")


def _render(folder: Path, say: Say) -> None:
    cli("render", folder / "scene", "-o", folder / "out", "--turntable", "3", "--size", "32", "--overwrite")
    say(1)


def _render_on_a_cluster(folder: Path, say: Say) -> None:
    """Pictures of two local workers, which write them."""
    words = ("--turntable", "3", "--size", "32", "--overwrite", "--cluster", "2")
    cli("render", folder / "scene", "-o", folder / "out", *words)
    say(1)


def _render_video(folder: Path, say: Say) -> None:
    arguments = ("--turntable", "6", "--size", "96", "--overwrite")
    cli("render", folder / "scene", "-o", folder / "out.mp4", *arguments)
    say(1)


def _bake(folder: Path, say: Say) -> None:
    arguments = ("--resolution", "16", "--compare", "0", "--overwrite")
    cli("bake", folder / "scene", "-o", folder / "new", *arguments)
    say(1)


def _mesh(folder: Path, say: Say) -> None:
    cli("export", folder / "scene", "-o", folder / "mesh.glb", "--as", "mesh", "--overwrite")
    say(1)


def _make_scene(folder: Path, say: Say) -> None:
    arguments = ("--views", "2", "--test-views", "1", "--size", "16", "--overwrite")
    cli("make-scene", "chair", "-o", folder / "out", *arguments)
    say(1)


@cache
def _posed() -> tempfile.TemporaryDirectory[str]:
    """Photos without poses, and the data set that was made of them; made once, by another process."""
    folder = tempfile.TemporaryDirectory(prefix="cagefield-posed-")
    photos = photos_alone(Path(folder.name) / "photos")
    command = [sys.executable, "-m", "cagefield", "poses", str(photos), "-o", f"{folder.name}/data"]
    subprocess.run(command, check=True, capture_output=True)
    return folder


def _make_posed(folder: Path) -> None:
    shutil.copytree(_posed().name, folder, dirs_exist_ok=True)
    (folder / "data" / "notes.txt").write_text("mine")


def _poses(folder: Path, say: Say) -> None:
    from cagefield.datasets.sfm import matching

    matching._MIN_PAIRS_PER_PROCESS = 3  # six pairs are matched in two processes, as those of many photos are
    cli("poses", folder / "photos", "-o", folder / "data", "--overwrite")
    say(1)


@cache
def _posed_video() -> tempfile.TemporaryDirectory[str]:
    """The photos as a video, and the data set that was made of it; made once, by another process."""
    from cagefield.images.image_files import read_image
    from cagefield.images.video import open_encoder

    folder = tempfile.TemporaryDirectory(prefix="cagefield-posed-video-")
    video = Path(folder.name) / "v.mp4"
    pictures = [read_image(file) for file in sorted((Path(_posed().name) / "photos").iterdir())]
    height, width = pictures[0].shape[:2]
    with open_encoder(video, (width, height), 4.0, 10) as encode:
        for picture in pictures:
            encode(picture[..., :3].tobytes())
    words = ["poses", str(video), "-o", f"{folder.name}/data", "--frames", "4"]
    subprocess.run([sys.executable, "-m", "cagefield", *words], check=True, capture_output=True)
    return folder


def _make_posed_video(folder: Path) -> None:
    shutil.copytree(_posed_video().name, folder, dirs_exist_ok=True)
    (folder / "data" / "notes.txt").write_text("mine")


def _poses_of_video(folder: Path, say: Say) -> None:
    cli("poses", folder / "v.mp4", "-o", folder / "data", "--frames", "4", "--overwrite")
    say(1)


def _make_verified(folder: Path) -> None:
    make_scene("chair", folder / "photos", views=3, size=16, test_views=1)
    write_transforms(load_dataset(folder / "photos"), folder / "data")
    (folder / "data" / "notes.txt").write_text("mine")


def _verify(folder: Path, say: Say) -> None:
    cli("poses", folder / "photos", "-o", folder / "data", "--overwrite")
    say(1)


_verifying = Command(_make_verified, _verify, posed_problem)
_posing = Command(_make_posed, _poses, poses_problem)

COMMANDS: dict[str, Command] = {
    "edit --overwrite": Command(put_scene, _edit, scene_problem),
    "edit -o": Command(put_scene, _edit_new, new_problem),
    "import --overwrite": Command(put_splats, _import, scene_problem),
    "export .ply": Command(put_splats, _export(".ply"), file_problem(".ply")),
    "export .spz": Command(put_splats, _export(".spz"), file_problem(".spz")),
    "export .html": Command(put_splats, _export(".html"), file_problem(".html")),
    "convert": Command(put_splats, _convert, file_problem(".spz")),
    "changes and saves": Command(put_scene, _session, _session_problem),
    "save as": Command(put_scene, _save_as, new_problem),
    "edit --overwrite, renames": renamed(Command(put_scene, _edit, scene_problem)),
    **LINES,
    **EXPORTS,
}
"""Commands that write without kernels: a process for each kill takes a tenth of a second."""

SLOW_COMMANDS: dict[str, Command] = {
    "edit, free-form": Command(put_free_form, _edit, _free_form_problem),
    "changes and saves, free-form": Command(put_free_form, _free_form_session, _free_form_session_problem),
    "train": Command(_make_photos, _train, trained_problem),
    "render, pictures": Command(_make_pictures, _render, pictures_problem),
    **(
        {"render, a cluster": Command(_make_pictures, _render_on_a_cluster, pictures_problem)}
        if importlib.util.find_spec("distributed") is not None
        else {}
    ),
    "render .mp4": Command(put_scene, _render_video, video_problem),
    "bake": Command(put_splats, _bake, trained_problem),
    "export --as mesh": Command(put_scene, _mesh, glb_problem("mesh.glb")),
    "make-scene": Command(put_scene, _make_scene, photos_problem("out")),
    "poses": _posing,
    "poses, renames": renamed(_posing, "data"),
    "poses of a video": Command(_make_posed_video, _poses_of_video, poses_problem),
    "poses of a data set": _verifying,
    "poses of a data set, renames": renamed(_verifying, "data"),
    **SLOW_LINES,
    **SLOW_EXPORTS,
}
"""Others: seconds for each kill."""
