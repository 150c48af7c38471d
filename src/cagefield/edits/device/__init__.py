"""Edits packed for the compute device."""
