"""A run as a function of its parameters, for optimisers and sweeps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from typing import Any, TypeVar

from .simulation import Simulation

Measured = TypeVar("Measured")


def evaluate(source: str | PathLike[str] | Mapping[str, Any], overrides: Mapping[str, Any] | None,
             measure: Callable[[Any], Measured], *, until: float | None = None, threads: int = 1) -> Measured:
    """Run a namelist with some overrides to its end, or until a time [s], and measure its last frame.

    `measure` gets a `polydem_post` frame. Nothing is written.
    """
    with Simulation(source, overrides, threads=threads) as simulation:
        simulation.run(until=until)
        return measure(simulation.frame())
