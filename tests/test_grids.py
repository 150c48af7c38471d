"""Pictures of shell maps: lines where the map has them, red where it folds, and the command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from benchmarks.edits.distortion import Distortion
from benchmarks.edits.methods import exact_map
from benchmarks.edits.warp_grids import _RED, VIEW, Style, caption, grids, lattice_picture, turned

from cagefield.cli import main
from cagefield.errors import CagefieldError
from cagefield.images.image_files import read_image

SIDE = 172  # pixels of 0.01


def pixel(x: float, y: float) -> tuple[int, int]:
    return int((VIEW - y) / VIEW * SIDE / 2), int((x + VIEW) / VIEW * SIDE / 2)


def is_red(picture: np.ndarray) -> np.ndarray:
    """Mask of the pixels that are red: paper or lines, the lines blended with it."""
    return np.asarray((picture[..., 0] > 150) & (picture[..., 1] < 120) & (picture[..., 2] < 120))


def test_lines_are_where_the_lattice_goes() -> None:
    edit = turned(0.0).translate((0.05, 0.0, 0.0))
    picture = lattice_picture(exact_map("trilinear", edit), edit, SIDE, 0.1).astype(int)
    dark = picture.sum(axis=2)
    # In the inner cage, moved by 0.05, the lines at multiples of 0.1 are between them; outside they stay.
    for line, blank in ((0.05, 0.0), (-0.15, -0.1)):
        assert dark[pixel(line, 0.033)] < dark[pixel(blank, 0.033)] - 150
    row = pixel(0.0, 0.833)[0]
    assert dark[row][pixel(0.2, 0.0)[1]] < dark[row][pixel(0.25, 0.0)[1]] - 50
    assert not is_red(picture).any()


def test_folds_are_red_and_only_folds() -> None:
    for name in ("trilinear", "mean value"):
        small, large = turned(10.0), turned(90.0)
        assert not is_red(lattice_picture(exact_map(name, small), small, 48, 10.0)).any()
        red = is_red(lattice_picture(exact_map(name, large), large, 48, 10.0))
        assert 0.01 < red.mean() < 0.2
        # The picture looks the same from all four sides.
        assert np.mean(red != np.rot90(red)) < 0.02
    flow = lattice_picture(exact_map("flow", large), large, 32, 0.1)
    assert not is_red(flow).any()


def test_red_is_the_sign_of_the_determinant() -> None:
    edit = turned(120.0)
    warp = exact_map("mean value", edit)
    picture = lattice_picture(warp, edit, 64, 10.0)  # a lattice so wide that it has the lines at 0 only
    g = VIEW * (2 * (np.arange(64) + 0.5) / 64 - 1)
    y, x = np.meshgrid(g[::-1], g, indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), np.zeros(64 * 64)], axis=1)
    det = np.linalg.det(warp.to_canonical(points).jacobian).reshape(64, 64)
    full = (picture == np.array(_RED)).all(axis=2)
    assert full.sum() > 50 and (det[full] < 0.0).all()
    assert not is_red(picture)[det > 0.5].any()


def test_captions() -> None:
    assert caption(Distortion(0.374, 2.0, 0.1, 0.0)) == "min det J 0.37"
    assert caption(Distortion(-1.2, np.inf, 0.1, 0.1)) == "folds: min det J -1.20"


def test_the_whole_picture_and_what_it_refuses() -> None:
    lines: list[str] = []
    style = Style(panel=24)
    picture = grids(("trilinear",), (15.0, 60.0), style, lines.append)
    assert picture.dtype == np.uint8 and picture.shape[1] == 64 + 24 + style.gap
    assert [line.split(":")[0] for line in lines] == ["trilinear at 15 degrees", "trilinear at 60 degrees"]
    assert "min det J 0.5" in lines[0] and "folds" in lines[1]
    with pytest.raises(CagefieldError, match="at least one method and one angle"):
        grids((), (15.0,))
    with pytest.raises(CagefieldError, match="panel is 8; it must be at least 16 pixels"):
        Style(panel=8)


def test_command(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    out = tmp_path / "grids.png"
    argv = ["bench", "grids", "-o", str(out), "--methods", "trilinear", "--degrees", "15", "--panel", "24"]
    assert main(argv) == 0
    assert "trilinear at 15 degrees: min det J 0.5" in capsys.readouterr().out
    assert read_image(out).shape[2] == 3
    for wrong, message in (
        (argv, "grids.png exists already"),
        (["bench", "grids", "--methods", "green"], "there is no method 'green'; choose from flow"),
        (["bench", "grids", "-o", str(tmp_path / "x.jpg")], "must end in .png"),
    ):
        assert main(wrong) == 2
        assert message in capsys.readouterr().err
