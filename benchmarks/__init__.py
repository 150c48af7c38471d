"""Benchmarks of cagefield: `python -m benchmarks`, or `cagefield bench` in a checkout."""
