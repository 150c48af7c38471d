"""Grades in edit files: a mapping of the values that are not neutral."""

from __future__ import annotations

from cagefield.edits.file_nodes import Node
from cagefield.edits.grade import GRADE_FIELDS, NEUTRAL_GRADE, RANGES, Grade


def parse_grade(node: Node) -> Grade:
    """Grade of a mapping such as {exposure: 0.5, saturation: 1.2}.

    Raises `EditFileError` for unknown keys and values out of their range.
    """
    keys = node.mapping(required=(), optional=GRADE_FIELDS)
    values = {}
    for name, value in keys.items():
        low, high = RANGES[name]
        values[name] = value.number()
        if not low <= values[name] <= high:
            raise value.error(f"{name} of a grade must be {low:g} to {high:g}, got {values[name]:g}")
    return Grade(**values)


def dump_grade(grade: Grade) -> dict[str, float]:
    """Values of a grade that are not neutral."""
    pairs = ((name, getattr(grade, name)) for name in GRADE_FIELDS)
    return {name: value for name, value in pairs if value != getattr(NEUTRAL_GRADE, name)}
