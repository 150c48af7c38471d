"""The block of one discrete edit: its surfaces, and what the light on them is multiplied by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.completion.inpainting.feathering import feather_rim
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.lighting.light_change import LightChange
from cagefield.completion.surfaces.footprint import CONTACT_DISTANCE_VOXELS, Footprint
from cagefield.completion.surfaces.grid_block import GridBlock, extract_block
from cagefield.completion.surfaces.patch_bounds import SUPPORT_DISTANCE_VOXELS, patch_box
from cagefield.completion.surfaces.plane_snapping import flattened
from cagefield.completion.surfaces.support_plane import Support, find_support
from cagefield.completion.surfaces.surfels import (
    Surfels,
    concatenate_surfels,
    extract_cut_faces,
    extract_surfels,
    prefer_visible,
)
from cagefield.completion.surfaces.visibility import CameraVisibility
from cagefield.edits import Edit
from cagefield.edits.stack import EditStack
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, Mask
from cagefield.warps.hexahedron_map import HexahedronMap

LIGHT_SPACING_VOXELS = 2.0
"""Maximum distance of the surfels on which light is computed, voxels."""

LIGHT_SPACING_SHARE = 1.0 / 16.0
"""Maximum distance of these surfels as a share of the largest occlusion radius."""

PROBE_DEPTH_VOXELS = 0.75
"""How far beneath its surface what is looked at is of a part; voxels."""

MIN_LOG_CHANGE = 0.01
"""The log of a change of light that is left out."""


@dataclass(frozen=True, eq=False)
class EditContext:
    """An edit's block: as it was, with V^c emptied, and masks [X,Y,Z] of V^c and of what was solid in it.

    settled: the part is shown at its new place, and casts its shadow there. apart: how far apart
    light is worked out, world units; pasted: all surfaces with a paste, None of another edit.
    """

    edit: Edit
    region: Cage
    before: GridBlock
    emptied: GridBlock
    inside: Mask
    part: Mask
    settled: bool
    sight: CameraVisibility | None
    apart: float
    pasted: Surfels | None = None

    @classmethod
    def of(
        cls,
        field: VoxelField,
        below: EditStack,
        edit: Edit,
        ambience: LightModel | None,
        settled: bool,
        preserve_opacity: bool,
        after: VoxelField | None,
        sight: CameraVisibility | None,
    ) -> EditContext:
        # What is seen of the field itself is not where edits below have taken it.
        sight = None if below.active else sight
        settled = settled and not edit.deleted
        voxel = float(field.voxel_size.max())
        lit = ambience if ambience is not None and ambience.shows else LightModel((), ())
        apart = min(LIGHT_SPACING_VOXELS * voxel, LIGHT_SPACING_SHARE * lit.reach or np.inf)
        box = patch_box(edit, voxel, lit.reach, settled=settled, falls=lit.falls)
        before = extract_block(field, below, box, preserve_opacity=preserve_opacity)
        region = Cage.box(box.mean(axis=0), box[1] - box[0] - 2.0 * voxel)
        if edit.source is not None:
            shown, stack = (field, below.append(edit)) if after is None else (after, EditStack())
            pasted = extract_surfels(extract_block(shown, stack, box, preserve_opacity=preserve_opacity))
            none = np.zeros(before.shape, bool)
            return cls(edit, region, before, before, none, none, settled, sight, apart, pasted)
        inside = edit.inner.contains(before.positions(np.ones(before.shape, bool))).reshape(before.shape)
        emptied = before
        if not edit.keep_source:
            # Below zero it is emptier than empty, which makes the surfaces beside it sharp.
            emptied = before.with_density(inside, np.minimum(before.density[inside], 0.0))
        return cls(edit, region, before, emptied, inside, before.solid & inside, settled, sight, apart)

    @cached_property
    def surface(self) -> Mask:
        """Surface vertices outside of V^c."""
        return np.asarray(self.emptied.surface & ~self.inside)

    @cached_property
    def rest_at(self) -> Array:
        """Block coordinates [N,3] of the surfaces of all but the part."""
        return self.before.coordinates(self.rest.points)

    def _away(self, mask: Mask, spacing: float = 1.0) -> Array:
        """How far the surfaces of all but the part [N] are from the vertices of a mask [X,Y,Z]."""
        if not mask.any():
            return np.full(len(self.rest_at), np.inf)
        away = ndimage.distance_transform_edt(~mask, sampling=spacing)
        return np.asarray(ndimage.map_coordinates(away, self.rest_at.T, order=1, mode="nearest"))

    @cached_property
    def rim(self) -> NDArray[np.bool_]:
        """Which of the surfaces of all but the part [N] are around V^c."""
        size = float(np.median(self.edit.inner.aabb[1] - self.edit.inner.aabb[0]))
        return np.asarray(self._away(self.inside) < max(SUPPORT_DISTANCE_VOXELS, 0.5 * size / self.voxel))

    @property
    def close(self) -> Array:
        """Block coordinates [N,3] of surfaces that the part hides from close by."""
        return self.rest_at[self.rim & (self._away(self.part) < CONTACT_DISTANCE_VOXELS)]

    def support(self) -> Support | None:
        """What the part stood on."""
        return find_support(self.part, self.rest, self.rest_at, self.rim, self.voxel)

    @property
    def voxel(self) -> float:
        """The longest edge of a voxel."""
        return max(self.before.spacing)

    @cached_property
    def _surface(self) -> tuple[Surfels, NDArray[np.bool_]]:
        """(the surfaces before, which of them [N] are of the part)."""
        surface = extract_surfels(self.before)
        if self.sight is not None:
            surface = prefer_visible(surface, self.sight.surface.within(self.before), self.voxel)
        surface = surface.thinned(self.voxel)
        within = surface.points - PROBE_DEPTH_VOXELS * self.voxel * surface.normals
        return surface, np.asarray(self.edit.inner.contains(within) & (self.edit.source is None))

    @cached_property
    def rest(self) -> Surfels:
        """The surfaces of all but the part; all, where that is kept."""
        surface, _ = self._surface
        return surface if self.edit.keep_source else self.others

    @cached_property
    def gone(self) -> Surfels:
        """The surfaces of the part."""
        surface, part = self._surface
        return surface.take(part)

    @cached_property
    def others(self) -> Surfels:
        """The surfaces of all but the part, also where that is kept."""
        surface, part = self._surface
        return surface.take(~part)

    @cached_property
    def lit(self) -> Surfels:
        """The rest as far apart as light is worked out."""
        return self.rest.thinned(self.apart)

    def without_part(self, ambience: LightModel) -> Array:
        """By how much what is `lit` [N] is brighter (log) once the part is gone: not where that is kept."""
        if self.edit.keep_source or not len(self.gone.points):
            return np.zeros(len(self.lit.points))
        return _log_light_change(
            ambience, self.lit, [self.rest], [self.rest, self.gone], self.gone, self.voxel
        )

    def cast(
        self, under: GridBlock, filled: Footprint | None, ambience: LightModel, strength: float
    ) -> tuple[LightChange, LightChange | None]:
        """What the light on a block, and on the part, is multiplied by once the part is at its new place.

        `under` is the block without the part, some of it `filled`. The part's shade on it has a strength. A
        paste keeps its own light.
        """
        rest = self.rest
        if filled is not None:
            points = filled.points(under)
            made = Surfels(points, np.broadcast_to(filled.support.normal, points.shape))
            rest = concatenate_surfels([rest.take(~filled.holds(self.rest_at)), made])
        lit = rest.thinned(self.apart)
        if self.pasted is not None:
            new = self.pasted.take(rest.distance(self.pasted.points) > 0.5 * self.voxel)
            log = _log_light_change(ambience, lit, [rest, new], [rest], new, self.voxel)
            return LightChange.of(under, lit, log, self.apart), None
        part, moved = self._moved(self.gone)
        # It is cut from what is solid: where it stood, it is no shell.
        whole = concatenate_surfels([moved, self._moved(extract_cut_faces(self.before, self.edit.inner))[1]])
        log = strength * _log_light_change(ambience, lit, [rest, whole], [rest], whole, self.voxel)
        cast = LightChange.of(under, lit, log, self.apart)
        before = [self.others, self.gone]
        log = ambience.log_light([rest, whole], moved) - ambience.log_light(before, part)
        log = np.where(np.abs(log) < MIN_LOG_CHANGE, 0.0, log)
        on_part = LightChange.of(self.before, part, log, self.apart)
        where = on_part.where & self.inside
        return cast, LightChange(where, on_part.log_ratio[self.inside[on_part.where]])

    def _moved(self, surface: Surfels) -> tuple[Surfels, Surfels]:
        """(what of a surface lies in V^c, the same at its new place)."""
        inside, points, jacobian = HexahedronMap(self.edit.deformed, self.edit.inner)(surface.points)
        kept = surface.take(inside)
        return kept, kept.turned(points, jacobian)

    def shown_part(self, block: GridBlock, there: GridBlock) -> GridBlock | None:
        """The part, as it became in its block, put into `there`; no more has colours. None where it stays."""
        feather = self.edit.feather if self.settled and self.edit.source is None else 0.0
        if block is self.before and feather == 0.0:
            return None
        if feather > 0.0:
            edit = self.edit
            block = feather_rim(block, there, edit.inner, edit.deformed, self.inside, feather)
        kept = ndimage.binary_dilation(self.inside, iterations=2)
        at = np.argwhere(kept)
        part = replace(block, slot=np.where(kept, block.slot, -1))
        return part.cropped(at.min(axis=0), at.max(axis=0)) if len(at) else part


def _log_light_change(
    ambience: LightModel,
    at: Surfels,
    now: Sequence[Surfels],
    before: Sequence[Surfels],
    what: Surfels,
    voxel: float,
) -> Array:
    """By how much surface elements [N] are brighter (log) among some surfaces than among those before.

    These differ in `what`, which makes no difference to openness from afar.
    """
    near = np.arange(len(at.points))
    if ambience.sun is None:
        near = np.flatnonzero(what.distance(at.points, 2.0 * ambience.reach) < 2.0 * ambience.reach)
    rows, _ = flattened(at.take(near), voxel, edges=True)
    log = np.zeros(len(at.points))
    log[near] = ambience.log_light(now, rows) - ambience.log_light(before, rows)
    return np.where(np.abs(log) < MIN_LOG_CHANGE, 0.0, log)
