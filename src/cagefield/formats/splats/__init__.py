"""Splat file formats."""
