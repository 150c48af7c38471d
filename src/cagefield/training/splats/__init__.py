"""Training of splats."""
