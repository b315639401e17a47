"""Samples of a bench: reading, statistics, kinds of scenes, and the numbers that the paper published."""

from .samples import Bench, Case, read_bench
from .statistics import typical

__all__ = ["Bench", "Case", "read_bench", "typical"]
