"""Inpainting of what an edit uncovers."""
