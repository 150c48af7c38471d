"""cagefield in other programs: a process that deforms splats for them, and the frames it is spoken to in."""
