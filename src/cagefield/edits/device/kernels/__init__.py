"""Quadrants kernels of edit stacks."""
