"""Commands of `cagefield bench`."""
