"""Requests of another program for one scene of splats: opened, deformed by its cages, saved, exported.

Arrays of splats, in requests and replies (canonical or deformed space, world units): "means" [N,3],
"log_scales" [N,3], "quaternions" [N,4] (w, x, y, z), "opacities" [N] in [0,1], "sh" [N,(L+1)^2,3], all
float32, as in `SplatField`. Cages: see `_cage`.

| request | further keys | arrays | reply |
| --- | --- | --- | --- |
| hello | | | version |
| open | path, of a scene folder or a splat file | | count, sh_degree, up [3], edits; splats |
| load | name | splats | count, sh_degree, up [3], edits |
| deform | kind, name, infill, lattice, inner, outer | inner_*, outer_* | count; splats |
| save | those of deform, path, overwrite | those of deform | path, edits |
| export | those of deform, path, overwrite | those of deform | path, count |
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

import cagefield
from cagefield.edits import EditStack
from cagefield.edits.edit import Continuous, Copy, Delete, Edit, Move
from cagefield.edits.edit_files import save_edits
from cagefield.edits.edit_names import problem_of_name
from cagefield.edits.fitted_operations import operations_to
from cagefield.edits.paste_paths import rebased
from cagefield.errors import CageError, CagefieldError, EditError, FieldError
from cagefield.exporting import edited_splats, upright
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import Cage
from cagefield.integrations.cage_arrays import NOW, Role, lattice_cage, mesh_cage
from cagefield.integrations.frames import Frame
from cagefield.scene.scene import Scene
from cagefield.typing import AnyArray, Array

PROTOCOL_VERSION = 1
SPLAT_ARRAYS = ("means", "log_scales", "quaternions", "opacities", "sh")
DISCRETE_KINDS: dict[str, Callable[..., Edit]] = {"move": Move, "copy": Copy, "delete": Delete}
Value = TypeVar("Value")


class SplatDeformer:
    """One scene of splats, and the replies to requests about it. Requests that fail leave it as it was."""

    def __init__(self) -> None:
        self._scene: Scene | None = None
        self._requests: Mapping[str, Callable[[Frame], Frame]] = {
            "hello": self._hello,
            "open": self._open,
            "load": self._load,
            "deform": self._deform,
            "save": self._save,
            "export": self._export,
        }

    def reply(self, request: Frame) -> Frame:
        """The reply to a request. Raises CagefieldError or OSError for one that is not possible."""
        kind = request.header.get("request")
        if not isinstance(kind, str) or kind not in self._requests:
            raise CagefieldError(f"a request is one of {', '.join(self._requests)}, got {kind!r:.40}")
        return self._requests[kind](request)

    # ---- requests ----

    def _hello(self, request: Frame) -> Frame:
        return Frame({"version": cagefield.__version__, "protocol": PROTOCOL_VERSION})

    def _open(self, request: Frame) -> Frame:
        self._scene = open_splat_scene(Path(_value(request, "path", str)))
        return Frame(self._description, splat_arrays(edited_splats(self._scene)))

    def _load(self, request: Frame) -> Frame:
        self._scene = scene_of_splats(splats_from_arrays(request.arrays))
        return Frame(self._description)

    def _deform(self, request: Frame) -> Frame:
        splats = edited_splats(self._edited(request))
        return Frame({"count": len(splats)}, splat_arrays(splats))

    def _save(self, request: Frame) -> Frame:
        edited, path = self._edited(request), _destination(request)
        save_edits(EditStack(rebased(edited.edits, edited.folder, path.absolute().parent)), path)
        return Frame({"path": str(path), "edits": len(edited.edits)})

    def _export(self, request: Frame) -> Frame:
        from cagefield.formats.splats.splat_files import write_splats

        path, edited = _destination(request), self._edited(request)
        splats = edited_splats(edited)
        write_splats(upright(splats, edited.up), path)
        return Frame({"path": str(path), "count": len(splats)})

    # ---- the scene ----

    @property
    def _description(self) -> dict[str, Any]:
        scene = self._opened
        return {
            "count": len(scene.field) if isinstance(scene.field, SplatField) else 0,
            "sh_degree": scene.field.sh_degree,
            "up": scene.up.tolist(),
            "edits": len(scene.edits),
        }

    @property
    def _opened(self) -> Scene:
        if self._scene is None:
            raise CagefieldError("no splats are open; open a scene or a splat file first")
        return self._scene

    def _edited(self, request: Frame) -> Scene:
        """The scene with the edit of a request after its own edits."""
        scene = self._opened
        scene.patcher  # noqa: B018  made once, for all edits
        return scene.with_edits(EditStack([*scene.edits, edit_from_request(request)]))


def open_splat_scene(path: Path) -> Scene:
    """The scene of a scene folder, or of a splat file, whose edits are none.

    Raises:
        CagefieldError: a file or folder that holds no splats, or does not exist.
    """
    from cagefield.formats.splats.splat_files import read_splats
    from cagefield.scene.scene_files import is_scene

    if not path.exists():
        raise FieldError(f"{path} does not exist; give a scene folder or a splat file")
    if not is_scene(path):
        return scene_of_splats(read_splats(path))
    scene = Scene.open(path)
    if not isinstance(scene.field, SplatField):
        raise FieldError(
            f"{path} holds voxels, no splats; fit splats with `cagefield export {path} -o splats.ply`, and"
            " open these"
        )
    return scene


def scene_of_splats(splats: SplatField) -> Scene:
    """The scene of splats without edits, cameras around it. Raises FieldError where none is visible."""
    from cagefield.scene.import_splats import import_splats

    imported = import_splats(splats)
    return Scene(imported.field, cameras=imported.cameras, background=imported.background)


def splat_arrays(splats: SplatField) -> dict[str, AnyArray]:
    """The arrays of splats as frames have them."""
    return {name: getattr(splats, name) for name in SPLAT_ARRAYS}


def splats_from_arrays(arrays: Mapping[str, AnyArray]) -> SplatField:
    """The splats of a request. Raises FieldError for missing arrays, mismatched shapes, NaN."""
    missing = [name for name in SPLAT_ARRAYS if name not in arrays]
    if missing:
        raise FieldError(f"arrays of the splats are missing: {', '.join(missing)}")
    wrong = [name for name in SPLAT_ARRAYS if arrays[name].dtype != np.float32]
    if wrong:
        raise FieldError(f"{wrong[0]} must be float32, got {arrays[wrong[0]].dtype}")
    means, log_scales, quaternions, opacities, sh = (arrays[name] for name in SPLAT_ARRAYS)
    return SplatField(means, log_scales, quaternions, opacities, sh)


# ---- edits ----


def edit_from_request(request: Frame) -> Edit:
    """The edit of a request: its kind, its cages at rest and now, and the operations between them.

    `kind` is "continuous" (with an outer cage), "move", "copy" or "delete". `infill` true fills what a move
    or a delete uncovers and takes contact shadows along, as edits do by default; false does neither, which is
    faster. `lattice`: nodes per axis of the shell's lattice, null for the exact map.

    Raises:
        CagefieldError: missing or impossible values, with the cure.
    """
    kind = _value(request, "kind", str)
    if kind != "continuous" and kind not in DISCRETE_KINDS:
        raise EditError(f"kind is continuous, {', '.join(DISCRETE_KINDS)}, got {kind!r:.40}")
    options: dict[str, Any] = {"name": _value(request, "name", str, "")}
    if (problem := problem_of_name(options["name"])) is not None:
        raise EditError(problem)
    if not _value(request, "infill", bool, False):
        options |= {"fill": "none", "relight": "none"}
    inner, target = _cage(request, "inner")
    edit: Edit
    if kind == "continuous":
        _, outer = _cage(request, "outer")
        edit = Continuous(inner, Cage(outer), lattice=_lattice_nodes(request), **options)
    else:
        edit = DISCRETE_KINDS[kind](inner, **options)
    if kind != "delete":
        try:
            edit = edit.replace(operations=operations_to(inner, target))
        except CageError as error:
            raise CageError(f"inner cage {NOW}: {error}") from None
    edit.check()
    return edit


def _lattice_nodes(request: Frame) -> int | None:
    """Nodes per axis of the shell's lattice. Raises EditError for another value than a number or null."""
    nodes = request.header.get("lattice")
    if nodes is not None and type(nodes) is not int:
        raise EditError(f"lattice is a number of nodes or null, got {nodes!r:.40}")
    return nodes


def _cage(request: Frame, role: Role) -> tuple[Cage, Array]:
    """(canonical cage, target of its handles) of the cage with a role, "inner" or "outer".

    The header's key of that name is {"type": "mesh"}, with arrays ROLE_rest and ROLE_target [V,3] float64,
    ROLE_edges [E,2] and ROLE_triangles [F,3] int32; or {"type": "lattice", "shape": [nx, ny, nz],
    "interpolation": "bspline" or "linear"} with ROLE_rest and ROLE_target [n,3], x fastest. An outer cage has
    one shape: its target is taken, and no motion.
    """
    settings = request.header.get(role)
    if not isinstance(settings, dict):
        raise CageError(f"no {role} cage is given; assign an object as the {role} cage")
    kind = settings.get("type")
    if kind == "mesh":
        shape = {"rest": (np.float64, 3), "target": (np.float64, 3), "edges": (np.int32, 2)}
        rest, target, edges, triangles = (
            _array(request, f"{role}_{name}", dtype, width)
            for name, (dtype, width) in (shape | {"triangles": (np.int32, 3)}).items()
        )
        return mesh_cage(rest, target, edges, triangles, role)
    if kind == "lattice" and role == "inner":
        rest, target = (_array(request, f"inner_{name}", np.float64, 3) for name in ("rest", "target"))
        size = settings.get("shape")
        if not isinstance(size, list) or not all(type(count) is int for count in size):
            raise CageError(f"the shape of a lattice is 3 whole numbers, got {size!r:.60}")
        return lattice_cage(rest, target, size, str(settings.get("interpolation", "bspline")))
    of = "mesh or lattice" if role == "inner" else "mesh"
    raise CageError(f"the type of an {role} cage is {of}, got {kind!r:.40}; use a cube")


def _array(request: Frame, name: str, dtype: type, width: int) -> AnyArray:
    """The array [n,width] of a request. Raises CageError where it is missing or of another kind."""
    values = request.arrays.get(name)
    if values is None:
        raise CageError(f"array {name} is missing")
    if values.ndim != 2 or values.shape[1] != width or values.dtype != dtype:
        raise CageError(
            f"{name} must be {np.dtype(dtype)}[n,{width}], got {values.dtype}{list(values.shape)}"
        )
    return values


def _value(request: Frame, key: str, kind: type[Value], default: Value | None = None) -> Value:
    """A value of a request's header. Raises CagefieldError where it is missing, or of another type."""
    value = request.header.get(key, default)
    if type(value) is not kind:
        raise CagefieldError(f'"{key}" of a request is of type {kind.__name__}, got {value!r:.60}')
    return value


def _destination(request: Frame) -> Path:
    """The path that a request writes. Raises CagefieldError where something is there and not overwritten."""
    path = Path(_value(request, "path", str))
    if path.exists() and not _value(request, "overwrite", bool, False):
        raise CagefieldError(f"{path} exists; choose another name, or allow it to be replaced")
    return path
