"""Content pasted from other scenes."""
