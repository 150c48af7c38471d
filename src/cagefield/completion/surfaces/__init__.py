"""Surfaces beside an edit: visibility, surfels, supports."""
