"""Kernels of the warps for many points at once (Numba)."""
