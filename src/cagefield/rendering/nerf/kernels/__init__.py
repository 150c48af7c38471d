"""Quadrants kernels of NeRF rendering."""
