"""Scenes as a browser's GPU draws them: fields, edits, layers, splats, paths."""
