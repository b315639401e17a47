"""The verbs of the laboratory, their options and help texts."""

from .verbs import add_verbs

__all__ = ["add_verbs"]
