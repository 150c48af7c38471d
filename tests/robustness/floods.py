"""How long a page waits for its answers while an editor is flooded."""

from __future__ import annotations

import contextlib
import os
import time
from dataclasses import dataclass, field

from flooding import flooded

from editor_server import EditorServer, PageClient, page


@dataclass
class Answers:
    """How long a page waited for its answers, and how much memory the editor took."""

    seconds: list[float] = field(default_factory=list)
    most: int = 0
    """Bytes of the editor's own process, at most."""


def during(
    server: EditorServer, flood: str | None, questions: int, every: float = 0.2, floods: int = 1
) -> Answers:
    """Answers that a second page gets to so many questions, during a flood or none."""
    found = Answers()
    with page(server) as (client, hello):
        if flood == "screenshots":  # of as many pixels as there may be
            client.look_from(hello, side=4096)
        with contextlib.nullcontext() if flood is None else flooded(flood, server.link, floods):
            time.sleep(1.0)
            for number in range(1, questions + 1):
                begun = time.monotonic()
                client.send("ask", request=number, what="path")
                _answer(client, number)
                found.seconds.append(time.monotonic() - begun)
                found.most = max(found.most, memory(server.process.pid))
                time.sleep(every)
    return found


def _answer(client: PageClient, number: int) -> None:
    client.until(lambda m: m["type"] == "answer" and m["request"] == number)


def memory(process: int) -> int:
    """Bytes that a process has in memory."""
    with open(f"/proc/{process}/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
