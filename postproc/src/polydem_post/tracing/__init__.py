"""Outlines of grains from pictures and drawings."""

from .choices import Tracing
from .tracing import FORMAT_OF_SUFFIX, trace

__all__ = ["FORMAT_OF_SUFFIX", "Tracing", "trace"]
