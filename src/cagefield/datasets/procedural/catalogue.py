"""The built-in scenes by name."""

from __future__ import annotations

from collections.abc import Callable

from cagefield.datasets.procedural.chair import chair
from cagefield.datasets.procedural.digger import digger
from cagefield.datasets.procedural.microphone import microphone
from cagefield.datasets.procedural.plant import plant
from cagefield.datasets.procedural.scene import ProceduralScene
from cagefield.errors import SceneError

SCENES: dict[str, Callable[[], ProceduralScene]] = {
    "digger": digger,
    "chair": chair,
    "microphone": microphone,
    "plant": plant,
}


def procedural_scene(name: str) -> ProceduralScene:
    """The built-in scene of that name. Raises SceneError with the names there are."""
    if name not in SCENES:
        raise SceneError(f"there is no built-in scene {name!r}; choose one of {', '.join(SCENES)}")
    return SCENES[name]()
