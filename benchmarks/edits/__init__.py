"""Quality of edits against ground truth, and of the maps behind them."""
