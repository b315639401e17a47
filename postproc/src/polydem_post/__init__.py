"""Reads, tabulates and draws results of polydem."""

from .trajectory import Contacts, Frame, NoManifest, ResultError, Trajectory, Walls

__all__ = ["Contacts", "Frame", "NoManifest", "ResultError", "Trajectory", "Walls"]
__version__ = "0.1.0"
