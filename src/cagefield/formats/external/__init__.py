"""Readers of checkpoints of other programs' fields."""
