"""Splats that an edit bends or cuts, split: pictures stay, moments stay, and nothing hangs over."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from cagefield import Cage, Camera, Edit, EditStack
from cagefield.fields.splat_field import SplatField
from cagefield.geometry import MeshCage
from cagefield.geometry.quaternions import quaternions_from_matrices, rotation_matrices
from cagefield.images.metrics import psnr
from cagefield.rendering.splats import split_children, splitting
from cagefield.rendering.splats.bake_splats import baked_splats
from cagefield.rendering.splats.gaussian_profile import OPAQUE_PARTS, OVERHANG, PARTS, part_below
from cagefield.rendering.splats.raster_splats import deformed_splats
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.rendering.splats.splitting import split_for_edits
from splat_scenes import assert_same_splats, random_splats
from tiers import nightly_except

CAMERA = Camera.look_at((0.3, -4.5, 0.6), (0.1, 0, 0.1), width=100, height=120, fov_x=0.6)
BENDS = {
    "stretch": Edit.continuous(
        Cage.box((0, 0, 0.3), (0.6, 0.6, 0.5)), Cage.box((0, 0, 0.3), (2, 2, 3.6))
    ).scale((1, 1, 4)),
    "twist": Edit.continuous(
        Cage.box((0, 0, 0.9), (0.8, 0.8, 0.4)), Cage.box((0, 0, 0.2), (1.8, 1.8, 2.2))
    ).rotate((0, 0, np.radians(150))),
    "bend": Edit.continuous(Cage.box((0, 0, 0.8), 0.5), Cage.box((0.3, 0, 0.2), (2.4, 2.4, 2.6)))
    .translate((0.55, 0, -0.1))
    .rotate((0, np.radians(60), 0)),
    "lattice": Edit.continuous(
        Cage.box((0.15, 0, 0), (0.6, 0.6, 1.4)).subdivided((1, 1, 4)), Cage.box((0.3, 0, 0), (2.6, 2.2, 3.4))
    ).bend("z", np.radians(70)),
    "points": Edit.points([[0.15, 0, 0.1]], radius=0.9).move_point(0, (0.45, 0, 0)),
    "mesh": Edit.continuous(
        MeshCage.of_box(Cage.box((0, 0, 0.9), (0.8, 0.8, 0.4))), Cage.box((0, 0, 0.2), (1.8, 1.8, 2.2))
    ).rotate((0, 0, np.radians(120))),
}
NAMES = nightly_except(BENDS, "stretch", "twist", "bend")
"""Edits of hexahedra, of a lattice, of a point and of a mesh."""

INNER = Cage.box((0, 0, 0), 0.6)


def rod(count: int = 7, opacity: float = 0.9) -> SplatField:
    """Long splats one after the other along z, a thin part beside the axis."""
    z = np.linspace(-0.8, 0.8, count)
    color = np.stack([1.0 + np.sin(6.0 * z), np.ones(count), 1.0 - np.sin(6.0 * z)], axis=1)
    return SplatField(
        np.stack([0.0 * z + 0.15, 0.0 * z, z], axis=1),
        np.log(np.tile([0.04, 0.04, 0.9 / (count - 1)], (count, 1))),
        np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
        np.full(count, opacity),
        color[:, None],
        bounds=np.array([[-2.0] * 3, [2.0] * 3]),
    )


def covariances(field: SplatField) -> np.ndarray:
    R = rotation_matrices(field.quaternions.astype(np.float64))
    return R @ (np.exp(2.0 * field.log_scales.astype(np.float64))[:, :, None] * R.transpose(0, 2, 1))


@pytest.mark.parametrize("name", NAMES)
def test_what_is_split_looks_the_same_at_rest(name: str) -> None:
    field = rod()
    split = split_for_edits(field, EditStack([BENDS[name]])).field
    assert len(split) > 2 * len(field)
    pictures = [SplatRenderer(each).render(CAMERA, background="black").rgb for each in (field, split)]
    # What two rows across each other let through is not exact: 1 % of what is opaque
    assert psnr(*pictures) > 40.0


@pytest.mark.parametrize("name", NAMES)
def test_split_splats_follow_the_edit_more_closely(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    field, edits = rod(), EditStack([BENDS[name]])

    def shown(parts: SplatField) -> np.ndarray:
        renderer = SplatRenderer(parts)
        renderer.splats = deformed_splats(parts, edits)
        return renderer.render(CAMERA, background="black").rgb

    whole, split = shown(field), shown(split_for_edits(field, edits).field)
    monkeypatch.setattr(split_children, "BEND", 0.04)
    monkeypatch.setattr(splitting, "ROUNDS", 6)
    fine = shown(split_for_edits(dataclasses.replace(field), edits).field)
    assert psnr(split, fine) > psnr(whole, fine) + 1.0


@pytest.mark.parametrize(("r", "error"), [(0.5, 0.15), (0.7, 0.05), (0.85, 0.01)])
def test_a_row_of_children_has_the_width_of_the_splat(r: float, error: float) -> None:
    # Faint ones: optical depths add up
    row = split_children._row(np.zeros(1, np.int64), np.eye(3)[:1], np.array([r]), np.array([1e-4]))
    mass = row.opacity * row.r
    assert np.sum(mass) == pytest.approx(1e-4, rel=error)
    variance = np.sum(mass * (row.r**2 + row.x**2)) / np.sum(mass)
    assert variance == pytest.approx(1.0, rel=2.0 * error)


@pytest.mark.parametrize("opacity", [0.2, 0.9, 0.99])
@pytest.mark.parametrize("r", [0.5, 0.7, 0.9])
def test_a_row_is_as_thick_as_the_splat(r: float, opacity: float) -> None:
    row = split_children._row(np.zeros(1, np.int64), np.eye(3)[:1], np.array([r]), np.array([opacity]))
    u = np.linspace(-6.0, 6.0, 2001)[:, None]
    for x in (0.0, row.x[len(row.x) // 2 + 1]):
        each = row.opacity * np.exp(-0.5 * ((x - row.x) / r) ** 2 - 0.5 * (u / row.across) ** 2)
        whole = opacity * np.exp(-0.5 * (x * x + u * u))
        depth, wanted = -np.log1p(-each).sum(axis=1), -np.log1p(-whole[:, 0])
        # Exact but for how much narrower one child is than the next
        assert np.trapezoid(depth, u[:, 0]) == pytest.approx(np.trapezoid(wanted, u[:, 0]), rel=0.03)
        assert np.trapezoid(depth * u[:, 0] ** 2) == pytest.approx(
            np.trapezoid(wanted * u[:, 0] ** 2), rel=0.2
        )


def test_what_is_twisted_about_its_middle_is_split() -> None:
    # Its axes stay straight: only the mixed term of its width and its height says that it bends.
    one = rod().take(np.array([3]))
    flat = dataclasses.replace(
        one,
        means=np.array([[0.0, 0.0, 0.2]], np.float32),
        log_scales=np.log(np.array([[0.15, 0.01, 0.15]], np.float32)),
    )
    assert len(split_for_edits(flat, EditStack([BENDS["twist"]])).field) > 3


def test_small_splats_bend_further_than_large_ones_before_they_are_split() -> None:
    bend = BENDS["bend"]
    size = float(np.linalg.norm(np.ptp(np.concatenate([bend.boxes, bend.inner.aabb[None]]), axis=(0, 1))))

    def children(share: float, stronger: float) -> int:
        A = np.diag([1.0, 0.1, 0.1])[None] * share * size
        change = np.array([[stronger * split_children.BEND, 0.0, 0.0]])
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(split_children, "_bend", lambda *_: change)
            rows = np.array([0])
            return len(split_children.bent_children(bend, rod(), rows, np.zeros((1, 3)), A, size, None).x)

    assert children(split_children.SMALL_SHARE, 1.1) > 0
    assert children(split_children.SMALL_SHARE / 2, 1.9) == 0
    assert children(split_children.SMALL_SHARE / 2, 2.2) > 0


def test_children_that_are_not_drawn_are_not_made() -> None:
    split = split_for_edits(rod(), EditStack([BENDS["bend"]])).field
    assert split.opacities.min() > 1.0 / 255.0


@pytest.mark.parametrize("offset", [-0.2, 0.0, 0.3])
def test_a_cut_is_two_parts_of_the_splat_that_add_up_to_it(offset: float) -> None:
    # A faint splat through the middle of the face +x, far from all others.
    q = quaternions_from_matrices(np.linalg.qr(np.random.default_rng(0).normal(size=(1, 3, 3)))[0])
    field = SplatField(
        [[0.3 + 0.03 * offset, 0, 0]], np.log([[0.03, 0.02, 0.01]]), q, [0.02], np.zeros((1, 1, 3))
    )
    parts = split_for_edits(field, EditStack([Edit.move(INNER).translate((0, 2, 0))])).field
    assert len(parts) == 2 and sorted(parts.means[:, 0] > 0.3) == [False, True]
    mass = (parts.opacities * np.exp(parts.log_scales.sum(axis=1))).astype(np.float64)
    assert mass.sum() == pytest.approx(0.02 * np.exp(field.log_scales.sum()), rel=0.2)
    mass /= mass.sum()
    mean = mass @ parts.means
    C = covariances(field)[0]
    assert np.linalg.norm(mean - field.means[0]) < 0.1 * np.sqrt(np.trace(C))
    spread = parts.means - mean
    got = np.einsum("n,nij->ij", mass, covariances(parts)) + np.einsum("n,ni,nj->ij", mass, spread, spread)
    assert np.linalg.norm(got - C) < 0.15 * np.linalg.norm(C)


@pytest.mark.parametrize("t", [-1.5, -0.6, 0.0, 0.7, 1.8])
@pytest.mark.parametrize(("parts", "beyond"), [(PARTS, OVERHANG[0]), (OPAQUE_PARTS, OVERHANG[1])])
def test_a_part_is_the_nearest_splat_to_its_side(parts: np.ndarray, beyond: float, t: float) -> None:
    u = np.linspace(-8.0, 8.0, 16001)
    side = np.where(u < t, np.exp(-0.5 * u * u), 0.0)
    weight = np.where(u < t, 1.0, beyond)

    def off(x: float, r: float, amplitude: float) -> float:
        return float((weight * (amplitude * np.exp(-0.5 * ((u - x) / r) ** 2) - side) ** 2).sum())

    x, r, amplitude = (float(np.interp(t, parts[0], column)) for column in parts[1:])
    best = off(x, r, amplitude)
    assert best < 0.5 * (weight * side**2).sum()
    for step in (-0.05, 0.05):
        assert best < off(x + step * r, r, amplitude)
        assert best < off(x, r * (1.0 + step), amplitude)
        assert best < off(x, r, amplitude * (1.0 + step))


def test_parts_of_splats_are_those_of_faint_and_of_opaque_ones() -> None:
    opacity, t = np.array([0.3, 1.0, 0.993]), np.array([-1.0, -1.0, -1.0])
    x, r, alpha, across = part_below(opacity, t)
    (faint,), (opaque,) = (parts[1:, parts[0] == -1.0].T for parts in (PARTS, OPAQUE_PARTS))
    np.testing.assert_allclose((x[0], r[0], alpha[0]), faint * [1.0, 1.0, 0.3], rtol=1e-6)
    np.testing.assert_allclose((x[1], r[1], alpha[1]), opaque, rtol=1e-6)
    assert r[0] < r[2] < r[1] and (across == 1.0).all()
    # The opacity of a part is one that has a profile.
    assert part_below(np.ones(1), np.ones(1))[2] < 1.0


def test_splats_of_no_opacity_are_not_cut() -> None:
    field = SplatField(
        [[0.3, 0.0, 0.0]] * 2, np.full((2, 3), -3.0), [[1, 0, 0, 0]] * 2, [0.0, 1.0], np.zeros((2, 1, 3))
    )
    split = split_for_edits(field, EditStack([Edit.delete(INNER)])).field
    assert np.count_nonzero(split.opacities == 0.0) == 1
    assert len(split) > 2 and np.isfinite(split.means).all() and np.isfinite(split.log_scales).all()


@pytest.mark.parametrize("delete", [False, True])
def test_nothing_hangs_over_a_cut(delete: bool) -> None:
    chance = np.random.default_rng(0)
    count = 3000
    field = SplatField(
        chance.uniform(-0.6, 0.6, (count, 3)),
        np.log(chance.uniform(0.02, 0.06, (count, 3))),
        chance.normal(size=(count, 4)),
        chance.uniform(0.2, 0.9, count),
        np.zeros((count, 1, 3)),
    )
    edit = Edit.delete(INNER) if delete else Edit.move(INNER).translate((3.0, 0, 0))

    def over(parts: SplatField) -> float:
        """The share of the mass that lies where the cage was, of splats that stay."""
        shown = baked_splats(parts, EditStack([edit]), split=False)
        shown = shown.take(shown.means[:, 0] < 1.5)
        chosen = chance.integers(0, len(shown), 100_000)
        z = chance.normal(size=(len(chosen), 3)) * np.exp(shown.log_scales[chosen])
        points = shown.means[chosen] + np.einsum(
            "nij,nj->ni", rotation_matrices(shown.quaternions)[chosen], z
        )
        weight = shown.opacities[chosen] * np.exp(shown.log_scales[chosen].sum(axis=1))
        return float(weight[INNER.contains(points)].sum() / weight.sum())

    whole, split = over(field), over(split_for_edits(field, EditStack([edit])).field)
    assert whole > 0.01 and split < 0.3 * whole


def test_edits_that_bend_nothing_split_nothing() -> None:
    field = random_splats(200)
    far = Edit.continuous(Cage.box((9, 0, 0), 0.5), Cage.box((9, 0, 0), 1.5)).translate((0.1, 0, 0))
    assert split_for_edits(field, EditStack([far])).field is field
    assert split_for_edits(field, EditStack()).field is field
    moved = Edit.move(Cage.box((0, 0, 0), 50.0)).translate((100.0, 0, 0))
    assert split_for_edits(field, EditStack([moved])).field is field


def test_there_are_never_many_times_as_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(splitting, "MORE", 10)
    field = rod(15)
    assert len(field) < len(split_for_edits(field, EditStack([BENDS["bend"]])).field) <= 3 * len(field) + 20


@pytest.mark.parametrize("name", ["stretch", "twist", "bend", "move"])
def test_baked_splats_look_as_the_edited_ones(name: str) -> None:
    field = dataclasses.replace(random_splats(150, degree=2), bounds=np.array([[-2.0] * 3, [2.0] * 3]))
    moves = {**BENDS, "move": Edit.copy(INNER).rotate((0.5, 1, 2))}
    edits = EditStack([moves[name]])
    edited = SplatRenderer(field, edits).render(CAMERA).rgb
    baked = baked_splats(field, edits)
    # Axes and scales of a covariance in float32, and the slack that keeps flat ones positive
    assert psnr(SplatRenderer(baked).render(CAMERA).rgb, edited) > 60.0
    assert baked_splats(field, EditStack()) is field


def test_baking_leaves_what_no_edit_reaches_as_it_is() -> None:
    field = random_splats(300, degree=1)
    edits = EditStack([Edit.move(Cage.box((0.7, 0.7, 0.7), 0.5)).translate((3, 0, 0))])
    baked = baked_splats(field, edits, split=False)
    away = np.flatnonzero(~Cage.box((0.7, 0.7, 0.7), 0.5).contains(field.means))
    assert len(away) < 300
    assert_same_splats(baked.take(np.flatnonzero(baked.means[:, 0] < 1.5)), field.take(away))
