from .alignment import Alignment as Alignment
from .paste_alignment import align_paste as align_paste
from .scene import Scene as Scene
