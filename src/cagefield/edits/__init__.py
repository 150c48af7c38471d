"""Edits of a radiance field: what moves, how, and what becomes of the surroundings."""

from __future__ import annotations

from cagefield.edits.edit import Edit
from cagefield.edits.edit_files import dump_edits, load_edits, parse_edits, save_edits
from cagefield.edits.operations import (
    MoveCorner,
    MoveCorners,
    MoveEdge,
    MoveFace,
    Operation,
    Rotate,
    Scale,
    Shear,
    Translate,
)
from cagefield.edits.stack import CanonicalSamples, DeformedPoints, EditStack, LatticeError

__all__ = [
    "CanonicalSamples",
    "DeformedPoints",
    "Edit",
    "EditStack",
    "LatticeError",
    "MoveCorner",
    "MoveCorners",
    "MoveEdge",
    "MoveFace",
    "Operation",
    "Rotate",
    "Scale",
    "Shear",
    "Translate",
    "dump_edits",
    "load_edits",
    "parse_edits",
    "save_edits",
]
