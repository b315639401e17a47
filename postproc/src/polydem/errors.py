"""What goes wrong, by kind; the message is that of the program."""

from __future__ import annotations


class PolydemError(Exception):
    """Any failure of a simulation."""


class InputError(PolydemError, ValueError):
    """Bad input: a namelist, a name, a shape, a simulation that is closed or in use."""


class RunError(PolydemError, RuntimeError):
    """A run that has stopped: by a guard, at a condition, or since a state is not finite."""


class FileError(PolydemError, OSError):
    """A file or folder that cannot be read or written."""


#: Exceptions by the codes of polydem.h
BY_CODE = {1: RunError, 2: InputError, 3: FileError}
