"""Files of keyframed camera paths in nerfstudio's format, keyframes included.

The edits' parts and a key's seconds have names of their own, which nerfstudio ignores.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeGuard

from cagefield.cameras.keyframes import Keyframe, stills
from cagefield.errors import CameraError
from cagefield.files import json_text
from cagefield.files.safe_open import read_text


def dump_path(
    keys: Sequence[Keyframe], *, loop: bool, fps: float = 24.0, width: int = 800, height: int = 800
) -> str:
    """Text of a nerfstudio camera-path file: its keyframes, and a camera for each image."""
    images = stills(keys, loop=loop, fps=fps, width=width, height=height) if keys else ()
    aspect = width / height
    document = {
        "camera_type": "perspective",
        "render_height": height,
        "render_width": width,
        "fps": fps,
        "seconds": len(images) / fps,
        "is_cycle": loop,
        "smoothness_value": 0.0,
        "default_fov": keys[0].fov_y_deg if keys else 50.0,
        "default_transition_sec": 2.0,
        "keyframes": [
            {
                "matrix": list(key.c2w),
                "fov": key.fov_y_deg,
                "aspect": aspect,
                "override_transition_enabled": True,
                # nerfstudio's is the time from the key before; the first key's, that of a loop's last leg.
                "override_transition_sec": keys[n - 1].seconds,
                "cagefield_parts": {str(name): part for name, part in key.parts.items()},
            }
            for n, key in enumerate(keys)
        ],
        "camera_path": [
            {
                "camera_to_world": still.camera.c2w.reshape(-1).tolist(),
                "fov": still.fov_y_deg,
                "aspect": aspect,
            }
            for still in images
        ],
    }
    return json.dumps(document, indent=1, allow_nan=False) + "\n"


def is_path(text: str) -> bool:
    """Whether `text` is a camera-path file, whole or damaged."""
    keys = ('"camera_path"', '"keyframes"', '"camera_type"')
    return text.lstrip().startswith("{") and '"edits"' not in text and any(key in text for key in keys)


def load_keys(path: Path) -> tuple[tuple[Keyframe, ...], bool]:
    """(keyframes, loop) of a nerfstudio camera-path file.

    Raises:
        CameraError: the file holds no keyframes, or a value that makes none; names it and the cure.
    """
    try:
        document = json_text.loads(read_text(path))
    except OSError as error:
        raise CameraError(
            f"{path} cannot be read ({error.strerror}); make it readable or remove it"
        ) from None
    except (ValueError, RecursionError) as error:
        raise CameraError(f"{path} is not JSON ({error}); write the camera path again or remove it") from None
    given = document.get("keyframes") if isinstance(document, dict) else None
    if not isinstance(given, list):
        raise CameraError(f'{path}: "keyframes" must be a list; write the camera path again or remove it')
    try:
        default = _read_number(document, "default_transition_sec", 2.0)
        loop = document.get("is_cycle", False)
        if not isinstance(loop, bool):
            raise CameraError(f'"is_cycle" is {_shorten(loop)}; give true or false')
    except CameraError as error:
        raise CameraError(f"{path}: {error}") from None
    return tuple(_key(given, n, default, path) for n in range(len(given))), loop


def _key(given: list[Any], n: int, default: float, path: Path) -> Keyframe:
    """Keyframe of number `n`, with the time to the next one."""
    try:
        entry = _mapping(given[n], 'a keyframe must have the keys "matrix" and "fov"')
        matrix = entry.get("matrix")
        if not isinstance(matrix, list) or len(matrix) != 16 or not all(map(_is_number, matrix)):
            raise CameraError('"matrix" must hold 16 numbers, the camera to the world row by row')
        fov = _read_number(entry, "fov", None)
        parts = _parts(entry.get("cagefield_parts", {}))
    except CameraError as error:
        raise CameraError(f"{path}: keyframes[{n}]: {error}") from None
    after = (n + 1) % len(given)
    try:
        next_entry = _mapping(given[after], 'a keyframe must have the keys "matrix" and "fov"')
        seconds = _seconds(next_entry, default)
    except CameraError as error:
        raise CameraError(f"{path}: keyframes[{after}]: {error}") from None
    try:
        return Keyframe(tuple(map(float, matrix)), fov, seconds, parts)
    except CameraError as error:
        raise CameraError(f"{path}: keyframes[{n}]: {error}") from None


def _seconds(key: Mapping[str, Any], default: float) -> float:
    """Seconds from the keyframe before to this one."""
    next_entry = key.get("override_transition_sec")
    if next_entry is None or not key.get("override_transition_enabled", True):
        return default
    return _read_number(key, "override_transition_sec", None)


def _parts(given: object) -> dict[int, float]:
    cure = '"cagefield_parts" must give numbers from 0 to 1 by the numbers of edits'
    parts = _mapping(given, cure)
    if not all(name.isascii() and name.isdigit() and _is_number(part) for name, part in parts.items()):
        raise CameraError(f"{cure}, got {_shorten(given)}")
    return {int(name): float(part) for name, part in parts.items()}


def _mapping(value: object, cure: str) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise CameraError(f"{cure}, got {_shorten(value)}")
    return value


def _read_number(values: Mapping[str, Any], name: str, default: float | None) -> float:
    value = values.get(name, default)
    if not _is_number(value):
        raise CameraError(f'"{name}" must be a number, got {_shorten(value)}')
    return float(value)


def _is_number(value: object) -> TypeGuard[int | float]:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e300


def _shorten(value: object) -> str:
    text = "nothing" if value is None else json.dumps(value)
    return text if len(text) <= 40 else text[:37] + "..."
