from .cage import Cage as Cage
from .cage import LatticeCage as LatticeCage
from .control_points import ControlPoints as ControlPoints
from .mesh_cage import MeshCage as MeshCage
from .mesh_files import read_mesh_cage as read_mesh_cage
