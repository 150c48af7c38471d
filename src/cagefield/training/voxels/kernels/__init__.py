"""Quadrants kernels of voxel training; their host code is one folder up."""
