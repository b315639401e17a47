"""Pictures, films and the page that plays a result in a browser; `draw` puts a frame into a figure of your own."""

from .plot import draw

__all__ = ["draw"]
