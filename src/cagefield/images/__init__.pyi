from .metrics import psnr as psnr
from .metrics import ssim as ssim
from .render_result import RenderResult as RenderResult
