"""Edits on splats done more simply than `SplatRenderer` does them, for comparison.

Notation as in `cagefield.rendering.splats.raster_splats`: an edit takes a splat's mean along, its covariance
C
to J C J^T, and its harmonics through R, J = R S. All ways here move, copy, hide and delete by the means, and
keep opacity; none splits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from benchmarks.common.figures import stacked, supersampled
from cagefield.cameras.camera import Camera
from cagefield.edits import EditStack
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.rendering.splats.raster_splats import DeformedSplats, Places, deformed_splats
from cagefield.rendering.splats.splat_motion import moved_splats
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.scene.scene import Scene
from cagefield.typing import AnyArray, Float32

NAIVE = ("means only", "no turned SH", "not split")
"""Means alone; means and covariances, colors unturned; everything but splitting."""


def naive_splats(field: SplatField, edits: EditStack) -> Iterator[tuple[str, DeformedSplats]]:
    """The splats that each of the `NAIVE` ways makes of a field, by their names, in that order.

    Raises EditError for an edit that cannot be evaluated.
    """
    whole = deformed_splats(field, edits)
    unturned = replace(whole, rotations=None)
    own = Places(moved_splats(field, edits)).put(DeformedSplats.of_field(field).covariances, None)
    yield from zip(NAIVE, (replace(unturned, covariances=own), unturned, whole), strict=True)


def seen_naively(scene: Scene, cameras: Sequence[Camera], rays: int = 1) -> Iterator[tuple[str, AnyArray]]:
    """Pictures [V,H,W,3] over white of a scene of splats under its edits, by each of the `NAIVE` ways.

    Each pixel is the mean of rays x rays.

    Raises EditError for an edit that cannot be evaluated.
    """
    field = scene.field
    if not isinstance(field, SplatField):
        raise CagefieldError(f"naive editing is that of splats, not of a {type(field).__name__}")
    for name, splats in naive_splats(field, scene.edits):
        renderer = SplatRenderer(field)
        renderer.splats = splats

        def draw(camera: Camera, renderer: SplatRenderer = renderer) -> Float32:
            return renderer.render(camera, background="white").rgb

        yield name, stacked([supersampled(draw, camera, rays) for camera in cameras])
