"""Free-form cases: their edit files, and their maps against parts deformed in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.common.cases import CASES, FREE_FORM_CASES, Case, chosen
from benchmarks.edits.closed_forms import canonical_inside, deformed_scene, map_errors
from benchmarks.edits.edit_quality import eye
from benchmarks.edits.edits_table import Inside, Score, table
from benchmarks.edits.exact_maps import exact

from benchmark_settings import TINY
from cagefield.cameras.camera import Camera
from cagefield.edits import EditStack, KernelMap
from cagefield.errors import CagefieldError
from cagefield.geometry import ControlPoints, LatticeCage, MeshCage
from cagefield.geometry.cage import Cage
from cagefield.procedural import procedural_scene
from tiers import nightly_except

MAX_ERROR = {
    "bend_arm": 0.003,
    "bend_arm_mesh": 0.016,
    "bend_arm_mean_value": 0.017,
    "turn_painted_flower": 1e-4,
    "twist_stem": 0.004,
    "straighten_cable": 0.001,
    "pull_crest": 5e-5,
    "pull_flower": 1e-6,
}
"""World units: an 8-point B-spline rounds an arc off by angle^2 / 6 / 7^2 of its radius, and a twist so."""


def named(case: Case) -> str:
    return f"{case.scene}-{case.name}"


DEFORMED = tuple(case for case in FREE_FORM_CASES if case.deformed is not None)


EVERY_RUN = tuple(case for case in DEFORMED if case.name != "bend_arm_mean_value")
"""Cases of every run; the others, which differ in the blend alone, are nightly."""


@pytest.fixture(scope="module", params=nightly_except(DEFORMED, *EVERY_RUN), ids=map(named, DEFORMED))
def case(request: pytest.FixtureRequest) -> Case:
    found: Case = request.param
    return found


@pytest.fixture(scope="module")
def edits(case: Case) -> EditStack:
    return case.edits


def test_edit_files_move_the_part_as_the_closed_form(case: Case, edits: EditStack) -> None:
    with case.blended():
        edits.check()
    deformed = deformed_scene(case)
    mask, points, canonical = canonical_inside(edits[-1].inner, deformed, deformed, eye(case.scene, 72))
    assert mask.sum() >= 6
    moved = np.linalg.norm(points - canonical, axis=1)
    with case.blended():
        errors = map_errors(exact(edits), points, canonical)
    assert errors.max() < MAX_ERROR[case.name] < 0.05 * moved.max()
    assert moved.max() > 0.05


def test_cages_are_of_their_kind(case: Case, edits: EditStack) -> None:
    kinds = {"pull_crest": ControlPoints} | dict.fromkeys(
        ("bend_arm", "twist_stem", "straighten_cable"), LatticeCage
    )
    kinds |= dict.fromkeys(("bend_arm_mesh", "bend_arm_mean_value", "turn_painted_flower"), MeshCage)
    if case.name in kinds:
        assert isinstance(edits[-1].inner, kinds[case.name])
        assert not isinstance(exact(edits), KernelMap)
    else:
        assert edits[-1].inner.is_hexahedron


def test_outside_the_cages_nothing_moves(case: Case, edits: EditStack) -> None:
    low, high = edits[-1].bounds
    scene = procedural_scene(case.scene)
    start, end = 1.2 * scene.bounds
    p = np.random.default_rng(0).uniform(start, end, (4000, 3))
    p = p[((p < low) | (p > high)).any(axis=1)]
    assert len(p) > 500
    np.testing.assert_array_equal(edits.to_canonical(p, np.eye(3)[[2]].repeat(len(p), 0)).points, p)


@pytest.mark.nightly
def test_a_mesh_bends_closer_to_the_closed_form_by_harmonic_coordinates() -> None:
    errors = {}
    for case in chosen((), ("bend_arm_mesh", "bend_arm_mean_value")):
        deformed = deformed_scene(case)
        _, points, canonical = canonical_inside(case.edits[-1].inner, deformed, deformed, eye("digger", 48))
        with case.blended():
            errors[case.blend] = map_errors(exact(case.edits), points, canonical).mean()
    assert 0.0 < errors["harmonic"] < 0.9 * errors["mean value"]


def test_a_painted_cone_is_in_its_cage() -> None:
    """Nearly all pixels of the cone show points that the cage holds."""
    (case,) = chosen((), ("move_painted_cone",))
    assert case.moved is not None and case.kind == "move"
    still, everywhere = procedural_scene(case.scene), Cage.box((0, 0, 0), 10.0)
    camera = Camera.look_at((3.2, 1.6, 1.3), (0, 0, 0), width=96, height=96, fov_x=0.7)
    held, whole = (
        canonical_inside(cage, still, case.moved(still), camera)[0].sum()
        for cage in (case.edits[0].inner, everywhere)
    )
    assert whole > 60 and held >= 0.95 * whole


def test_they_are_measured_where_they_are_named() -> None:
    assert chosen() == CASES and not set(CASES) & set(FREE_FORM_CASES)
    assert [case.name for case in chosen((), ("bend_arm", "move_cone"))] == ["move_cone", "bend_arm"]
    with pytest.raises(CagefieldError, match="bend_arm"):
        chosen(("digger",), ("twist_stem",))


@pytest.mark.nightly
def test_table_has_columns_of_the_inside_only_with_closed_forms() -> None:
    from benchmarks.common.figures import Figures

    figures = Figures(30.0, 29.0, 0.9, 0.9, 30.0, 28.0, 10.0, 0.1)
    inside = Inside(31.5, 30.25, 0.05, 0.002, 0.003)
    scores = [
        Score(FREE_FORM_CASES[0], "exact map", 1, 16, figures, 1.0, inside=inside),
        Score(CASES[0], "exact map", 1, 16, figures, 1.0),
    ]
    text = table(scores, TINY).markdown()
    assert "| 5.00% | 31.50 | 30.25 | 1.25 | 2.00 | 3.00 |" in text
    assert len({row.count("|") for row in text.splitlines() if row.startswith("|")}) == 1
    assert "inside lost" not in table(scores[1:], TINY).markdown()
