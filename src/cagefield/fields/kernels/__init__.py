"""Compiled loops of the fields; imported late."""
