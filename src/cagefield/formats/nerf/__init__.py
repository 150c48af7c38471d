"""NeRF checkpoint formats."""
