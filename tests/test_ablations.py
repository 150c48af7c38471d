"""The ablations: what each measures on a tiny trained scene, their pictures, and the command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from benchmarks.common.cases import chosen
from benchmarks.common.image_strips import difference, strip
from benchmarks.common.workbench import Settings, Workbench, beside
from benchmarks.edits import ablations
from benchmarks.edits.ablations import Subject, around
from benchmarks.edits.compare_shells import continuous
from benchmarks.edits.edit_quality import eye
from benchmarks.edits.failure_modes import limits

from cagefield.cli import main
from cagefield.errors import CagefieldError
from cagefield.images.image_files import read_image
from cagefield.training.voxels.voxel_config import VoxelConfig

TINY = Settings(
    views=16,
    size=32,
    test_views=3,
    config=VoxelConfig(steps=60, resolution=24),
    compared_size=16,
    compared_views=1,
)
PICTURE = 32


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Workbench:
    """A workbench with tiny photos and short trainings."""
    return Workbench(TINY, tmp_path_factory.mktemp("bench"))


@pytest.fixture
def subject(bench: Workbench) -> Subject:
    (case,) = chosen(["microphone"], ["push_head"])
    return Subject(case, bench, PICTURE)


@pytest.mark.nightly
def test_larger_outer_cages_distort_less_and_change_more(subject: Subject) -> None:
    result = ablations.outer_size(subject, (0.1, 0.5))
    small, large = result.table.rows
    least, stretch = (result.table.columns.index(name) for name in ("min det J", "max stretch"))
    assert 0.0 < float(small[least]) < float(large[least]) < 1.0
    assert float(small[stretch]) > float(large[stretch]) > 1.0
    assert result.picture.shape[1] == 3 * PICTURE + 2 * 8


def test_the_box_around_an_edit_leaves_the_gap() -> None:
    (case,) = chosen(["microphone"], ["push_head"])
    edit = continuous(case)
    outer = around(edit, 0.2)
    gap = 0.2 * np.mean([0.5, 0.5, 0.87])
    A, b = edit.inner.affine
    lengths = np.linalg.norm(A, axis=0)
    corners = np.concatenate([edit.inner.corners, edit.deformed.corners])
    u, v = ((p - b) @ np.linalg.inv(A).T * lengths for p in (corners, outer.corners))
    np.testing.assert_allclose(v.min(axis=0), u.min(axis=0) - gap, atol=1e-9)
    np.testing.assert_allclose(v.max(axis=0), u.max(axis=0) + gap, atol=1e-9)
    edit.replace(outer=outer).check()


@pytest.mark.nightly  # lattices converge by test_warps_lattice; the ablations' command runs by the last test
def test_finer_lattices_are_nearer_to_the_exact_map(subject: Subject) -> None:
    result = ablations.resolution(subject, (8, 32))
    names = [row[:2] for row in result.table.rows]
    assert names == [(shell, n) for shell in ("flow", "trilinear") for n in ("8", "32", "exact")]
    worst, mean, same = (result.table.columns.index(c) for c in ("max error", "mean error", "PSNR to exact"))
    for at in (0, 3):
        coarse, fine, exact = result.table.rows[at : at + 3]
        assert float(coarse[mean]) > 2.0 * float(fine[mean]) > 0.0
        assert float(coarse[worst]) > float(fine[worst])
        assert float(coarse[same]) < float(fine[same])
        assert (exact[worst], exact[mean], exact[same]) == ("0.000", "0.0000", "inf")
    assert result.picture.shape[1] == 3 * PICTURE + 2 * 8


@pytest.mark.nightly
def test_discrete_edits_change_less_than_continuous_ones(subject: Subject) -> None:
    result = ablations.discrete_continuous(subject)
    assert [row[0] for row in result.table.rows] == ["continuous", "discrete", "discrete copy"]
    assert result.picture.shape[1] == 4 * PICTURE + 3 * 8
    # The copy leaves the head where it was, too: less is changed than by the move.
    changed = [float(row[1].rstrip("%")) for row in result.table.rows]
    assert changed[2] <= changed[1]


@pytest.mark.nightly
def test_limits(bench: Workbench) -> None:
    (case,) = chosen(["plant"], ["move_pinecone"])
    result = limits(case, bench, 40)
    values = [float(row[2]) for row in result.table.rows]
    # Seen from behind, a capture of one side is worse than one all round, and than its own side.
    assert values[3] < values[4] and values[3] < values[2]
    assert result.picture.shape[1] == 3 * 40 + 2 * 8
    (other,) = chosen(["plant"], ["taller"])
    with pytest.raises(CagefieldError, match="plant taller moves no part; choose a discrete edit"):
        limits(other, bench, PICTURE)


def test_cameras_beside_each_other(bench: Workbench) -> None:
    front = eye("digger", 16)
    assert beside(front, front, 0.0)
    assert beside(eye("plant", 16), front, 60.0) and not beside(eye("chair", 16), front, 60.0)
    with pytest.raises(CagefieldError, match="no photo of plant is from within 0 degrees; take more views"):
        bench.one_sided("plant", front, 0.0)


# -- strips ------------------------------------------------------------------------------------------------


def test_strips_hold_their_panels() -> None:
    red, blue = np.zeros((2, 20, 30, 3), np.uint8)
    red[..., 0], blue[..., 2] = 255, 255
    picture = strip([[("one", red), ("two\nlines", blue)], [("three", red / 255.0)]])
    assert picture.shape == (2 * (20 + 46 + 8) - 8, 68, 3)
    assert (picture[:20, :30] == red).all() and (picture[:20, 38:] == blue).all()
    assert (picture[74:94, :30] == red).all() and (picture[74:94, 38:] == 255).all()
    assert (picture[20:66, :30] < 200).any()  # the caption
    with pytest.raises(CagefieldError, match="panels must be of one size, not"):
        strip([[("a", red), ("b", red[:10])]])
    with pytest.raises(CagefieldError, match="panels must be of one size, not"):
        strip([[]])


def test_differences_are_white_where_there_are_none() -> None:
    first = np.full((2, 2, 3), 0.5)
    second = first.copy()
    second[0, 0, 1] += 0.1
    shown = difference(first, second, 5.0)
    assert shown[1, 1, 0] == 1.0 and shown[0, 0] == pytest.approx(0.5, abs=1e-5)


# -- command -----------------------------------------------------------------------------------------------


@pytest.mark.nightly
def test_command(capsys: pytest.CaptureFixture[str], tmp_path: Path, bench: Workbench) -> None:
    argv = [
        "bench", "ablation", "discrete-continuous", "-o", str(tmp_path), "--workdir", str(bench.folder),
        "--views", "16", "--size", "32", "--test-views", "3", "--steps", "60", "--resolution", "24",
        "--compared-size", "16", "--compared-views", "1", "--picture-size", "32",
    ]  # fmt: skip
    assert main(argv) == 0
    assert "discrete-continuous.png" in capsys.readouterr().out
    assert read_image(tmp_path / "discrete-continuous.png").shape[2] == 3
    text = (tmp_path / "discrete-continuous.md").read_text()
    assert text.startswith("# Discrete against continuous: microphone, push head")
    assert "Command: `cagefield bench ablation discrete-continuous --views 16" in text
    assert str(tmp_path) not in text
    for more, message in (
        ([], "discrete-continuous.png exists already"),
        (["--scene", "chair"], "--scene and --edit go together"),
        (["--scene", "chair", "--edit", "delete_back"], "is a delete edit; discrete-continuous needs a cont"),
        (["--overwrite", "--picture-size", "8"], "--picture-size is 8; it must be at least 16"),
    ):
        assert main([*argv, *more]) == 2
        assert message in capsys.readouterr().err
