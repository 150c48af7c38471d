"""Files that other programs wrote: one module for each format."""
