"""Figures of a bench; all its tables, figures and verdicts in one folder."""
