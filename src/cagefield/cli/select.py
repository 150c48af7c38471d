"""`cagefield select`: elements of a scene's field by criteria, a cage around them, the scene without them."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
import tyro

from cagefield.cli.options import Flag, OptionalOutput
from cagefield.errors import CagefieldError

if TYPE_CHECKING:
    from cagefield.scene.scene import Scene
    from cagefield.selection import Elements
    from cagefield.selection.element_positions import DeformedPositions
    from cagefield.typing import Mask

Range = tuple[float, float]


@dataclass(frozen=True)
class Select:
    """Select splats, or cells of voxels, that meet every criterion given; then grow, shrink, invert."""

    scene: tyro.conf.Positional[Path]
    """Scene folder."""
    flood: tuple[float, float, float] | None = None
    """Connected to the element nearest to X Y Z, world units, as the scene's edits show it."""
    flood_opacity: float = 0.3
    """Opacity from which on a flood goes through a cell."""
    flood_reach: float | None = None
    """Bound of a flood's distance from its point, world units."""
    floaters: float | None = None
    """Probable floaters, of a strength from 0 to 1."""
    size: Range | None = None
    """Splats whose largest standard deviation is between LOW and HIGH, world units."""
    opacity: Range | None = None
    """Opacity between LOW and HIGH, of [0, 1]."""
    red: Range | None = None
    """Red between LOW and HIGH, of [0, 1]; so are the other colors."""
    green: Range | None = None
    blue: Range | None = None
    hue: Range | None = None
    saturation: Range | None = None
    value: Range | None = None
    grow: int = 0
    """Cells by which the selection grows."""
    shrink: int = 0
    """Cells by which it then shrinks."""
    invert: Flag = False
    """Select all others instead."""
    to_cage: Path | None = None
    """Write an edit file with a continuous edit whose inner cage is around the selection."""
    cage: Literal["box", "lattice", "mesh"] = "box"
    """Shape of the cage of --to-cage: the least box, that box with a lattice of control points, or a closed
    mesh around the selection."""
    faces: int = 240
    """Triangles of a mesh cage, at most."""
    margin: float | None = None
    """Distance from the selection to the cage, world units; left out, the edge of a cell."""
    remove: Flag = False
    """Delete the selected elements: the field stays whole, and a file beside it names them."""
    restore: Flag = False
    """Bring all deleted elements back; takes no criteria."""
    out: OptionalOutput = None
    """New scene folder, for --remove and --restore; left out, the scene itself is changed, which needs
    --overwrite."""
    overwrite: Flag = False
    """Replace the scene or the edit file that is there."""

    def run(self) -> None:
        """Prints the number of selected elements, and writes the cage or the scene."""
        from cagefield.edits import EditStack
        from cagefield.scene.scene import Scene
        from cagefield.scene.scene_files import check_destination
        from cagefield.selection.element_positions import deformed_positions
        from cagefield.selection.field_elements import elements_of_field

        changes = self.remove or self.restore
        if self.out is not None and not changes:
            raise CagefieldError("-o is for the scene of --remove or --restore; give one of them")
        if changes and self.out is None and not self.overwrite:
            raise CagefieldError(
                f"without -o the scene {self.scene} itself would change; give -o NEW_SCENE, or --overwrite"
            )
        if self.restore:
            self._write_restored(self.out or self.scene)
            return
        if self.to_cage is not None and self.to_cage.exists() and not self.overwrite:
            raise CagefieldError(f"{self.to_cage} exists already; give another name, or --overwrite")
        if changes:
            check_destination(self.out or self.scene, self.overwrite)
        scene = Scene.open(self.scene)
        elements = elements_of_field(scene.field)
        edits = EditStack(scene.patcher.with_detours(scene.edits.resolved))
        seen = deformed_positions(elements.positions, edits)
        mask = self._selected(elements, seen)
        noun = "splats" if elements.kind == "splats" else "cells"
        print(f"{np.count_nonzero(mask)} of {len(mask)} {noun} selected")
        if self.to_cage is not None:
            self._write_cage(elements, seen, mask, self.to_cage)
        if self.remove:
            self._write_rest(scene, elements, mask, self.out or self.scene)

    def _selected(self, elements: Elements, seen: DeformedPositions) -> Mask:
        from cagefield.selection.elements import ATTRIBUTES
        from cagefield.selection.floater_preset import floaters
        from cagefield.selection.neighborhoods import flood, grow, shrink

        if min(self.grow, self.shrink) < 0:
            raise CagefieldError("--grow and --shrink are numbers of cells, 0 or more")
        ranges = {name: getattr(self, name) for name in ATTRIBUTES if getattr(self, name) is not None}
        if self.flood is None and self.floaters is None and not ranges:
            raise CagefieldError(
                "nothing says which elements: give --flood X Y Z, --floaters STRENGTH, or a range such as "
                "--opacity 0 0.1"
            )
        mask = np.ones(len(elements), bool)
        if self.flood is not None:
            if not len(seen.points):
                raise CagefieldError("the scene has nothing to flood: all of it is transparent or deleted")
            nearest = np.argmin(((seen.points - np.array(self.flood)) ** 2).sum(axis=1))
            seed = int(seen.element[nearest])
            mask &= flood(elements, seed, self.flood_opacity, self.flood_reach)
        if self.floaters is not None:
            mask &= floaters(elements, self.floaters)
        for name, (low, high) in ranges.items():
            mask &= elements.in_range(name, low, high)
        mask = grow(elements, mask, self.grow) if self.grow else mask
        mask = shrink(elements, mask, self.shrink) if self.shrink else mask
        return ~mask if self.invert else mask

    def _write_cage(self, elements: Elements, seen: DeformedPositions, mask: Mask, path: Path) -> None:
        from cagefield.edits import Edit, EditStack, save_edits
        from cagefield.selection.selection_cages import cage_around, outer_cage_of_shape

        seen = seen.take(mask[seen.element])
        margin = elements.cell_edge if self.margin is None else self.margin
        radii = elements.radii[seen.element]
        inner = cage_around(self.cage, seen.points, margin, radii, faces=self.faces)
        edit = Edit.continuous(inner, outer_cage_of_shape(inner), name="selection")
        save_edits(EditStack([edit]), path)
        print(f"cage written to {path}; apply it after the scene's edits with `cagefield edit --append`")

    def _write_rest(self, scene: Scene, elements: Elements, mask: Mask, out: Path) -> None:
        from cagefield.scene.removed_elements import removed_also

        if scene.original is not None:
            raise CagefieldError(
                "the scene has the NeRF that its voxels were baked from, of which nothing can be removed; "
                "delete with a cage (--to-cage), or bake voxels alone"
            )
        if mask.all():
            raise CagefieldError("the selection is all of the field; leave something, or invert it")
        if not mask.any():
            print(f"nothing deleted, nothing written: the selection is empty, {out} stays as it is")
            return
        removal = removed_also(scene.removal, scene.field, elements, mask)
        dataclasses.replace(scene, removal=removal).save(out, self.overwrite)
        deleted = removal.selection
        print(f"scene with {deleted.count} of {deleted.total} deleted written to {out}")

    def _write_restored(self, out: Path) -> None:
        from cagefield.scene.scene import Scene
        from cagefield.scene.scene_files import check_destination

        if self.remove or self.to_cage is not None:
            raise CagefieldError("--restore goes alone: it brings all deleted elements back")
        check_destination(out, self.overwrite)
        scene = Scene.open(self.scene)
        if scene.removal is None:
            raise CagefieldError(f"nothing is deleted from {self.scene}; there is nothing to restore")
        dataclasses.replace(scene, field=scene.removal.field, removal=None).save(out, self.overwrite)
        print(f"scene with all {scene.removal.selection.total} written to {out}")
