"""An editor whose pages come and go for a while has no more threads, files and processes than before.

`benchmarks/robustness/soak.py` does it for hours and measures memory.
"""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from soak import Sample, Soak, sample

from editor_server import EditorServer, editor_server
from scenes import ball_scene

pytestmark = pytest.mark.nightly


def test_pages_leave_nothing_behind(tmp_path: Path) -> None:
    ball_scene().save(tmp_path / "scene")
    with editor_server(tmp_path / "scene") as server:
        before = _begun(server, tmp_path)
        soak = Soak(server, tmp_path, pause=0.05, stay=1.0)
        soak.run(6, 6.0, 1.0, lambda found: None)
        assert soak.faults == []
        assert soak.done["open"] > 6 and soak.done["hang up"] and soak.done["drag"] and soak.done["save"]
        after = _rested(server)
        assert after.processes == before.processes
        # A pool of threads grows to its end; each page has more than one file handle.
        assert after.threads <= before.threads + 4
        assert after.files <= before.files + 2


def _begun(server: EditorServer, folder: Path) -> Sample:
    """Once all that starts on first use has started, which takes longer on a machine with other work."""
    threads = -1
    for _ in range(6):
        Soak(server, folder, pause=0.05, stay=1.0).run(4, 3.0, 1.0, lambda found: None)
        found = _rested(server)
        if found.threads == threads:
            break
        threads = found.threads
    return found


def _rested(server: EditorServer) -> Sample:
    """Once jobs and pictures are over: twice the same."""
    begun = time.monotonic()
    found = [sample(server, begun)]
    while len(found) < 4 or len({(one.files, one.processes) for one in found[-4:]}) > 1:
        assert time.monotonic() - begun < 60.0, found[-4:]
        time.sleep(0.5)
        found.append(sample(server, begun))
    return found[-1]
