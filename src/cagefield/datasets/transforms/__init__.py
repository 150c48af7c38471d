"""transforms.json captures."""
