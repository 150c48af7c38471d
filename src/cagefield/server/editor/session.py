"""Editing session of several pages: one method per command, without web and rendering.

Every method that changes something raises a `CagefieldError` with the cure where it cannot, and then
changes nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import PurePath

import numpy as np
from numpy.typing import ArrayLike

from cagefield.cameras.keyframes import Keyframe
from cagefield.edits import Edit, Paste
from cagefield.edits.operations import Operation
from cagefield.errors import EditError
from cagefield.geometry.cage import Cage
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.scene.alignment import Alignment
from cagefield.scene.hotspot_motion import following
from cagefield.scene.hotspots import Hotspot
from cagefield.selection.element_selection import Mode, Selection
from cagefield.selection.selection_cages import outer_cage_of_shape
from cagefield.server.editor import hotspot_list
from cagefield.server.editor.cage_placement import cage_pair_around, outer_cage_around
from cagefield.server.editor.chain_edits import renamed, with_own_names, with_parent, without
from cagefield.server.editor.document import Document
from cagefield.server.editor.drag_solver import Moved, Target, move
from cagefield.server.editor.edit_kinds import Kind, with_kind, with_options, with_outer, with_shell
from cagefield.server.editor.edit_texts import ReadEdits, edits_in
from cagefield.server.editor.labels import edit_label, fresh_name, option_word, suffix_for
from cagefield.server.editor.manifest_merge import ManifestValues, merged
from cagefield.server.editor.mirror import mirror_edit
from cagefield.server.editor.pasting import crop_paste
from cagefield.server.editor.point_edits import edit_of_mesh, edit_of_point, subdivided, with_reach
from cagefield.server.editor.session_state import SessionState
from cagefield.server.editor.validity import check_has_corners
from cagefield.typing import Array

LATTICE = 64
"""Lattice nodes along an axis of a new continuous edit."""

NOTHING_SELECTED = "nothing is selected; paint with the brush (M), or drag a lasso (J) around it"


class Session(SessionState):
    """Commands that change the document of a session."""

    # ---- operations ----

    def apply(self, number: int, target: Target, operation: Operation) -> Moved:
        """A whole operation at once. Raises EditError where not all of it is possible."""
        entry = self.document.entry(number)
        moved = move(entry, target, operation)
        if moved.part < 1.0:
            raise EditError(f"{moved.why}; {moved.part:.0%} of it is possible")
        self._put(edit_label(operation, target, entry), replace(entry, edit=moved.edit))
        return moved

    # ---- cages ----

    def set_cage(self, number: int, which: str, cage: Cage) -> None:
        """The "inner" or "outer" cage by its corners; the field does not move."""
        entry = self._unlocked(number)
        edit = entry.edit
        if which == "outer":
            edit = with_outer(edit, cage)
        else:
            check_has_corners(edit)
            edit = crop_paste(edit, cage) if isinstance(edit, Paste) else edit.replace(inner=cage)
        self._put(f"Set {which} cage{suffix_for(entry)}", replace(entry, edit=edit))

    def place(self, point: Array, view_height: float) -> int:
        """The number of a new continuous edit, selected, its cages around a point [3] of a surface."""
        inner, outer = cage_pair_around(point, view_height, self.bounds, self.voxel)
        edit = Edit.continuous(inner, outer, name=fresh_name(self.document, "edit"), lattice=LATTICE)
        return self._add("Place cages", edit)

    def place_point(self, point: Array, view_height: float) -> int:
        """The number of a new edit, selected, of one control point [3] on a surface."""
        inner, _ = cage_pair_around(point, view_height, self.bounds, self.voxel)
        edit = edit_of_point(inner, name=fresh_name(self.document, "points"), lattice=LATTICE)
        return self._add("Place control point", edit)

    def place_mesh(self, cage: MeshCage, file: str) -> int:
        """The number of a new continuous edit, selected, with a mesh cage read from a file."""
        named = fresh_name(self.document, PurePath(file).stem[:100] or "mesh")
        return self._add("Mesh cage from a file", edit_of_mesh(cage, name=named, lattice=LATTICE))

    def subdivide(self, number: int, cells: tuple[int, int, int], interpolation: str) -> None:
        """The inner cage as a lattice of `cells` along its axes."""
        entry = self._unlocked(number)
        edit = subdivided(entry.edit, cells, interpolation)
        self._put(f"Subdivide{suffix_for(entry)}", replace(entry, edit=edit))

    def point_reach(
        self, number: int, radius: float | None, falloff: str | None, connected: bool | None = None
    ) -> None:
        """The radius, the falloff and the kind of distance of control points; None leaves each."""
        entry = self._unlocked(number)
        edit = with_reach(entry.edit, radius, falloff, connected)
        if edit != entry.edit:
            self._put(f"Reach{suffix_for(entry)}", replace(entry, edit=edit))

    def paste(self, edit: Paste) -> int:
        """The number of a new edit that pastes from another scene, selected."""
        edit = edit.replace(name=fresh_name(self.document, edit.name or "paste"))
        return self._add("Paste from another scene", edit)

    def align(self, number: int, before: Paste, aligned: Paste) -> None:
        """A paste with the operations and the grade of its alignment.

        Raises EditError where it is not as it was `before` any more.
        """
        entry = self._unlocked(number)
        if entry.edit is not before:
            raise EditError(f'edit "{before.name}" was changed meanwhile; align it again')
        self._put(f"Align{suffix_for(entry)}", replace(entry, edit=aligned))

    def fit_inner(self, number: int, inner: Cage) -> None:
        """The inner cage as it was fitted to its content."""
        entry = self._unlocked(number)
        check_has_corners(entry.edit)
        if isinstance(entry.edit, Paste):
            inner = Cage(inner.corners, pivot=entry.edit.inner.pivot)
        self._put(f"Fit inner cage{suffix_for(entry)}", replace(entry, edit=entry.edit.replace(inner=inner)))

    def outer_margin(self, number: int, margin: float) -> None:
        """The outer cage as a margin around all that the inner cage is and was."""
        entry = self._unlocked(number)
        outer = outer_cage_around(entry.edit, margin)
        self._put(f"Outer margin{suffix_for(entry)}", replace(entry, edit=with_outer(entry.edit, outer)))

    # ---- selected elements ----

    def pick(self, label: str, picked: Selection, mode: Mode = "replace") -> None:
        """The selection after elements were picked; an entry of the history where it changes."""
        before = self.document.selection or Selection.none(picked.total)
        after = before.combine(picked, mode)
        self.select_elements(label, after)

    def select_elements(self, label: str, selection: Selection | None) -> None:
        """Another selection of elements; an entry of the history where it changes."""
        removed = self.document.removed
        if selection and removed is not None:
            selection = selection.combine(removed, "subtract")
        selection = selection or None
        if selection != self.document.selection:
            self._push(label, replace(self.document, selection=selection))

    def remove_elements(self) -> None:
        """The selected elements are deleted from the field. Raises EditError without any, or where they are
        all."""
        selection = self.document.selection
        if selection is None:
            raise EditError(NOTHING_SELECTED)
        before = self.document.removed or Selection.none(selection.total)
        removed = before.combine(selection, "add")
        if removed.count == removed.total:
            raise EditError("the selection is all of the field; leave something, or invert it (Ctrl+I)")
        self.isolated = None
        self._push("Delete selected", replace(self.document, selection=None, removed=removed))

    def restore_elements(self) -> None:
        """All deleted elements are there again. Raises EditError where none are deleted."""
        if self.document.removed is None:
            raise EditError("nothing is deleted from the field")
        self._push("Restore deleted", replace(self.document, removed=None))

    def isolate(self, on: bool) -> None:
        """Show the selected elements alone, on all pages, or all again. Raises EditError without any."""
        if on and self.document.selection is None:
            raise EditError(NOTHING_SELECTED)
        self.isolated = self.document.selection if on else None
        self.revision += 1

    def place_around_selection(self, inner: Cage) -> int:
        """The number of a new continuous edit, selected, its inner cage around the selected elements."""
        outer = outer_cage_of_shape(inner)
        edit = Edit.continuous(inner, outer, name=fresh_name(self.document, "edit"), lattice=LATTICE)
        return self._add("Cage around the selection", edit)

    # ---- options and the list ----

    def change(
        self,
        number: int,
        *,
        kind: Kind | None = None,
        shell: str | None = None,
        locked: bool | None = None,
        parent: int | None = None,
        **options: object,
    ) -> None:
        """An edit's options; `options` are other fields of `Edit`: name, enabled, falloff, width, fill, ...

        A continuous edit keeps `fill` and `relight` for when it is discrete again. `parent` is the number of
        the edit that carries this one, 0 for none.
        """
        before = self.document.entry(number)
        entry = before if locked is None else replace(before, locked=locked)
        if entry.locked and (kind or shell or parent is not None or set(options) - {"enabled"}):
            raise EditError(f'edit "{entry.edit.name}" is locked; unlock it to change it')
        if parent is not None:
            carried = with_parent(self.document, number, parent or None)
            entry = replace(entry, edit=carried.edit)
        entry = entry if kind is None else with_kind(entry, kind)
        entry = entry if shell is None else with_shell(entry, shell)
        entry = replace(entry, edit=with_options(entry.edit, options))
        words = [
            word
            for word, value in (("kind", kind), ("shell", shell), ("lock", locked), ("parent", parent))
            if value is not None
        ]
        if options.get("enabled") is not None:
            words.append("show" if options["enabled"] else "hide")
        words += [option_word(name) for name in options if name != "enabled"]
        if entry != before:
            self._push(
                f"{', '.join(words).capitalize()}{suffix_for(before)}", renamed(self.document, before, entry)
            )
            self.selected = entry.id

    def preserve_opacity(self, value: bool) -> None:
        """Whether density is scaled with the map, for all edits."""
        if value != self.document.preserve_opacity:
            self._push("Preserve opacity", replace(self.document, preserve_opacity=value))

    def set_scale(self, meters_per_unit: float | None) -> None:
        """The scene's scale in meters; None forgets it."""
        if meters_per_unit != self.document.meters_per_unit:
            self._push("Scale in meters", replace(self.document, meters_per_unit=meters_per_unit))

    def set_up(self, up: ArrayLike | None) -> None:
        """The direction [3] that is up; None takes that of the cameras. Raises SceneError for zeros."""
        direction = Alignment(up=None if up is None else np.asarray(up, np.float64)).direction
        if direction != self.document.up:
            self._push("Up direction", replace(self.document, up=direction))

    def put_hotspot(self, number: int | None, hotspot: Hotspot, *, follows: bool = False) -> int:
        """The number of a hotspot: a new one for None, else the one of that number, changed.

        Its position and camera are of the edited scene; `follows` takes them back to canonical space, from
        where edits carry them. Raises `EditError` where the edits leave nothing to follow.
        """
        entries = self.document.hotspots
        if follows:
            hotspot = self._following(number, hotspot)
        if number is None:
            number = self._next_hotspot
            self._next_hotspot += 1
            label, entries = "Place hotspot", hotspot_list.added(entries, number, hotspot)
        else:
            label, entries = "Change hotspot", hotspot_list.changed(entries, number, hotspot)
        self._push_hotspots(f'{label} "{hotspot.title:.60}"', entries)
        return number

    def _following(self, number: int | None, hotspot: Hotspot) -> Hotspot:
        for entry, seen in zip(self.document.hotspots, self.shown_hotspots(), strict=True):
            if entry.id == number and entry.hotspot.follows and seen is None:
                # Hidden: pages know it in canonical space alone.
                return replace(hotspot, follows=True)
        found = following(hotspot, self._drawn(self.document.applied))
        if found is None:
            raise EditError("the edits leave nothing there to follow; place the hotspot on a surface")
        return found

    def remove_hotspot(self, number: int) -> None:
        """A hotspot goes."""
        self._push_hotspots("Remove hotspot", hotspot_list.removed(self.document.hotspots, number))

    def move_hotspot(self, number: int, to: int) -> None:
        """A hotspot goes to another place in the list, 0 first."""
        self._push_hotspots("Reorder hotspots", hotspot_list.moved(self.document.hotspots, number, to))

    def _push_hotspots(self, label: str, entries: hotspot_list.HotspotList) -> None:
        if entries != self.document.hotspots:
            self._push(label, replace(self.document, hotspots=entries))

    def select(self, number: int | None) -> None:
        """Select an edit on all pages; no entry of the history."""
        if number is not None:
            self.document.entry(number)
        self.selected = number
        self.revision += 1

    def duplicate(self, number: int) -> int:
        """The number of a copy of an edit, after it."""
        entry = self.document.entry(number)
        edit = entry.edit.replace(name=fresh_name(self.document, entry.edit.name or "edit"))
        return self._add(f"Duplicate{suffix_for(entry)}", edit, at=self.document.place(number) + 1)

    def mirror(self, number: int, axis: int) -> int:
        """The number of a mirrored copy of an edit, across the plane through the field's middle."""
        entry = self.document.entry(number)
        if isinstance(entry.edit, Paste):
            raise EditError(f'edit "{entry.edit.name}" is pasted; what is pasted cannot be mirrored')
        edit = mirror_edit(entry.edit, axis, float(self.bounds[:, axis].mean()))
        edit = edit.replace(name=fresh_name(self.document, entry.edit.name or "edit"))
        return self._add(f"Mirror{suffix_for(entry)}", edit, at=self.document.place(number) + 1)

    def remove(self, number: int) -> None:
        """An edit goes, its children to its own parent; the edit beside it is selected."""
        entry = self._unlocked(number)
        at = self.document.place(number)
        document = without(self.document, number)
        self._push(f"Remove{suffix_for(entry)}", document)
        rest = document.entries
        self.selected = rest[min(at, len(rest) - 1)].id if rest else None

    def reorder(self, number: int, to: int) -> None:
        """An edit goes to another place in the stack, 0 first."""
        entry = self.document.entry(number)
        document = self.document.moved(number, to)
        if document != self.document:
            self._push(f"Reorder{suffix_for(entry)}", document)

    def reset_operations(self, number: int) -> None:
        """The inner cage goes back to where it was set."""
        entry = self._unlocked(number)
        if entry.edit.operations:
            self._put(f"Reset{suffix_for(entry)}", replace(entry, edit=entry.edit.replace(operations=())))

    def remove_last_operation(self, number: int) -> None:
        """The last operation of an edit goes."""
        entry = self._unlocked(number)
        if entry.edit.operations:
            edit = entry.edit.replace(operations=entry.edit.operations[:-1])
            self._put(f"Remove last operation{suffix_for(entry)}", replace(entry, edit=edit))

    # ---- texts and path ----

    def load_edits(
        self, text: str, append: bool, admitted: Callable[[Edit], Edit] = lambda edit: edit
    ) -> int:
        """How many edits a text held; they replace the stack, or are appended to it. Raises as `edits_in`."""
        return self.take_edits(ReadEdits(edits_in(text, admitted), (), ()), append)

    def take_edits(self, read: ReadEdits, append: bool) -> int:
        """How many edits there are; they replace the stack, or are appended to it.

        Appended parents have names of their own. Raises EditError for a parent that is not possible.
        """
        for edit, found in zip(read.edits, read.problems, strict=False):
            self._problems.put(edit, found or self._source_problem(edit))
        document = self.document if append else replace(self.document, entries=())
        for edit in with_own_names(read.edits, document):
            document = document.insert(self._entry(edit, document))
        self._push("Paste" if append else "Load edits", document)
        self.selected = document.entries[-1].id if document.entries else None
        return len(read.edits)

    def set_path(self, keys: tuple[Keyframe, ...], loop: bool) -> None:
        """The camera path's keyframes."""
        document = replace(self.document, keys=keys, loop=loop)
        if document != self.document:
            self._push("Camera path", document)

    def take_manifest(self, before: ManifestValues, disk: ManifestValues) -> list[str]:
        """Values of the manifest that another program alone changed, as one entry; words for conflicts.

        `before` are the values that both began with, `disk` those of the file.
        """
        document, conflicts = merged(self.document, before, disk, self._next_hotspot)
        if document != self.document:
            self._next_hotspot = hotspot_list.next_number(document.hotspots)
            self._push("Changed by another program", document)
        return conflicts

    def restore(self, document: Document) -> None:
        """Changes that were not saved before a crash, as one entry."""
        self._next = max([self._next, *(entry.id + 1 for entry in document.entries)])
        self._next_hotspot = max(self._next_hotspot, hotspot_list.next_number(document.hotspots))
        self._push("Restore unsaved changes", document)
        self.selected = document.entries[-1].id if document.entries else None
