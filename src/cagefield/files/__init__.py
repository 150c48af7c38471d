"""Files: atomic writes, safe reading, caches of the user."""
