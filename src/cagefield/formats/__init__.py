"""Readers and writers of other programs' files: one module per format."""
