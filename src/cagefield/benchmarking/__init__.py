"""Measurements: edits against ground truth, frame times, PSNR against training time."""
