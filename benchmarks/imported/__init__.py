"""Fields of other programs: checkpoints made by their authors' own code, and comparisons with it."""
