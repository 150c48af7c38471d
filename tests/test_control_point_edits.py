"""Edits of control points on their way to pictures: lattices, pages and camera paths."""

from __future__ import annotations

import numpy as np

from cagefield.edits import Edit, EditStack
from cagefield.edits.device import packing
from cagefield.edits.device_stack import DeviceStack
from cagefield.edits.partial_edit import partial_edit
from cagefield.geometry.cage import Cage
from cagefield.geometry.reach_cage import ReachCage
from cagefield.pages import row_layout
from cagefield.pages.page_edits import for_page, page_rows

EDIT = (
    Edit.points([[0, 0, 0], [0.3, 0, 0]], radius=0.5, name="nose").translate((0.4, 0, 0)).rotate((0, 0, 0.5))
)


def test_states_of_a_camera_path_share_one_outer_cage() -> None:
    for share in (0.25, 0.5, 0.75):
        there = partial_edit(EDIT, share)
        assert there is not None and there.is_possible
        assert isinstance(EDIT.shell_settings.outer, ReachCage)
        np.testing.assert_array_equal(there.shell_settings.outer.corners, EDIT.shell_settings.outer.corners)
        # And the operations, not a share of the map: half a translation is half as far.
    half = partial_edit(Edit.points([[0, 0, 0]], radius=0.5).translate((0.4, 0, 0)), 0.5)
    np.testing.assert_allclose(half.exact_warp.to_deformed(np.zeros((1, 3))).points, [[0.2, 0, 0]], atol=1e-6)
    confined = EDIT.replace(outer=Cage.box((0.3, 0, 0), 3.0))
    assert partial_edit(confined, 0.5).shell_settings.outer is confined.shell_settings.outer


def test_a_page_reads_the_whole_outer_cage_from_the_lattice() -> None:
    assert for_page(EDIT) is EDIT
    stack = EditStack([EDIT])
    packed = DeviceStack.from_stack(stack)
    row = packed.params[0]
    assert (row[packing.FIRST], row[packing.LAST], row[packing.RESOLUTION]) == (1, 2, 64)
    assert len(packed.lattice) == 64**3
    rows = page_rows(stack.steps, packed)
    # The page's short way looks for an inner hexahedron, which there is none of.
    assert rows[row_layout.SIMPLE_SCALAR, 3] == 0 and rows[row_layout.FIRST_SCALAR, 3] == 1
    assert rows[row_layout.RESOLUTION_SCALAR, 3] == 64


def test_equal_edits_share_their_nodes() -> None:
    again = Edit.points([[0, 0, 0], [0.3, 0, 0]], radius=0.5, name="nose").translate((0.4, 0, 0))
    assert again.rotate((0, 0, 0.5)) == EDIT and again.rotate((0, 0, 0.5)).lattice_nodes is EDIT.lattice_nodes
