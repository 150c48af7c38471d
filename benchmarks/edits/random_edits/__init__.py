"""Random continuous edits of every kind of cage, each in an outer box; by seed, for tests and the table."""
