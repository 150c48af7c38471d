"""Conversion between messages and edited values: operations, cages, keyframes, the state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from types import MappingProxyType
from typing import Any, Literal, cast

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.cameras.keyframes import Keyframe, Timeline
from cagefield.edits import Continuous, Edit, Flow, Paste
from cagefield.edits import operations as ops
from cagefield.edits.chains import parent_numbers
from cagefield.edits.operations import Operation
from cagefield.edits.options import CastShadow
from cagefield.errors import CameraError
from cagefield.geometry.cage import Cage, LatticeCage
from cagefield.geometry.control_points import ControlPoints
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.scene.hotspots import Hotspot
from cagefield.selection.element_selection import Selection
from cagefield.server.editor.document import Entry
from cagefield.server.editor.drag_solver import Moved, move_corners
from cagefield.server.editor.edit_kinds import kind_of
from cagefield.server.editor.hotspot_list import HotspotEntry
from cagefield.server.editor.pasting import cage_in_scene
from cagefield.server.editor.session import Session
from cagefield.server.protocol import client_messages, common, operation_messages, server_messages
from cagefield.server.protocol.common import Corners, Vec3
from cagefield.server.protocol.hotspot_messages import HotspotCamera
from cagefield.typing import Array

STILLS_PER_SECOND, MOST_STILLS = 30.0, 6000
"""How densely pages are told of a camera path; a longer one has them further apart."""


def operation_of(message: operation_messages.OperationMessage) -> Operation:
    """The operation that a message states."""
    if isinstance(message, operation_messages.TranslateBy):
        return ops.Translate(message.by)
    if isinstance(message, operation_messages.RotateBy):
        return ops.Rotate(message.rotation_deg, message.axes)
    if isinstance(message, operation_messages.ScaleBy):
        return ops.Scale.from_factors(message.by, message.axes)
    if isinstance(message, operation_messages.ShearBy):
        return ops.Shear(
            message.xy, message.xz, message.yx, message.yz, message.zx, message.zy, axes=message.axes
        )
    if isinstance(message, operation_messages.MoveCornersBy):
        return move_corners(tuple(message.corners), message.by)
    if isinstance(message, operation_messages.MovePointBy):
        return ops.MovePoint(message.point, message.by)
    if isinstance(message, operation_messages.MovePointsBy):
        return ops.MovePoints(tuple(message.points), message.by, message.radius, message.falloff)
    if isinstance(message, operation_messages.BendBy):
        return ops.Bend(message.axis, message.degrees, message.towards, message.fixed)
    if isinstance(message, operation_messages.TwistBy):
        return ops.Twist(message.axis, message.degrees, message.fixed)
    if isinstance(message, operation_messages.MirrorBy):
        return ops.Mirror(message.axis)
    return ops.Taper(message.axis, message.factor, message.fixed)


def camera_of(message: common.CameraMessage) -> Camera:
    """The camera that a page looks from. Raises CameraError for a pose that is not rigid."""
    focal = 0.5 * message.height / float(np.tan(0.5 * np.radians(message.fov_y_deg)))
    return Camera(
        np.array(message.c2w).reshape(4, 4),
        message.width, message.height, focal, focal, 0.5 * message.width, 0.5 * message.height,
    )  # fmt: skip


def keys_of(message: client_messages.SetPath) -> tuple[Keyframe, ...]:
    """The keyframes that a message states. Raises CameraError for impossible ones."""
    return tuple(_key_of(key, number) for number, key in enumerate(message.keys, start=1))


def _key_of(key: common.Key, number: int) -> Keyframe:
    try:
        return Keyframe(tuple(key.c2w), key.fov_y_deg, key.seconds, dict(key.parts))
    except CameraError as error:
        raise CameraError(f"the camera path is not taken: keyframe {number}: {error}") from None


def stills_of(keys: Sequence[Keyframe], loop: bool) -> list[server_messages.Still]:
    """The camera path as pages play it. Raises CameraError where it does not move."""
    line = Timeline(keys, loop=loop)
    count = min(max(2, round(line.seconds * STILLS_PER_SECOND) + 1), MOST_STILLS)
    at = np.linspace(0.0, line.seconds, count)
    poses = line.poses(at).reshape(-1, 16).tolist()
    return [
        server_messages.Still(c2w=c2w, fov_y_deg=fov)
        for c2w, fov in zip(poses, line.fovs_y_deg(at).tolist(), strict=True)
    ]


def vec3(value: Array) -> Vec3:
    """A point as a message has it."""
    x, y, z = value.tolist()
    return x, y, z


def corners(cage: Cage) -> Corners:
    """A cage as a message has it."""
    return cast(Corners, tuple(vec3(corner) for corner in cage.corners))


def points_of(cage: Cage) -> list[Vec3]:
    """Control points of a cage as a message has them; none of a box."""
    return [] if cage.is_hexahedron else [vec3(point) for point in cage.handles]


def points_state(edit: Edit) -> server_messages.PointsState | None:
    """Control points of an edit's inner cage; None of a box."""
    inner = edit.inner
    if inner.is_hexahedron:
        return None
    on_their_own = inner if isinstance(inner, ControlPoints) else None
    lattice = inner if isinstance(inner, LatticeCage) else None
    return server_messages.PointsState(
        canonical=points_of(inner),
        deformed=points_of(edit.deformed),
        shape=None if lattice is None else lattice.shape,
        edges=[(i, j) for i, j in inner.mesh_edges.tolist()] if isinstance(inner, MeshCage) else None,
        interpolation=None if lattice is None else cast(Any, lattice.interpolation),
        radius=None if on_their_own is None else on_their_own.radius,
        falloff=None if on_their_own is None else cast(Any, on_their_own.falloff),
        connected=on_their_own is not None and on_their_own.connected,
    )


def _cage_kind(cage: Cage) -> Literal["box", "lattice", "points", "mesh"]:
    if cage.is_hexahedron:
        return "box"
    if isinstance(cage, MeshCage):
        return "mesh"
    return "lattice" if isinstance(cage, LatticeCage) else "points"


def edit_state(
    entry: Entry,
    problem: str | None,
    error: tuple[float, float] | None,
    parent: int | None = None,
    carrier: Array | None = None,
) -> server_messages.EditState:
    """One edit as pages show it; `error` is its lattice's, in voxels, `carrier` its parents' map [3,4]."""
    edit, settings = entry.edit, entry.edit.shell_settings
    points = points_state(edit)
    flow = settings.shell if isinstance(settings.shell, Flow) else Flow()
    return server_messages.EditState(
        id=entry.id,
        name=edit.name,
        color=entry.color,
        enabled=edit.enabled,
        locked=entry.locked,
        kind=kind_of(edit),
        source=edit.source if isinstance(edit, Paste) else None,
        shell=cast(Any, settings.shell.name),
        falloff=cast(Any, flow.falloff),
        width=flow.width,
        fill="none" if edit.fill == "none" else "surroundings",
        relight="shadow" if isinstance(edit.relight, CastShadow) else edit.relight,
        lattice=(edit.kernel_lattice if isinstance(edit, Continuous) else settings.lattice) or 0,
        lattice_error=error,
        inner=corners(cage_in_scene(edit)),
        deformed=corners(edit.deformed),
        outer=None if settings.outer is None else corners(settings.outer),
        cage=_cage_kind(edit.inner),
        points=points,
        outer_follows=settings.outer is not None and settings.outer.follows_edit,
        pivot=vec3(edit.deformed.pivot),
        inner_pivot=vec3(cage_in_scene(edit).pivot),
        outer_pivot=None if settings.outer is None else vec3(settings.outer.pivot),
        operations=[f"{operation.noun} {operation}" for operation in edit.operations],
        grade=common.GradeValues(**asdict(edit.grading)),
        parent=parent,
        carrier=_affine(carrier),
        problem=problem,
    )


def _affine(carrier: Array | None) -> Any:
    """A map [3,4] as a message has it."""
    return None if carrier is None else tuple(carrier.reshape(-1).tolist())


def state_of(
    session: Session,
    path: str,
    pictured: int,
    errors: dict[int, tuple[float, float]],
    *,
    is_file: bool = False,
) -> server_messages.State:
    """Everything that pages show of the edits, drags included; `errors` of lattices by edit, where known."""
    document = session.shown
    parents = parent_numbers([entry.edit for entry in document.entries])
    return server_messages.State(
        revision=session.revision,
        pictured=pictured,
        edits=[
            edit_state(
                entry,
                session.problem(entry.edit),
                errors.get(entry.id),
                None if parent is None else document.entries[parent].id,
                session.carrier(entry),
            )
            for entry, parent in zip(document.entries, parents, strict=True)
        ],
        selected=session.selected,
        history=list(session.history.names),
        entry=session.history.entry,
        saved=session.saved,
        path=path,
        is_file=is_file,
        preserve_opacity=document.preserve_opacity,
        meters_per_unit=document.meters_per_unit,
        up=document.up,
        keys=[
            common.Key(c2w=list(key.c2w), fov_y_deg=key.fov_y_deg, seconds=key.seconds, parts=dict(key.parts))
            for key in document.keys
        ],
        loop=document.loop,
        hotspots=[
            _hotspot_state(entry, seen)
            for entry, seen in zip(session.document.hotspots, session.shown_hotspots(), strict=True)
        ],
        selection=_count_of(document.selection),
        removed=_count_of(document.removed),
        isolated=session.isolated is not None,
    )


def _hotspot_state(entry: HotspotEntry, seen: Hotspot | None) -> server_messages.HotspotState:
    """State of a hotspot that the edited scene shows as `seen`, or not at all."""
    hotspot = entry.hotspot if seen is None else seen
    view = hotspot.view
    camera = None if view is None else HotspotCamera(c2w=list(view.c2w), fov_y_deg=view.fov_y_deg)
    return server_messages.HotspotState(
        id=entry.id,
        title=hotspot.title,
        text=hotspot.text,
        position=hotspot.position,
        camera=camera,
        follows=entry.hotspot.follows,
        hidden=seen is None,
    )


def _count_of(selection: Selection | None) -> server_messages.SelectionCount | None:
    if selection is None:
        return None
    return server_messages.SelectionCount(count=selection.count, total=selection.total)


def dragged_of(
    drag: int, seq: int, moved: Moved, carriers: Mapping[int, Array | None] = MappingProxyType({})
) -> server_messages.Dragged:
    """Message with the result of a drag, and the maps [3,4] of the edits that the dragged one carries."""
    edit, outer = moved.edit, moved.edit.shell_settings.outer
    return server_messages.Dragged(
        drag=drag,
        seq=seq,
        part=moved.part,
        why=moved.why,
        inner=corners(cage_in_scene(edit)),
        deformed=corners(edit.deformed),
        outer=None if outer is None else corners(outer),
        points=points_of(edit.inner),
        deformed_points=points_of(edit.deformed),
        carried=[
            server_messages.Carried(edit=number, carrier=_affine(carrier))
            for number, carrier in carriers.items()
        ],
    )


def view_height(camera: Camera, distance: float) -> float:
    """Height of the view frustum at a distance from its camera, world units."""
    return camera.height / camera.fy * distance


def cage_of(corners: Corners, pivot: Array | None = None) -> Cage:
    """The cage with these corners."""
    values = np.array(corners)
    return Cage(values) if pivot is None else Cage(values, pivot=pivot)
