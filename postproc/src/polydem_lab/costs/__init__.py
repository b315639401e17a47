"""Counts that a machine without noise gives: instructions, cache misses, lines of code; and the cost of models."""
