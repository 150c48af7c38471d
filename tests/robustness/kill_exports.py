"""Commands that are killed while they write hotspots, grades, frames of a path, USD or levels of detail."""

from __future__ import annotations

import functools
import importlib.util
from pathlib import Path

from kill_checks import file_problem, old_problem, page_folder_problem, scene_problem
from kill_command import Command, cli, put_scene, put_splats
from kill_points import Say

from cagefield import Scene
from cagefield.cameras.keyframe_files import dump_path
from cagefield.cameras.keyframes import Keyframe
from cagefield.formats.splats.splat_files import read_splats, write_splats
from splat_scenes import ball_of_splats

FRAMES = 3
GRADES = """edits:
  - name: moved
    inner: {center: [0, 0, 0], size: 1}
    outer: {margin: 0.2}
    grade: {hue_deg: 40, exposure: 0.5}
"""


def _put_grade(folder: Path) -> None:
    put_scene(folder)
    (folder / "e.yaml").write_text(GRADES)


def _grade(folder: Path, say: Say) -> None:
    cli("edit", folder / "scene", folder / "e.yaml", "--overwrite")
    say(1)


def _grade_problem(folder: Path, said: int) -> str | None:
    found = scene_problem(folder, said)
    if found is None and said >= 1 and Scene.open(folder / "scene").edits[0].grading.hue_deg != 40.0:
        found = "lost: the grade"
    return found


def _hotspots(folder: Path, say: Say) -> None:
    """Hotspots are added, one more each time; says how many there are."""
    number = len(Scene.open(folder / "scene").hotspots)
    cli("hotspot", folder / "scene", "--add", f"h{number}", "--at", "0", "0", "0.5")
    say(number + 1)


def _hotspots_problem(folder: Path, said: int) -> str | None:
    found = scene_problem(folder, 0)
    if found is None:
        titles = [hotspot.title for hotspot in Scene.open(folder / "scene").hotspots]
        if len(titles) < said or titles != [f"h{n}" for n in range(len(titles))]:
            found = f"lost: {said} hotspots were promised, {titles} are there"
    return found


def _put_path(folder: Path) -> None:
    """A scene of splats and a camera path of FRAMES frames at one a second."""
    put_splats(folder)
    camera = Scene.open(folder / "scene").first_camera
    key = Keyframe(tuple(camera.c2w.ravel().tolist()), 40.0, 1.0)
    (folder / "path.json").write_text(dump_path([key] * FRAMES, loop=False))


def _sequence(folder: Path, say: Say) -> None:
    arguments = ("--camera-path", folder / "path.json", "--fps", "1")
    cli("export", folder / "scene", "-o", folder / "frames" / "%d.ply", *arguments)
    say(1)


def _sequence_problem(folder: Path, said: int) -> str | None:
    """Fault of a frame that is there, or of one that is not there though all were promised."""
    files = sorted((folder / "frames").glob("[0-9].ply"))
    if said >= 1 and len(files) != FRAMES:
        return f"lost: {len(files)} frames are there"
    try:
        for file in files:
            if len(read_splats(file)) != 50:
                return f"lost: splats of {file.name}"
    except Exception as error:
        return f"unreadable: {error}"
    return None


def _time_samples(folder: Path, say: Say) -> None:
    arguments = ("--camera-path", folder / "path.json", "--fps", "1", "--overwrite")
    cli("export", folder / "scene", "-o", folder / "out.usda", *arguments)
    say(1)


def _put_old_usd(folder: Path) -> None:
    _put_path(folder)
    write_splats(ball_of_splats(30), folder / "out.usda")


def _usd(ending: str) -> Command:
    def make(folder: Path) -> None:
        put_splats(folder)
        write_splats(ball_of_splats(30), folder / f"out{ending}")

    def work(folder: Path, say: Say) -> None:
        cli("export", folder / "scene", "-o", folder / f"out{ending}", "--overwrite")
        say(1)

    return Command(make, work, old_problem(f"out{ending}", file_problem(ending)))


def _levels(folder: Path, say: Say) -> None:
    """Levels of detail of a scene of 50 splats: a coarse level of 20, and nodes of 15."""
    from cagefield.pages import page_nodes, scene_page

    small = functools.partial(page_nodes.encode_page_nodes, coarse=20, node=15)
    setattr(scene_page, "encode_page_nodes", small)  # noqa: B010
    arguments = ("--embed", "--levels", "--overwrite")
    cli("export", folder / "scene", "-o", folder / "out", *arguments)
    say(1)


def _levels_problem(folder: Path, said: int) -> str | None:
    if said < 1 and not (folder / "out").exists():
        return None
    return page_folder_problem("out")(folder, said)


def _small_streamed() -> None:
    """Streamed SOG in leaves of 15 splats, files of 20, levels of 50, 12 and 3."""
    from cagefield.formats.splats import sog_lod_writer

    for name, value in (("LEAF_SPLATS", 15), ("FILE_SPLATS", 20), ("COARSE_SPLATS", 10)):
        setattr(sog_lod_writer, name, value)


def _put_streamed(folder: Path) -> None:
    put_splats(folder)
    _small_streamed()
    write_splats(ball_of_splats(30), folder / "out" / "lod-meta.json")


def _streamed(folder: Path, say: Say) -> None:
    _small_streamed()
    cli("export", folder / "scene", "-o", folder / "out" / "lod-meta.json", "--overwrite")
    say(1)


def _streamed_problem(folder: Path, said: int) -> str | None:
    """Fault of the folder: all levels of the old splats or the new ones are there, and all their files."""
    from cagefield.formats.splats.sog_lod_writer import sog_lod_summary

    try:
        counts, _ = sog_lod_summary(folder / "out" / "lod-meta.json")
        found = len(read_splats(folder / "out"))
    except Exception as error:
        return f"unreadable: {error}"
    if found != counts[0] or (said >= 1 and found == 30):
        return f"lost: {found} splats are there"
    return None


HAS_USD = importlib.util.find_spec("pxr") is not None

EXPORTS: dict[str, Command] = {
    "edit, a grade": Command(_put_grade, _grade, _grade_problem),
    "hotspot": Command(put_scene, _hotspots, _hotspots_problem),
    "export, a sequence": Command(_put_path, _sequence, _sequence_problem),
    **({"export .usda": _usd(".usda")} if HAS_USD else {}),
}
"""Commands that write without kernels; files of USD are read by usd-core."""

SLOW_EXPORTS: dict[str, Command] = {
    "export --levels": Command(put_splats, _levels, _levels_problem),
    "export, a streamed SOG": Command(_put_streamed, _streamed, _streamed_problem),
    **({f"export {ending}": _usd(ending) for ending in (".usdc", ".usdz")} if HAS_USD else {}),
    **(
        {"export, time samples": Command(_put_old_usd, _time_samples, file_problem(".usda"))}
        if HAS_USD
        else {}
    ),
}
"""Others: seconds for each kill."""
