"""Files of the table of fields, by independent writers: values at the vertices of their grids."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

from benchmarks.imported.written_fields import (
    CENTER,
    HALF,
    solid,
    vertices,
    write_instant_ngp,
    write_nerfacto,
)

from cagefield.formats.external.read_external import read_external

pytestmark = pytest.mark.nightly


def check(file: Path, points: np.ndarray, tolerance: float) -> None:
    """Density and color of the file's field at vertices [n,n,n,3] of the world are the chair's."""
    inner = points[1:-1, 1:-1, 1:-1].reshape(-1, 3)
    sigma, rgb = solid(inner)
    full = sigma > 1.0
    assert full.sum() > 1000
    found = read_external(file)
    assert found is not None
    below = np.tile(np.array([0.0, 0.0, -1.0], np.float32), (int(full.sum()), 1))
    density, color = found.field(inner[full].astype(np.float32), below)
    np.testing.assert_allclose(density, sigma[full], rtol=tolerance)
    np.testing.assert_allclose(color, np.clip(rgb[full], 0.02, 0.98), atol=tolerance)


def test_nerfacto_in_the_layout_of_tiny_cuda_nn(tmp_path: Path) -> None:
    write_nerfacto(tmp_path)
    file = next((tmp_path / "nerfstudio_models").iterdir())
    check(file, (vertices() - 0.5) * (2.0 * HALF) + CENTER, 1e-3)


def test_instant_ngp(tmp_path: Path) -> None:
    write_instant_ngp(tmp_path / "a.ingp")
    check(tmp_path / "a.ingp", ((vertices() - 0.5) * (2.0 * HALF))[..., [2, 0, 1]], 0.01)
