"""Names of files and folders beside photos that are no photos: hidden files, system files, masks."""

from __future__ import annotations

import re
from collections.abc import Iterable

SYSTEM_NAMES = frozenset({"__macosx", "@eadir", "thumbs.db", "desktop.ini"})
"""Names, in lower case, of files and folders that operating systems put beside photos."""

DYNAMIC_MASK_PREFIX = "dynamic_mask_"
"""Prefix of the names of Instant-NGP's masks, which lie beside their photos."""

MASK_FOLDER_PATTERN = re.compile(r"masks(_[1-9]\d*)?", re.IGNORECASE)
"""Pattern of the names of mask folders."""


def is_hidden(parts: Iterable[str]) -> bool:
    """Whether one of these file or folder names is hidden, a system file, or a mask beside a photo."""
    return any(
        (part.startswith(".") and part != "..")
        or part.lower() in SYSTEM_NAMES
        or part.startswith(DYNAMIC_MASK_PREFIX)
        for part in parts
    )
