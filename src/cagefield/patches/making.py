"""What one discrete edit took away is filled, and light goes along: on a block of a voxel field's grid."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.cages import Cage
from cagefield.edits import Edit
from cagefield.edits.options import Clone
from cagefield.edits.patch import Patch
from cagefield.edits.stack import EditStack
from cagefield.fields.voxel import VoxelField
from cagefield.patches.block import Block, block_of
from cagefield.patches.cloning import cloned
from cagefield.patches.extent import RIM, patch_box
from cagefield.patches.feathering import feathered
from cagefield.patches.light import Ambience, Lighting, distance_in
from cagefield.patches.seen import Sight
from cagefield.patches.sun import Distance
from cagefield.patches.support import Support, footprint_of, rebuilt, support_of
from cagefield.typing import Array, Float32, Mask
from cagefield.warps.inner_map import HexahedronMap

CLOSE = 3.0
"""Surfaces are hidden by what comes this near to them, voxels."""

UNSURE = 0.6
"""Where light is to grow by more than this (log), what was photographed there is noise: it is filled."""

VIEWS = 2
"""Cameras that see a surface from which on it counts as known."""

BEFORE = 0.7
"""What is so little behind what a camera shows, in voxels, is seen."""


@dataclass(frozen=True, eq=False)
class Made:
    """What was worked out for a discrete edit.

    before: the block as the edits below make it; under: with V^c emptied, filled and in its new light; inside
    [X,Y,Z]: V^c; light: on all but the part, and part_light: on the part, None where these stay as they were;
    support: what was filled, None where nothing was.
    """

    work: _Work
    under: Block
    light: Lighting | None
    part_light: Lighting | None
    support: Support | None

    @property
    def before(self) -> Block:
        return self.work.before

    @property
    def inside(self) -> Mask:
        return self.work.inside

    @cached_property
    def emptied(self) -> Block:
        """The block with V^c emptied, in its new light, before it is filled."""
        return _lit(self.work.emptied, self.light)


def made_of(
    field: VoxelField,
    below: EditStack,
    edit: Edit,
    ambience: Ambience | None,
    *,
    settled: bool = True,
    sight: Sight | None = None,
    preserve_opacity: bool = True,
    after: VoxelField | None = None,
) -> Made:
    """What a discrete edit of a field makes of it, under the edits below; `ambience` None leaves the light.

    A copy is not filled, as nothing is uncovered. Unless it is `settled`, the part casts no shadow where it
    is moved to, and keeps the light that it had. A paste keeps that in any case, and takes nothing away;
    `after` is the field with it, where the edit does not say that. What cameras did see, by their `sight` of
    the field without edits, is not filled.
    """
    work = _Work.of(field, below, edit, ambience, settled, preserve_opacity, after)
    lighting = part_light = footprint = None
    fills = edit.fill == "surroundings" and not edit.keep_source
    relights = ambience is not None and ambience.shows
    under_part = work.support() if fills or relights else None
    support = under_part if fills else None
    ground = work.emptied
    if support is not None:
        near = work.rim & (ndimage.distance_transform_edt(~work.part) < CLOSE)
        footprint = footprint_of(ground, support, work.part, near)
    if footprint is not None and sight is not None:
        footprint = footprint.without(work.seen(footprint.points(ground), below, sight), work.part | near)
    if ambience is not None and relights:
        level = None if under_part is None else under_part.normals(ground)
        lighting = work.light(ground, ambience, level)
        part_light = work.part_light(ambience) if work.settled and edit.source is None else None
    under = _lit(ground, lighting)
    if footprint is not None and lighting is not None:
        footprint = footprint.with_hole(np.argwhere(work.rim & (lighting.dense(under) > UNSURE)))
    if footprint is None or not footprint.hole.any():
        support = None
    else:
        under = rebuilt(under, footprint, work.inside)
    if isinstance(edit.fill, Clone) and not edit.keep_source:
        cages = edit.inner, edit.fill.source
        under = cloned(under, below, cages, work.inside, work.surface, preserve_opacity)
    return Made(work, under, lighting, part_light, support)


def patch_of(
    field: VoxelField,
    below: EditStack,
    edit: Edit,
    ambience: Ambience | None,
    *,
    settled: bool = True,
    sight: Sight | None = None,
    preserve_opacity: bool = True,
) -> Patch:
    """The patch of a discrete edit of a voxel field, as `made_of` works it out."""
    made = made_of(
        field, below, edit, ambience, settled=settled, sight=sight, preserve_opacity=preserve_opacity
    )
    changed = made.under.differs(made.before) | made.inside
    region, under = made.under.around(changed, made.work.region)
    part = made.work.shown_part(made.part_light, made.under)
    return Patch(region, under.layer(), None if part is None else part.layer())


def _lit(block: Block, light: Lighting | None) -> Block:
    return block if light is None else block.relit(light.where, np.exp(light.log_ratio))


@dataclass(frozen=True, eq=False)
class _Work:
    """An edit's block: as it was, with V^c emptied, and masks [X,Y,Z] of V^c and of what was solid in it.

    settled: the part is shown at its new place, and casts its shadow there. pasted [X,Y,Z]: where there
    is matter with a paste, None of another edit.
    """

    edit: Edit
    region: Cage
    before: Block
    emptied: Block
    inside: Mask
    part: Mask
    settled: bool
    pasted: Mask | None = None

    @classmethod
    def of(
        cls,
        field: VoxelField,
        below: EditStack,
        edit: Edit,
        ambience: Ambience | None,
        settled: bool,
        preserve_opacity: bool,
        after: VoxelField | None,
    ) -> _Work:
        settled = settled and not edit.deleted
        voxel = float(field.voxel_size.max())
        lit = ambience if ambience is not None and ambience.shows else Ambience((), ())
        box = patch_box(edit, voxel, lit.reach, settled=settled, falls=lit.falls)
        before = block_of(field, below, box, preserve_opacity=preserve_opacity)
        region = Cage.box(box.mean(axis=0), box[1] - box[0] - 2.0 * voxel)
        if edit.source is not None:
            shown, stack = (field, below.append(edit)) if after is None else (after, EditStack())
            pasted = block_of(shown, stack, box, preserve_opacity=preserve_opacity).matter
            none = np.zeros(before.shape, bool)
            return cls(edit, region, before, before, none, none, settled, pasted)
        inside = edit.inner.contains(before.positions(np.ones(before.shape, bool))).reshape(before.shape)
        emptied = before
        if not edit.keep_source:
            emptied = before.with_density(inside, np.zeros(int(inside.sum()), np.float32))
        return cls(edit, region, before, emptied, inside, before.solid & inside, settled)

    @cached_property
    def surface(self) -> Mask:
        """Surface vertices outside of V^c."""
        return np.asarray(self.emptied.surface & ~self.inside)

    @cached_property
    def rim(self) -> Mask:
        """Those around V^c."""
        spacing = tuple(float(edge) for edge in self.before.field.voxel_size)
        away = ndimage.distance_transform_edt(~self.inside, sampling=spacing)
        size = np.median(self.edit.inner.aabb[1] - self.edit.inner.aabb[0])
        return np.asarray(self.surface & (away < max(RIM * max(spacing), 0.5 * float(size))))

    def seen(self, points: Array, below: EditStack, sight: Sight) -> NDArray[np.bool_]:
        """Which of some points [N,3], of surfaces as the edits below make them, cameras see well.

        What an edit below made up is as good as it gets. In V^c is the part, however flat it is.
        """
        mapped = below.to_canonical(points)
        within = BEFORE * float(self.before.field.voxel_size.max())
        known = (sight.views_of(mapped.points, within) >= VIEWS) | (mapped.layer != 0)
        return np.asarray(known & ~self.edit.inner.contains(points))

    def support(self) -> Support | None:
        """What the part stood on."""
        return support_of(self.emptied, self.part, self.rim, self.surface)

    @cached_property
    def _distances(self) -> tuple[Distance, Distance]:
        """Distances to what matter there was, and to what there is then."""
        return distance_in(self.emptied, self.before.matter), distance_in(self.emptied, self.matter_after())

    def matter_after(self) -> Mask:
        """Where there is matter [X,Y,Z] once the part is where it is moved to, or gone."""
        matter = self.emptied.matter.copy()
        if not self.settled:
            return matter
        if self.pasted is not None:
            return self.pasted
        phi = HexahedronMap(self.edit.inner, self.edit.deformed)
        inside, canonical, _ = phi(self.before.positions(np.ones(matter.shape, bool)))
        matter.reshape(-1)[inside] = (
            self.before.lookup(self.before.matter.astype(np.float32), canonical) > 0.5
        )
        return matter

    def light(self, block: Block, ambience: Ambience, level: Float32 | None) -> Lighting:
        """What the light on a block without the part is multiplied by."""
        before, after = self._distances

        def change(points: Array, normals: Array) -> Array:
            return ambience.log_light(after, points, normals) - ambience.log_light(before, points, normals)

        return Lighting.on(block, np.ones(block.shape, bool), change, level)

    def part_light(self, ambience: Ambience) -> Lighting:
        """What the light on the content of V^c is multiplied by at its new place."""
        before, after = self._distances
        phi = HexahedronMap(self.edit.deformed, self.edit.inner)

        def change(points: Array, normals: Array) -> Array:
            inside, moved, jacobian = phi(points)
            turned = np.einsum("nji,nj->ni", np.linalg.inv(jacobian), normals[inside])
            turned /= np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-9)
            log = np.zeros(len(points))
            new = ambience.log_light(after, moved, turned)
            log[inside] = new - ambience.log_light(before, points[inside], normals[inside])
            return log

        return Lighting.on(self.before, self.inside, change)

    def shown_part(self, light: Lighting | None, there: Block) -> Block | None:
        """The content of V^c as it is put into `there`; no more has colours. None where it stays."""
        feather = self.edit.feather if self.settled and self.edit.source is None else 0.0
        if light is None and feather == 0.0:
            return None
        block = _lit(self.before, light)
        if feather > 0.0:
            edit = self.edit
            block = feathered(block, there, edit.inner, edit.deformed, self.inside, feather)
        kept = ndimage.binary_dilation(self.inside, iterations=2)
        at = np.argwhere(kept)
        part = replace(block, slot=np.where(kept, block.slot, -1))
        return part.cropped(at.min(axis=0), at.max(axis=0)) if len(at) else part
