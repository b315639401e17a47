"""Outlines of grains from pictures and drawings."""

from .choices import Tracing
from .picture_files import Picture, read_picture
from .tracing import FORMAT_OF_SUFFIX, Traced, trace

__all__ = ["FORMAT_OF_SUFFIX", "Picture", "Traced", "Tracing", "read_picture", "trace"]
