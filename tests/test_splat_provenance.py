"""SplatSet: origins of the scene's own splats and of pasted ones, through joining, selection and splits."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest

from cagefield.edits import Edit, EditStack, PreparedEdit, PreparedStack
from cagefield.edits.patch import Pasted
from cagefield.errors import EditError
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import Cage
from cagefield.rendering.splats.splat_provenance import MAX_JOINED_SETS, SplatSet
from cagefield.rendering.splats.splitting import split_of
from splat_scenes import random_splats

CAGE = Cage.box((0.0, 0.0, 0.0), 3.0)
NAMES = ("means", "log_scales", "quaternions", "opacities")


def paste(part: SplatField | None) -> PreparedEdit:
    return PreparedEdit(Edit.paste("../other", CAGE), pasted=Pasted(splats=part))


@pytest.fixture
def scene() -> SplatSet:
    return SplatSet.from_field(random_splats(5, degree=0))


@pytest.fixture
def parts() -> tuple[SplatField, SplatField]:
    return random_splats(3, degree=1, seed=1), random_splats(2, degree=0, seed=2)


def test_splats_of_a_field_are_the_scenes_own(scene: SplatSet) -> None:
    assert SplatSet.from_field(scene) is scene and scene.scene is scene.field and len(scene) == 5
    assert (scene.origins == -1).all() and not scene.is_pasted.any()
    assert scene.with_pastes(EditStack([Edit.delete(CAGE)])) is scene


def test_pasted_splats_follow_the_scenes_own(scene: SplatSet, parts: tuple[SplatField, SplatField]) -> None:
    first, second = paste(parts[0]), paste(parts[1])
    joined = scene.with_pastes(PreparedStack([first, second, paste(parts[0])]))
    assert joined.scene is scene.field and joined.parts == parts
    assert joined.origins.tolist() == [-1] * 5 + [0] * 3 + [1] * 2
    assert joined.pasted_rows(first).tolist() == [5, 6, 7] and joined.pasted_rows(second).tolist() == [8, 9]
    assert joined.pasted_rows(PreparedEdit(Edit.delete(CAGE))).tolist() == []
    for name in NAMES:
        wanted = np.concatenate([getattr(each, name) for each in (scene.field, *parts)])
        np.testing.assert_array_equal(getattr(joined.field, name), wanted)
    # Harmonics get the highest degree of all, with zeros.
    wanted = np.concatenate(
        [np.pad(p.sh, ((0, 0), (0, 4 - p.sh.shape[1]), (0, 0))) for p in (scene.field, *parts)]
    )
    np.testing.assert_array_equal(joined.field.sh, wanted)


def test_a_scenes_set_keeps_the_latest_joined_ones(scene: SplatSet) -> None:
    stacks = [PreparedStack([paste(random_splats(2, seed=n))]) for n in range(MAX_JOINED_SETS + 1)]
    joined = [scene.with_pastes(stack) for stack in stacks[:-1]]
    assert [scene.with_pastes(stack) for stack in stacks[:-1]] == joined
    # One more, and the least recently used one is made anew.
    scene.with_pastes(stacks[-1])
    assert scene.with_pastes(stacks[0]) is not joined[0]
    assert scene.with_pastes(stacks[-2]) is joined[-1]
    # A joined set has all that its edits paste.
    assert joined[0].with_pastes(stacks[1]) is joined[0]


def test_sets_end_with_the_scenes(parts: tuple[SplatField, SplatField]) -> None:
    scene = SplatSet.from_field(random_splats(5))
    joined = weakref.ref(scene.with_pastes(PreparedStack([paste(parts[0])])).field)
    own = weakref.ref(scene.field)
    gc.collect()
    assert joined() is not None
    del scene
    gc.collect()
    assert joined() is None and own() is None


def test_a_paste_without_its_content_is_an_error(
    scene: SplatSet, parts: tuple[SplatField, SplatField]
) -> None:
    without = PreparedEdit(Edit.paste("../other", CAGE, name="chair"))
    assert scene.with_pastes(PreparedStack([without, paste(None)])) is scene
    joined = scene.with_pastes(PreparedStack([paste(parts[0])]))
    for splats, step in (
        (scene, without),
        (joined, without),
        (joined, paste(parts[1])),
        (joined, paste(None)),
    ):
        with pytest.raises(EditError, match="as part of a Scene"):
            splats.pasted_rows(step)


def test_selected_and_derived_splats_inherit_origins(
    scene: SplatSet, parts: tuple[SplatField, SplatField]
) -> None:
    joined = scene.with_pastes(PreparedStack([paste(each) for each in parts]))
    mask = np.arange(10) % 3 == 0
    some = joined.take(mask)
    assert some.origins.tolist() == [-1, -1, 0, 1] and some.parts == parts
    np.testing.assert_array_equal(some.field.means, joined.field.means[mask])
    derived = joined.inherit_origins(random_splats(3, seed=4), np.array([9, 0, 9]))
    assert derived.origins.tolist() == [1, -1, 1] and derived.pasted_rows(paste(parts[1])).tolist() == [0, 2]
    # Rows of theirs are no rows of the scene's field.
    assert some.scene is some.field and derived.scene is derived.field


def test_sets_one_after_the_other_keep_origins(scene: SplatSet, parts: tuple[SplatField, SplatField]) -> None:
    joined = scene.with_pastes(PreparedStack([paste(each) for each in parts]))
    both = SplatSet.concatenate([joined.take(np.arange(3, 7)), joined.take(np.arange(8, 10))])
    assert both.origins.tolist() == [-1, -1, 0, 0, 1, 1] and both.parts == parts
    np.testing.assert_array_equal(both.field.sh, joined.field.sh[[3, 4, 5, 6, 8, 9]])
    assert both.field.antialiased == joined.field.antialiased
    np.testing.assert_array_equal(both.field.bounds, joined.field.bounds)


def test_children_of_split_splats_have_the_origins_of_their_parents(scene: SplatSet) -> None:
    step = paste(random_splats(40, seed=5))
    cut = Cage.box((0.0, 0.0, 0.0), 1.0)
    stack = PreparedStack([step, PreparedEdit(Edit.delete(cut))])
    joined = scene.with_pastes(stack)
    split = split_of(joined, stack)
    assert split is not None and split.children.parts == joined.parts
    np.testing.assert_array_equal(split.children.origins, joined.origins[split.sources])
    assert set(split.children.origins) == {-1, 0}
    assert split_of(joined, stack) is split is split_of(scene, stack)
