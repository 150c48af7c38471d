"""Files and folders beside photos that are no photos: hidden ones, the system's, masks."""

from __future__ import annotations

import re
from collections.abc import Iterable

SYSTEM_NAMES = frozenset({"__macosx", "@eadir", "thumbs.db", "desktop.ini"})
"""Files and folders, in lower case, that systems put beside photos; those with a leading dot are too."""

DYNAMIC_MASK = "dynamic_mask_"
"""Beginning of the names of Instant-NGP's masks, which are beside their photos."""

MASK_FOLDER = re.compile(r"masks(_[1-9]\d*)?", re.IGNORECASE)
"""Names of folders of masks."""


def is_hidden(parts: Iterable[str]) -> bool:
    """Whether one of these names of files and folders is hidden, the system's, or a mask's beside a photo."""
    return any(
        (part.startswith(".") and part != "..")
        or part.lower() in SYSTEM_NAMES
        or part.startswith(DYNAMIC_MASK)
        for part in parts
    )
