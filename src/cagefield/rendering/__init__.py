"""Pictures of fields: renderers, frames, image files, image metrics."""

from cagefield.rendering.frame import Frame
from cagefield.rendering.metrics import psnr, ssim
from cagefield.rendering.reference_renderer import render_sampled

__all__ = ["Frame", "psnr", "render_sampled", "ssim"]
