"""Numba kernels of splat training."""
