"""Pictures of fields: renderers, frames, image files, image metrics."""

from cagefield.renamed_modules import old_names
from cagefield.rendering.metrics import psnr, ssim
from cagefield.rendering.reference_renderer import render_sampled
from cagefield.rendering.render_result import RenderResult

__all__ = ["RenderResult", "psnr", "render_sampled", "ssim"]

__getattr__ = old_names(__name__, {"Frame": RenderResult})
