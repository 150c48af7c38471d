"""Scenes of named parts that can be really moved: the ground truth of edits.

World: z up, the object within about [-1,1]^3. Angles are radians, intrinsic XYZ, right-handed.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cagefield.cameras.camera import Camera
from cagefield.errors import SceneError
from cagefield.images.render_result import Background, RenderResult
from cagefield.procedural.deformations import Deformation
from cagefield.procedural.deformed_parts import deform_part
from cagefield.procedural.occlusion import Occlusion
from cagefield.procedural.parts import Part, PlacedPrimitive, affine_matrix
from cagefield.procedural.room_light import Room, RoomLight
from cagefield.procedural.shading import Light, shade
from cagefield.procedural.supersampling import photograph
from cagefield.procedural.surfaces import SHELL_EXTENT_EPS, SurfaceField, shade_surface
from cagefield.procedural.tracing import Hits, points_along_rays, trace
from cagefield.typing import Array, Float32


@dataclass(frozen=True)
class ProceduralScene:
    """Named parts with their placement and lighting; every change returns a new scene.

    modeled   the parts as first built: baked occlusion is theirs, whatever moves later
    relit     True: a rotated part is lit anew, as in the world. False: a part carries its colors like an
              edited radiance field, color(p, d) = modeled color(canonical point, canonical direction).
    lowest    elevation in degrees of the lowest camera that make_scene places
    room      the room around the parts, whose walls are parts too, and whose window lights them
    """

    name: str
    parts: tuple[Part, ...]
    modeled: tuple[Part, ...] = ()
    relit: bool = True
    lowest: float = 5.0
    room: Room | None = None

    def __post_init__(self) -> None:
        names = [part.name for part in self.parts]
        duplicates = sorted({name for name in names if names.count(name) > 1})
        if duplicates:
            raise SceneError(
                f"part names must differ; {', '.join(duplicates)} is used twice in scene {self.name}"
            )
        if not self.modeled:
            object.__setattr__(self, "modeled", self.parts)

    @property
    def part_names(self) -> tuple[str, ...]:
        return tuple(part.name for part in self.parts)

    @property
    def bounds(self) -> Array:
        """Box [2,3] that holds all parts."""
        boxes = np.stack([part.bounds for part in self.parts])
        return np.stack([boxes[:, 0].min(0), boxes[:, 1].max(0)])

    def part_bounds(self, part: str | Sequence[str]) -> Array:
        """Box [2,3] that holds a part, or several parts, in their present place."""
        boxes = np.stack([self.parts[i].bounds for i in self._indices(part)])
        return np.stack([boxes[:, 0].min(0), boxes[:, 1].max(0)])

    def part_box(self, part: str | Sequence[str], margin: float = 0.01) -> tuple[Array, Array]:
        """(center [3], size [3]) of a box around a part or parts, `margin` larger on every side."""
        low, high = self.part_bounds(part)
        return (low + high) / 2, high - low + 2 * margin

    def move(
        self,
        part: str | Sequence[str],
        *,
        translate: ArrayLike = (0, 0, 0),
        rotate: ArrayLike = (0, 0, 0),
        scale: ArrayLike = 1.0,
        pivot: ArrayLike | None = None,
    ) -> ProceduralScene:
        """Scene whose part (or parts, together) went p -> pivot + translate + R S (p - pivot).

        rotate in radians, intrinsic XYZ; scale a number or one per world axis; pivot defaults to the center
        of part_bounds, where a cage around the part has its center. Raises SceneError for unknown parts and
        for scales that are not positive.
        """
        moved = self._motion(part, translate, rotate, scale, pivot)
        chosen = self._indices(part)
        return self._with(
            replace(p, motion=moved @ p.motion) if i in chosen else p for i, p in enumerate(self.parts)
        )

    def deform(self, part: str | Sequence[str], deformation: Deformation) -> ProceduralScene:
        """Scene whose part or parts are bent, twisted or pulled by a deformation of world space.

        Raises SceneError for unknown parts, for those that were moved or deformed before, and for those that
        reach past a bend's center.
        """
        chosen = self._indices(part)
        return self._with(deform_part(p, deformation) if i in chosen else p for i, p in enumerate(self.parts))

    def remove(self, part: str | Sequence[str]) -> ProceduralScene:
        """Scene without a part or parts. Raises SceneError for unknown parts and when none would be left."""
        chosen = self._indices(part)
        if len(chosen) == len(self.parts):
            raise SceneError(f"scene {self.name} must keep at least one part")
        return self._with(p for i, p in enumerate(self.parts) if i not in chosen)

    def duplicate(
        self,
        part: str | Sequence[str],
        *,
        translate: ArrayLike = (0, 0, 0),
        rotate: ArrayLike = (0, 0, 0),
        scale: ArrayLike = 1.0,
        pivot: ArrayLike | None = None,
        suffix: str = " copy",
    ) -> ProceduralScene:
        """Scene with a moved copy of a part or parts, named with the suffix; arguments as for `move`."""
        moved = self._motion(part, translate, rotate, scale, pivot)
        copies = [
            replace(self.parts[i], name=self.parts[i].name + suffix, motion=moved @ self.parts[i].motion)
            for i in self._indices(part)
        ]
        return self._with((*self.parts, *copies))

    def with_parts(self, parts: Sequence[Part]) -> ProceduralScene:
        """Scene of other parts alone, in the light of this scene, whose shadows and occlusion stay as
        modeled.
        """
        return self._with(parts)

    def with_light(self, light: Light) -> ProceduralScene:
        """Scene in another light."""
        scene = self._share_light(replace(self))
        scene.__dict__["light"] = light
        return scene

    def with_modeled_light(self) -> ProceduralScene:
        """Scene with `relit` False: moved parts keep the colors they had as modeled."""
        return self._share_light(replace(self, relit=False))

    def with_new_occlusion(self) -> ProceduralScene:
        """Scene as if modeled with its parts in their present place, which determine the ambient occlusion.

        The shadows in a room follow, too. Surfaces that no part approached or left look as before.
        """
        parts = tuple(part.with_baked_motion() for part in self.parts)
        scene = replace(self, parts=parts, modeled=parts)
        scene.__dict__["occlusion"] = scene._occlusion(aligned_with=self.occlusion)
        return scene

    def photograph(
        self, camera: Camera, *, supersample: int = 2, background: Background = "none"
    ) -> RenderResult:
        """Image of the surfaces, as `supersampling.photograph` renders it."""
        return photograph(self.shoot, camera, supersample=supersample, background=background)

    def shoot(
        self, origin: Array, directions: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], Hits]:
        """(rgb [N,3], normals [N,3], hits) of rays from one origin [3] with unit directions [3,N]."""
        hits = trace(self.placed, origin, directions)
        rgb, normals = self.colors(hits, points_along_rays(origin, directions, hits.t), directions)
        for index, item in enumerate(self.placed):
            if item.primitive.mirror:
                self._reflect(index, hits, origin, directions, rgb, normals)
        return rgb, normals, hits

    def colors(
        self, hits: Hits, points: Float32, viewdirs: Float32, placed: Sequence[PlacedPrimitive] | None = None
    ) -> tuple[Float32, Float32]:
        """(rgb [N,3], normals [N,3]) of hits at points [3,N] seen in directions [3,N], 0 where no surface was
        hit.

        The hits are of `placed`, all primitives where it is left out. Nothing is reflected.
        """
        rgb, normals = np.zeros((2, len(hits.t), 3), np.float32)
        for index, item in enumerate(self.placed if placed is None else placed):
            rows = np.flatnonzero(hits.primitive == index)
            if len(rows):
                rgb[rows], normals[rows] = shade_surface(
                    item,
                    points[:, rows],
                    hits.instance[rows],
                    viewdirs[:, rows],
                    openness=self.occlusion,
                    relit=self.relit,
                    light=self.light,
                )
        return rgb, normals

    def _reflect(
        self,
        index: int,
        hits: Hits,
        origin: Array,
        directions: NDArray[np.float32],
        rgb: NDArray[np.float32],
        normals: NDArray[np.float32],
    ) -> None:
        """Add to `rgb` [N,3] the single reflection in the top face of a polished primitive.

        The face is a plane, so that the reflected rays all come from the camera's mirror image. The share of
        the reflection is F = m + (1 - m) (1 - cos)^5, m the primitive's `mirror`. Source: Schlick, "An
        inexpensive BRDF model for physically-based rendering" (1994), equation 15.
        """
        item = self.placed[index]
        up = item.linear[0, :, 2].astype(np.float64)
        up /= np.linalg.norm(up)
        rows = np.flatnonzero(hits.primitive == index)
        rows = rows[normals[rows] @ up > 0.9999]
        if not len(rows):
            return
        top = item.shift[0] + item.linear[0, :, 2] * item.extent[2]
        image = origin - 2 * ((origin - top) @ up) * up
        cosine = up.astype(np.float32) @ directions[:, rows]
        mirrored = directions[:, rows] - 2 * cosine * up.astype(np.float32)[:, None]
        other_primitives = self.placed[:index] + self.placed[index + 1 :]
        hits_behind = trace(other_primitives, image, mirrored, hits.t[rows])
        reflected, _ = self.colors(
            hits_behind, points_along_rays(image, mirrored, hits_behind.t), mirrored, other_primitives
        )
        base = np.float32(item.primitive.mirror)
        share = (base + (1 - base) * (1 - np.abs(cosine)) ** 5)[:, None]
        rgb[rows] = rgb[rows] * (1 - share) + share * reflected

    def field(self, eps: float = 0.004) -> SurfaceField:
        """Radiance field of the scene whose surfaces are about `eps` (world units) soft."""
        if not 0 < eps < np.inf:
            raise SceneError(f"eps must be positive, not {eps}")
        reach = SHELL_EXTENT_EPS * eps
        low, high = self.bounds
        bounds = np.stack([low - reach, high + reach])
        return SurfaceField(self.placed, self.occlusion, self.relit, eps, bounds, self.light)

    def _indices(self, part: str | Sequence[str]) -> tuple[int, ...]:
        names = (part,) if isinstance(part, str) else tuple(part)
        unknown = [name for name in names if name not in self.part_names]
        if unknown or not names:
            raise SceneError(
                f"scene {self.name} has no part {', '.join(map(repr, unknown)) or '()'}; "
                f"its parts are {', '.join(self.part_names)}"
            )
        return tuple(self.part_names.index(name) for name in names)

    def _motion(
        self, part: str | Sequence[str], translate: Any, rotate: Any, scale: Any, pivot: Any
    ) -> Array:
        factors = np.asarray(scale, np.float64)
        if factors.shape not in ((), (3,)) or not (np.isfinite(factors).all() and (factors > 0).all()):
            raise SceneError(f"scale must be positive, one number or three, not {scale!r}")
        center = self.part_bounds(part).mean(0) if pivot is None else pivot
        return affine_matrix(translate, rotate, factors, center)

    def _with(self, parts: Iterable[Part]) -> ProceduralScene:
        return self._share_light(replace(self, parts=tuple(parts)))

    def _share_light(self, scene: ProceduralScene) -> ProceduralScene:
        """Scene of the same modeled parts, which gets this scene's occlusion and light."""
        scene.__dict__["occlusion"], scene.__dict__["light"] = self.occlusion, self.light
        return scene

    @cached_property
    def placed(self) -> tuple[PlacedPrimitive, ...]:
        """All primitives in their present place."""
        return tuple(
            PlacedPrimitive.build(part, primitive) for part in self.parts for primitive in part.primitives
        )

    @cached_property
    def occlusion(self) -> Occlusion:
        """Baked occlusion of the scene as modeled (computed on first use)."""
        return self._occlusion()

    def _occlusion(self, aligned_with: Occlusion | None = None) -> Occlusion:
        if self.room is None:
            return Occlusion(self.modeled, aligned_with=aligned_with)
        parts = self.room.furniture(self.modeled)
        return Occlusion(parts, self.room, self.room.detail, aligned_with=aligned_with)

    @cached_property
    def light(self) -> Light:
        """Light that falls on the scene as modeled."""
        return shade if self.room is None else RoomLight(self.room, self.occlusion)
