"""Loader of the content of pastes, with a cache of the latest."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Protocol

from cagefield.completion.pasting.paste_content import SourceContent, extract_content
from cagefield.edits import Edit, Paste, PreparedEdit
from cagefield.edits.patch import Pasted
from cagefield.errors import CagefieldError, EditError
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.fields.voxel_layers import layer_slices

MAX_UNUSED_PASTES = 4
"""Number of pastes in memory besides those last used: undo brings one back."""

MAX_PASTED_VERTICES = 1 << 29
"""Maximum number of vertices in the slices of the grid of all pastes: 2 GB of their index."""


class SceneLibrary(Protocol):
    """Source of the scenes of pastes."""

    def state(self, source: str) -> Hashable:
        """Value that changes with the scene. Raises EditError for a missing scene."""

    def read(self, source: str) -> SourceContent:
        """Content of the scene. Raises CagefieldError if it cannot be read."""


class PasteLoader:
    """Content of pastes into one field."""

    def __init__(self, library: SceneLibrary) -> None:
        self._library = library
        self._cache: dict[Hashable, Pasted] = {}

    def read(
        self,
        edits: Sequence[Edit],
        field: VoxelField | SplatField,
        *,
        preserve_opacity: bool = True,
        proceed: Callable[[], None] | None = None,
    ) -> list[PreparedEdit]:
        """Edits, with the content of those that paste.

        Raises EditError, which names the edit, if a scene is missing or cannot be pasted.
        """
        loaded, used = [], {}
        for edit in edits:
            content = None
            if isinstance(edit, Paste) and edit.enabled:
                if proceed is not None:
                    proceed()
                key, content = self._load(edit, field, preserve_opacity)
                used[key] = content
            loaded.append(PreparedEdit(edit, pasted=content))
        if used and isinstance(field, VoxelField):
            _check_size(used.values(), field)
        unused = [(key, content) for key, content in self._cache.items() if key not in used]
        self._cache = dict(unused[-MAX_UNUSED_PASTES:]) | used
        return loaded

    def _load(
        self, edit: Paste, field: VoxelField | SplatField, preserve_opacity: bool
    ) -> tuple[Hashable, Pasted]:
        """(cache key, content) of a paste."""
        try:
            key = (self._library.state(edit.source), edit.inner, preserve_opacity)
            if key not in self._cache:
                content = self._library.read(edit.source)
                self._cache[key] = extract_content(
                    content, edit.inner, field, preserve_opacity=preserve_opacity
                )
        except EditError as error:
            raise edit.cannot_paste(str(error)) from None
        except CagefieldError as error:
            raise edit.cannot_paste(f"it cannot be read: {error}") from None
        return key, self._cache[key]


def _check_size(pastes: Iterable[Pasted], field: VoxelField) -> None:
    """Raise EditError if pastes need too much memory."""
    _, ny, nz = field.resolution
    ends = [layer_slices(each.part) for each in pastes if each.part is not None]
    vertices = sum(high - low for low, high in ends) * ny * nz
    if vertices > MAX_PASTED_VERTICES:
        raise EditError(
            f"the pastes take {vertices / 1e6:.0f} million vertices of this scene's grid, more than"
            f" the limit of {MAX_PASTED_VERTICES / 1e6:.0f} million; paste less, or one cage several times"
        )
