from .nerf.nerf_renderer import NerfRenderer as NerfRenderer
from .reference_renderer import render_sampled as render_sampled
from .splats.splat_renderer import SplatRenderer as SplatRenderer
from .voxels.voxel_renderer import VoxelRenderer as VoxelRenderer
