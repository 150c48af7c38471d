from .scene import Scene as Scene
