"""Edits a nerfacto that nerfstudio trained (torch implementation, on the CPU or a GPU), and bakes it.

    ns-train nerfacto --pipeline.model.implementation torch --data DATA
    python examples/nerfstudio_nerfacto.py outputs/.../config.yml edits.yaml edited.png

Positions are nerfstudio's own: what `dataparser_transforms.json` made of the data set's.
"""

import sys
from pathlib import Path

import numpy as np
import torch

from cagefield import Camera, load_edits
from cagefield.images.image_files import write_png
from cagefield.rendering import render_sampled


class Nerfacto:
    """The field of a trained nerfacto as a cagefield field, inside the box [2,3] of its scene."""

    def __init__(self, field, box):
        self.field = field.eval()
        self.bounds = box.detach().cpu().numpy().astype(np.float64)

    @torch.no_grad()
    def __call__(self, positions, viewdirs):
        from nerfstudio.cameras.rays import Frustums, RaySamples
        from nerfstudio.field_components.field_heads import FieldHeadNames

        device = next(self.field.parameters()).device
        x, d = (torch.from_numpy(np.array(a, np.float32)).to(device) for a in (positions, viewdirs))
        edge = torch.zeros_like(x[:, :1])
        frustums = Frustums(origins=x, directions=d, starts=edge, ends=edge, pixel_area=edge)
        samples = RaySamples(frustums=frustums, camera_indices=torch.zeros_like(edge, dtype=torch.int64))
        outputs = self.field(samples)
        sigma, rgb = outputs[FieldHeadNames.DENSITY][:, 0], outputs[FieldHeadNames.RGB]
        return sigma.cpu().numpy(), rgb.cpu().numpy()


def main(config, edits, picture):
    from nerfstudio.utils.eval_utils import eval_setup

    _, pipeline, _, _ = eval_setup(Path(config), test_mode="inference")
    seen = pipeline.datamanager.train_dataset.cameras[0]
    pose = np.eye(4)
    pose[:3] = seen.camera_to_worlds.cpu().numpy().reshape(3, 4)
    size = int(seen.width), int(seen.height)
    lens = float(seen.fx), float(seen.fy), float(seen.cx), float(seen.cy)
    camera = Camera(pose, *size, *lens).resized(size[0] // 4, size[1] // 4)
    field = Nerfacto(pipeline.model.field, pipeline.model.scene_box.aabb)
    write_png(picture, render_sampled(field, camera, samples=256, edits=load_edits(edits)).rgb)


if __name__ == "__main__":
    main(*sys.argv[1:])
