"""SplatSet: splats with their provenance, the scene's own and those that edits paste from other scenes.

Edits of splats are evaluated on one SplatField: the scene's own splats first, then those of each paste, in
the other scene's space. The latter are not shown where they are, but where their paste takes them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import EditMap, Paste, PreparedEdit
from cagefield.fields.splat_field import SplatField
from cagefield.typing import Float32, Mask

MAX_JOINED_SETS = 3
"""Sets with pasted splats that a scene's set keeps, those used last."""


@dataclass(frozen=True, eq=False)
class SplatSet:
    """N splats in canonical space, each that of its own scene.

    Sets are compared by identity: results of edits are cached for a living set. A scene's set also keeps the
    latest sets `with_pastes`, so that equal pastes give the same object.

    Attributes:
        field: the splats.
        scene: the scene's field, whose rows come first in `field`; the set's own field where splats stand for
            others (`inherit_origins`).
        origins: [N] int32, indices into `parts`; -1 for the scene's own splats.
        parts: the fields of pasted splats.
    """

    field: SplatField
    scene: SplatField
    origins: NDArray[np.int32]
    parts: tuple[SplatField, ...] = ()
    _joined: list[SplatSet] = dataclasses.field(default_factory=list, init=False, repr=False)

    @classmethod
    def from_field(cls, splats: SplatField | SplatSet) -> SplatSet:
        """Set of a scene's field, all splats its own; a set itself."""
        if isinstance(splats, SplatSet):
            return splats
        return cls(splats, splats, np.full(len(splats), -1, np.int32))

    @classmethod
    def concatenate(cls, sets: Sequence[SplatSet]) -> SplatSet:
        """Set of the splats of several sets with equal `parts`, one after the other."""
        field = _concatenate([each.field for each in sets])
        return cls(field, field, np.concatenate([each.origins for each in sets]), sets[0].parts)

    def __len__(self) -> int:
        return len(self.field)

    @property
    def is_pasted(self) -> Mask:
        """[N], True where a splat is pasted: it is not shown at its own place."""
        return self.origins >= 0

    def with_pastes(self, edits: EditMap) -> SplatSet:
        """Set with the splats that active edits paste behind its own; itself without pastes, or with them
        joined.

        Harmonics get the highest degree of all. Pastes without their content are left out.
        """
        pasted = (step.pasted.splats for step in edits.steps if step.pasted is not None)
        parts = tuple(dict.fromkeys(part for part in pasted if part is not None))
        if self.parts or not parts:
            return self
        found = next((each for each in self._joined if each.parts == parts), None)
        if found is None:
            counts = [len(self), *(len(part) for part in parts)]
            origins = np.repeat(np.arange(-1, len(parts), dtype=np.int32), counts)
            found = SplatSet(_concatenate([self.field, *parts]), self.scene, origins, parts)
        self._joined[:] = [found, *(each for each in self._joined if each is not found)][:MAX_JOINED_SETS]
        return found

    def pasted_rows(self, step: PreparedEdit) -> NDArray[np.int64]:
        """Rows [K] of the splats that an edit pastes; none for an edit that does not.

        Raises EditError for a paste without its content.
        """
        if not isinstance(step.edit, Paste):
            return np.zeros(0, np.int64)
        for number, part in enumerate(self.parts):
            if step.pasted is not None and part is step.pasted.splats:
                return np.flatnonzero(self.origins == number)
        raise step.edit.unread()

    def inherit_origins(self, field: SplatField, rows: NDArray[Any]) -> SplatSet:
        """Set of a field whose splats stand for rows [M], or those True in a mask [N], of this one."""
        return SplatSet(field, field, self.origins[rows], self.parts)

    def take(self, rows: NDArray[Any]) -> SplatSet:
        """Set of the splats of the given rows or mask."""
        return self.inherit_origins(self.field.take(rows), rows)


def _concatenate(fields: Sequence[SplatField]) -> SplatField:
    """Field of the splats of several fields; other attributes are those of the first one."""
    means, log_scales, quaternions, opacities = (
        _read_only(np.concatenate([getattr(part, name) for part in fields]))
        for name in ("means", "log_scales", "quaternions", "opacities")
    )
    sh = np.zeros((len(means), max(part.sh.shape[1] for part in fields), 3), np.float32)
    first = 0
    for part in fields:
        sh[first : first + len(part), : part.sh.shape[1]] = part.sh
        first += len(part)
    return dataclasses.replace(
        fields[0],
        means=means,
        log_scales=log_scales,
        quaternions=quaternions,
        opacities=opacities,
        sh=_read_only(sh),
    )


def _read_only(values: NDArray[np.float32]) -> Float32:
    values.setflags(write=False)
    return values
