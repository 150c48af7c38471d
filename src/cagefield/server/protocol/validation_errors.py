"""Why a message from a page cannot be taken, for who sees the editor."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import ValidationError

_KEY = {
    "c2w": "its camera (c2w) must be 16 finite numbers, row by row",
    "fov_y_deg": "its field of view (fov_y_deg) must be a number of degrees",
    "seconds": "its time to the next one (seconds) must be a number",
    "parts": "its parts of edits (parts) must be numbers from 0 to 1 by the edits' numbers",
}
_PATH = {
    "keys": "keys must be a list of keyframes, at most 500; remove some",
    "loop": "loop must be true or false",
}


def refusal(error: ValidationError) -> str:
    """First problem of a message, in one line with its cure."""
    problem = error.errors(include_url=False, include_input=False)[0]
    where = problem["loc"]
    if where and where[0] == "set_path":
        return f"the camera path is not taken: {_of_path(where[1:])}"
    said = f"{'.'.join(map(str, where))}: {problem['msg']}" if where else str(problem["msg"])
    return f"malformed message: {said:.200}; reload the page"


def _of_path(where: Sequence[int | str]) -> str:
    if len(where) < 2 or where[0] != "keys":
        return _PATH.get(str(where[0]), f'unknown key "{where[0]}"; the keys here are keys and loop')
    frame, name = f"keyframe {int(where[1]) + 1}", str(where[2]) if len(where) > 2 else None
    if name is None:
        return f"{frame} must have the keys {', '.join(_KEY)}"
    return f"{frame}: " + _KEY.get(name, f'unknown key "{name}"; the keys here are {", ".join(_KEY)}')
