"""Compute runtimes: devices, kernels and their caches."""
