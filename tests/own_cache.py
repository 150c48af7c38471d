"""A cache apart from the user's, in which kernels are those of the user's."""

from __future__ import annotations

from pathlib import Path

from cagefield.files.user_cache import cache_root


def cache_of_its_own(place: Path) -> None:
    """Makes such a folder for XDG_CACHE_HOME."""
    kernels = cache_root() / "kernels"
    kernels.mkdir(parents=True, exist_ok=True)
    (place / "cagefield").mkdir(parents=True)
    (place / "cagefield" / "kernels").symlink_to(kernels)
