"""Built-in scenes by name."""

from __future__ import annotations

from collections.abc import Callable

from cagefield.errors import SceneError
from cagefield.procedural.chair import chair
from cagefield.procedural.digger import digger
from cagefield.procedural.microphone import microphone
from cagefield.procedural.plant import plant
from cagefield.procedural.scene import ProceduralScene

SCENES: dict[str, Callable[[], ProceduralScene]] = {
    "digger": digger,
    "chair": chair,
    "microphone": microphone,
    "plant": plant,
}


def procedural_scene(name: str) -> ProceduralScene:
    """Built-in scene of a name. Raises SceneError that lists the names."""
    if name not in SCENES:
        raise SceneError(f"there is no built-in scene {name!r}; choose one of {', '.join(SCENES)}")
    return SCENES[name]()
