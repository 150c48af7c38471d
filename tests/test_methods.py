"""The comparison of methods on the continuous edits, the operations that the cases cover, LPIPS."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from benchmarks.common import perceptual
from benchmarks.common.cases import CASES, Case, chosen
from benchmarks.common.figures import compare
from benchmarks.common.workbench import Workbench
from benchmarks.edits.compare_shells import (
    Comparison,
    MapTime,
    continuous,
    map_time,
    measure,
    summaries,
    table,
)
from benchmarks.edits.distortion import Distortion
from benchmarks.edits.exact_maps import exact
from benchmarks.edits.methods import METHODS

from benchmark_settings import TINY
from cagefield.cli import main
from cagefield.edits import EditStack, KernelMap
from cagefield.edits.operations import MoveCorner, MoveEdge, MoveFace, Rotate, Scale, Shear, Translate
from cagefield.errors import CagefieldError

CONTINUOUS = [case for case in CASES if case.kind == "continuous"]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Workbench:
    """A workbench with tiny photos and short trainings."""
    return Workbench(TINY, tmp_path_factory.mktemp("bench"))


def case(scene: str, name: str) -> Case:
    (found,) = chosen([scene], [name])
    return found


def test_the_cases_cover_every_operation_of_the_paper() -> None:
    operations = [operation for one in CONTINUOUS for operation in continuous(one).operations]
    assert {type(operation) for operation in operations} == {
        Translate, Rotate, Scale, Shear, MoveCorner, MoveEdge, MoveFace,
    }  # fmt: skip
    factors = [len(set(operation.by)) for operation in operations if isinstance(operation, Scale)]
    assert 1 in factors and max(factors) > 1  # uniform, and per axis
    assert {one.kind for one in CASES} == {"continuous", "move", "copy", "delete"}
    assert len({one.scene for one in CONTINUOUS}) == 4 and len(CASES) >= 12


def test_a_case_without_a_continuous_edit_has_no_shell() -> None:
    with pytest.raises(CagefieldError, match="chair delete_back has 0 continuous edits; it must have one"):
        continuous(case("chair", "delete_back"))


@pytest.mark.nightly
def test_methods_share_the_motion_and_differ_in_the_shell(bench: Workbench) -> None:
    cases = [case("microphone", "bigger_head"), case("microphone", "delete_base")]
    methods = ("flow", "trilinear", "trilinear 64", "harmonic")
    rows = list(measure(cases, methods, bench))
    assert [(row.case.name, row.method) for row in rows] == [("bigger_head", name) for name in methods]
    by_name = {row.method: row for row in rows}
    assert by_name["trilinear"].distortion == by_name["trilinear 64"].distortion
    # Scaled by 1.25 in a shell of 0.3 around half-sizes .25, .25, .435: the thinnest is left .2375 of .3
    assert by_name["trilinear"].distortion.least_det == pytest.approx(0.2375 / 0.3 * 0.80, rel=0.1)
    assert not by_name["flow"].distortion.folds
    lost = [row.figures.lost for row in rows]
    assert max(lost) - min(lost) < 3.0  # the same field, each against its own map: no method is off
    assert by_name["trilinear"].figures.edited != by_name["flow"].figures.edited
    assert all(row.time.per_million > 0 and row.time.set_up > 0 for row in rows)
    text = table(rows, bench, ("Machine: a test",)).markdown()
    assert "| microphone | bigger head | trilinear 64 | no | 0.6" in text and text.endswith("a test\n")
    with pytest.raises(CagefieldError, match="there is no method 'green'"):
        next(measure(cases, ("green",), bench))


def row(method: str, lost: float, stretch: float, least: float = 0.5, rigidity: float = 0.3) -> Comparison:
    black = np.zeros((1, 16, 16, 3), np.float32)
    figures = replace(compare(black, black, black, black), unedited=30.0, edited=30.0 - lost)
    one = case("plant", "taller")
    return Comparison(one, method, Distortion(least, stretch, rigidity, 0.0), MapTime(1.0, 2.0), figures)


def test_summaries_say_where_a_peer_is_better() -> None:
    rows = [row("flow", 0.5, 3.0), row("harmonic", 0.25, 2.0), row("trilinear", 0.75, np.inf, -1.0, 0.2)]
    assert summaries(rows) == [
        "flow: 0.50 dB lost on average over 1 edits, 0 of which fold.",
        "harmonic: 0.25 dB lost on average over 1 edits, 0 of which fold; loses less than flow on: "
        "plant taller; stretches less on: plant taller.",
        "trilinear: 0.75 dB lost on average over 1 edits, 1 of which fold; is nearer to rigid on: "
        "plant taller.",
    ]


@pytest.mark.nightly
def test_map_times_are_of_the_whole_stack() -> None:
    stack = METHODS["trilinear 64"].of_all(case("digger", "raise_arm").edits)
    assert len(stack) == 2
    taken = map_time(stack)
    assert 0 < taken.per_million < 1e5 and taken.set_up > 0
    # What is made is not what an equal edit had: the harmonic solution takes a second or so.
    harmonic = METHODS["harmonic"].of_all(case("plant", "taller").edits)
    assert min(map_time(harmonic).set_up for _ in range(2)) > 0.3


def test_exact_maps_by_the_kernel_are_those_of_the_reference() -> None:
    stack = case("plant", "taller").edits
    p = np.random.default_rng(0).uniform(-1.0, 1.3, (2000, 3))
    d = np.broadcast_to([0.6, 0.0, 0.8], p.shape)
    kernel = exact(EditStack(edit.replace(lattice=8) for edit in stack))
    assert isinstance(kernel, KernelMap) and kernel.edits[0].lattice is None
    got, expected = kernel.to_canonical(p, d), stack.to_canonical(p.astype(np.float32), d)
    near = np.abs(got.points - expected.points).max(axis=1) < 2e-5  # float32
    assert near.mean() > 0.999
    np.testing.assert_allclose(got.viewdirs[near], expected.viewdirs[near], atol=2e-2)
    np.testing.assert_array_equal(kernel.bounds, stack.bounds)
    harmonic = exact(METHODS["harmonic"].of_all(stack))
    assert isinstance(harmonic, EditStack) and harmonic[0].lattice is None


# -- LPIPS -------------------------------------------------------------------------------------------------


def test_lpips_says_what_is_missing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(perceptual, "find_spec", lambda name: None if name == "lpips" else object())
    assert perceptual.lpips() == (None, "LPIPS is left out; not installed: lpips")
    torch = ModuleType("torch")
    torch.hub = ModuleType("torch.hub")  # type: ignore[attr-defined]
    torch.hub.get_dir = lambda: str(tmp_path)
    monkeypatch.setitem(sys.modules, "torch", torch)
    monkeypatch.setattr(perceptual, "find_spec", lambda name: object())
    distance, reason = perceptual.lpips()
    assert distance is None and "weights (alexnet-owt-7be5be79.pth) are not in torch's cache" in reason


def test_lpips_is_left_out_where_a_package_is_broken(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(name: str) -> ModuleType:
        raise RuntimeError("operator torchvision::nms does not exist")

    monkeypatch.setattr(perceptual, "find_spec", lambda name: object())
    monkeypatch.setattr(perceptual, "import_module", broken)
    reason = "LPIPS is left out; it cannot be imported: operator torchvision::nms does not exist"
    assert perceptual.lpips() == (None, reason)


def test_lpips_of_equal_pictures_is_zero() -> None:
    distance, reason = perceptual.lpips()
    if distance is None:
        pytest.skip(reason)
    picture = np.random.default_rng(0).random((1, 64, 64, 3))
    assert distance(picture, picture) == pytest.approx(0.0, abs=1e-6)
    assert distance(picture, 1.0 - picture) > 0.1


# -- command -----------------------------------------------------------------------------------------------


@pytest.mark.nightly
def test_bench_edits_compares_methods(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bench: Workbench
) -> None:
    argv = [
        "bench", "edits", "--scenes", "microphone", "--edits", "push_head", "--views", "8", "--size", "32",
        "--test-views", "3", "--steps", "60", "--resolution", "24", "--exact-size", "24", "--exact-views",
        "1", "--compared-size", "16", "--compared-views", "1", "--methods",
        "flow 64", "trilinear", "--workdir", str(bench.folder), "-o", str(tmp_path / "edits.md"),
    ]  # fmt: skip
    assert main(argv) == 0
    out = capsys.readouterr().out
    assert "microphone, push_head, flow 64: min det J" in out and "microphone, push_head, trilinear:" in out
    text = (tmp_path / "edits_methods.md").read_text()
    assert "| microphone | push head | flow 64 | no |" in text
    assert "--methods 'flow 64' trilinear --compared-size 16" in text
    first = (tmp_path / "edits.md").read_text()
    assert "| microphone | push head | continuous | exact map |" in first
    assert "LPIPS is left out" in first or "LPIPS edited" in first
    (tmp_path / "edits.md").unlink()
    assert main(argv) == 2
    assert "edits_methods.md exists already" in capsys.readouterr().err
