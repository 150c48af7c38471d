"""Rendering of NeRFs through edits."""
