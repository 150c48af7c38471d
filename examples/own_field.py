"""Edits a field that cagefield has never seen: any PyTorch module, through the Field protocol.

    pip install 'cagefield[nerf]' && python examples/own_field.py edited.png

writes two pictures of the same edit side by side: left the module itself, asked at every sample (any field
can be rendered so, slowly), right the voxels that were baked from it (what the editor and `cagefield render`
show).

For a module of your own replace Torus, and in OwnField the box that holds the scene. Positions are in the
module's own units, directions point from the camera into the scene, density is per unit of length.
"""

import sys

import numpy as np
import torch
from PIL import Image

from cagefield import Cage, Edit, EditStack, VoxelRenderer, bake, render_sampled, turntable


class Torus(torch.nn.Module):
    """The user's own module: positions and view directions [N,3] to density [N] and colour [N,3]."""

    def forward(self, x, d):
        ring = torch.hypot(torch.hypot(x[:, 0], x[:, 1]) - 0.6, x[:, 2])
        return 80.0 * torch.sigmoid((0.2 - ring) / 0.02), torch.sigmoid(2.0 * x - d)


class OwnField:
    """All that cagefield asks for: a box, and numpy in, numpy out."""

    bounds = np.array([[-0.9, -0.9, -0.3], [0.9, 0.9, 0.3]])

    def __init__(self, module):
        self.module = module

    @torch.no_grad()
    def __call__(self, positions, viewdirs):
        x, d = (torch.from_numpy(np.array(values, np.float32)) for values in (positions, viewdirs))
        sigma, rgb = self.module(x, d)
        return sigma.numpy(), rgb.numpy()


def main(path):
    field, cage = OwnField(Torus()), Cage.box((0.6, 0, 0), (0.5, 0.7, 0.5))
    edits = EditStack(
        [Edit.continuous(cage, cage.grown(0.25), lattice=32).scale((1, 1, 1.4)).translate((0.1, 0, 0.1))]
    )
    camera = turntable((0, 0, 0), 3.0, 1, elevation=0.7, width=64, height=64, fov_x=0.7)[0]
    exact = render_sampled(field, camera, samples=64, edits=edits)
    fast = VoxelRenderer(bake(field, 64), edits).render(camera, background="white")
    Image.fromarray(np.hstack([exact.rgb8(), fast.rgb8()])).save(path)


if __name__ == "__main__":
    main(sys.argv[1])
