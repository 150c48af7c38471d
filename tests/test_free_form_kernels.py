"""Kernels of free-form checks: none is left to be compiled when a drag begins."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from tiers import nightly_after_first

DRAGS = """
import sys
import trimesh
from numba.core.dispatcher import Dispatcher
from cagefield.edits import Edit
from cagefield.edits.operations import Bend, MovePoint, MovePoints
from cagefield.geometry.cage import Cage
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.server.editor.document import Entry
from cagefield.server.editor.drag_solver import move
from cagefield.server.editor.free_form_kernels import load_kernels

def specializations():
    modules = [module for name, module in list(sys.modules.items()) if name.startswith("cagefield.")]
    kernels = {id(value): value for module in modules for value in vars(module).values()}
    return sum(len(one.signatures) for one in kernels.values() if isinstance(one, Dispatcher))

kind, interpolation = sys.argv[1:]
load_kernels(kind)
before = specializations()
box, ball = Cage.box((0, 0, 0), 2.0), trimesh.creation.icosphere(1, 0.9)
mesh = MeshCage(ball.vertices, ball.faces)
inner = box.subdivided((3, 2, 2), interpolation) if kind == "lattice" else mesh
entry = Entry(1, Edit.continuous(inner, box.grown(1.0), lattice=16), "#ff0000")
for operation in (MovePoint(3, (0.1, 0.1, 0)), MovePoints((0, 1), (9, 0, 0)), Bend("z", 20.0, "x")):
    assert move(entry, "field", operation).part > 0.0
print(before > 0, specializations() - before)
"""


@pytest.mark.parametrize(
    ("kind", "interpolation"),
    nightly_after_first([("lattice", "bspline"), ("lattice", "linear"), ("mesh", "")]),
)
def test_a_first_drag_compiles_nothing(kind: str, interpolation: str) -> None:
    pytest.importorskip("trimesh")
    done = subprocess.run(
        [sys.executable, "-c", DRAGS, kind, interpolation],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["True", "0"]
