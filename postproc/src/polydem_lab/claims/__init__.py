"""Verdicts on the claims of the paper, with the rules behind them."""
