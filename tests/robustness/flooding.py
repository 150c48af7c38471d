"""Floods an editor until its stdin ends: in a process of its own, beside the one that measures."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from flood_kinds import FLOODS, EditorAt


@contextlib.contextmanager
def flooded(name: str, link: str, count: int) -> Iterator[None]:
    """So many floods of a kind go on; link is that of `cagefield view`."""
    command = [sys.executable, str(Path(__file__).resolve()), name, link, str(count)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert process.stdin is not None and process.stdout is not None
    try:
        if process.stdout.readline() != b"flooding\n":
            raise RuntimeError(f"the flood {name!r} did not begin")
        yield
    finally:
        process.stdin.close()
        try:
            process.wait(30)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()


def main(name: str, link: str, count: int) -> None:
    """Floods in threads."""
    over = threading.Event()
    server = EditorAt(link)
    for _ in range(count):
        threading.Thread(target=FLOODS[name], args=(server, over), daemon=True).start()
    print("flooding", flush=True)
    sys.stdin.read()
    over.set()


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
