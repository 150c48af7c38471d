"""Edit files: an edit stack as YAML or JSON that a person can write.

    version: 1
    edits:
      - name: arm up
        inner: {center: [0, 0, 1], size: [1, 1, 2], rotation_deg: [0, 0, 30]}    # or {corners: [8 points]}
        outer: {margin: 2.5}                  # or a cage like inner; not needed by a discrete edit
        operations:
          - translate: [0, 0, 0.5]
          - rotate_deg: [0, 0, 20]            # or {by: [0, 0, 20], axes: cage}
          - scale: 1.2                        # or three factors, or {by: ..., axes: cage}
          - shear: {xy: 0.1}
          - move_corner: {corner: 7, by: [0.1, 0, 0]}
          - move_edge: {edge: [0, 1], by: [0, 0, 0.1]}
          - move_face: {face: +x, by: [0.2, 0, 0]}
          - move_corners: {corners: [0, 3, 5], by: [0.1, 0, 0]}
        adjustment: continuous                # or discrete
        shell: flow                           # or trilinear; flow if left out
        falloff: smooth                       # of the flow shell: smooth (if left out) or linear
        width: 1                              # of the flow shell: how much of it moves, up to 1, all of it
        lattice: 64                           # nodes per axis; left out: exact
      - name: no cup
        delete: true
        inner: {center: [2, 0, 0], size: 0.5}
        fill: surroundings                    # if left out: its support goes on; or none, or a cage
                                              # to copy from: {clone: {center: [0, 2, 0], size: 0.5}}
        relight: occlusion                    # or none: contact shadows go along, if left out
      - name: microphone
        source: ../microphone                 # a copy from another scene, or a file of splats: relative to
                                              # this file's folder, or absolute
        inner: {center: [0, 0, 0], size: 2}   # in that scene's space
      - name: nose
        inner: {points: [[0, 0, 1]], radius: 0.5, falloff: smooth}    # or sphere, root, sharp, linear
        operations:                           # no outer cage: the box around all that is reached
          - move_point: {point: 0, by: [0, 0.3, 0]}
          - move_points: {points: [0], by: [0, 0.1, 0]}
      - name: bent arm
        inner: {center: [0, 0, 1], size: [0.3, 0.3, 1], lattice: {points: [2, 2, 5], interpolation: bspline}}
        outer: {margin: 0.5}                  # a lattice of control points, x fastest; or linear
        operations:
          - bend: {axis: z, degrees: 60, towards: x, fixed: start}    # or middle, end; along its own axes
          - twist: {axis: z, degrees: 30}
          - taper: {axis: z, factor: 0.8}
          - move_points: {points: [16, 17], by: [0, 0.1, 0], radius: 0.4, falloff: smooth}
      - name: statue
        inner: {mesh: {file: statue.obj}}     # or .ply, .glb; or {vertices: [...], triangles: [...]}
        outer: {margin: 0.5}
        operations:
          - move_point: {point: 12, by: [0, 0, 0.2]}    # a vertex

Further keys of an edit: keep_source (discrete: copy instead of move), enabled, allow_folding, parent (the
name of the edit that carries this one, see `chains`), grade (not of a deletion: {exposure: 0.5, hue_deg: 30},
or temperature, tint, saturation, opacity, see `Grade`). One more operation, of a move, copy or paste, is
mirror: x, y or z, along the cage's own axis. Lengths are world units, angles degrees.
`parse_edits(dump_edits(stack))` is the stack, bit for bit.
"""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from cagefield.edits import file_nodes
from cagefield.edits.cage_nodes import (
    dump_cage,
    dump_inner,
    dump_outer,
    parse_cage,
    parse_inner,
    parse_outer,
)
from cagefield.edits.chains import problem_of_chains
from cagefield.edits.edit import Continuous, Copy, Delete, Edit, ImpossibleEditError, Move, Paste
from cagefield.edits.edit_names import problem_of_name, sanitize_name
from cagefield.edits.file_nodes import Node
from cagefield.edits.grade_nodes import dump_grade, parse_grade
from cagefield.edits.operation_nodes import dump_operation, parse_operation
from cagefield.edits.operation_sequence import problem_of_count
from cagefield.edits.options import DEFAULT_FEATHER_VOXELS, CastShadow, Clone, problem_of_lattices
from cagefield.edits.shells import Flow, ShellKind, ShellSettings, problem_of_unused_falloff, shell_kind
from cagefield.edits.stack import EditStack
from cagefield.errors import CagefieldError, EditError, EditFileError
from cagefield.files.atomic import replaced_file
from cagefield.files.safe_open import read_text
from cagefield.geometry.cage import Cage

VERSION = 1
_OPTIONAL_KEYS = (
    "name",
    "outer",
    "operations",
    "adjustment",
    "shell",
    "falloff",
    "width",
    "keep_source",
    "delete",
    "lattice",
    "enabled",
    "allow_folding",
    "fill",
    "relight",
    "feather",
    "grade",
    "source",
    "parent",
)
"""Keys of an edit beside `inner`."""

MAX_EDITS = 500
"""Edits of a file: each takes a millisecond to be checked."""


def load_edits(path: str | os.PathLike[str], *, check: bool = True, mend: bool = False) -> EditStack:
    """The edit stack of a .yaml, .yml or .json file; with check=False also one that cannot be evaluated.

    With mend=True names that no edit may have, which older versions wrote, are replaced, with a warning.

    Raises `EditFileError`, naming the file, the line (YAML), the key and the cure, for a file that cannot be
    read, unknown keys and impossible values.
    """
    file = Path(path)
    kind = _format_of(file)
    try:
        text = read_text(file)
    except UnicodeDecodeError:
        raise EditFileError(f"{file}: not a UTF-8 text file; save it as UTF-8") from None
    except OSError as error:
        raise EditFileError(f"{file}: cannot be read ({error.strerror or error})") from None
    folder = file.absolute().parent
    return parse_edits(text, format=kind, source=str(file), check=check, mend=mend, folder=folder)


def parse_edits(
    text: str,
    *,
    format: str = "yaml",
    source: str = "edits",
    check: bool = True,
    mend: bool = False,
    folder: Path | None = None,
) -> EditStack:
    """The edit stack of a text, format "yaml" or "json"; `source` names it in errors.

    Enabled edits are checked (`Edit.check`) unless check=False, parents with check or mend; `mend` as for
    `load_edits`. Mesh files that the text names are relative to `folder`; without one, none is read.
    """
    yaml = format == "yaml"
    root = file_nodes.read_yaml(text, source, halves=mend) if yaml else file_nodes.read_json(text, source)
    if root.is_list:
        return _stack(root, check, mend, folder)
    keys = root.mapping(required=("edits",), optional=("version",))
    if "version" in keys and keys["version"].integer(1, 10**6) > VERSION:
        raise keys["version"].error(
            f"version {keys['version'].value} is newer than this program's {VERSION}; update cagefield"
        )
    return _stack(keys["edits"], check, mend, folder)


def _stack(node: Node, check: bool, mend: bool, folder: Path | None) -> EditStack:
    items = node.items()
    if len(items) > MAX_EDITS:
        raise node.error(f"{len(items)} edits are too many, a file has at most {MAX_EDITS}; leave some out")
    edits = [_edit(item, check, mend, folder) for item in items]
    if (check or mend) and (fault := problem_of_chains(edits)) is not None:
        keys = items[fault[0]].mapping(required=("inner",), optional=_OPTIONAL_KEYS)
        raise keys["parent"].error(fault[1])
    shown = (edit.kernel_lattice for edit in edits if edit.enabled and isinstance(edit, Continuous))
    if (problem := problem_of_lattices(shown)) is not None:
        if not mend:
            raise node.error(problem)
        warnings.warn(f"{node.error(problem)}; lattices above 64 are made 64", stacklevel=2)
        edits = [_with_small_lattice(edit) for edit in edits]
    return EditStack(edits)


def _with_small_lattice(edit: Edit) -> Edit:
    settings = edit.shell_settings
    if not settings.lattice:
        return edit
    return edit.with_shell_settings(replace(settings, lattice=min(settings.lattice, 64)))


def save_edits(stack: EditStack, path: str | os.PathLike[str]) -> None:
    """Write the stack to a .yaml, .yml or .json file, atomically: a reader sees the old file or the new."""
    file = Path(path)
    text = dump_edits(stack, format=_format_of(file))
    try:
        with replaced_file(file, parents=False) as temporary, temporary.open("w", encoding="utf-8") as stream:
            stream.write(text)
            stream.flush()
            os.fsync(stream.fileno())
    except OSError as error:
        raise EditFileError(f"{file}: cannot be written ({error.strerror or error})") from None


def dump_edits(stack: EditStack, *, format: str = "yaml") -> str:
    """The text of an edit file, "yaml" or "json"."""
    content = {"version": VERSION, "edits": [_from_edit(edit) for edit in stack]}
    if format == "json":
        return json.dumps(content, indent=2, allow_nan=False) + "\n"
    return file_nodes.write_yaml(content)


def _edit(node: Node, check: bool, mend: bool, folder: Path | None) -> Edit:
    keys = node.mapping(
        required=("inner",),
        optional=_OPTIONAL_KEYS,
    )
    inner = parse_inner(keys["inner"], folder)
    has_outer = "outer" in keys and not keys["outer"].is_null
    outer = parse_outer(keys["outer"], inner, folder) if has_outer else None
    options: dict[str, Any] = {}
    if "fill" in keys:
        options["fill"] = _fill(keys["fill"])
    if "relight" in keys:
        options["relight"] = _relight(keys["relight"])
    if "name" in keys:
        options["name"] = _name(keys["name"], mend)
    if "parent" in keys and not keys["parent"].is_null:
        options["parent"] = _name(keys["parent"], mend)
    if "enabled" in keys:
        options["enabled"] = keys["enabled"].boolean()
    if "grade" in keys and not keys["grade"].is_null:
        options["grading"] = parse_grade(keys["grade"])
    if "feather" in keys:
        options["feather"] = keys["feather"].number()
    items = keys["operations"].items() if "operations" in keys else []
    if (problem := problem_of_count(len(items))) is not None:
        raise keys["operations"].error(problem)
    options["operations"] = tuple(parse_operation(item) for item in items)
    try:
        edit = _of_kind(keys, inner, outer, options)
    except ImpossibleEditError as error:
        raise items[error.number - 1].error(str(error)) from None
    except EditFileError:
        raise
    except CagefieldError as error:
        raise node.error(str(error)) from None
    if check and edit.enabled:
        try:
            edit.check()
        except CagefieldError as error:
            raise node.error(str(error)) from None
    return edit


def _of_kind(keys: dict[str, Node], inner: Cage, outer: Cage | None, options: dict[str, Any]) -> Edit:
    """The edit of the kind that the keys "adjustment", "keep_source", "delete" and "source" name together.

    Raises `EditError` for keys that do not go together.
    """
    delete = "delete" in keys and keys["delete"].boolean()
    source = None if "source" not in keys or keys["source"].is_null else keys["source"].text()
    keep_source = (
        keys["keep_source"].boolean() if "keep_source" in keys else source is not None and not delete
    )
    adjustment = "discrete" if delete or source is not None else "continuous"
    if "adjustment" in keys:
        adjustment = keys["adjustment"].choice(("continuous", "discrete"))
    shell = keys["shell"].text() if "shell" in keys else "flow"
    falloff = {name: read(keys[name]) for name, read in _FALLOFF_READERS.items() if name in keys}
    lattice = None
    if "lattice" in keys and not keys["lattice"].is_null:
        lattice = keys["lattice"].integer(2, 512)
    allow_folding = "allow_folding" in keys and keys["allow_folding"].boolean()
    name = options.get("name", "")
    try:
        if source is not None and (adjustment == "continuous" or delete or not keep_source):
            raise EditError(
                "source is for copies: a paste is discrete and keeps its source; leave out adjustment,"
                " keep_source and delete, or use Edit.paste"
            )
        if adjustment == "continuous":
            if keep_source or delete:
                raise EditError(f'{"deleted" if delete else "keep_source"} needs adjustment="discrete"')
            kind = _shell_kind(shell, falloff, f"{shell} shell")
        else:
            kind = _shell_kind(shell, falloff, "discrete edit", has_falloff=False)
        if delete and (options["operations"] or keep_source):
            raise EditError("a delete has no operations and keeps no source")
    except EditError as error:
        raise EditError(f'edit "{name}": {error}' if name else f"edit: {error}") from None
    if adjustment == "continuous":
        # Without an outer cage the edit says so.
        return Continuous(
            inner,
            outer,  # type: ignore[arg-type]
            shell=kind,
            lattice=lattice,
            allow_folding=allow_folding,
            **options,
        )
    options["unused_shell"] = ShellSettings(outer, kind, lattice, allow_folding)
    if source is not None:
        return Paste(inner, source, **options)
    return (Delete if delete else Copy if keep_source else Move)(inner, **options)


_FALLOFF_READERS: dict[str, Callable[[Node], Any]] = {"falloff": Node.text, "width": Node.number}


def _shell_kind(name: str, falloff: dict[str, Any], owner: str, *, has_falloff: bool = True) -> ShellKind:
    """The shell kind of a name with its falloff and width, which an `owner` without a flow shell has not."""
    kind, flow = shell_kind(name), Flow(**falloff)
    if has_falloff and isinstance(kind, Flow):
        return flow
    problem = problem_of_unused_falloff(flow, owner)
    if problem is not None:
        raise EditError(problem)
    return kind


def _relight(node: Node) -> Any:
    """How an edit is relit: a word, or {shadow: direction to the light}."""
    if node.is_mapping:
        return CastShadow(node.mapping(required=("shadow",))["shadow"].vector())
    return node.text()


def _fill(node: Node) -> Any:
    """Infill of an edit: a word, or {clone: cage}."""
    if node.is_mapping:
        return Clone(parse_cage(node.mapping(required=("clone",))["clone"]))
    return node.text()


def _name(node: Node, mend: bool) -> str:
    name = node.text()
    problem = problem_of_name(name)
    if problem is None:
        return name
    if not mend:
        raise node.error(problem)
    warnings.warn(f"{node.error(problem)}; it is replaced", stacklevel=2)
    return sanitize_name(name)


def _from_edit(edit: Edit) -> dict[str, Any]:
    content: dict[str, Any] = {"name": edit.name} if edit.name else {}
    if edit.parent:
        content["parent"] = edit.parent
    settings = edit.shell_settings
    if isinstance(edit, Delete):
        content["delete"] = True
    if isinstance(edit, Paste):
        content["source"] = edit.source
    content["inner"] = dump_inner(edit.inner)
    if settings.outer is not None and not settings.outer.follows_edit:
        content["outer"] = dump_outer(edit.inner, settings.outer)
    if edit.operations:
        content["operations"] = [dump_operation(operation) for operation in edit.operations]
    if not isinstance(edit, Delete | Paste):
        content["adjustment"] = "continuous" if isinstance(edit, Continuous) else "discrete"
    if isinstance(edit, Continuous) or not isinstance(settings.shell, Flow):
        content["shell"] = settings.shell.name
    if isinstance(settings.shell, Flow):
        if settings.shell.falloff != "smooth":
            content["falloff"] = settings.shell.falloff
        if settings.shell.width != 1.0:
            content["width"] = settings.shell.width
    if isinstance(edit, Copy):
        content["keep_source"] = True
    if isinstance(edit.fill, Clone):
        content["fill"] = {"clone": dump_cage(edit.fill.source)}
    elif edit.fill != "surroundings":
        content["fill"] = edit.fill
    if isinstance(edit.relight, CastShadow):
        content["relight"] = {"shadow": list(edit.relight.direction)}
    elif edit.relight != "occlusion":
        content["relight"] = edit.relight
    if edit.feather != DEFAULT_FEATHER_VOXELS:
        content["feather"] = edit.feather
    if edit.is_graded:
        content["grade"] = dump_grade(edit.grading)
    if settings.lattice is not None:
        content["lattice"] = settings.lattice
    if not edit.enabled:
        content["enabled"] = False
    if settings.allow_folding:
        content["allow_folding"] = True
    return content


def _format_of(file: Path) -> str:
    suffix = file.suffix.lower()
    if suffix not in (".yaml", ".yml", ".json"):
        raise EditFileError(f'{file}: an edit file ends in .yaml, .yml or .json, got "{suffix}"; rename it')
    return "json" if suffix == ".json" else "yaml"
