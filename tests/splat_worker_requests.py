"""Requests to the process that deforms splats for other programs, and that process, for tests."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from cagefield.geometry.cage import EDGES, Cage
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.integrations.frames import Frame, read_frame, write_frame
from cagefield.typing import AnyArray, Array

COMMAND = (sys.executable, "-m", "cagefield.integrations.splat_worker")
CUBE_EDGES = np.array(EDGES, np.int32)
CUBE_TRIANGLES = MeshCage.of_box(Cage.box((0, 0, 0), 1.0)).triangles.astype(np.int32)


def mesh_arrays(role: str, rest: Array, target: Array) -> dict[str, AnyArray]:
    """Arrays of a cube's mesh in corner order, as a request has them."""
    return {
        f"{role}_rest": rest,
        f"{role}_target": target,
        f"{role}_edges": CUBE_EDGES,
        f"{role}_triangles": CUBE_TRIANGLES,
    }


def deform_request(
    inner: Cage, target: Array, outer: Cage | None = None, *, request: str = "deform", **header: Any
) -> Frame:
    """A request with an edit of box cages; continuous with an outer cage, else a move."""
    arrays = mesh_arrays("inner", inner.corners, target)
    header = {"kind": "move" if outer is None else "continuous", "inner": {"type": "mesh"}, **header}
    if outer is not None:
        arrays |= mesh_arrays("outer", outer.corners, outer.corners)
        header["outer"] = {"type": "mesh"}
    return Frame({"request": request, **header}, arrays)


class RunningWorker:
    """A worker's process and a connection to it."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self.process = process

    def ask(self, request: Frame) -> Frame:
        """The reply to a request."""
        assert self.process.stdin is not None and self.process.stdout is not None
        write_frame(self.process.stdin, request)
        reply = read_frame(self.process.stdout)
        assert reply is not None
        return reply


@contextmanager
def running_worker() -> Iterator[RunningWorker]:
    """A worker that is killed when the context ends."""
    process = subprocess.Popen(
        [*COMMAND, "--parent", str(os.getpid())],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    with process:
        try:
            yield RunningWorker(process)
        finally:
            process.kill()
