"""Error against time of integrators and precisions."""

from .work_precision import read_study

__all__ = ["read_study"]
