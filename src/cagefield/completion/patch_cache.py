"""What was worked out for a field and its edits, kept on disk for the next process.

Each result is a file of arrays in the user's cache. Its name is a digest of all that the result follows
from: the package's source, the field, its cameras, and what is asked for. A file that is damaged, missing or
cannot be written costs the time of working it out again, and nothing else.
"""

from __future__ import annotations

import contextlib
import dataclasses
import errno
import hashlib
import importlib.metadata
import json
import os
import shutil
import time
from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, Final, TypeVar, cast

import numpy as np
import scipy
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.lighting.diffuse_irradiance import DiffuseLight
from cagefield.completion.lighting.directional_light import DirectionalLight
from cagefield.completion.surfaces.surfels import Surfels
from cagefield.completion.surfaces.visibility import CameraVisibility, SurfacePairs
from cagefield.edits import Edit
from cagefield.edits.patch import NewLight, Patch, SplatPatch
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.files.atomic import replaced_file
from cagefield.files.npz import read_arrays
from cagefield.files.stale_files import remove_unfinished
from cagefield.files.user_cache import MAX_UNUSED_SECONDS, cache_root, source_digest
from cagefield.geometry.cage import Cage

MIN_CACHED_SECONDS = 0.3
"""What a result must have taken to be kept."""

MAX_CACHE_BYTES = 1 << 30
"""Room that all files take at most: those that were not used for longest go. One takes a quarter at most."""

MIN_FREE_BYTES = 1 << 30
"""Room that stays free on the disk, at least."""

VERSIONS = source_digest(), np.__version__, scipy.__version__
"""Of what works results out, as it was imported."""

KINDS: Final = {
    kind.__name__: kind
    for kind in (
        LightModel,
        Cage,
        Camera,
        DiffuseLight,
        NewLight,
        Patch,
        SurfacePairs,
        CameraVisibility,
        SplatPatch,
        DirectionalLight,
        Surfels,
        VoxelField,
    )
}
"""Classes that results consist of."""

Result = TypeVar("Result")


class DiskCache:
    """Results for one field, photographed by these cameras; see the module."""

    def __init__(self, field: VoxelField | SplatField, cameras: Sequence[Camera]) -> None:
        self._field, self._cameras = field, cameras

    def get_or_make(self, what: Sequence[object], make: Callable[[], Result]) -> Result:
        """What `make` gives: from disk, where it was made before for the same `what`.

        `what` holds edits, cages, numbers and texts. What a paste has a part in is not kept.
        """
        path = self._path(what)
        if path is None:
            return make()
        with contextlib.suppress(OSError, ValueError):
            return cast(Result, self._read(path))
        began = time.perf_counter()
        made = make()
        if time.perf_counter() - began > MIN_CACHED_SECONDS:
            with contextlib.suppress(OSError, ValueError, MemoryError):
                self._write(path, made)
        return made

    @cached_property
    def _base(self) -> bytes:
        digest = hashlib.sha256()
        for each in (*VERSIONS, importlib.metadata.version("quadrants"), tuple(self._cameras)):
            self._add(digest, each)
        for name in (each.name for each in _init_fields(self._field)):
            self._add(digest, getattr(self._field, name))
        return digest.digest()

    def _path(self, what: Sequence[object]) -> Path | None:
        digest = hashlib.sha256()
        try:
            self._add(digest, tuple(what))
            digest.update(self._base)
            return cache_root() / "patches" / f"{digest.hexdigest()[:32]}.npz"
        except (OSError, RuntimeError, TypeError):
            return None

    def _read(self, path: Path) -> object:
        """Raises OSError where there is no file, ValueError for one that is damaged."""
        arrays = read_arrays(path)
        try:
            found = self._unpacked(json.loads(arrays["tree"].tobytes()), arrays)
        except Exception as error:  # classes of the package refuse in their own ways
            raise ValueError(str(error)) from error
        with contextlib.suppress(OSError):
            os.utime(path)
        return found

    def _write(self, path: Path, made: object) -> None:
        """Raises OSError without room, ValueError for what is too large or of other classes."""
        arrays: dict[str, NDArray[Any]] = {}
        tree = json.dumps(self._packed(made, arrays)).encode()
        arrays["tree"] = np.frombuffer(tree, np.uint8)
        size = sum(values.nbytes for values in arrays.values())
        if size > MAX_CACHE_BYTES // 4:
            raise ValueError("it is too large to be kept")
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if shutil.disk_usage(path.parent).free < MIN_FREE_BYTES + size:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        remove_unfinished(path.parent)
        with replaced_file(path) as temporary:
            np.savez(temporary, **cast(Any, arrays))
        _evict_files(path.parent)

    def _packed(self, value: Any, arrays: dict[str, NDArray[Any]]) -> Any:
        """The value as JSON; its arrays are added to `arrays`, and named in it."""
        if value is self._field:
            return {"field": True}
        if value is None or isinstance(value, (bool, int, float, str)):
            return value
        if isinstance(value, np.ndarray):
            name = f"a{len(arrays)}"
            arrays[name] = value
            return {"array": name}
        if isinstance(value, tuple):
            return {"tuple": [self._packed(each, arrays) for each in value]}
        if type(value) is KINDS.get(type(value).__name__):
            values = {
                each.name: self._packed(getattr(value, each.name), arrays) for each in _init_fields(value)
            }
            return {"kind": type(value).__name__, "values": values}
        raise ValueError(f"{type(value)} is not kept")

    def _unpacked(self, tree: Any, arrays: dict[str, NDArray[Any]]) -> Any:
        if not isinstance(tree, dict):
            return tree
        if "field" in tree:
            return self._field
        if "array" in tree:
            return arrays[tree["array"]]
        if "tuple" in tree:
            return tuple(self._unpacked(each, arrays) for each in tree["tuple"])
        values = {name: self._unpacked(value, arrays) for name, value in tree["values"].items()}
        return KINDS[tree["kind"]](**values)

    def _add(self, digest: Any, value: object) -> None:
        """Adds all that a value says; raises TypeError for what may say more: functions, what is pasted.

        What an edit is called says nothing.
        """
        if value is self._field:
            digest.update(b"field")
        elif isinstance(value, np.ndarray):
            digest.update(f"{value.dtype.str}{value.shape}".encode())
            digest.update(np.ascontiguousarray(value).data)
        elif isinstance(value, (tuple, list)):
            digest.update(f"({len(value)}".encode())
            for each in value:
                self._add(digest, each)
        elif dataclasses.is_dataclass(value) and not isinstance(value, type):
            if isinstance(value, Edit) and (value.pasted is not None or value.source is not None):
                raise TypeError("what is pasted may change")
            digest.update(type(value).__name__.encode())
            for each in _init_fields(value):
                if not (isinstance(value, Edit) and each.name == "name"):
                    self._add(digest, getattr(value, each.name))
        elif value is None or isinstance(value, (bool, int, float, str, np.generic)):
            digest.update(f"<{value!r}>".encode())
        else:
            raise TypeError(f"a {type(value).__name__}")


def _init_fields(value: Any) -> tuple[dataclasses.Field[Any], ...]:
    return tuple(each for each in dataclasses.fields(value) if each.init)


def _evict_files(folder: Path) -> None:
    """Removes what was not used for long, and what was not for longest where all take too much room."""
    found = []
    for path in folder.glob("[!.]*.npz"):
        with contextlib.suppress(OSError):
            status = path.stat()
            found.append((status.st_mtime, status.st_size, path))
    room = MAX_CACHE_BYTES
    for used, size, path in sorted(found, reverse=True):
        room -= size
        if room < 0 or time.time() - used > MAX_UNUSED_SECONDS:
            with contextlib.suppress(OSError):
                path.unlink()
