"""Outlines of grains from pictures and drawings."""

from .tracing import FORMAT_OF_SUFFIX, Tracing, trace

__all__ = ["FORMAT_OF_SUFFIX", "Tracing", "trace"]
