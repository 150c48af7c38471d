"""Kernels of the trainers; their host code lies one folder up."""
