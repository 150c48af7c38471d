"""`cagefield align`: meters per unit and the up direction of a scene, which exports honor."""

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

    Field, cameras and edits keep their coordinates. Without an option the present alignment is printed.
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
    device: Device = "auto"

    def run(self) -> None:
        """Check the options, write the scene's manifest, print the alignment."""
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
