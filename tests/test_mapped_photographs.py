"""Photographs through maps: against plain photos, parts really moved, and rays sampled densely."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from benchmarks.common.cases import chosen
from benchmarks.edits.edit_quality import eye
from benchmarks.edits.exact_maps import exact
from benchmarks.edits.mapped_photographs import MappedScene
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.edits import Edit, EditStack, Flow, SpaceMap
from cagefield.edits.mapped_samples import KernelSamples
from cagefield.errors import SceneError
from cagefield.geometry.cage import Cage
from cagefield.images.metrics import psnr
from cagefield.procedural import SCENES, ProceduralScene, procedural_scene
from cagefield.procedural.distance_cells import CELL_SIZE, DistanceCells
from cagefield.procedural.parts import Part, Primitive, pose_matrix
from cagefield.procedural.shapes import Box, Cylinder, Sphere
from cagefield.procedural.textures import Plain
from cagefield.rendering.reference_renderer import intersect_box
from tiers import nightly_after_first

GREY = Plain((0.6, 0.5, 0.4))


def scene_of(*primitives: Primitive) -> ProceduralScene:
    return ProceduralScene("test", (Part("thing", primitives),))


def view(size: int, fov_x: float, target: tuple[float, float, float] = (0, 0, 0)) -> Camera:
    return Camera.look_at((2.4, -2.0, 0.9), target, width=size, height=size, fov_x=fov_x)


@dataclass(frozen=True)
class Still:
    """A map that moves nothing, in a box around the scenes."""

    bounds: Any = ((-1.2, -1.2, -1.2), (1.2, 1.2, 1.2))
    boxes: Any = ()

    def to_canonical(self, points: NDArray[Any], viewdirs: NDArray[Any] | None = None) -> KernelSamples:
        assert viewdirs is not None
        count = len(points)
        return KernelSamples(points, viewdirs, np.ones(count, np.float32), np.zeros(count, bool))


def brute(scene: ProceduralScene, mapping: SpaceMap, camera: Camera, spacing: float) -> NDArray[np.bool_]:
    """Pixels [H,W] whose ray has a sample inside the scene, the samples so far apart."""
    origins, directions = camera.rays()
    boxes = np.stack([scene.bounds, np.asarray(mapping.bounds)])
    enter, leave = intersect_box(origins, directions, (boxes[:, 0].min(0), boxes[:, 1].max(0)))
    field, inside = scene.field(1e-3), np.zeros(len(origins), bool)
    for row in np.flatnonzero(enter < leave):
        t = np.arange(enter[row], leave[row], spacing, dtype=np.float32)
        at = mapping.to_canonical(
            origins[row] + t[:, None] * directions[row], np.tile(directions[row], (len(t), 1))
        )
        distance = field.distance(np.ascontiguousarray(at.points, np.float32))[0]
        inside[row] = (distance[at.layer >= 0] < 0).any()
    return inside.reshape(camera.height, camera.width)


def met(scene: ProceduralScene, mapping: SpaceMap, camera: Camera) -> NDArray[np.bool_]:
    """Pixels [H,W] whose ray meets a surface."""
    frame = MappedScene(scene, mapping).photograph(camera, supersample=1)
    return frame.opacity > 0.5


# -- distances ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SCENES)
def test_cells_bound_the_distance_and_give_it_near_surfaces(name: str) -> None:
    scene = procedural_scene(name)
    rng = np.random.default_rng(0)
    points = rng.uniform(-1.4, 1.4, (4000, 3)).astype(np.float32)
    # shells of SHELL * eps = .12: further out the field's distance is inf
    true, owner, instance = scene.field(0.02).distance(points)
    found = DistanceCells(scene.placed)(np.ascontiguousarray(points.T))
    alike = ~np.array([item.stretched for item in scene.placed])[owner]
    # float32 of coordinates near 1, and distances of stretched parts are of first order
    assert (found.bound <= np.where(alike, true, np.inf) + 2e-6).all()
    near = alike & (true < 0.9 * CELL_SIZE) & ~np.isin(found.primitive, _stretched(scene))
    assert near.sum() > 50
    np.testing.assert_allclose(found.bound[near], true[near], atol=2e-6)
    np.testing.assert_array_equal(found.primitive[near], owner[near])
    np.testing.assert_array_equal(found.instance[near], instance[near])
    # in the open the bound is worth a step
    assert np.median(found.bound[np.isinf(true)]) > 0.1


def _stretched(scene: ProceduralScene) -> list[int]:
    return [index for index, item in enumerate(scene.placed) if item.stretched]


# -- photographs -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", nightly_after_first(SCENES))
def test_a_map_that_moves_nothing_gives_the_photograph(name: str) -> None:
    scene, camera = procedural_scene(name), eye(name, 64)
    photo = scene.photograph(camera, background="white")
    frame = MappedScene(scene, Still()).photograph(camera, background="white")
    # rays that graze a surface arrive within the tolerance of `trace` by the one and not by the other
    assert psnr(frame.rgb, photo.rgb) > 45
    assert (np.abs(frame.opacity - photo.opacity) > 0).mean() < 0.01
    both = (frame.opacity == 1) & (photo.opacity == 1)
    # both end within the tolerance of 2e-4 of the surface, which a slanted ray meets farther on
    assert np.median(np.abs(frame.depth[both] - photo.depth[both])) < 5e-4
    # half of the box: what is before it, in it and behind it is one picture
    half = MappedScene(scene, Still(((-0.3, -1.2, -1.2), (0.2, 1.2, 1.2)))).photograph(camera)
    assert psnr(half.over("white").rgb, photo.rgb) > 45
    nothing = MappedScene(scene, exact(EditStack())).photograph(camera, background="white")
    np.testing.assert_array_equal(nothing.rgb, photo.rgb)


def test_an_affine_edit_of_a_whole_scene_is_its_motion() -> None:
    """The chair's inner cage holds all its parts; carried light is that of the canonical point."""
    (case,) = chosen(["chair"], ["lower_wider"])
    scene, camera = procedural_scene("chair"), eye("chair", 64)
    (edit,) = case.edits
    moved = scene.move(
        scene.part_names, scale=(1, 1.35, 0.75), translate=(0, 0, -0.2475), pivot=edit.inner.center
    ).with_modeled_light()
    frame = MappedScene(scene, exact(case.edits)).photograph(camera, background="white")
    truth = moved.photograph(camera, background="white")
    # 2 of 3 pixels of 64 have an edge; the unmoved chair is 11 dB
    assert psnr(frame.rgb, truth.rgb) > 40


def test_a_turned_part_is_seen_by_its_canonical_directions() -> None:
    """A box's faces keep the light and the highlights they had, as where light is carried along."""
    scene = scene_of(Primitive(Box((0.25, 0.2, 0.15), 0.02), GREY, gloss=(0.3, 9.0)))
    inner = Cage.box((0, 0, 0), 0.8)
    edit = Edit.continuous(inner, inner.grown(0.5), shell=Flow()).rotate((0.2, 0.3, 0.9))
    moved = scene.move("thing", rotate=(0.2, 0.3, 0.9), pivot=(0, 0, 0))
    frame = MappedScene(scene, exact(EditStack([edit]))).photograph(view(48, 0.4), background="white")
    carried, lit = (
        each.photograph(view(48, 0.4), background="white") for each in (moved.with_modeled_light(), moved)
    )
    # subsamples at edges may fall to the one side or the other; within faces the pictures are equal
    assert psnr(frame.rgb, carried.rgb) > 38
    faces = carried.opacity == 1
    apart, anew = (np.abs(frame.rgb - each.rgb)[faces] for each in (carried, lit))
    assert np.median(apart) < 1e-3 < 0.02 < np.median(anew)


@pytest.mark.nightly
def test_a_thin_rod_in_a_twisted_shell_is_not_missed() -> None:
    rod = Primitive(Cylinder(0.004, 0.9), GREY, pose_matrix((0.28, 0, 0))[None])
    scene = scene_of(rod, Primitive(Sphere(0.1), GREY, pose_matrix((0, 0, 0.5))[None]))
    inner = Cage.box((0, 0, 0), (0.8, 0.8, 0.5))
    edit = Edit.continuous(inner, Cage.box((0, 0, 0), (1.5, 1.5, 1.5))).rotate((0, 0, np.radians(80)))
    mapping = exact(EditStack([edit]))
    # where the rod goes through the upper half of the shell
    camera = view(24, 0.06, (0.21, 0.18, 0.47))
    want, got = brute(scene, mapping, camera, 2e-3), met(scene, mapping, camera)
    assert want.sum() >= 20
    assert (want & ~got).sum() == 0
    # a ray that misses by less than the tolerance has arrived; the rod is a pixel wide
    assert (got & ~want).sum() <= 0.15 * want.sum()
    # it is bent, and nowhere where it was
    assert (want & met(scene, Still(), camera)).sum() < 0.2 * want.sum()


def test_cuts_and_copies_have_the_surfaces_that_samples_have() -> None:
    """Maps that jump: half of a box is deleted, and the rest put beside it once more."""
    scene = scene_of(Primitive(Box((0.3, 0.3, 0.3), 0.05), GREY))
    cut = Edit.delete(Cage.box((0.25, 0, 0), (0.5, 0.8, 0.8)))
    copy = Edit.copy(Cage.box((-0.2, 0, 0), (0.38, 0.8, 0.8)))
    mapping = exact(EditStack([cut, copy.translate((0, 0.7, 0.1)).rotate((0, 0, 0.5))]))
    camera = view(40, 0.6)
    want, got = brute(scene, mapping, camera, 1e-3), met(scene, mapping, camera)
    assert want.sum() > 150
    # rays that clip an edge by less than a sample, or the tolerance
    assert (want ^ got).sum() <= 4
    assert (want ^ met(scene, Still(), camera)).sum() > 60
    frame = MappedScene(scene, mapping).photograph(camera, supersample=1)
    row = camera.project(np.array([[0.0, 0.0, 0.0]]))[0].astype(int)[0]
    # the cut through the box's middle is a face across the ray, .3 behind the box's own
    origin, direction = camera.origin, camera.rays(row[None])[1][0]
    np.testing.assert_allclose(frame.depth[row[1], row[0]], -origin[0] / direction[0], atol=1e-3)


def test_a_thin_copy_in_open_space_is_not_stepped_over() -> None:
    """Before the copy a ray's sample is far from all surfaces, and knows nothing of the jump ahead."""
    scene = scene_of(Primitive(Box((0.004, 0.25, 0.25)), GREY, pose_matrix((-0.5, 0, 0))[None]))
    copy = Edit.copy(Cage.box((-0.5, 0, 0), (0.012, 0.6, 0.6)))
    mapping = exact(EditStack([copy.translate((1.0, 0.2, 0))]))
    camera = view(24, 0.6)
    frame = MappedScene(scene, mapping).photograph(camera, supersample=1)
    truth = scene.duplicate("thing", translate=(1.0, 0.2, 0)).photograph(camera, supersample=1)
    assert (truth.opacity > 0).sum() > 1.5 * (scene.photograph(camera, supersample=1).opacity > 0).sum()
    assert ((frame.opacity > 0) ^ (truth.opacity > 0)).sum() <= 2
    both = (frame.opacity > 0) & (truth.opacity > 0)
    np.testing.assert_allclose(frame.depth[both], truth.depth[both], atol=2e-3)


@dataclass(frozen=True)
class Squeezed(Still):
    """x^c = x + tanh(50 x) / 2: what lies within half a unit of x = 0 is pressed into a twentieth of that."""

    def to_canonical(self, points: NDArray[Any], viewdirs: NDArray[Any] | None = None) -> KernelSamples:
        assert viewdirs is not None
        canonical, along = points.copy(), viewdirs.copy()
        canonical[:, 0] += np.tanh(50 * points[:, 0]) / 2
        along[:, 0] *= 1 + 25 * (1 - np.tanh(50 * points[:, 0]) ** 2)
        stretch = np.linalg.norm(along, axis=1)
        return KernelSamples(canonical, along / stretch[:, None], stretch, np.zeros(len(points), bool))


def test_what_a_map_squeezes_is_not_stepped_over() -> None:
    """Before the squeeze nothing is near and the map is as it should be; a step goes right over it."""
    scene = scene_of(Primitive(Box((0.02, 0.5, 0.5)), GREY))
    camera = Camera.look_at((3.0, 0, 0), (0, 0, 0), width=16, height=16, fov_x=0.2)
    # whole steps of .1 from the face at 1.15 end at .05 and -.05
    squeezed = Squeezed(((-1.2, -1.2, -1.2), (1.15, 1.2, 1.2)))
    frame = MappedScene(scene, squeezed).photograph(camera, supersample=1)
    assert (frame.opacity == 1).all()
    np.testing.assert_allclose(frame.depth[7:9, 7:9], 3.0, atol=0.02)


def test_mirrors_are_refused() -> None:
    mirror = replace(Primitive(Box((0.3, 0.3, 0.3)), GREY), mirror=0.2)
    with pytest.raises(SceneError, match="scene test has a mirror, which cannot be seen through a map"):
        MappedScene(scene_of(mirror), Still())
