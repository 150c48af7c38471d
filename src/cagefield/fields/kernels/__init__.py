"""Numba kernels of the fields; import them only where they run."""
