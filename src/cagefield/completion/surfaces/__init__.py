"""Surfaces around an edit: visibility, surfels, support planes, footprints."""
