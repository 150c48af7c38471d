"""Reasons in words why photos were not registered, from their sharpness and their matches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.datasets.raw_photos import RawPhoto
from cagefield.datasets.sfm import features

MAX_BLURRED_SHARPNESS_SHARE = 0.3
"""Sharpness, over the photos' median, below which a photo is called blurred."""

MIN_REGISTRATION_MATCHES = 30


@dataclass(frozen=True)
class Matches:
    """Numbers of verified matches of pairs [N,N], and mask [N,N] of the pairs without parallax."""

    counts: Any
    no_parallax: Any


def verified_matches(database: Path, count: int) -> Matches:
    """Match of `count` photos that COLMAP has verified."""
    pycolmap = features.import_pycolmap()
    counts = np.zeros((count, count), dtype=np.int64)
    no_parallax = np.zeros((count, count), dtype=bool)
    kinds = pycolmap.TwoViewGeometryConfiguration
    with features.open_database(database) as source:
        for pair, geometry in zip(*source.read_two_view_geometries(), strict=True):
            i, j = (number - 1 for number in pycolmap.pair_id_to_image_pair(pair))
            counts[i, j] = counts[j, i] = len(geometry.inlier_matches)
            no_parallax[i, j] = no_parallax[j, i] = geometry.config in (
                kinds.PANORAMIC,
                kinds.PLANAR_OR_PANORAMIC,
            )
    return Matches(counts, no_parallax)


def explain_unregistered(
    photos: Sequence[RawPhoto], placed: set[int], other_models: Sequence[Any], matches: Matches
) -> dict[str, str]:
    """Reason, by name, why each photo that is not in `placed` was not registered."""
    median = float(np.median([photo.sharpness for photo in photos]))
    other_model_sizes = {
        image_id - 1: model.num_reg_images()
        for model in reversed(other_models)
        for image_id in model.reg_image_ids()
    }
    reasons = {}
    registered = sorted(placed)
    for index, photo in enumerate(photos):
        if index in placed:
            continue
        counts = matches.counts[index, registered]
        most_matches = int(counts.max(initial=0))
        if photo.sharpness < MAX_BLURRED_SHARPNESS_SHARE * median:
            reason = f"blurred ({photo.sharpness / median:.0%} of the sharpness of the others)"
        elif index in other_model_sizes:
            reason = (
                f"not connected: one of {other_model_sizes[index]} photos that fit each other, not the rest"
            )
        elif most_matches < MIN_REGISTRATION_MATCHES:
            reason = f"too few matches (at most {most_matches} with a photo that found its place)"
        elif matches.no_parallax[index, registered][counts >= MIN_REGISTRATION_MATCHES].all():
            reason = "no parallax (taken from where another was taken)"
        else:
            reason = f"its {most_matches} matches fit no place"
        reasons[photo.name] = reason
    return reasons


def explain_no_model(photos: Sequence[RawPhoto], matches: Matches) -> str:
    """Reason why no photos at all fit together, and the cure."""
    enough_matches = matches.counts >= MIN_REGISTRATION_MATCHES
    if not enough_matches.any():
        most_matches = int(matches.counts.max(initial=0))
        return (
            f"no two of the {len(photos)} photos have enough in common (at most {most_matches} "
            f"matches); take them "
            "closer together, sharp, and of things with texture"
        )
    if matches.no_parallax[enough_matches].mean() > 0.5:
        return "the photos have no parallax: the camera only turned; walk around what you capture"
    return "the photos match, and fit no common place; take more, closer together, each from another place"
