"""Training of captures: curves, held-out views, frame times."""
