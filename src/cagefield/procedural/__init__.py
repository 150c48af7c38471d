"""Built-in scenes whose parts can be really moved: the embedded default and the ground truth of edits."""

from cagefield.procedural.builtin_scenes import SCENES, procedural_scene
from cagefield.procedural.capture_writer import make_capture
from cagefield.procedural.captures import CAPTURES, Capture, capture, is_capture
from cagefield.procedural.scene import ProceduralScene
from cagefield.procedural.writer import DepthViews, make_scene, viewpoints

__all__ = [
    "CAPTURES",
    "SCENES",
    "Capture",
    "DepthViews",
    "ProceduralScene",
    "capture",
    "is_capture",
    "make_capture",
    "make_scene",
    "procedural_scene",
    "viewpoints",
]
