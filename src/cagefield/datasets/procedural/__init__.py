"""Built-in scenes whose parts can be really moved: the embedded default and the ground truth of edits."""

from cagefield.datasets.procedural.catalogue import SCENES, procedural_scene
from cagefield.datasets.procedural.scene import ProceduralScene
from cagefield.datasets.procedural.writer import DepthViews, make_scene, viewpoints

__all__ = ["SCENES", "DepthViews", "ProceduralScene", "make_scene", "procedural_scene", "viewpoints"]
