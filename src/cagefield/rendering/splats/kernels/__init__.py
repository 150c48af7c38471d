"""Numba and Quadrants kernels of the splat rasterizers."""
