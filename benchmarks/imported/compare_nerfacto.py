"""PSNR of exact pictures of a nerfacto checkpoint against those that `train_nerfacto` rendered.

python -m benchmarks.imported.compare_nerfacto OUT/blender/nerfacto/run
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.fields.external.external_field import ExternalField
from cagefield.formats.external.read_external import read_external
from cagefield.rendering.external.external_renderer import ExternalRenderer


def main() -> None:
    """Prints one line for each view."""
    folder = Path(sys.argv[1])
    found = read_external(next((folder / "nerfstudio_models").glob("*.ckpt")))
    assert found is not None and isinstance(found.field, ExternalField)
    print(found.description)
    theirs = np.load(folder / "renders.npz")
    for index in range(sum(name.startswith("rgb") for name in theirs.files)):
        pose = np.eye(4)
        pose[:3] = theirs[f"c2w{index}"]
        fx, fy, cx, cy, width, height = theirs[f"k{index}"].tolist()
        camera = Camera(pose, int(width), int(height), fx, fy, cx, cy)
        ours = ExternalRenderer(found.field).render(camera, background=found.background or "white")
        error = ours.rgb.astype(np.float64) - theirs[f"rgb{index}"].clip(0.0, 1.0)
        print(f"view {index}: {-10 * np.log10(np.mean(error**2)):.1f} dB, largest {np.abs(error).max():.1e}")


if __name__ == "__main__":
    main()
