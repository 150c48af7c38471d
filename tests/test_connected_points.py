"""Detours of connected control points in the density of fields, and edits of scenes by them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.edits import Continuous, Edit, EditStack, PreparedStack
from cagefield.errors import EditError
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.geometry.control_points import ControlPoints
from cagefield.geometry.detour_grid import DetourGrid
from cagefield.scene.scene import Scene
from cagefield.selection.connected_points import detours_of, with_detours
from scenes import ball_cameras
from slabs import TIP, on_slab, slabs, slabs_of_splats
from test_control_point_velocity import check

NONE = EditStack()

FIELDS = pytest.mark.parametrize("field", [slabs(), slabs_of_splats()], ids=["voxels", "splats"])


def pull(radius: float = 0.8, by: tuple[float, float, float] = (0.0, 0.0, 0.2)) -> Continuous:
    return Edit.points([TIP], radius=radius, connected=True).translate(by)


@FIELDS
@pytest.mark.parametrize("by", [(0.0, 0.0, 0.3), (0.0, 0.3, 0.0), (-0.3, 0.0, 0.0)])
def test_the_slab_beside_stays(field: VoxelField | SplatField, by: tuple[float, float, float]) -> None:
    edit = with_detours(pull(by=by), field, NONE)
    warp, length = edit.exact_warp, float(np.linalg.norm(by))
    right, left = on_slab(0.25), on_slab(-0.25)
    stays = np.linalg.norm(warp.to_deformed(right).points - right, axis=1)
    assert stays.max() <= 1e-3 * length
    np.testing.assert_allclose(warp.to_deformed(np.array([TIP])).points, [np.add(TIP, by)], atol=1e-5)
    # In matter without obstacles the way is straight: the slab moves as by plain control points.
    plain = Edit.points([TIP], radius=0.8).translate(by).exact_warp
    moved, same = (w.to_deformed(left).points for w in (warp, plain))
    assert np.linalg.norm(same - left, axis=1).max() > 0.8 * length
    # Matter that falls behind the points on the way has its detour from beside the slab: some percent.
    # Across the slab, towards -x, it falls behind into the gap's detours, and moves less.
    if by[0] == 0.0:
        assert np.abs(moved - same).max() < 0.05 * length
    # And by plain ones the other slab does not stay.
    assert np.linalg.norm(plain.to_deformed(right).points - right, axis=1).max() > 0.1 * length


@FIELDS
def test_the_map_does_not_fold(field: VoxelField | SplatField) -> None:
    edit = with_detours(pull(by=(0.1, 0.1, 0.3)).rotate((0.0, 0.0, 0.3)), field, NONE)
    check(edit, 0, 1500)


def test_a_way_around_is_as_long_as_through_the_foot() -> None:
    points = ControlPoints([TIP], 2.0, connected=True)
    grid = detours_of(points, slabs(joined=True), NONE)
    # From the tip down, across the foot and up again: 8 corners of the way by hand, in voxels of 1/24.
    there = np.array([[0.25, 0.0, 0.4]])
    straight = 0.5
    down, across = (0.4 - (-1.0 + 7 / 24)), 7 / 24  # to the foot's top layer, between the slabs' inner faces
    around = 2.0 * np.hypot(down, 0.1) + across
    detour = grid.at(there - points.pivot)[0][0]
    assert detour == pytest.approx(around - straight, rel=0.1)
    # Along the slab itself there is none.
    assert grid.at(np.array([[-0.25, 0.0, -0.4]]) - points.pivot)[0][0] < 0.02
    # And without the foot there is no way.
    apart = detours_of(points, slabs(), NONE)
    assert apart.at(there - points.pivot)[0][0] == pytest.approx(2.0)


def test_two_connected_points_move_both_slabs() -> None:
    edit = Edit.points([TIP, (0.25, 0.0, 0.4)], radius=0.6, connected=True).translate((0, 0, 0.2))
    warp = with_detours(edit, slabs(), NONE).exact_warp
    both = np.array([TIP, (0.25, 0.0, 0.4)])
    np.testing.assert_allclose(warp.to_deformed(both).points, both + np.array([0, 0, 0.2]), atol=1e-5)


def test_the_matter_is_that_of_the_edits_below() -> None:
    """A slab that was moved away from under the point is not there, and where it went it is."""
    aside = Edit.move(Cage.box((-0.25, 0.0, -0.1), (0.3, 0.9, 1.3))).translate((0.0, 0.0, 0.5))
    points = ControlPoints([(-0.25, 0.0, 0.8)], 0.3, connected=True)
    with pytest.raises(EditError, match=r"control point 0 .* is connected to nothing"):
        detours_of(points, slabs(), NONE)
    grid = detours_of(points, slabs(), PreparedStack([aside]))
    assert grid.at(np.zeros((1, 3)))[0][0] == 0.0


def test_a_point_in_empty_space_is_refused_with_its_edit() -> None:
    edit = Edit.points([(0.0, 0.0, 0.9)], radius=0.1, connected=True, name="tip").translate((0, 0, 0.1))
    with pytest.raises(EditError, match=r'edit "tip": control point 0 .* is connected to nothing'):
        with_detours(edit, slabs(), NONE)
    off = edit.replace(enabled=False)
    assert with_detours(off, slabs(), NONE) is off


def scene_of(field: VoxelField | SplatField, *edits: Edit) -> Scene:
    return Scene(field, EditStack(edits), cameras={"train": ball_cameras(2)})


@FIELDS
def test_scenes_prepare_their_edits(field: VoxelField | SplatField, tmp_path: Path) -> None:
    edit = pull().replace(name="finger", relight="none")
    scene_of(field, edit).save(tmp_path / "scene")
    scene = Scene.open(tmp_path / "scene")
    assert scene.edits[0].inner == edit.inner
    (prepared,) = scene.prepared_edits
    points = prepared.edit.inner
    assert isinstance(points, ControlPoints) and isinstance(points.detours, DetourGrid)
    # Made once.
    again = scene.prepared_edits[0].edit.inner
    assert isinstance(again, ControlPoints) and again.detours is points.detours
    right = on_slab(0.25)
    moved = scene.prepared_edits.to_deformed(right).points
    assert np.abs(moved - right).max() < 2e-4


def test_pictures_show_the_other_slab_where_it_is() -> None:
    def rows(edit: Edit) -> NDArray[np.floating]:
        scene = scene_of(slabs(), edit)
        camera = ball_cameras(1, 0.0)[0]
        # From +x the slabs lie one behind the other: look from -y.
        camera = type(camera).look_at((0, -3, 0), (0, 0, 0), width=48, height=48, fov_x=0.9)
        return np.asarray(scene.render(camera).opacity)

    plain = Edit.points([TIP], radius=0.8, relight="none").translate((0, 0, 0.2))
    connected = pull().replace(relight="none")
    still = rows(plain.replace(enabled=False))
    right = slice(25, 48)
    assert (
        np.abs(rows(connected)[:, right] - still[:, right]).mean()
        < 0.1 * np.abs(rows(plain)[:, right] - still[:, right]).mean()
    )
    assert np.abs(rows(connected)[:, :23] - still[:, :23]).max() > 0.5
