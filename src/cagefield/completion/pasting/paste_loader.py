"""What pastes show, read from other scenes when it is asked for, and kept while it is."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Protocol

from cagefield.completion.pasting.paste_content import SourceContent, extract_content
from cagefield.edits import Edit
from cagefield.edits.patch import Pasted
from cagefield.errors import CagefieldError, EditError
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.fields.voxel_layers import layer_slices

MAX_UNUSED_PASTES = 4
"""Pastes that are kept beside those that were asked for last: undo takes one back."""

MAX_PASTED_VERTICES = 1 << 29
"""Vertices of the grid's slices of all pastes together: 2 GB of their index."""


class SceneLibrary(Protocol):
    """Where pastes get scenes from."""

    def state(self, source: str) -> Hashable:
        """What changes where the scene of a source does. Raises EditError for one that is not there."""

    def read(self, source: str) -> SourceContent:
        """The scene of a source. Raises CagefieldError where it cannot be read."""


class PasteLoader:
    """Gives pastes into one field what they show."""

    def __init__(self, library: SceneLibrary) -> None:
        self._library = library
        self._kept: dict[Hashable, Pasted] = {}

    def read(
        self,
        edits: Sequence[Edit],
        field: VoxelField | SplatField,
        *,
        preserve_opacity: bool = True,
        proceed: Callable[[], None] | None = None,
    ) -> list[Edit]:
        """The edits, those of them that paste with what they show.

        Raises EditError, in words of the edit, where a scene is not there or cannot be pasted.
        """
        found, used = [], {}
        for edit in edits:
            if edit.source is not None and edit.enabled:
                if proceed is not None:
                    proceed()
                key, shown = self._shown(edit, edit.source, field, preserve_opacity)
                used[key] = shown
                edit = edit.replace(pasted=shown)
            found.append(edit)
        if used and isinstance(field, VoxelField):
            _check_size(used.values(), field)
        others = [(key, shown) for key, shown in self._kept.items() if key not in used]
        self._kept = dict(others[-MAX_UNUSED_PASTES:]) | used
        return found

    def _shown(
        self, edit: Edit, source: str, field: VoxelField | SplatField, preserve_opacity: bool
    ) -> tuple[Hashable, Pasted]:
        try:
            key = (self._library.state(source), edit.inner, preserve_opacity)
            if key not in self._kept:
                content = self._library.read(source)
                self._kept[key] = extract_content(
                    content, edit.inner, field, preserve_opacity=preserve_opacity
                )
        except EditError as error:
            raise edit.cannot_paste(str(error)) from None
        except CagefieldError as error:
            raise edit.cannot_paste(f"it cannot be read: {error}") from None
        return key, self._kept[key]


def _check_size(pastes: Iterable[Pasted], field: VoxelField) -> None:
    """Raises EditError where pastes take too much memory."""
    _, ny, nz = field.resolution
    ends = [layer_slices(each.part) for each in pastes if each.part is not None]
    vertices = sum(high - low for low, high in ends) * ny * nz
    if vertices > MAX_PASTED_VERTICES:
        raise EditError(
            f"what is pasted takes {vertices / 1e6:.0f} million vertices of this scene's grid, at most"
            f" {MAX_PASTED_VERTICES / 1e6:.0f} million are kept; paste less, or the same cage several times"
        )
