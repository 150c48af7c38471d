"""Training of voxel fields."""
