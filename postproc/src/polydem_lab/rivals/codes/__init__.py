"""The codes, one module each."""

from __future__ import annotations

from types import ModuleType

from . import box2d, chipmunk, polydem, rapier, siconos, yade

#: Word for options -> module; polydem first
CODES: dict[str, ModuleType] = {module.__name__.rpartition(".")[2]: module
                                for module in (polydem, box2d, chipmunk, rapier, siconos, yade)}

#: Those that polydem is compared with
RIVALS = [word for word in CODES if word != "polydem"]
