__version__: str

from .cameras.camera import Camera as Camera
from .cameras.camera import turntable as turntable
from .cameras.camera_paths import CameraPath as CameraPath
from .datasets.dataset_loader import load_dataset as load_dataset
from .datasets.views import Dataset as Dataset
from .edits.edit import Edit as Edit
from .edits.edit_files import load_edits as load_edits
from .edits.edit_files import save_edits as save_edits
from .edits.stack import EditStack as EditStack
from .errors import CagefieldError as CagefieldError
from .fields.baking import bake as bake
from .fields.nerf_field import NerfField as NerfField
from .fields.protocol import Field as Field
from .fields.splat_decimation import decimate_splats as decimate_splats
from .fields.splat_field import SplatField as SplatField
from .fields.voxel_field import VoxelField as VoxelField
from .formats.splats.splat_files import read_splats as read_splats
from .formats.splats.splat_files import write_splats as write_splats
from .geometry.cage import Cage as Cage
from .images.render_result import RenderResult as RenderResult
from .rendering.reference_renderer import render_sampled as render_sampled
from .rendering.splats.splat_renderer import SplatRenderer as SplatRenderer
from .rendering.voxels.voxel_renderer import VoxelRenderer as VoxelRenderer
from .scene.scene import Scene as Scene
from .training.splats.train_splats import train_splat as train_splat
from .training.voxels.train_voxels import train_voxel as train_voxel
