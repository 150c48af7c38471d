"""What the rendering process does with each kind of task."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cagefield.server.studio import Studio
from cagefield.server.tasks import Answered, FitTask, PictureTask, Result, SurfaceTask, Task

Abandoned = Callable[[int], bool]


class Working:
    """Does tasks, one after the other, on one studio."""

    def __init__(self, studio: Studio) -> None:
        self._studio = studio

    def do(self, task: Task, abandoned: Abandoned) -> Result:
        """The task's result. Raises CagefieldError where it cannot be done."""
        if isinstance(task, PictureTask):
            return self._studio.picture(task, lambda: abandoned(task.generation))
        if isinstance(task, SurfaceTask):
            return Answered(task.number, self._surface(task))
        if isinstance(task, FitTask):
            return Answered(task.number, self._fit(task))
        raise NotImplementedError(type(task).__name__)

    def close(self) -> None:
        """Drops what is half done."""

    def _surface(self, task: SurfaceTask) -> tuple[list[float], list[float]] | None:
        """(point, normal) of the surface at a pixel; None where the picture is half empty."""
        camera = task.camera
        x = min(int(task.x * camera.width), camera.width - 1)
        y = min(int(task.y * camera.height), camera.height - 1)
        renderer = self._studio.renderer(task.shown, exact=False)
        frame = renderer.render(camera, normals=True, region=(x, y, 1, 1))
        if frame is None or frame.normals is None or frame.opacity[0, 0] < 0.5:
            return None
        origins, directions = camera.rays(np.array([[x, y]]))
        point = origins[0] + float(frame.depth[0, 0]) * directions[0]
        return point.tolist(), frame.normals[0, 0].tolist()

    def _fit(self, task: FitTask) -> list[bool]:
        """Which of the cage's `probes` are dense."""
        from cagefield.edits import EditStack
        from cagefield.server.placing import probes
        from cagefield.warps.device import DeviceStack

        points = probes(task.cage)
        stack = DeviceStack.from_stack(EditStack(self._studio.edits(task.shown.edits)))
        along = np.tile(np.array([1.0, 0.0, 0.0], np.float32), (len(points), 1))
        canonical, _, _, emptied = stack.to_canonical(points.astype(np.float32), along)
        field = self._studio.scene.field
        sigma, _ = field(canonical.astype(np.float64), along)
        dense = (np.asarray(sigma) * float(min(field.voxel_size)) > DENSE) & ~emptied
        return dense.tolist()


DENSE = 0.05
"""Optical depth of a voxel from which on it counts as dense."""
