"""`cagefield align`: meters per unit and the up direction of a scene, and pastes aligned with it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from cagefield.cli.options import Device, Flag
from cagefield.errors import CagefieldError

if TYPE_CHECKING:
    from cagefield.scene.alignment import Alignment
    from cagefield.scene.scene import Scene
    from cagefield.typing import Array

FLOOR = "floor"
"""Word of --up for the dominant plane of the scene's surfaces."""


@dataclass(frozen=True)
class Align:
    """Set the scale of a scene in meters, and its up direction; exports and pages honor both.

    Field, cameras and edits keep their coordinates. Without an option the present alignment is printed. With
    --paste an edit that pastes another scene is aligned with this one instead.
    """

    scene: tyro.conf.Positional[Path]
    """Scene folder."""
    distance: Annotated[tuple[str, str, float] | None, tyro.conf.arg(metavar="X,Y,Z X,Y,Z METERS")] = None
    """Two points of the scene, and how many meters lie between them."""
    meters_per_unit: float | None = None
    """The scale itself, in place of --distance."""
    up: Annotated[tuple[str, ...] | None, tyro.conf.arg(metavar="floor|X,Y,Z...")] = None
    """floor: the normal of the largest plane of the scene's surfaces. One direction, or three points of a
    plane that is level."""
    reset: Flag = False
    """Remove scale and up direction."""
    paste: str | None = None
    """Name of an edit that pastes: its operations are replaced by those that align it."""
    pairs: Annotated[tuple[str, ...], tyro.conf.arg(metavar="X,Y,Z...")] = ()
    """Pairs of points for --paste, three at least: each a point of the other scene, then that of this scene
    where it belongs."""
    refine: Flag = False
    """Bring the surfaces of both scenes nearer after the pairs (iterative closest points)."""
    keep_scale: Flag = False
    """Leave the scale that the pairs give."""
    match_colors: Flag = False
    """Match exposure and white balance of the paste to this scene's where they come side by side."""
    device: Device = "auto"

    def run(self) -> None:
        """Check the options, write the scene's manifest or edits, print the alignment."""
        if self.paste is not None:
            return self._align_paste(self.paste)
        if self.pairs or self.refine or self.keep_scale or self.match_colors:
            raise CagefieldError(
                "--pairs, --refine, --keep-scale and --match-colors are for --paste; give its edit's name"
            )
        from cagefield.scene.alignment import Alignment, meters_per_unit
        from cagefield.scene.scene import Scene

        if self.distance is not None and self.meters_per_unit is not None:
            raise CagefieldError("--distance and --meters-per-unit both give the scale; leave one out")
        changes = (self.distance, self.meters_per_unit, self.up) != (None, None, None)
        if self.reset and changes:
            raise CagefieldError("--reset removes the alignment; leave out the other options")
        scene = Scene.open(self.scene, whole=True)
        alignment = Alignment() if self.reset else scene.alignment
        scale = self.meters_per_unit
        if self.distance is not None:
            first, second, meters = self.distance
            scale = meters_per_unit(_numbers(first), _numbers(second), meters)
        if scale is not None:
            alignment = dataclasses.replace(alignment, meters_per_unit=scale)
        if self.up is not None:
            alignment = dataclasses.replace(alignment, up=self._direction(scene))
        if changes or self.reset:
            dataclasses.replace(scene, alignment=alignment).save_manifest(self.scene)
        print("\n".join(describe_alignment(alignment, scene)))

    def _align_paste(self, name: str) -> None:
        """Align a paste, write the scene's edits, and print how well it fits."""
        from cagefield.edits import EditStack, Paste
        from cagefield.scene.paste_alignment import align_paste
        from cagefield.scene.scene import Scene

        if self.reset or (self.distance, self.meters_per_unit, self.up) != (None, None, None):
            raise CagefieldError("--paste aligns an edit; set scale and up direction by themselves")
        if len(self.pairs) < 6 or len(self.pairs) % 2:
            raise CagefieldError(
                f"--pairs has {len(self.pairs)} points; give three pairs or more, each a point of the other "
                "scene and the point of this scene where it belongs"
            )
        scene = Scene.open(self.scene, whole=True)
        found = [edit for edit in scene.edits if edit.name == name]
        if len(found) != 1 or not isinstance(found[0], Paste):
            names = ", ".join(f'"{edit.name}"' for edit in scene.edits if isinstance(edit, Paste))
            raise CagefieldError(f'"{name}" is no paste of this scene; its pastes are: {names or "none"}')
        points = [_numbers(text) for text in self.pairs]
        aligned = align_paste(
            scene,
            found[0],
            points[::2],
            points[1::2],
            refine=self.refine,
            keep_scale=self.keep_scale,
            match_colors=self.match_colors,
        )
        stack = EditStack([aligned.edit if edit is found[0] else edit for edit in scene.edits])
        stack.check()
        scene.with_edits(stack).save(self.scene, overwrite=True)
        print(f"pairs       {aligned.residual:.4g} apart (root mean square, units of the scene)")
        if (fit := aligned.refinement) is not None:
            print(f"surfaces    {fit.distance:.4g} apart (median), {fit.distance_before:.4g} before")
        if self.match_colors:
            grade = aligned.edit.grading
            print(
                f"colors      exposure {grade.exposure:+.3f} stops, temperature {grade.temperature:+.3f}, "
                f"tint {grade.tint:+.3f}"
            )
        for operation in aligned.edit.operations:
            print(f"{operation.noun:<12}{operation}")

    def _direction(self, scene: Scene) -> Array:
        """The up direction [3] of --up."""
        import numpy as np

        from cagefield.compute import devices
        from cagefield.scene.alignment import dominant_plane, up_from_points

        texts = self.up or ()
        if texts == (FLOOR,):
            devices.start(self.device)
            surface = scene.patcher.visible_surfels
            plane = dominant_plane(surface.points, surface.normals, scene.up, scene.field.sample_spacing)
            if plane is None:
                raise CagefieldError(
                    "no plane is nearly level in this scene; give --up three points of one that is level"
                )
            tilt = np.degrees(np.arccos(np.clip(plane.normal @ scene.up, -1.0, 1.0)))
            print(f"floor       {plane.share:.0%} of the surfaces, tilted by {tilt:.1f}° from up so far")
            return plane.normal
        points = [_numbers(text) for text in texts]
        if len(points) == 1:
            return np.array(points[0])
        if len(points) == 3:
            return up_from_points(points, scene.up)
        raise CagefieldError(f"--up has {len(points)} points; give floor, one direction, or three points")


def describe_alignment(alignment: Alignment, scene: Scene) -> list[str]:
    """Lines of a report about an alignment of a scene."""
    scale, up = alignment.meters_per_unit, alignment.up
    size = scene.field.bounds[1] - scene.field.bounds[0]
    lines = []
    if scale is not None:
        extent = " x ".join(f"{edge * scale:.3g}" for edge in size)
        lines.append(f"scale       {scale:.6g} m per unit; the box is {extent} m")
    if up is not None:
        lines.append("up          (" + ", ".join(f"{value:.6g}" for value in up) + ")")
    return lines or ["alignment   none; up is that of the cameras, units are the capture's"]


def _numbers(text: str) -> tuple[float, ...]:
    """Three numbers X,Y,Z."""
    try:
        values = tuple(float(part) for part in text.replace(" ", "").split(","))
    except ValueError:
        values = ()
    if len(values) != 3:
        raise CagefieldError(f'"{text}" is no point; give three numbers with commas, such as 0,0.5,-1')
    return values
