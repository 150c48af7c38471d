from .external.checkpoint import ExternalCheckpoint as ExternalCheckpoint
from .external.read_external import read_external as read_external
from .splats.splat_files import convert_splats as convert_splats
from .splats.splat_files import read_splats as read_splats
from .splats.splat_files import write_splats as write_splats
