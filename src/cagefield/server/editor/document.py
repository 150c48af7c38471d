"""Document of an editor as one immutable value; undo restores an earlier value."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from cagefield.cameras.keyframes import Keyframe
from cagefield.edits import Edit, EditStack
from cagefield.edits.chains import application_order
from cagefield.edits.grade import NEUTRAL_GRADE, Grade
from cagefield.edits.operations import Operation
from cagefield.edits.shells import SMOOTH_FLOW, Flow
from cagefield.errors import EditError
from cagefield.scene.alignment import Direction
from cagefield.scene.hotspots import Hotspot
from cagefield.selection.element_selection import Selection
from cagefield.server.editor.hotspot_list import HotspotList, numbered

COLORS = ("#4cc2ff", "#ffb14c", "#7ee081", "#ff7eb6", "#c9a7ff", "#f4e04d", "#5ce0d0", "#ff8a66")
"""Colors of cage pairs."""


@dataclass(frozen=True)
class Spare:
    """Options that an edit of the present kind cannot have, kept for when the kind is changed back."""

    operations: tuple[Operation, ...] = ()
    flow: Flow = SMOOTH_FLOW
    grading: Grade = NEUTRAL_GRADE


@dataclass(frozen=True)
class Entry:
    """An edit in the list: its number (never given out twice), the edit, and how the editor treats it."""

    id: int
    edit: Edit
    color: str
    locked: bool = False
    spare: Spare = Spare()


@dataclass(frozen=True)
class Document:
    """The edits in order, the scene's opacity choice, scale and up direction, the camera path, hotspots,
    selected elements.

    The selection is undone as edits are, all pages share it, and no file has it; None selects nothing.
    Elements in `removed` are deleted from the field; None deletes nothing. `up` is a unit vector, None for
    that of the cameras.
    """

    entries: tuple[Entry, ...] = ()
    preserve_opacity: bool = True
    keys: tuple[Keyframe, ...] = ()
    loop: bool = False
    selection: Selection | None = None
    removed: Selection | None = None
    meters_per_unit: float | None = None
    hotspots: HotspotList = ()
    up: Direction | None = None

    @classmethod
    def from_edits(
        cls,
        edits: Iterable[Edit],
        *,
        preserve_opacity: bool = True,
        keys: tuple[Keyframe, ...] = (),
        loop: bool = False,
        removed: Selection | None = None,
        meters_per_unit: float | None = None,
        hotspots: Iterable[Hotspot] = (),
        up: Direction | None = None,
    ) -> Document:
        """The document of an edit stack, its edits and hotspots numbered from 1."""
        numbers = numbered(hotspots)
        document = cls((), preserve_opacity, keys, loop, None, removed, meters_per_unit, numbers, up)
        for number, edit in enumerate(edits, start=1):
            document = document.insert(Entry(number, edit, document.next_color))
        return document

    @property
    def stack(self) -> EditStack:
        """The edits as a stack."""
        return EditStack(entry.edit for entry in self.entries)

    @property
    def applied(self) -> tuple[Entry, ...]:
        """The entries in the order of application: children directly before their parents."""
        if not any(entry.edit.parent for entry in self.entries):
            return self.entries
        order = application_order([entry.edit for entry in self.entries])
        return tuple(self.entries[number] for number in order)

    @property
    def saved_part(self) -> Document:
        """The document without its selection, which is not saved."""
        return self if self.selection is None else replace(self, selection=None)

    @property
    def placed_keys(self) -> tuple[Keyframe, ...]:
        """The keyframes with edits named by their place in the list from 1, as files have them."""
        places = {entry.id: place for place, entry in enumerate(self.entries, start=1)}
        return tuple(
            replace(key, parts={places[name]: part for name, part in key.parts.items() if name in places})
            for key in self.keys
        )

    @property
    def next_color(self) -> str:
        """The first of the colors that the fewest entries have: the same edits in order get the same."""
        taken = [entry.color for entry in self.entries]
        return min(COLORS, key=taken.count)

    def place(self, number: int) -> int:
        """Where in the list the edit of that number is. Raises EditError where it is not there any more."""
        for at, entry in enumerate(self.entries):
            if entry.id == number:
                return at
        raise EditError(f"edit {number} is not there any more; choose another in the list")

    def entry(self, number: int) -> Entry:
        """The entry of that number. Raises EditError where it is not there any more."""
        return self.entries[self.place(number)]

    def has(self, number: int | None) -> bool:
        """True where there is an edit of that number."""
        return any(entry.id == number for entry in self.entries)

    def put(self, entry: Entry) -> Document:
        """The document with an entry replaced by one of the same number."""
        at = self.place(entry.id)
        return replace(self, entries=(*self.entries[:at], entry, *self.entries[at + 1 :]))

    def insert(self, entry: Entry, at: int | None = None) -> Document:
        """The document with one more entry, at a place in the list or its end."""
        at = len(self.entries) if at is None else at
        return replace(self, entries=(*self.entries[:at], entry, *self.entries[at:]))

    def without(self, number: int) -> Document:
        """The document without an entry."""
        at = self.place(number)
        return replace(self, entries=self.entries[:at] + self.entries[at + 1 :])

    def moved(self, number: int, to: int) -> Document:
        """The document with an entry at another place in the list, 0 first."""
        entry = self.entry(number)
        return self.without(number).insert(entry, min(to, len(self.entries) - 1))
