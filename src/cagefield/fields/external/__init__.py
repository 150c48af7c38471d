"""Fields that other programs trained, evaluated and sampled as those programs do."""
