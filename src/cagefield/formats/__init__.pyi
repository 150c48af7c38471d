from .splats.splat_files import convert_splats as convert_splats
from .splats.splat_files import read_splats as read_splats
from .splats.splat_files import write_splats as write_splats
