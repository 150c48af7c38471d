"""Why photos found no place, in words: by their sharpness and their matches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.datasets.raw_photos import RawPhoto
from cagefield.datasets.sfm import features

BLURRED = 0.3
"""Share of the photos' median sharpness under which one is called blurred."""

FEW_MATCHES = 30


@dataclass(frozen=True)
class Matches:
    """Verified matches of pairs [N,N], and which of the pairs show no parallax [N,N]."""

    counts: Any
    no_parallax: Any


def verified_matches(database: Path, count: int) -> Matches:
    """The matches of `count` photos that COLMAP has verified."""
    pycolmap = features.engine()
    counts = np.zeros((count, count), dtype=np.int64)
    flat = np.zeros((count, count), dtype=bool)
    kinds = pycolmap.TwoViewGeometryConfiguration
    with features.opened(database) as source:
        for pair, geometry in zip(*source.read_two_view_geometries(), strict=True):
            i, j = (number - 1 for number in pycolmap.pair_id_to_image_pair(pair))
            counts[i, j] = counts[j, i] = len(geometry.inlier_matches)
            flat[i, j] = flat[j, i] = geometry.config in (kinds.PANORAMIC, kinds.PLANAR_OR_PANORAMIC)
    return Matches(counts, flat)


def reasons_left_out(
    photos: Sequence[RawPhoto], placed: set[int], others: Sequence[Any], matches: Matches
) -> dict[str, str]:
    """What was wrong with each photo that is not in `placed`."""
    median = float(np.median([photo.sharpness for photo in photos]))
    elsewhere = {
        image_id - 1: model.num_reg_images()
        for model in reversed(others)
        for image_id in model.reg_image_ids()
    }
    found = {}
    inside = sorted(placed)
    for index, photo in enumerate(photos):
        if index in placed:
            continue
        counts = matches.counts[index, inside]
        most = int(counts.max(initial=0))
        if photo.sharpness < BLURRED * median:
            reason = f"blurred ({photo.sharpness / median:.0%} of the sharpness of the others)"
        elif index in elsewhere:
            reason = f"not connected: one of {elsewhere[index]} photos that fit each other, not the rest"
        elif most < FEW_MATCHES:
            reason = f"too few matches (at most {most} with a photo that found its place)"
        elif matches.no_parallax[index, inside][counts >= FEW_MATCHES].all():
            reason = "no parallax (taken from where another was taken)"
        else:
            reason = f"its {most} matches fit no place"
        found[photo.name] = reason
    return found


def why_none(photos: Sequence[RawPhoto], matches: Matches) -> str:
    """Why no photos at all fit together, and the cure."""
    good = matches.counts >= FEW_MATCHES
    if not good.any():
        most = int(matches.counts.max(initial=0))
        return (
            f"no two of the {len(photos)} photos have enough in common (at most {most} matches); take them "
            "closer together, sharp, and of things with texture"
        )
    if matches.no_parallax[good].mean() > 0.5:
        return "the photos have no parallax: the camera only turned; walk around what you capture"
    return "the photos match, and fit no common place; take more, closer together, each from another place"
