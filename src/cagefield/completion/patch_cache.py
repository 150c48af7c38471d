"""Disk cache of patches, light models and visibility, shared by processes.

Each result is a file of arrays in the user's cache. Its name is a digest of all inputs of the result: the
package's source, the field, its cameras, and the arguments. A damaged, missing or unwritable file costs the
time of the computation, and nothing else.
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
from cagefield.edits import Edit, Paste
from cagefield.edits.patch import NewLight, Patch, SplatPatch
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.files.atomic import replaced_file
from cagefield.files.npz import read_arrays
from cagefield.files.stale_files import remove_unfinished
from cagefield.files.user_cache import MAX_UNUSED_SECONDS, cache_root, source_digest
from cagefield.geometry.cage import Cage

MIN_CACHED_SECONDS = 0.3
"""Minimum computation time of a result that is stored."""

MAX_CACHE_BYTES = 1 << 30
"""Maximum size of all files; those unused for longest are removed. One file takes a quarter at most."""

MIN_FREE_BYTES = 1 << 30
"""Minimum free space on the disk after a file is written."""

VERSIONS = source_digest(), np.__version__, scipy.__version__
"""Versions of the code that computes results, as imported."""

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
"""Classes in results."""

Result = TypeVar("Result")


class DiskCache:
    """Results for one field and its cameras."""

    def __init__(self, field: VoxelField | SplatField, cameras: Sequence[Camera]) -> None:
        self._field, self._cameras = field, cameras

    def get_or_make(self, key: Sequence[object], make: Callable[[], Result]) -> Result:
        """Result of `make`, from disk if it was computed before with the same inputs `key`.

        `key` holds edits, cages, numbers and strings. Results with pastes are not stored.
        """
        path = self._path(key)
        if path is None:
            return make()
        with contextlib.suppress(OSError, ValueError):
            return cast(Result, self._read(path))
        start = time.perf_counter()
        result = make()
        if time.perf_counter() - start > MIN_CACHED_SECONDS:
            with contextlib.suppress(OSError, ValueError, MemoryError):
                self._write(path, result)
        return result

    @cached_property
    def _base(self) -> bytes:
        """Digest of the versions, the cameras and the field."""
        digest = hashlib.sha256()
        for each in (*VERSIONS, importlib.metadata.version("quadrants"), tuple(self._cameras)):
            self._update_digest(digest, each)
        for name in (each.name for each in _init_fields(self._field)):
            self._update_digest(digest, getattr(self._field, name))
        return digest.digest()

    def _path(self, key: Sequence[object]) -> Path | None:
        """Path of the file of a key; None if the key holds values without a digest."""
        digest = hashlib.sha256()
        try:
            self._update_digest(digest, tuple(key))
            digest.update(self._base)
            return cache_root() / "patches" / f"{digest.hexdigest()[:32]}.npz"
        except (OSError, RuntimeError, TypeError):
            return None

    def _read(self, path: Path) -> object:
        """Result in a file. Raises OSError without the file, ValueError if it is damaged."""
        arrays = read_arrays(path)
        try:
            result = self._unpack(json.loads(arrays["tree"].tobytes()), arrays)
        except Exception as error:  # constructors of the classes raise errors of many kinds
            raise ValueError(str(error)) from error
        with contextlib.suppress(OSError):
            os.utime(path)
        return result

    def _write(self, path: Path, result: object) -> None:
        """Write a result. Raises OSError without space, ValueError if it is too large or of another class."""
        arrays: dict[str, NDArray[Any]] = {}
        tree = json.dumps(self._pack(result, arrays)).encode()
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

    def _pack(self, value: Any, arrays: dict[str, NDArray[Any]]) -> Any:
        """JSON tree of a value; its arrays are added to `arrays` and named in the tree."""
        if value is self._field:
            return {"field": True}
        if value is None or isinstance(value, (bool, int, float, str)):
            return value
        if isinstance(value, np.ndarray):
            name = f"a{len(arrays)}"
            arrays[name] = value
            return {"array": name}
        if isinstance(value, tuple):
            return {"tuple": [self._pack(each, arrays) for each in value]}
        if type(value) is KINDS.get(type(value).__name__):
            values = {
                each.name: self._pack(getattr(value, each.name), arrays) for each in _init_fields(value)
            }
            return {"kind": type(value).__name__, "values": values}
        raise ValueError(f"{type(value)} is not kept")

    def _unpack(self, tree: Any, arrays: dict[str, NDArray[Any]]) -> Any:
        """Value of a JSON tree and its arrays."""
        if not isinstance(tree, dict):
            return tree
        if "field" in tree:
            return self._field
        if "array" in tree:
            return arrays[tree["array"]]
        if "tuple" in tree:
            return tuple(self._unpack(each, arrays) for each in tree["tuple"])
        values = {name: self._unpack(value, arrays) for name, value in tree["values"].items()}
        return KINDS[tree["kind"]](**values)

    def _update_digest(self, digest: Any, value: object) -> None:
        """Add all of a value except the names of edits to a digest.

        Raises TypeError for a value that does not determine its content, such as a function or a paste.
        """
        if value is self._field:
            digest.update(b"field")
        elif isinstance(value, np.ndarray):
            digest.update(f"{value.dtype.str}{value.shape}".encode())
            digest.update(np.ascontiguousarray(value).data)
        elif isinstance(value, (tuple, list)):
            digest.update(f"({len(value)}".encode())
            for each in value:
                self._update_digest(digest, each)
        elif dataclasses.is_dataclass(value) and not isinstance(value, type):
            if isinstance(value, Paste):
                raise TypeError("the content of a paste may change")
            digest.update(type(value).__name__.encode())
            for each in _init_fields(value):
                if not (isinstance(value, Edit) and each.name == "name"):
                    self._update_digest(digest, getattr(value, each.name))
        elif value is None or isinstance(value, (bool, int, float, str, np.generic)):
            digest.update(f"<{value!r}>".encode())
        else:
            raise TypeError(f"a {type(value).__name__}")


def _init_fields(value: Any) -> tuple[dataclasses.Field[Any], ...]:
    """Fields of a dataclass that its constructor takes."""
    return tuple(each for each in dataclasses.fields(value) if each.init)


def _evict_files(folder: Path) -> None:
    """Remove files unused for KEPT_SECONDS, and the least recently used ones beyond MAX_CACHE_BYTES."""
    files = []
    for path in folder.glob("[!.]*.npz"):
        with contextlib.suppress(OSError):
            status = path.stat()
            files.append((status.st_mtime, status.st_size, path))
    room = MAX_CACHE_BYTES
    for used, size, path in sorted(files, reverse=True):
        room -= size
        if room < 0 or time.time() - used > MAX_UNUSED_SECONDS:
            with contextlib.suppress(OSError):
                path.unlink()
