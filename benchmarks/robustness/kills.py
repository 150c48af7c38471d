"""Kills commands where they write, and editors while pages edit and save, and counts what is lost.

python benchmarks/robustness/kills.py [--rounds 1] [--random 40] [--servers 10] [--out FILE.md]

Each command is killed at every call that changes something (`tests/robustness/kills.py`), as many rounds as
wanted, and at random moments. Editors (`cagefield view`) are killed while a page sends changes and saves;
what the page was told is compared with what the next editor has. About half an hour of one processor.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from cagefield import devices
from cagefield.benchmarking.machine import cpu_model

TESTS = Path(__file__).resolve().parents[2] / "tests"
sys.path[:0] = [str(TESTS / "robustness"), str(TESTS)]

import kills  # noqa: E402

from cagefield import Scene  # noqa: E402
from cagefield.server.editor.persistence import SceneStore  # noqa: E402
from editor_server import editor_server, page  # noqa: E402

STAYS = 5.0
"""Seconds after which no process of a killed editor may be there."""


@dataclass
class Servers:
    """What came of killed editors."""

    kills: int = 0
    changes: int = 0
    """Changes that pages were told of."""
    saves: int = 0
    lost: int = 0
    unreadable: int = 0
    outlived: int = 0
    longest: float = 0.0
    """Seconds that a process was there after its editor."""


def main() -> None:
    """See the module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--random", type=int, default=40)
    parser.add_argument("--slow", type=int, default=20, help="kills of commands with kernels, each")
    parser.add_argument("--servers", type=int, default=10)
    parser.add_argument("--out", type=Path, default=None)
    options = parser.parse_args()
    rows = []
    for name, command in {**kills.COMMANDS, **kills.SLOW_COMMANDS}.items():
        slow = name in kills.SLOW_COMMANDS
        found = kills.Killed()
        with tempfile.TemporaryDirectory() as folder:
            calls, seconds = kills.calls_of(name, Path(folder))
        points = [*range(1, calls + 1)] * options.rounds
        random.Random(name).shuffle(points)
        for at in points[: options.slow] if slow else points:
            with tempfile.TemporaryDirectory() as folder:
                kills.kill(command, name, Path(folder), at, found)
        for after in kills.moments(options.slow if slow else options.random, seconds, len(name)):
            with tempfile.TemporaryDirectory() as folder:
                kills.kill(command, name, Path(folder), 0, found, after)
        counts = (calls, found.kills, found.lost, found.unreadable, found.left)
        rows.append(f"| {name} | {' | '.join(map(str, counts))} |")
        print(rows[-1], *found.faults, sep="\n    ", flush=True)
    servers = Servers()
    for number in range(options.servers):
        with tempfile.TemporaryDirectory() as folder:
            _kill_editor(Path(folder), number, servers)
        print(servers, flush=True)
    if options.out is not None:
        options.out.write_text(_table(rows, servers, options))


def _kill_editor(folder: Path, number: int, found: Servers) -> None:
    """Kills an editor at a random moment while a page names an edit and saves it, over and over."""
    chance = random.Random(number)
    kills.COMMANDS["changes and saves"].make(folder)
    told, saved = 0, 0
    with editor_server(folder / "scene") as server, page(server) as (client, hello):
        client.look_from(hello)
        client.send("load_edits", text=kills.EDITS)
        edit = client.state(lambda state: bool(state["edits"]))["edits"][0]["id"]
        # It draws meanwhile, so that processes have something to do.
        children = server.children()
        threading.Timer(chance.uniform(0.0, 3.0), server.kill).start()
        try:
            for n in range(1, 10_000):
                client.send("change", edit=edit, name=f"n{n}")
                client.state(lambda state, n=n: state["edits"][0]["name"] == f"n{n}")  # type: ignore[misc]
                told = n
                if n % 5 == 0:
                    client.send("command", name="save")
                    client.until(lambda m: m["type"] == "notice" and "saved to" in m["text"])
                    saved = n
        except Exception:  # the socket has gone
            pass
        begun = time.monotonic()
        server.process.wait(30)
        while any(_runs(child) for child in children) and time.monotonic() - begun < 30.0:
            time.sleep(0.05)
        took = time.monotonic() - begun
    found.kills += 1
    found.changes, found.saves = found.changes + told, found.saves + saved // 5
    found.longest = max(found.longest, took)
    found.outlived += took > STAYS
    try:
        scene = Scene.open(folder / "scene")
        store = SceneStore(scene, folder / "scene")
        document = store.recovered() or store.document()
    except Exception as error:
        print(f"unreadable: {error}")
        found.unreadable += 1
        return
    kept = [int(entry.edit.name[1:]) for entry in document.entries if entry.edit.name.startswith("n")]
    on_disk = [int(edit.name[1:]) for edit in scene.edits if edit.name.startswith("n")]
    found.lost += max(kept, default=0) < told or max(on_disk, default=0) < saved


def _runs(process: int) -> bool:
    try:
        return ") Z" not in Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return False


def _table(rows: list[str], servers: Servers, options: argparse.Namespace) -> str:
    command = f"--rounds {options.rounds} --random {options.random} --slow {options.slow}"
    command += f" --servers {options.servers}"
    return f"""# Kills

Calls: those that change a name or open a file to write, of the whole command; each is a kill point, and then
there are random moments. Lost: what the command, or the editor, had said was done, or a file of the user's.
Unreadable: no scene, old or new, at its place. Left: hidden files after the same command has been run again.

{cpu_model()}, {devices.threads()} cores, other work beside.

    python benchmarks/robustness/kills.py {command} --out benchmarks/results/robustness_kills.md

| command | calls | kills | lost | unreadable | left |
| --- | ---: | ---: | ---: | ---: | ---: |
{chr(10).join(rows)}

Editors killed while a page changes and saves: {servers.kills}, with {servers.changes} acknowledged changes
and {servers.saves} acknowledged saves; lost {servers.lost}, unreadable {servers.unreadable}; processes that
were there {STAYS:g} s later: {servers.outlived}, the longest {servers.longest:.1f} s.
"""


if __name__ == "__main__":
    main()
