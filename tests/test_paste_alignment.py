"""Similarities between point sets, and pastes that they align with the scene around them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cagefield.edits import Edit, EditStack
from cagefield.edits.grade import Grade, grade_sh
from cagefield.errors import CagefieldError
from cagefield.exporting import edited_splats
from cagefield.exporting.similarity import transform_field
from cagefield.geometry.cage import Cage
from cagefield.geometry.point_alignment import Similarity, fit_similarity, refine_similarity
from cagefield.scene.paste_alignment import align_paste, placed
from cagefield.scene.scene import Scene
from commands import printed, refused
from splat_scenes import splat_scene
from tiers import nightly_except

TURN = Rotation.from_euler("xyz", (20.0, -35.0, 130.0), degrees=True).as_matrix()
TRUE = Similarity(1.7, TURN, np.array([0.4, -2.0, 3.0]))


def bumpy_surface(count: int, seed: int) -> np.ndarray:
    """Points of a surface without symmetry."""
    u = np.random.default_rng(seed).normal(size=(count, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    radius = 1.0 + 0.3 * np.sin(3.0 * u[:, 0] + 1.0) + 0.25 * u[:, 1] * u[:, 2] + 0.4 * (u[:, 2] > 0.7)
    return radius[:, None] * u * (1.0, 0.7, 0.5)


def corner_error(found: Similarity, expected: Similarity = TRUE) -> float:
    """Largest distance between the images of a cube's corners."""
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
    gaps = found.transform_points(corners) - expected.transform_points(corners)
    return float(np.linalg.norm(gaps, axis=1).max())


@pytest.mark.parametrize("count", [3, 4, 50])
def test_pairs_give_the_similarity(count: int) -> None:
    source = np.random.default_rng(1).normal(size=(count, 3))
    assert corner_error(fit_similarity(source, TRUE.transform_points(source))) < 1e-9
    noisy = TRUE.transform_points(source) + np.random.default_rng(2).normal(0, 1e-3, (count, 3))
    found = fit_similarity(source, noisy)
    assert np.linalg.det(found.rotation) == pytest.approx(1.0) and corner_error(found) < 2e-2


def test_a_mirrored_target_gives_a_rotation() -> None:
    source = np.random.default_rng(1).normal(size=(20, 3))
    found = fit_similarity(source, source * (1.0, 1.0, -1.0))
    assert np.linalg.det(found.rotation) == pytest.approx(1.0) and 0.0 < found.scale < 1.0


@pytest.mark.parametrize(
    ("source", "target", "message"),
    [
        (np.eye(3)[:2], np.eye(3)[:2], "at least three pairs"),
        (np.eye(3), np.eye(4)[:, :3], "at least three pairs"),
        ([(0, 0, 0), (1, 1, 1), (2, 2, 2)], np.eye(3), "source's points lie on a line"),
        (np.eye(3), np.ones((3, 3)), "target's points lie on a line"),
        (np.eye(3), np.full((3, 3), np.nan), "finite"),
    ],
)
def test_impossible_pairs_are_refused(source: object, target: object, message: str) -> None:
    with pytest.raises(CagefieldError, match=message):
        fit_similarity(source, target)


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_surfaces_correct_rough_pairs(unit: float) -> None:
    """Other points of one surface, a third of the target missing, clutter around: half a percent is left."""
    source, target = bumpy_surface(4000, 0), bumpy_surface(6000, 5)
    target = target[target[:, 0] > -0.45]
    clutter = np.random.default_rng(9).uniform(-6, 6, (1500, 3))
    to_unit = Similarity(unit * TRUE.scale, TRUE.rotation, unit * TRUE.translation)
    target = np.concatenate([to_unit.transform_points(target), unit * clutter])
    rough = Similarity(
        1.06 * to_unit.scale,
        Rotation.from_euler("xyz", (5.0, -6.0, 4.0), degrees=True).as_matrix() @ TURN,
        to_unit.translation + unit * np.array([0.08, -0.06, 0.1]),
    )
    found = refine_similarity(source, target, rough)
    assert found.distance < 0.5 * found.distance_before
    assert corner_error(found.similarity, to_unit) < 0.05 * corner_error(rough, to_unit) + 0.02 * unit
    metric = Similarity(to_unit.scale, rough.rotation, rough.translation)
    same = refine_similarity(source, target, metric, keep_scale=True).similarity
    assert same.scale == metric.scale and corner_error(same, to_unit) < 0.02 * unit


@pytest.mark.parametrize("keep_scale", nightly_except([False, True], False))
def test_a_source_of_which_little_has_a_counterpart_is_not_shrunk_onto_it(keep_scale: bool) -> None:
    """A fifth of the surface is in the target: without a reach, the rest would draw the source together."""
    source, target = bumpy_surface(6000, 0), bumpy_surface(20_000, 5)
    target = TRUE.transform_points(target[target[:, 0] > 0.45])
    rough = Similarity(
        TRUE.scale if keep_scale else 1.03 * TRUE.scale,
        Rotation.from_euler("xyz", (2.0, -2.0, 1.5), degrees=True).as_matrix() @ TURN,
        TRUE.translation + np.array([0.04, -0.03, 0.05]),
    )
    found = refine_similarity(source, target, rough, keep_scale=keep_scale, reach=0.25)
    near = source[source[:, 0] > 0.5]
    error, before = (
        np.linalg.norm(each.transform_points(near) - TRUE.transform_points(near), axis=1).mean()
        for each in (found.similarity, rough)
    )
    assert error < 0.5 * before
    anyhow = refine_similarity(source, target, rough)
    assert 1 / 1.25 < anyhow.similarity.scale / rough.scale < 1.25
    with pytest.raises(CagefieldError, match="none of the surfaces side by side"):
        refine_similarity(source, target + 50.0, rough, reach=0.25)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A scene of splats, and beside it `other`, the same splats under the inverse of TRUE."""
    scene = dataclasses.replace(splat_scene(), edits=EditStack())
    scene.save(tmp_path / "scene")
    back = np.eye(4)
    back[:3, :3] = TRUE.rotation.T / TRUE.scale
    back[:3, 3] = -back[:3, :3] @ TRUE.translation
    field = transform_field(dataclasses.replace(scene.field, bounds=None), back)
    dataclasses.replace(scene, field=field, cameras={}).save(tmp_path / "other")
    paste = Scene.open(tmp_path / "scene").paste("../other", name="other")
    Scene.open(tmp_path / "scene").with_edits(EditStack([paste])).save(tmp_path / "scene", overwrite=True)
    return tmp_path / "scene"


def pairs(folder: Path, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """(points of the other scene, points of this one with noise) for four splats that are far apart."""
    here = Scene.open(folder).field.means.astype(float)
    rows = [here[:, 0].argmin(), here[:, 0].argmax(), here[:, 1].argmax(), here[:, 2].argmax()]
    there = Scene.open(folder.parent / "other").field.means.astype(float)[rows]
    return there, here[rows] + np.random.default_rng(3).normal(0.0, noise, (4, 3))


def test_a_paste_comes_to_the_points_of_its_pairs(folder: Path) -> None:
    scene = Scene.open(folder)
    found = align_paste(scene, scene.edits[0], *pairs(folder, 0.0))
    assert found.residual < 1e-4 and found.refinement is None
    expected = TRUE.transform_points(scene.edits[0].inner.corners)
    np.testing.assert_allclose(found.edit.deformed.corners, expected, atol=1e-4)
    moved = edited_splats(scene.with_edits(EditStack([found.edit]))).means
    count = len(scene.field)
    inside = scene.edits[0].inner.contains(Scene.open(folder.parent / "other").field.means.astype(float))
    assert len(moved) > 1.5 * count
    np.testing.assert_allclose(
        np.sort(moved[count:], axis=0), np.sort(scene.field.means[inside], axis=0), atol=1e-3
    )


def test_surfaces_refine_the_pairs(folder: Path) -> None:
    scene = Scene.open(folder)
    there, here = pairs(folder, 0.03)
    rough = align_paste(scene, scene.edits[0], there, here)
    fine = align_paste(scene, scene.edits[0], there, here, refine=True)
    expected = TRUE.transform_points(scene.edits[0].inner.corners)
    rough_error, fine_error = (
        np.linalg.norm(each.edit.deformed.corners - expected, axis=1).max() for each in (rough, fine)
    )
    assert fine.refinement is not None and fine.refinement.distance < fine.refinement.distance_before
    assert fine_error < 0.3 * rough_error


def test_placed_operations_are_those_of_the_similarity() -> None:
    edit = Edit.paste("../x", Cage.box((1.0, 2.0, 3.0), (1.0, 0.5, 2.0))).translate((9.0, 9.0, 9.0))
    corners = placed(edit, TRUE).deformed.corners
    np.testing.assert_allclose(corners, TRUE.transform_points(edit.inner.corners), atol=1e-7)
    still = placed(edit, Similarity(1.0, np.eye(3), np.zeros(3)))
    np.testing.assert_allclose(still.deformed.corners, edit.inner.corners, atol=1e-12)


def test_the_command_writes_the_edits(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    there, here = pairs(folder, 0.02)
    texts = [",".join(map(str, point)) for pair in zip(there, here, strict=True) for point in pair]
    said = printed(capsys, "align", folder, "--paste", "other", "--pairs", *texts, "--refine")
    assert "pairs" in said and "surfaces" in said and "scaling" in said
    (edit,) = Scene.open(folder).edits
    expected = TRUE.transform_points(edit.inner.corners)
    assert np.linalg.norm(edit.deformed.corners - expected, axis=1).max() < 0.05
    before = (folder / "edits.yaml").read_bytes()
    for options, message in [
        (
            ("--paste", "chair", "--pairs", *texts),
            '"chair" is no paste of this scene; its pastes are: "other"',
        ),
        (("--paste", "other", "--pairs", *texts[:4]), "--pairs has 4 points"),
        (("--paste", "other", "--pairs", *texts[:5]), "--pairs has 5 points"),
        (("--paste", "other", "--pairs", *texts[:2] * 3), "lie on a line"),
        (("--paste", "other", "--pairs", *texts, "--reset"), "--paste aligns an edit"),
        (("--refine",), "are for --paste"),
    ]:
        assert message in refused(capsys, "align", folder, *options)
    assert (folder / "edits.yaml").read_bytes() == before


def test_a_cage_without_surface_says_so(folder: Path) -> None:
    scene = Scene.open(folder)
    empty = scene.edits[0].replace(inner=Cage.box((50.0, 0.0, 0.0), 1.0))
    with pytest.raises(CagefieldError, match="holds no surface of the pasted scene"):
        align_paste(scene, empty, *pairs(folder, 0.0), refine=True)


@pytest.mark.parametrize("gains", [(1.0, 1.0, 1.0), (1.3, 0.8, 0.7), (0.5, 0.6, 0.9)])
def test_a_grade_of_gains_has_them_as_its_matrix(gains: tuple[float, ...]) -> None:
    np.testing.assert_allclose(Grade.from_gains(gains).matrix, np.diag(gains), atol=1e-12)


@pytest.mark.parametrize("gains", [(1.0, 0.0, 1.0), (1.0, np.nan, 1.0), (1.0, 1.0)])
def test_gains_that_are_none_are_refused(gains: tuple[float, ...]) -> None:
    with pytest.raises(CagefieldError, match="three numbers above 0"):
        Grade.from_gains(gains)


def test_colors_are_matched_where_the_scenes_meet(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The other scene was taken darker and bluer; the aligned paste has this scene's colors."""
    other = Scene.open(folder.parent / "other")
    darker = Grade(exposure=-0.7, temperature=-0.5, tint=0.2)
    sh = grade_sh(other.field.sh, np.broadcast_to(darker.matrix, (len(other.field), 3, 3)))
    dataclasses.replace(other, field=dataclasses.replace(other.field, sh=sh)).save(
        folder.parent / "other", overwrite=True
    )
    texts = [",".join(map(str, p)) for pair in zip(*pairs(folder, 0.0), strict=True) for p in pair]
    said = printed(capsys, "align", folder, "--paste", "other", "--pairs", *texts, "--match-colors")
    assert "colors      exposure" in said
    (edit,) = Scene.open(folder).edits
    back = edit.grading.matrix @ darker.matrix
    np.testing.assert_allclose(back, np.eye(3), atol=0.03)
