from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from cagefield.edits import Trilinear
from cagefield.edits.edit import Edit
from cagefield.edits.operations import euler_degrees
from cagefield.geometry import hexahedron
from cagefield.geometry.cage import FACES, Cage
from cagefield.typing import Array
from cagefield.warps.hexahedron_map import HexahedronMap
from cagefield.warps.trilinear_shell import SIDES, TrilinearShell
from random_cages import edits, examples, seeds, trilinear

INNER, OUTER = Cage.box((0, 0, 0), 0.6), Cage.box((0, 0, 0), 1.6)


def shell_of(edit: Edit) -> TrilinearShell:
    assert edit.outer is not None
    return TrilinearShell(edit.inner, edit.deformed, edit.outer)


def sampled(shell: TrilinearShell, seed: int, n: int = 40) -> tuple[Array, Array, Array, Array]:
    """Deformed and canonical points [6n,3] of the same u [6n,3], and the sides [6n], by definition."""
    rng = np.random.default_rng(seed)
    u = rng.random((6 * n, 3))
    side = np.repeat(np.arange(6), n)
    deformed = np.stack([trilinear(shell.deformed_hexahedra[s], v) for s, v in zip(side, u, strict=True)])
    canonical = np.stack([trilinear(shell.canonical_hexahedra[s], v) for s, v in zip(side, u, strict=True)])
    return deformed, canonical, u, side


def conditioning(shell: TrilinearShell, u: Array, side: Array) -> Array:
    """|J_c| |J_d^-1| [N], by which an error of the deformed point is amplified."""
    out = np.empty(len(u))
    for s in range(6):
        rows = side == s
        J_d = hexahedron.jacobian(shell.deformed_hexahedra[s], u[rows])
        J_c = hexahedron.jacobian(shell.canonical_hexahedra[s], u[rows])
        out[rows] = np.linalg.norm(J_c, axis=(1, 2)) * np.linalg.norm(np.linalg.inv(J_d), axis=(1, 2))
    return out


def test_hexahedra_join_faces_of_the_same_side() -> None:
    shell = TrilinearShell(INNER, INNER.translate((0.1, 0, 0)), OUTER)
    for n, side in enumerate(SIDES):
        outer_ids = [k for k in range(8) if k in FACES[side]]
        np.testing.assert_array_equal(shell.deformed_hexahedra[n][outer_ids], OUTER.corners[outer_ids])
        inner_ids = [k for k in range(8) if k not in FACES[side]]
        inner_face = shell.deformed.corners[list(FACES[side])]
        np.testing.assert_array_equal(shell.deformed_hexahedra[n][inner_ids], inner_face)
    for corners in shell.deformed_hexahedra:
        Cage(corners)  # valid: right-handed and not inside out


@examples(15)
@given(edits(), seeds)
def test_both_maps_against_the_definition(edit: Edit, seed: int) -> None:
    shell = shell_of(edit)
    deformed, canonical, u, side = sampled(shell, seed)
    amplified = conditioning(shell, u, side)
    q, J = shell.to_canonical(deformed)
    # The definition evaluates the same polynomial in another order: rounding, 1e-15, times the conditioning.
    assert (np.abs(q - canonical).max(axis=1) < 1e-13 * (10.0 + amplified)).all()
    p, J_back = shell.to_deformed(q)
    assert (np.abs(p - deformed).max(axis=1) < 1e-12 * (10.0 + amplified**2)).all()
    assert (np.linalg.det(J) > 0.0).all()
    np.testing.assert_allclose(J_back @ J, np.tile(np.eye(3), (len(J), 1, 1)), atol=1e-9 * amplified.max())


@examples(10)
@given(edits(fold_free=0.99), seeds)
def test_inverse_against_scipy(edit: Edit, seed: int) -> None:
    shell = shell_of(edit)
    deformed, _, u, side = sampled(shell, seed, n=3)
    q, _ = shell.to_canonical(deformed)
    amplified = conditioning(shell, u, side)
    for k in range(len(u)):
        corners = shell.deformed_hexahedra[side[k]]
        found = root(lambda v, c=corners, k=k: trilinear(c, v) - deformed[k], u[k] + 1e-3, tol=1e-14).x
        reference = trilinear(shell.canonical_hexahedra[side[k]], found)
        assert np.abs(q[k] - reference).max() < 1e-12 * (10.0 + amplified[k])


@examples(15)
@given(edits(), seeds)
def test_continuous_across_every_face(edit: Edit, seed: int) -> None:
    shell = shell_of(edit)
    t = np.random.default_rng(seed).random((15, 2))
    u = np.concatenate([np.insert(t, across, end, axis=1) for across in range(3) for end in (0.0, 1.0)])
    side, u = np.repeat(np.arange(6), len(u)), np.tile(u, (6, 1))
    p, expected = np.empty_like(u), np.empty_like(u)
    for n in range(6):
        p[side == n] = hexahedron.points(shell.deformed_hexahedra[n], u[side == n])
        expected[side == n] = hexahedron.points(shell.canonical_hexahedra[n], u[side == n])
    tolerance = 1e-11 * (1.0 + conditioning(shell, u, side))
    # On the face itself, whichever of its two hexahedra is chosen, and a hair on either side (where the
    # hexahedron is the neighbor, whose conditioning may be worse).
    q, _ = shell.to_canonical(np.concatenate([p, p + 1e-12, p - 1e-12]))
    errors = np.abs(q.reshape(3, -1, 3) - expected).max(axis=2)
    assert (errors[0] < tolerance).all() and (errors[1:] < tolerance.max()).all()
    for n, name in enumerate(SIDES):
        axis, outwards = "xyz".index(name[1]), float(name[0] == "+")
        on_inner = (side == n) & (u[:, axis] == 1.0 - outwards)
        on_outer = (side == n) & (u[:, axis] == outwards)
        _, phi, _ = HexahedronMap(edit.inner, edit.deformed)(p[on_inner])
        assert (np.abs(phi - expected[on_inner]).max(axis=1) < tolerance[on_inner]).all()
        assert (np.abs(p[on_outer] - expected[on_outer]).max(axis=1) < tolerance[on_outer]).all()


@examples(15)
@given(edits(), seeds)
def test_jacobian_against_finite_differences(edit: Edit, seed: int) -> None:
    shell = shell_of(edit)
    deformed, _, u, side = sampled(shell, seed)
    amplified = conditioning(shell, u, side)
    h = 1e-5
    # Only points whose neighbors at distance h are in the same hexahedron: J jumps from one to the next.
    deep = (np.minimum(u, 1.0 - u).min(axis=1) > 0.05) & (amplified < 30.0)
    assume(deep.any())
    p = deformed[deep]
    _, J = shell.to_canonical(p)
    shifted = p[:, None] + h * np.concatenate([np.eye(3), -np.eye(3)])
    q = shell.to_canonical(shifted.reshape(-1, 3))[0].reshape(-1, 6, 3)
    slope = np.transpose(q[:, :3] - q[:, 3:], (0, 2, 1)) / (2.0 * h)
    # Truncation h^2 x third derivative (at most conditioning^5 here), rounding 1e-15 x conditioning / h.
    assert (np.abs(J - slope).max(axis=(1, 2)) < 1e-8 + 1e-10 * amplified[deep] ** 5).all()


@examples(15)
@given(edits(fold_free=1.0))
def test_least_ratio_against_a_dense_sample(edit: Edit) -> None:
    shell = shell_of(edit)
    g = np.linspace(0.0, 1.0, 13)
    u = np.stack(np.meshgrid(g, g, g), axis=-1).reshape(-1, 3)
    ratios = [
        np.linalg.det(hexahedron.jacobian(d, u)) / np.linalg.det(hexahedron.jacobian(c, u))
        for c, d in zip(shell.canonical_hexahedra, shell.deformed_hexahedra, strict=True)
    ]
    # The net's spacing of 1/12 misses a minimum between its nodes by about (1/24)^2 of the variation.
    sampled_least, variation = float(np.min(ratios)), float(np.ptp(ratios))
    least = shell.least_ratio()
    assert sampled_least - 0.01 * variation - 2e-3 < least < sampled_least + 2e-3
    assert shell.problem() is None


def test_rotation_of_concentric_boxes_folds_where_a_dense_sample_says() -> None:
    """Half-sizes .3 in .8 fold from about 30 degrees of rotation about one axis (design.md, section 3)."""
    u = np.random.default_rng(0).random((4000, 3))
    u[:2000] = np.round(4.0 * u[:2000]) / 4.0

    def least(degrees: float) -> float:
        shell = TrilinearShell(INNER, INNER.rotate((0, 0, np.radians(degrees))), OUTER)
        return float(min(np.linalg.det(hexahedron.jacobian(h, u)).min() for h in shell.deformed_hexahedra))

    assert least(29.0) > 0.0 > least(30.5)
    edit = Edit.continuous(INNER, OUTER, shell=Trilinear()).rotate((0, 0, np.radians(60.0)))
    safe = 60.0 * edit.safe_fraction()
    assert 29.0 < safe < 30.5 and least(safe) > 0.0


def test_axes_that_are_numbered_differently_give_the_same_map() -> None:
    """An outer cage set up turned by quarter turns has the same faces, numbered in another order."""
    p = np.random.default_rng(0).uniform(-0.8, 0.8, (500, 3))
    moved = INNER.rotate((0, 0, 0.2)).translate((0.1, 0.2, 0))
    p = p[~moved.contains(p)]
    expected, _ = TrilinearShell(INNER, moved, OUTER).to_canonical(p)
    for turn in Rotation.create_group("O"):
        outer = Cage.box((0, 0, 0), 1.6, np.radians(euler_degrees(turn)))
        got, _ = TrilinearShell(INNER, moved, outer).to_canonical(p)
        np.testing.assert_allclose(got, expected, atol=1e-12)


def test_problems_are_named() -> None:
    assert TrilinearShell(INNER, INNER, OUTER).problem() is None
    flush = TrilinearShell(INNER.translate((0, 0, -0.5)), INNER, OUTER).problem()
    assert flush is not None and "before any operation, at side -z: leave a gap" in flush
    folded = TrilinearShell(INNER, INNER.rotate((0, 0, 1.0)), OUTER)
    assert folded.problem() is not None and "folds at side" in str(folded.problem())
    assert folded.least_ratio() < 0.0


def test_points_outside_a_folded_shell_still_get_a_value() -> None:
    folded = TrilinearShell(INNER, INNER.rotate((0, 0, 1.5)), OUTER)
    p = np.random.default_rng(0).uniform(-0.8, 0.8, (500, 3))
    q, J = folded.to_canonical(p)
    assert (np.abs(q) <= 0.8 + 1e-9).all() and np.isfinite(J).all()


def test_translation_uses_up_the_gap() -> None:
    """A box of half-size .3 moved by t in +x within .8: the +x hexahedron's depth is .5 - t."""
    for t in (0.1, 0.3, 0.45):
        shell = TrilinearShell(INNER, INNER.translate((t, 0, 0)), OUTER)
        # On the axis the +x side is compressed linearly from .5 to .5 - t.
        q, J = shell.to_canonical(np.array([[0.3 + t + 0.25 * (0.5 - t), 0.0, 0.0]]))
        np.testing.assert_allclose(q, [[0.3 + 0.25 * 0.5, 0.0, 0.0]], atol=1e-14)
        assert J[0, 0, 0] == pytest.approx(0.5 / (0.5 - t), abs=1e-12)
