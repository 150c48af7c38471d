"""Rendering of other programs' fields through edits."""
