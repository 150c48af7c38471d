"""Kernels of the renderers; their host code lies one folder up."""
