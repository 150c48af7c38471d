"""Quadrants kernels that several renderers use."""
