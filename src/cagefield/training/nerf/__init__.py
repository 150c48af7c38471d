"""Training of NeRFs."""
