"""The latest removals of parts, each shared by the stages of a patch and by all drags of its part."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable

from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.removal import Removal, remove_part
from cagefield.completion.splat_patch import SplatRemoval, remove_splats
from cagefield.completion.surfaces.surfels import Surfels
from cagefield.completion.surfaces.visibility import CameraVisibility
from cagefield.edits import Discrete, PreparedStack
from cagefield.fields.voxel_field import VoxelField
from cagefield.rendering.splats.splat_provenance import SplatSet

MAX_CACHED_REMOVALS = 2
"""Maximum number of removals in memory: tens of megabytes each."""

Key = tuple[object, ...]


class RemovalCache:
    """Removals of parts of one field; `surfels` gives those of the whole field (`extract_field_surfels`)."""

    def __init__(self, content: VoxelField | SplatSet, surfels: Callable[[], Surfels | None]) -> None:
        self._content, self._surfels = content, surfels
        self._cache: OrderedDict[Key, Removal | SplatRemoval] = OrderedDict()

    def __len__(self) -> int:
        return len(self._cache)

    def clear(self) -> None:
        """Release all removals."""
        self._cache.clear()

    def get_or_make(
        self,
        below: PreparedStack,
        edit: Discrete,
        model: LightModel | None,
        visibility: CameraVisibility | None,
        preserve_opacity: bool,
    ) -> Removal | SplatRemoval:
        """Removal of the part of an edit, no paste, above those below; arguments as in `remove_part`."""
        source = edit.inner, edit.uncovers, edit.fill
        key: Key = (*below.steps, *source, model, visibility is None, preserve_opacity)
        if key not in self._cache:
            self._cache[key] = self._make(below, edit, model, visibility, preserve_opacity)
            while len(self._cache) > MAX_CACHED_REMOVALS:
                self._cache.popitem(last=False)
        self._cache.move_to_end(key)
        return self._cache[key]

    def _make(
        self,
        below: PreparedStack,
        edit: Discrete,
        model: LightModel | None,
        visibility: CameraVisibility | None,
        preserve_opacity: bool,
    ) -> Removal | SplatRemoval:
        if not isinstance(self._content, VoxelField):
            return remove_splats(self._content, below, edit, model, visibility=visibility)
        return remove_part(
            self._content,
            below,
            edit,
            model,
            visibility=visibility,
            preserve_opacity=preserve_opacity,
            surfels=None if visibility is None or below.steps else self._surfels(),
        )
