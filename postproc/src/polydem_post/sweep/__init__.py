"""Batches of runs that differ in some entries of one namelist."""

from .batch import Run, Sweep, make_sweep

__all__ = ["Run", "Sweep", "make_sweep"]
