"""Pages that edit, play, have jobs rendered and reconnect for hours, and what the processes take up."""

from __future__ import annotations

import collections
import os
import random
import socket
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from soak_visit import Visit

from editor_server import EditorServer, page


@dataclass
class Sample:
    """Memory and handles of the editor's processes at a moment."""

    seconds: float
    server: int
    """Bytes in memory of the process that pages talk to."""
    rendering: int
    """Bytes in memory of the processes that it has started."""
    threads: int
    files: int
    """Open file handles; both of all processes together."""
    processes: int


def sample(server: EditorServer, begun: float) -> Sample:
    """Usage of the processes now."""
    own = server.process.pid
    processes = [own, *server.children()]
    return Sample(
        time.monotonic() - begun,
        _bytes(own),
        sum(_bytes(process) for process in processes[1:]),
        sum(len(os.listdir(f"/proc/{process}/task")) for process in processes),
        sum(len(os.listdir(f"/proc/{process}/fd")) for process in processes),
        len(processes),
    )


def _bytes(process: int) -> int:
    with open(f"/proc/{process}/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@dataclass
class Soak:
    """Counts of the pages' actions, and faults."""

    server: EditorServer
    out: Path
    """A folder that jobs write into."""
    pause: float = 0.5
    """Seconds between the actions of a page, about."""
    stay: float = 60.0
    """Seconds that a page stays, at most."""
    done: collections.Counter[str] = field(default_factory=collections.Counter)
    refused: collections.Counter[str] = field(default_factory=collections.Counter)
    """Messages to the pages' users, by their first words."""
    faults: list[str] = field(default_factory=list)
    """Pages that the editor closed, and answers that did not come."""
    over: threading.Event = field(default_factory=threading.Event)

    def run(self, pages: int, seconds: float, every: float, watch: Callable[[Sample], None]) -> None:
        """So many pages for so long; `watch` has a sample now and then."""
        begun = time.monotonic()
        threads = [
            threading.Thread(target=self._page, args=(number,), daemon=True) for number in range(pages)
        ]
        for thread in threads:
            thread.start()
        try:
            while time.monotonic() - begun < seconds and any(thread.is_alive() for thread in threads):
                self.over.wait(min(every, max(0.1, begun + seconds - time.monotonic())))
                watch(sample(self.server, begun))
        finally:
            self.over.set()
            for thread in threads:
                thread.join(150.0)
        self.faults += [f"page {number} hangs" for number, thread in enumerate(threads) if thread.is_alive()]

    def _page(self, number: int) -> None:
        """A page that comes and goes."""
        chance = random.Random(number)
        while not self.over.is_set():
            try:
                with page(self.server) as (client, hello):
                    self.done["open"] += 1
                    visit = Visit(self, client, hello, chance, number)
                    until = time.monotonic() + chance.uniform(0.1, 1.0) * self.stay
                    while not self.over.is_set() and time.monotonic() < until:
                        visit.act()
                        visit.read(chance.uniform(0.5, 1.5) * self.pause)
                    if chance.random() < 0.5:
                        self.done["hang up"] += 1
                        client.socket.socket.shutdown(socket.SHUT_RDWR)
            except Exception as error:
                self.faults.append(f"page {number}: {type(error).__name__}: {error}"[:300])
                self.over.wait(5.0)
