"""The paper's operations on the original NeRF and on its voxels, beside each other, from three views each.

    cagefield import CHECKPOINT --data DATA -o SCENE
    python -m benchmarks.operations SCENE -o OUT.png

SCENE holds the original NeRF that its voxels were baked from; the edit files in `benchmarks/operations` are
for nerf-pytorch's chair. Rows: unedited, then one for each file; columns: the original and the voxels, for
each view. Prints the PSNR between the two, in dB.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from benchmarks.common.image_strips import Panel, strip
from cagefield import EditStack, Scene, load_edits
from cagefield.compute import devices
from cagefield.errors import SceneError
from cagefield.images.image_files import write_png
from cagefield.images.metrics import psnr

EDITS = Path(__file__).parent / "operations"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scene", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--views", type=int, nargs="+", default=[5, 20, 40], help="test views")
    parser.add_argument("--size", type=int, default=200, help="width and height of a picture")
    parser.add_argument("--edits", type=Path, nargs="+", default=sorted(EDITS.glob("*.yaml")))
    options = parser.parse_args()
    scene = Scene.open(options.scene)
    if scene.original is None:
        raise SceneError(f"scene {options.scene} holds no original field; import a checkpoint")
    devices.start()
    cameras = [scene.cameras["test"][view].resized(options.size, options.size) for view in options.views]
    rows: list[list[Panel]] = []
    for path in [None, *options.edits]:
        edited = scene.with_edits(EditStack([]) if path is None else load_edits(path))
        row, scores = [], []
        for camera in cameras:
            exact, voxels = edited.render(camera, exact=True), edited.render(camera)
            scores.append(psnr(np.clip(exact.rgb, 0, 1), np.clip(voxels.rgb, 0, 1)))
            row += [("original", exact.rgb8()), ("voxels", voxels.rgb8())]
        name = "unedited" if path is None else path.stem
        print(f"{name}: {np.mean(scores):.2f} dB", flush=True)
        rows.append([(f"{name}\n{which}", picture) for which, picture in row])
        write_png(options.out, strip(rows))


if __name__ == "__main__":
    main()
