"""The photos that a subcommand takes, with poses found first where they have none."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from cagefield.cli.poses import posed, verified

if TYPE_CHECKING:
    from cagefield.datasets import Dataset


@dataclass(frozen=True)
class PhotoOptions:
    """Which photos are used."""

    data: tyro.conf.Positional[Path]
    """Folder of a data set, or its transforms.json, poses_bounds.npy or COLMAP model; for training also a
    folder of photos alone or a video, whose poses are then found first."""
    downscale: int | None = None
    """Shrink the photos by this factor; left out, as their size, their number and the minutes of the
    training ask for."""
    holdout: int = 8
    """Keep every so-many-th photo for testing where the data set has no test views; 0 keeps none."""
    masks: Path | None = None
    """Folder of masks, NAME.png for the photo NAME: black pixels are excluded from features, training and
    figures; left out, the masks that the data set has."""

    def load(self, posed_in: Path | None = None, minutes: float | None = None) -> Dataset:
        """The data set; photos without poses get them first, in the folder `posed_in` where it is given.

        For a training of `minutes` the photos are shrunk as `shrink_to_training_resolution` says.
        """
        from cagefield.datasets import load_dataset
        from cagefield.datasets.training_resolution import shrink_to_training_resolution

        data = self.data if posed_in is None else posed(self.data, posed_in, self.masks)
        masks = self.masks if data.expanduser() == self.data.expanduser() else None
        dataset = load_dataset(data, downscale=self.downscale, holdout=self.holdout, masks=masks)
        if minutes is None or self.downscale is not None:
            return dataset
        return shrink_to_training_resolution(dataset, minutes)

    def verified(self, dataset: Dataset, keep_poses: bool) -> Dataset:
        """The loaded data set with its poses verified; lines on stderr say its photos' size and pose error.

        Wrong poses are corrected unless `keep_poses`, or where they were found by `load`.
        """
        from cagefield.datasets.dataset_loader import has_photos_alone
        from cagefield.datasets.training_resolution import describe_resolution

        print(describe_resolution(dataset), file=sys.stderr, flush=True)
        given = not has_photos_alone(self.data.expanduser())
        return verified(dataset, correct=given and not keep_poses, stream=sys.stderr).dataset


@dataclass(frozen=True)
class CaptureOptions(PhotoOptions):
    """Which photos are used, of one capture or of several."""

    more: tyro.conf.Positional[tuple[Path, ...]] = ()
    """More captures: each is trained into a scene of its own, one after another or on the cluster."""


Captures = tyro.conf.OmitArgPrefixes[CaptureOptions]
Photos = tyro.conf.OmitArgPrefixes[PhotoOptions]
