"""Inpainting of uncovered surfaces, and blending of moved parts."""
