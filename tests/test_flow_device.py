"""The flow shell's kernels in float32 against the float64 reference."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given

from cagefield.compute import devices
from cagefield.edits import Edit, EditStack, Trilinear
from cagefield.errors import DeviceError, EditError
from cagefield.typing import Array
from cagefield.warps.continuous import ContinuousWarp
from flow_edits import EDITS, INNER, OUTER, flow_edits, shell_of, shell_points
from random_cages import examples, unit_vectors
from tiers import nightly_after_first, nightly_except

EPS = float(np.finfo(np.float32).eps)


@pytest.fixture(scope="module", autouse=True)
def device() -> None:
    devices.start()


def compare(edits: list[Edit], n: int) -> None:
    from cagefield.edits.device_stack import DeviceStack

    stack = EditStack(edits)
    rng = np.random.default_rng(0)
    low, high = stack.bounds
    p = (low + rng.uniform(-0.05, 1.05, (n, 3)) * (high - low)).astype(np.float32)
    d = unit_vectors(rng, n).astype(np.float32)
    expected = stack.to_canonical(p, d)
    assert expected.viewdirs is not None and expected.stretch is not None
    points, viewdirs, stretch, places = DeviceStack.from_stack(stack).to_canonical(p, d)
    assert not places.any()
    # Some hundred stages each round once, and what they leave grows with the stretch of the rest of the way.
    size = np.abs(p).max()
    J = np.linalg.norm(expected.jacobian, axis=(1, 2))
    gain = J * np.linalg.norm(np.linalg.inv(expected.jacobian), axis=(1, 2))
    error = np.abs(points - expected.points).max(axis=1) / (size * (1.0 + J))
    assert error.max() < 100 * EPS
    # J jumps at the cages' faces and has kinks: all but a few samples.
    turned = np.abs(viewdirs - expected.viewdirs).max(axis=1) / (gain * (1.0 + J))
    assert np.quantile(turned, 0.98) < 100 * EPS
    stretched = np.abs(stretch / expected.stretch - 1.0) / (gain * (1.0 + J))
    assert np.quantile(stretched, 0.98) < 100 * EPS


@pytest.mark.parametrize("name", EDITS)
def test_named_edits_against_the_reference(name: str) -> None:
    compare([EDITS[name]], 400)


def test_chain_against_the_reference() -> None:
    shell = Edit.continuous(INNER, OUTER, shell=Trilinear()).rotate((0, 0.1, 0.2))
    compare([EDITS["turn of 90"], shell, EDITS["corner after rotation"]], 400)


@examples(5)
@given(flow_edits())
def test_random_edits_against_the_reference(edit: Edit) -> None:
    compare([edit], 100)


@pytest.mark.parametrize("name", nightly_after_first(["turn of 90", "bent cages", "linear, half"]))
def test_lattice_error_falls_with_its_order(name: str) -> None:
    from cagefield.edits.device_stack import DeviceStack

    edit = EDITS[name]
    p = shell_points(shell_of(edit), 400).astype(np.float32)
    d = unit_vectors(np.random.default_rng(0), len(p)).astype(np.float32)
    exact = EditStack([edit]).to_canonical(p).points
    moved = np.abs(exact - p).max(axis=1) > 1e-3
    errors = []
    for nodes in (17, 33, 65):
        points, *_ = DeviceStack.from_stack(EditStack([edit.replace(lattice=nodes)])).to_canonical(p, d)
        errors.append(np.median(np.linalg.norm(points - exact, axis=1)[moved]))
    # R^-2 where the map is smooth, less for the cells that the inner cage's faces cut.
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 1.3).all() and (orders < 2.6).all()


def nodes_and_reference(edit: Edit, resolution: int) -> tuple[Array, Array]:
    """(displacements [R^3,3] by the lattice's kernel, those of the exact map)."""
    from cagefield.edits.device_stack import DeviceStack

    nodes = DeviceStack.from_stack(EditStack([edit.replace(lattice=resolution)])).lattice
    warp = edit.exact_warp
    assert isinstance(warp, ContinuousWarp)
    origin, frame = warp.outer.frame
    g = np.linspace(0.0, 1.0, resolution)
    z, y, x = np.meshgrid(g, g, g, indexing="ij")
    p = origin + np.stack([x, y, z], axis=-1).reshape(-1, 3) @ frame.T
    return nodes.astype(np.float64), warp.to_canonical(p).points - p


@pytest.mark.parametrize("name", nightly_except(EDITS, "bent cages", "corner after rotation"))
def test_lattice_nodes_are_the_maps_values(name: str) -> None:
    nodes, expected = nodes_and_reference(EDITS[name], 9)
    # The lattice's steps are eight times as long as the reference's: the error of the integration, which is
    # largest in the slot, and at the linear profile's kinks.
    apart = np.abs(nodes - expected).max(axis=1)
    assert apart.max() < 2e-2 and apart.mean() < 1e-3
    still = np.abs(expected).max(axis=1) < 1e-12
    # All on the faces of the box are, also where a bent outer cage reaches them only with its corners.
    assert still.sum() >= 9**3 - 7**3
    assert np.abs(nodes[still]).max() < 1e-6


@pytest.mark.parametrize("name", ["turn of 90", "corner after rotation", "bent cages"])
def test_lattice_with_the_references_steps_is_the_reference(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from cagefield.edits.device import edit_lattice

    monkeypatch.setattr(edit_lattice, "LATTICE_STRAIN", 0.125)
    nodes, expected = nodes_and_reference(EDITS[name], 9)
    apart = np.abs(nodes - expected).max(axis=1)
    # Rounding in float32; in bent cages the steps' own error, which differs in the outer cage's coordinates.
    assert apart.max() < 5e-5 and np.median(apart) < 2e-6


def test_nodes_that_are_lost_are_marched_again(monkeypatch: pytest.MonkeyPatch) -> None:
    from cagefield.warps import flow_shell_nodes

    if devices.is_gpu():
        pytest.skip("a GPU marches every node by itself")
    edit = EDITS["bent cages"]
    vectors, _ = nodes_and_reference(edit, 9)
    monkeypatch.setattr(flow_shell_nodes.devices, "is_gpu", lambda: True)  # marks all of them
    singly, expected = nodes_and_reference(edit.replace(name="again"), 9)
    assert not np.array_equal(vectors, singly)
    # Both are off by the same integration; what is between them is far less.
    assert np.abs(vectors - singly).max() < 0.1 * np.abs(singly - expected).max() + 1e-4


def test_lattice_error_of_an_edit() -> None:
    edit = EDITS["turn of 90"]
    worst, mean = edit.lattice_error(9, samples=2000)
    warp = edit.replace(lattice=9).warp
    exact = edit.exact_warp
    assert isinstance(exact, ContinuousWarp)
    p = exact.shell_points(400, seed=1)
    distance = np.linalg.norm(warp.to_canonical(p).points - exact.to_canonical(p).points, axis=1)
    # Other points, and a mean of some hundreds of them.
    assert mean == pytest.approx(distance.mean(), rel=0.2) and worst >= 0.8 * distance.max()
    assert edit.lattice_error() == (0.0, 0.0)


@pytest.mark.nightly
def test_promises_over_random_edits() -> None:
    # Two edits in float64, which needs a process of its own; the benchmark takes ten thousand.
    script = Path(__file__).parents[1] / "benchmarks" / "flow_random.py"
    code = f"""
import sys; sys.path.insert(0, {str(script.parent)!r})
import flow_random, numpy
rows, _ = flow_random.run((0, 2, 12, True))
least, moved, inside, face, still, trip, open_trip, steps, reference = numpy.array(rows).T
assert (least > 0.0).all() and (moved == 0.0).all(), rows
assert numpy.array_equal(trip, open_trip) and trip.max() < 1e-12
assert inside.max() < 1e-12 and still.max() < 1e-12, rows
assert 0.0 < face.max() < 1e-4, rows  # the integration's error
assert reference[0] < 1e-7, rows  # the kernel's Newton method stops at 3e-7
assert numpy.isnan(reference[1]), rows
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_lattice_errors_of_a_stack_are_in_voxels() -> None:
    lattice = EDITS["turn of 90"].replace(lattice=12, name="turn")
    stack = EditStack([EDITS["shear"], lattice, lattice.replace(enabled=False), Edit.delete(INNER)])
    (error,) = stack.lattice_errors(0.02, samples=2000)
    assert (error.number, error.name, error.resolution) == (1, "turn", 12)
    worst, mean = lattice.lattice_error(samples=2000)
    assert error.worst == pytest.approx(worst / 0.02) and error.mean == pytest.approx(mean / 0.02)
    assert error.worst > 3.0 * error.mean > 0.0
    with pytest.raises(EditError, match="voxel_size must be positive, the edge of a voxel, got 0"):
        stack.lattice_errors(0)


def test_the_reference_takes_the_kernels_lattice(monkeypatch: pytest.MonkeyPatch) -> None:
    edit = EDITS["turn of 90"].replace(lattice=9)
    warp = edit.warp
    assert isinstance(warp, ContinuousWarp) and warp.lattice is not None
    nodes, expected = nodes_and_reference(edit, 9)
    assert np.array_equal(warp.lattice.displacement.reshape(-1, 3), nodes)
    monkeypatch.setattr(devices, "_started", None)

    def broken(_device: str = "auto") -> str:
        raise DeviceError("no device here")

    monkeypatch.setattr(devices, "start", broken)
    slow = edit.replace(name="without a device").warp
    assert isinstance(slow, ContinuousWarp) and slow.lattice is not None
    np.testing.assert_allclose(slow.lattice.displacement.reshape(-1, 3), expected, atol=1e-12)
