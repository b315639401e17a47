"""Figures of a bench."""
