"""Rendering of splats through edits."""
