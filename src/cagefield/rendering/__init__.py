"""Pictures of fields: renderers, frames, image files, image metrics."""

from cagefield.images.metrics import psnr, ssim
from cagefield.images.render_result import RenderResult
from cagefield.renamed_modules import old_names
from cagefield.rendering.reference_renderer import render_sampled

__all__ = ["RenderResult", "psnr", "render_sampled", "ssim"]

__getattr__ = old_names(__name__, {"Frame": RenderResult})
