"""Scenes: a field with its edits, cameras and files."""

from cagefield.scene.scene import Scene

__all__ = ["Scene"]
