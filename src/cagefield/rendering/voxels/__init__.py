"""Rendering of voxel fields through edits."""
