"""The kernel's maps in float32 against the float64 reference."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

from cagefield.compute import devices
from cagefield.edits import Continuous, Edit, EditStack, Trilinear
from cagefield.geometry.cage import Cage
from random_cages import edits, examples, seeds, unit_vectors
from tiers import nightly_except

INNER, OUTER = Cage.box((0, 0, 0), 0.6), Cage.box((0, 0, 0), 1.6)
BENT = Cage.box((0.1, 0, 0), 0.6, (0.05, 0.1, 0.1)).move_corner(2, (-0.1, 0.1, -0.05))
EPS = float(np.finfo(np.float32).eps)


@pytest.fixture(scope="module", autouse=True)
def device() -> None:
    devices.start()


def samples(n: int = 20_000, reach: float = 1.1, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    p = rng.uniform(-reach, reach, (n, 3)).astype(np.float32)
    return p, unit_vectors(rng, n).astype(np.float32)


def off_faces(stack: EditStack, p: np.ndarray, margin: float = 1e-4) -> np.ndarray:
    """Samples that all their neighbors at distance `margin` map with the same Jacobian, up to curvature.

    The others are near a face, where J jumps, and a float32 may take either side.
    """
    here = stack.to_canonical(p)
    steady = np.ones(len(p), dtype=bool)
    for shift in margin * np.concatenate([np.eye(3), -np.eye(3)]):
        there = stack.to_canonical(p + shift)
        change = np.abs(there.jacobian - here.jacobian).max(axis=(1, 2))
        steady &= (change < 0.05 * np.abs(here.jacobian).max(axis=(1, 2))) & (there.emptied == here.emptied)
    return steady


def compare(stack: EditStack, p: np.ndarray, d: np.ndarray) -> None:
    from cagefield.edits.device_stack import DeviceStack

    expected = stack.to_canonical(p, d)
    points, viewdirs, stretch, places = DeviceStack.from_stack(stack).to_canonical(p, d)
    assert expected.viewdirs is not None and expected.stretch is not None
    # A float32 coordinate is off by EPS; Newton's method and three products of matrices carry some tens of
    # them, and the map amplifies them by |J|. Second derivatives are |J|^2 at most at these cages' scale.
    gain = np.linalg.norm(expected.jacobian, axis=(1, 2)) * np.linalg.norm(
        np.linalg.inv(expected.jacobian), axis=(1, 2)
    )
    largest = 1.0 + np.linalg.norm(expected.jacobian, axis=(1, 2))
    kept = ~expected.emptied & (places >= 0)
    error = np.abs(points - expected.points).max(axis=1) / largest**2
    steady = off_faces(stack, p)
    continuous = all(isinstance(edit, Continuous) for edit in stack.active)
    where = kept if continuous else kept & steady
    assert error[where].max(initial=0.0) < 60.0 * EPS
    assert np.array_equal(places[steady] < 0, expected.emptied[steady])
    turned = np.abs(viewdirs - expected.viewdirs).max(axis=1) / (gain * largest)
    assert turned[kept & steady].max(initial=0.0) < 200.0 * EPS
    stretched = np.abs(stretch / expected.stretch - 1.0) / (gain * largest)
    assert stretched[kept & steady].max(initial=0.0) < 200.0 * EPS


STACKS = {
    "affine": [
        Edit.continuous(INNER, OUTER, shell=Trilinear()).rotate((0, 0.1, 0.3)).translate((0.1, 0, 0.1))
    ],
    "deformed": [
        Edit.continuous(INNER, OUTER, shell=Trilinear())
        .rotate((0.2, 0.1, 0.3))
        .move_corner(7, (0.1, 0.1, 0.05))
    ],
    "bent cages": [
        Edit.continuous(BENT, OUTER.move_corner(3, (0.3, 0.2, -0.1)), shell=Trilinear())
        .scale((1.1, 0.9, 1.05))
        .rotate((0, 0.1, 0))
    ],
    "move": [Edit.move(INNER).translate((0.4, 0, 0)).rotate((0, 0, 0.5))],
    "move bent": [Edit.move(BENT).translate((0.4, 0, 0)).move_face("+x", (0.1, 0.1, 0))],
    "copy": [Edit.copy(INNER).translate((0.2, 0, 0)).shear(xy=0.5)],
    "delete": [Edit.delete(BENT)],
    "points": [
        Edit.points([[0, 0, 0], [0.3, 0.1, 0]], radius=0.5, lattice=33)
        .translate((0.2, 0.1, 0))
        .rotate((0, 0, 0.5))
    ],
    "points in a bent outer cage": [
        Edit.points([[0, 0, 0]], radius=0.5, outer=OUTER.move_corner(3, (-0.2, -0.1, 0.1)), lattice=20)
        .translate((0.1, 0, 0.1))
        .rotate((0, 0, 0.5))
    ],
    "nothing": [Edit.continuous(INNER, OUTER, shell=Trilinear())],
    "empty": [],
}
STACKS["chain"] = [
    *STACKS["deformed"],
    *STACKS["points"],
    *STACKS["move bent"],
    *STACKS["affine"],
    *STACKS["delete"],
]


@pytest.mark.parametrize("name", nightly_except(STACKS, "affine", "chain", "delete"))
def test_stacks_against_the_reference(name: str) -> None:
    compare(EditStack(STACKS[name]), *samples(4000))


@examples(15)
@given(edits(fold_free=0.9), seeds)
def test_random_edits_against_the_reference(edit: Edit, seed: int) -> None:
    rng = np.random.default_rng(seed)
    low, high = edit.bounds
    p = (low + rng.uniform(-0.1, 1.1, (500, 3)) * (high - low)).astype(np.float32)
    compare(EditStack([edit]), p, unit_vectors(rng, 500).astype(np.float32))


@pytest.mark.parametrize("name", ["affine", "deformed", "bent cages"])
def test_lattice_path_against_the_reference(name: str) -> None:
    stack = EditStack([STACKS[name][0].replace(lattice=17)])
    compare(stack, *samples(4000))


def test_lattices_of_a_stack_lie_one_after_the_other() -> None:
    from cagefield.edits.device_stack import DeviceStack

    edits_ = [
        STACKS["affine"][0].replace(lattice=9),
        STACKS["move"][0],
        STACKS["deformed"][0].replace(lattice=17),
    ]
    stack = EditStack(edits_)
    assert len(DeviceStack.from_stack(stack).lattice) == 9**3 + 17**3
    compare(stack, *samples(4000))


def test_what_is_outside_all_boxes_is_returned_bit_for_bit() -> None:
    from cagefield.edits.device_stack import DeviceStack

    stack = EditStack(STACKS["chain"])
    packed = DeviceStack.from_stack(stack)
    p, d = samples(20_000, reach=2.0)
    outside = np.ones(len(p), dtype=bool)
    for low, high in packed.boxes:
        outside &= ~((p >= low) & (p <= high)).all(axis=1)
    points, viewdirs, stretch, places = packed.to_canonical(p, d)
    assert outside.any() and not places[outside].any()
    assert np.array_equal(points[outside], p[outside]) and np.array_equal(viewdirs[outside], d[outside])
    assert (stretch[outside] == 1.0).all()
    # Inside a continuous edit's box but outside its (turned) outer cage, too.
    turned = Edit.continuous(INNER, Cage.box((0, 0, 0), 1.6, (0.1, 0.2, 0.1)), shell=Trilinear()).rotate(
        (0.1, 0, 0)
    )
    points, *_ = DeviceStack.from_stack(EditStack([turned])).to_canonical(p, d)
    free = ~turned.outer.grown(1e-5).contains(p)  # type: ignore[union-attr]
    assert np.array_equal(points[free], p[free])


def test_boxes() -> None:
    from cagefield.edits.device_stack import DeviceStack

    move = STACKS["move"][0]
    packed = DeviceStack.from_stack(
        EditStack([move, *STACKS["delete"], STACKS["affine"][0].replace(enabled=False)])
    )
    assert packed.n_edits == 2 and packed.boxes.shape == (3, 2, 3)
    expected = np.stack([move.deformed.aabb, INNER.aabb, BENT.aabb])
    # Widened, and by little.
    assert (packed.boxes[:, 0] < expected[:, 0]).all() and (packed.boxes[:, 1] > expected[:, 1]).all()
    np.testing.assert_allclose(packed.boxes, expected, atol=1e-4)
    empty = DeviceStack.from_stack(EditStack())
    assert empty.n_edits == 0 and empty.boxes.shape == (0, 2, 3)


@pytest.mark.parametrize("turn", [1.0, np.pi])
def test_folded_shells_that_are_allowed_give_finite_values(turn: float) -> None:
    from cagefield.edits.device_stack import DeviceStack

    folded = EditStack(
        [Edit.continuous(INNER, OUTER, shell=Trilinear(), allow_folding=True).rotate((0, 0, turn))]
    )
    p, d = samples(5000)
    points, viewdirs, stretch, _ = DeviceStack.from_stack(folded).to_canonical(p, d)
    assert np.isfinite(points).all() and np.isfinite(viewdirs).all() and np.isfinite(stretch).all()
    # Whatever sheet is shown, it is one of the outer cage's.
    within = OUTER.contains(p)
    assert (np.abs(points[within]) <= 0.8 + 1e-5).all() and np.array_equal(points[~within], p[~within])


def test_lattices_are_kept_with_their_edit(monkeypatch: pytest.MonkeyPatch) -> None:
    from cagefield.edits.device import edit_lattice
    from cagefield.edits.device_stack import DeviceStack

    edit = STACKS["affine"][0].replace(lattice=8)
    DeviceStack.from_stack(EditStack([edit]))
    sampled: list[object] = []
    monkeypatch.setattr(edit_lattice, "sample_lattice", lambda *arguments: sampled.append(arguments))
    DeviceStack.from_stack(EditStack([edit, STACKS["move"][0]]))
    assert not sampled
    DeviceStack.from_stack(EditStack([edit.translate((0.01, 0, 0))]))
    assert len(sampled) == 1


def test_kernels_show_control_points_without_a_lattice_by_one_of_64() -> None:
    from cagefield.edits.device_stack import DeviceStack

    (edit,) = STACKS["points"]
    exact, fine = edit.without_lattice(), edit.replace(lattice=64)
    assert exact.kernel_lattice == 64 and exact.lattice is None
    p, d = samples(2000)
    one, other = (DeviceStack.from_stack(EditStack([edit])).to_canonical(p, d) for edit in (exact, fine))
    for values, expected in zip(one, other, strict=True):
        np.testing.assert_array_equal(values, expected)
    # It is off by what is measured, and the reference of the edit without one by nothing.
    worst, mean = exact.lattice_error()
    points = DeviceStack.from_stack(EditStack([exact])).to_canonical(p, d)[0]
    error = np.linalg.norm(points - EditStack([exact]).to_canonical(p).points, axis=1)
    assert 0.0 < error.max() < 1.5 * worst + 1e-5 and mean < 1e-3
