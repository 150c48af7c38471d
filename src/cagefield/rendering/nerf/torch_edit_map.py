"""The map of an edit stack for tensors: the same kernel, on the device where the tensors are.

Kernels have no exact map of lattices, control points and meshes: stacks with one of these without a
`lattice` are evaluated by the float64 reference, sample by sample, on the CPU.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from cagefield.compute import devices
from cagefield.compute.block_cyclic import block_cyclic_schedule
from cagefield.compute.quadrants import take_tensors
from cagefield.edits import Continuous, Edit, EditMap
from cagefield.edits.device.kernels.device_stack import grade_samples
from cagefield.edits.device.kernels.edit_maps import EditArgs
from cagefield.edits.device_stack import DeviceStack
from cagefield.rendering.nerf.kernels.torch_edit_map import map_tensors

take_tensors(torch.Tensor)


class TensorMap:
    """An edit stack as a function of tensors.

    On a GPU the kernel reads and writes the tensors where they are. On the CPU it sees them as arrays of the
    same memory, which it takes faster; `as_tensors` hands it tensors there too.
    `is_reference`: by the float64 reference, see the module.
    """

    def __init__(
        self,
        edits: EditMap,
        device: torch.device,
        *,
        preserve_opacity: bool = True,
        as_tensors: bool = False,
    ) -> None:
        self.device = device
        self.preserve_opacity = preserve_opacity
        self.is_reference = any(_has_no_kernel(step.edit) for step in edits.steps)
        self._stack = edits
        self._is_graded = edits.is_graded
        self._layers = tuple(zip(edits.layers, edits.places, strict=True))
        if self.is_reference:
            return
        packed = DeviceStack.from_stack(edits)
        self._as_arrays = device.type == "cpu" and not as_tensors
        self.count, self.flows = packed.n_edits, packed.has_flows
        self._edits = EditArgs(self._argument(packed.params), self._argument(packed.lattice), packed.n_edits)

    def _argument(self, values: NDArray[np.float32]) -> Any:
        return values if self._as_arrays else torch.from_numpy(values.copy()).to(self.device)

    def __call__(self, points: Any, viewdirs: Any) -> tuple[Any, Any, Any]:
        """(canonical points [N,3], unit viewdirs [N,3], gain [N]) of deformed samples [N,3].

        Density is multiplied by the gain: 0 where a sample is emptied, else 1, or |J d| to preserve opacity.
        """
        return self._mapped(points, viewdirs, self.preserve_opacity)[:3]

    def evaluated(
        self, points: Any, viewdirs: Any, field: Callable[[Any, Any], tuple[Any, Any]]
    ) -> tuple[Any, Any]:
        """(sigma [N], rgb [N,3]) of a canonical field at deformed samples [N,3]; of layers in patches."""
        deformed = points
        points, viewdirs, gain, places = self._mapped(points, viewdirs, self.preserve_opacity)
        sigma, rgb = field(points, viewdirs)
        for layer, place in self._layers:
            rows = torch.nonzero(places == place)[:, 0]
            if len(rows):
                at, along = (values[rows].cpu().numpy() for values in (points, viewdirs))
                own = [torch.from_numpy(values).to(self.device) for values in layer(at, along)]
                sigma, rgb = sigma.index_copy(0, rows, own[0]), rgb.index_copy(0, rows, own[1])
        if self._is_graded:
            colors, density = self._grade(deformed)
            gain = gain * density
            rgb = torch.einsum("nij,nj->ni", colors, rgb).clamp(0.0, 1.0)
        return sigma * gain, rgb

    def _grade(self, points: Any) -> tuple[Any, Any]:
        """(matrices [N,3,3] of rgb, factors [N] of density) at deformed points [N,3]."""
        if self.is_reference:
            grade = self._stack.to_canonical(points.detach().cpu().numpy().astype(np.float64)).grade
            assert grade is not None
            return tuple(
                torch.from_numpy(values.astype(np.float32)).to(self.device)
                for values in (grade.colors, grade.density)
            )
        devices.start()
        samples = points.contiguous()
        out = torch.empty((len(samples), 10), dtype=torch.float32, device=self.device)
        if len(samples):
            table, result = [values.numpy() if self._as_arrays else values for values in (samples, out)]
            grade_samples(table, block_cyclic_schedule(len(samples)), result, self._edits, self.flows)
        return out[:, :9].reshape(-1, 3, 3), out[:, 9]

    def jacobian(self, points: Any) -> Any:
        """The map's Jacobian [N,3,3] at deformed points [N,3]; 0 where a sample is emptied."""
        columns = []
        for axis in torch.eye(3, device=self.device):
            _, along, stretch, _ = self._mapped(points, axis.expand(points.shape), True)
            columns.append(along * stretch[:, None])
        return torch.stack(columns, dim=2)

    def _mapped(self, points: Any, viewdirs: Any, preserve_opacity: bool) -> tuple[Any, Any, Any, Any]:
        """Results of the call, and x offsets [N] of the layers that samples read (`fields.voxel_layers`)."""
        if self.is_reference:
            return self._by_reference(points, viewdirs, preserve_opacity)
        devices.start()
        samples = torch.cat([points, viewdirs], dim=1).contiguous()
        out = torch.empty((len(samples), 8), dtype=torch.float32, device=self.device)
        if len(samples):
            table, result = [values.numpy() if self._as_arrays else values for values in (samples, out)]
            map_tensors(
                table, block_cyclic_schedule(len(samples)), result, self._edits, self.flows, preserve_opacity
            )
        return out[:, :3], out[:, 3:6], out[:, 6], out[:, 7]

    def _by_reference(self, points: Any, viewdirs: Any, preserve_opacity: bool) -> tuple[Any, Any, Any, Any]:
        """Results of `_mapped`, by the float64 reference."""
        p, d = (values.detach().cpu().numpy().astype(np.float64) for values in (points, viewdirs))
        mapped = self._stack.to_canonical(p, d)
        assert mapped.viewdirs is not None and mapped.stretch is not None
        gain = np.where(mapped.emptied, 0.0, mapped.stretch if preserve_opacity else 1.0)
        places = mapped.layer.astype(np.float32)
        for number, (_, place) in enumerate(self._layers, start=1):
            places[mapped.layer == number] = place
        columns = (mapped.points, mapped.viewdirs, gain, places)
        found = [torch.from_numpy(values.astype(np.float32)).to(self.device) for values in columns]
        return found[0], found[1], found[2], found[3]


def _has_no_kernel(edit: Edit) -> bool:
    """True of an edit that is to be exact, while kernels take a lattice of nodes for it."""
    return isinstance(edit, Continuous) and edit.lattice is None and edit.kernel_lattice is not None
