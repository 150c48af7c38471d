"""Names of edits: text that every file, page and terminal accepts."""

from __future__ import annotations

import json
import unicodedata

MAX_NAME_CHARACTERS = 200
"""Length of a name; as the editor's page has it."""

MAX_PATH_CHARACTERS = 4096
"""Length of a path; as Linux has it."""

_UNSAFE = ("Cc", "Cs")
"""Unicode categories that no name contains: control characters, and surrogates, which no UTF-8 has."""


def problem_of_name(name: object) -> str | None:
    """Why an edit may not have a name, and the cure; None where it may."""
    if not isinstance(name, str):
        return f"an edit's name must be text, got {type(name).__name__}"
    problem = problem_of_text(name)
    if problem is not None:
        return f"the name {problem}"
    if len(name) > MAX_NAME_CHARACTERS:
        return f"the name has {len(name)} characters, a name has at most {MAX_NAME_CHARACTERS}; shorten it"
    return None


def problem_of_parent(parent: object) -> str | None:
    """Why an edit may not have a parent of that name, and the cure; None where it may."""
    if not isinstance(parent, str):
        return f'parent must be the name of an edit, or "", got {type(parent).__name__}'
    problem = problem_of_name(parent)
    return None if problem is None else problem.replace("the name", "the name of its parent", 1)


def problem_of_source(source: object) -> str | None:
    """Error text, with the cure, for a paste's source that is no path; None for a path."""
    if not isinstance(source, str) or not source.strip():
        return f"source must be the path of a scene folder or a file of splats, got {source!r:.60}"
    if len(source) > MAX_PATH_CHARACTERS:
        return f"source has {len(source)} characters, a path has at most {MAX_PATH_CHARACTERS}"
    problem = problem_of_text(source)
    if problem is not None:
        return f"source {problem}"
    return None


def problem_of_text(text: str) -> str | None:
    """Error text for characters that no file, page and terminal accepts; None without such characters."""
    bad = next((c for c in text if unicodedata.category(c) in _UNSAFE), None)
    if bad is None:
        return None
    what = "half a character (a lone surrogate)" if "\ud800" <= bad <= "\udfff" else "a control character"
    return f"{json.dumps(text[:40])} holds {what}, U+{ord(bad):04X}; leave it out"


def sanitize_name(name: str) -> str:
    """The name with refused characters replaced by U+FFFD, and cut to its maximum length."""
    kept = (chr(0xFFFD) if unicodedata.category(c) in _UNSAFE else c for c in name[:MAX_NAME_CHARACTERS])
    return "".join(kept)
