"""The photos that a subcommand takes, with poses found first where they have none."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from cagefield.cli.poses import posed, unfolded

if TYPE_CHECKING:
    from cagefield.datasets import Dataset


@dataclass(frozen=True)
class PhotoOptions:
    """Which photos are used."""

    data: tyro.conf.Positional[Path]
    """Folder of a data set, or its transforms.json, poses_bounds.npy or COLMAP model; for training also a
    folder of photos alone or a video, whose poses are then found first."""
    downscale: int | None = None
    """Shrink the photos by this factor; left out, until their longer side is 800 pixels or less."""
    holdout: int = 8
    """Keep every so-many-th photo for testing where the data set has no test views; 0 keeps none."""
    masks: Path | None = None
    """Folder of masks, NAME.png for the photo NAME: black pixels are excluded from features, training and
    figures; left out, the masks that the data set has."""

    def load(self, posed_in: Path | None = None, keep_poses: bool = True) -> Dataset:
        """The data set; photos without poses get them first, in the folder `posed_in` where it is given.

        So do those whose poses are folded, unless `keep_poses`.
        """
        from cagefield.datasets import load_dataset

        data = self.data if posed_in is None else posed(self.data, posed_in, self.masks)
        masks = self.masks if data.expanduser() == self.data.expanduser() else None
        dataset = load_dataset(data, downscale=self.downscale, holdout=self.holdout, masks=masks)
        if posed_in is None or keep_poses or data != self.data.expanduser():
            return dataset
        return unfolded(dataset, posed_in, self.downscale)


Photos = tyro.conf.OmitArgPrefixes[PhotoOptions]
