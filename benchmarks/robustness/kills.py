"""Kills commands where they write, and editors while pages edit and save, and counts what is lost.

python -m benchmarks.robustness.kills [--rounds 1] [--random 40] [--slow 10] [--servers 10]
    [--step 1] [--but N] [--minutes M] [--tried N] [--forked] [--writes] [--only NAME ...] [--out FILE.md]

Each command is killed at every call that changes something (`tests/robustness/kills.py`), as many rounds as
wanted, and at random moments; with --writes in the middle of every write, half of whose bytes are then in
the file. Editors (`cagefield view`) are killed while a page sends changes, saves and renders a video, or
pictures; what the page was told is compared with what the next editor has. About an hour of one processor.

--but N leaves out what a run with --step N has tried; --minutes M ends the kills of each command after that
time, whose calls come in random order, and --tried N leaves out the first N of that order. --forked forks
the slow commands too, of a process that has imported what they need: two to eight times as many kills in
the same time. The exit status is 1 after a fault.
"""

from __future__ import annotations

import argparse
import os
import random
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from dataclasses import dataclass
from pathlib import Path

from benchmarks.common.machine import cpu_model
from cagefield.compute import devices

TESTS = Path(__file__).resolve().parents[2] / "tests"
sys.path[:0] = [str(TESTS / "robustness"), str(TESTS)]

import kill_command  # noqa: E402
import kill_points  # noqa: E402
import kills  # noqa: E402
import write_points  # noqa: E402

from cagefield import Scene  # noqa: E402
from cagefield.images.image_files import read_image  # noqa: E402
from cagefield.server.editor.persistence import SceneStore  # noqa: E402
from cagefield.server.editor.session import Session  # noqa: E402
from editor_server import PageClient, editor_server, page  # noqa: E402


@dataclass
class Told:
    """Messages to pages before their editors were killed."""

    changes: int = 0
    saves: int = 0
    videos: int = 0
    pictures: int = 0


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--random", type=int, default=40, help="kills at random, of each command")
    parser.add_argument("--slow", type=int, default=10, help="the same of each command with kernels")
    parser.add_argument("--servers", type=int, default=10)
    parser.add_argument("--step", type=int, default=1, help="kills at every such call only")
    parser.add_argument("--but", type=int, default=0, help="not at every such call: they have been tried")
    parser.add_argument("--minutes", type=float, default=None, help="for each command's calls, at most")
    parser.add_argument("--tried", type=int, default=0, help="so many have been, of the same calls")
    parser.add_argument("--forked", action="store_true", help="slow commands are forked, not started anew")
    parser.add_argument(
        "--writes", action="store_true", help="kills in the middle of writes, of files' content"
    )
    parser.add_argument("--only", nargs="*", default=None)
    parser.add_argument("--out", type=Path, default=None)
    options = parser.parse_args()
    if options.writes and not write_points.is_loaded():
        if reason := write_points.why_not():
            parser.error(reason)
        command = [sys.executable, "-m", "benchmarks.robustness.kills", *sys.argv[1:]]
        sys.exit(subprocess.run(command, env=os.environ | write_points.preloading()).returncode)
    rows, everything = [], []
    for name in kills.ALL if options.only is None else options.only:
        found = kills.Killed()
        calls = _kill_command(name, found, options)
        everything.append(found)
        rows.append(_row(name, str(calls), found))
        print(rows[-1], *found.faults, sep="\n    ", flush=True)
    found, told = kills.Killed(), Told()
    for number in range(options.servers):
        with tempfile.TemporaryDirectory() as folder:
            _kill_editor(Path(folder), number, found, told)
        print(found, told, flush=True)
    everything.append(found)
    rows.append(_row("whole editors", "", found))
    rows.append(_row("**all**", "", _sum(everything)))
    if options.out is not None:
        options.out.write_text(_table(rows, found, told, options))
    sys.exit(any(one.faults for one in everything))


def _kill_command(name: str, found: kills.Killed, options: argparse.Namespace) -> int:
    """Kills a command at all its calls, whose number is returned, and at random."""
    command, slow = kills.ALL[name], name in kills.SLOW_COMMANDS
    if slow and options.forked:
        kills.import_for(name)
    with tempfile.TemporaryDirectory() as folder:
        calls, seconds = kills.calls_of(name, Path(folder), writes=options.writes)
    tried = range(1, calls + 1, options.but) if options.but else ()
    points = [at for at in range(1, calls + 1, options.step) if at not in tried]
    points *= 1 if slow else options.rounds
    random.Random(name).shuffle(points)
    begun = time.monotonic()
    for at in points[options.tried :]:
        if options.minutes is not None and time.monotonic() - begun > 60.0 * options.minutes:
            break
        with tempfile.TemporaryDirectory() as folder:
            kills.kill(command, name, Path(folder), at, found, writes=options.writes)
    for after in kills.moments(options.slow if slow else options.random, seconds, len(name)):
        with tempfile.TemporaryDirectory() as folder:
            kills.kill(command, name, Path(folder), 0, found, after)
    return calls


def _kill_editor(folder: Path, number: int, found: kills.Killed, told: Told) -> None:
    """Kills an editor at a random moment while a page names an edit and saves it, over and over."""
    kills.COMMANDS["changes and saves"].make(folder)
    others = kill_points.adopted()
    with editor_server(folder / "scene") as server, page(server) as (client, hello):
        edit = _begin(client, hello)
        if number % 2:  # kernels are there, and ffmpeg soon
            client.final()
        renders = number % 4 == 3  # the video comes first
        after = random.Random(number).uniform(0.0, 16.0 if renders else 4.0)
        threading.Timer(after, server.kill).start()
        kept, saved = (_render_until_killed if renders else _edit_until_killed)(client, edit, told)
        server.process.wait(30)
        # The editor's own process is known, and has ended; its video goes with it.
        left, seconds = kill_points.outliving(others, kill_points.STAYS)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        problem = _problem(folder, kept, saved)
    ended = kill_points.Ended(True, 0, kept, left, seconds)
    found.count(f"editor {number}", ended, problem, kills.hidden(folder))


def _begin(client: PageClient, hello: dict[str, object]) -> int:
    """An edit, and a path whose video takes long: its number."""
    client.look_from(hello)
    client.send("load_edits", text=kill_command.EDITS)
    edit: int = client.state(lambda state: bool(state["edits"]))["edits"][0]["id"]
    pose = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 3.0, 0.0, 0.0, 0.0, 1.0]
    keys = [{"c2w": pose, "fov_y_deg": fov, "seconds": 4.0} for fov in (40.0, 44.0)]
    client.send("set_path", keys=keys)
    client.send("render", what="camera_path", out="r.mp4", width=160, height=120)
    return edit


def _edit_until_killed(client: PageClient, edit: int, told: Told) -> tuple[int, int]:
    """(the last name, the last saved name) that the page was told of before its socket was gone."""
    kept, saved = 0, 0
    try:
        for n in range(1, 10_000):
            client.send("change", edit=edit, name=f"n{n}")
            client.state(lambda state, n=n: state["edits"][0]["name"] == f"n{n}")  # type: ignore[misc]
            kept, told.changes = n, told.changes + 1
            if n % 5 == 0:
                client.send("command", name="save")
                client.until(lambda m: m["type"] == "notice" and "saved to" in m["text"])
                saved, told.saves = n, told.saves + 1
            if n % 40 == 0:
                client.send("render", what="camera_path", out="r.mp4", width=64, height=48, overwrite=True)
    except Exception:  # the socket has gone
        pass
    told.videos += any("r.mp4" in str(m.get("text")) for m in client.messages if m["type"] == "notice")
    return kept, saved


def _render_until_killed(client: PageClient, edit: int, told: Told) -> tuple[int, int]:
    """Renders the same pictures over and over: pages that wait for nothing leave time for that."""
    try:
        while True:
            client.send("render", what="test_views", out="views", width=32, height=24, overwrite=True)
            client.until(lambda m: m["type"] == "job" and m["state"] != "running")
            told.pictures += 1
    except Exception:  # the socket has gone
        return 0, 0


def _problem(folder: Path, kept: int, saved: int) -> str | None:
    """Content that the next editor does not find; the editor then saves."""
    try:
        for picture in (folder / "views").glob("*.png"):
            read_image(picture)
        scene = Scene.open(folder / "scene")
        store = SceneStore(scene, folder / "scene")
        store.lock()
        document = store.recovered() or store.document()
    except Exception as error:
        return f"unreadable: {error}"
    names = [int(entry.edit.name[1:]) for entry in document.entries if entry.edit.name.startswith("n")]
    on_disk = [int(edit.name[1:]) for edit in scene.edits if edit.name.startswith("n")]
    session = Session(document, scene.field.bounds, scene.field.sample_spacing)
    store.save(session)
    store.close()
    if max(names, default=0) < kept:
        return f"lost: change {kept} was acknowledged, {names} is there"
    if max(on_disk, default=0) < saved:
        return f"lost: change {saved} was saved, {on_disk} is there"
    return None


def _row(name: str, calls: str, found: kills.Killed) -> str:
    counts = (calls, found.kills, found.lost, found.unreadable, found.left, found.outlived)
    return f"| {name} | {' | '.join(map(str, counts))} | {found.stayed:.1f} |"


def _sum(every: list[kills.Killed]) -> kills.Killed:
    total = kills.Killed(stayed=max(found.stayed for found in every))
    for name in ("kills", "lost", "unreadable", "left", "outlived"):
        setattr(total, name, sum(getattr(found, name) for found in every))
    return total


def _table(rows: list[str], found: kills.Killed, told: Told, options: argparse.Namespace) -> str:
    command = f"--rounds {options.rounds} --random {options.random} --slow {options.slow}"
    command += f" --servers {options.servers}" + " --writes" * options.writes
    return f"""# Kills

Calls: those that change a name or open a file to write, of the whole command; each is a kill point, and then
there are random moments. With --writes they are writes, half of whose bytes are in the file. Lost: what the
command, or the editor, had said was done, or a file of the user's.
Unreadable: no scene, old or new, at its place. Left: hidden files after the same command has been run again.
Outlived: kills after which a process that the killed one had started was there {kill_points.STAYS:g} s later;
stayed: seconds that the last of them was there at most.

{cpu_model()}, {devices.threads()} cores, other work beside.

    python -m benchmarks.robustness.kills {command} --out benchmarks/results/robustness_kills.md

| command | calls | kills | lost | unreadable | left | outlived | stayed, s |
| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
{chr(10).join(rows)}

Whole editors draw, keep changes, save and render a video; one in four renders pictures over its last ones, as
often as it can. Pages had been told of {told.changes} changes, {told.saves} saves and {told.pictures} times
pictures before the {found.kills} kills. Hidden there are files after the next save.
"""


if __name__ == "__main__":
    main()
