"""Machine, tables, figures and test cases that benchmarks share."""
