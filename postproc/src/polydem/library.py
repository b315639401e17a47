"""The shared library: where it is, its functions (polydem.h), and errors as exceptions."""

from __future__ import annotations

import ctypes
import os
import threading
from ctypes import POINTER, byref, c_char_p, c_double, c_int, c_long, c_void_p
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import BY_CODE, InputError, PolydemError
from .ranks import Ranks

#: Name of the file
NAME = "libpolydem.so.0"
#: Name of that for several processes
MPI_NAME = "libpolydem_mpi.so.0"
#: Preset of the sources that makes it, and environment variable that names it
PRESETS = {NAME: ("release", "POLYDEM_LIBRARY"), MPI_NAME: ("mpi", "POLYDEM_MPI_LIBRARY")}
#: First part of a name of a text or array that all processes must ask for
SHARED = ("state_hash", "bodies", "contacts", "energy")

#: Debian packages of the libraries that it may want
PACKAGES = {"libgomp.so.1": "libgomp1", "libgfortran.so.5": "libgfortran5", "libhdf5_serial.so.103": "libhdf5-103-1",
            "libhdf5_serial_fortran.so.102": "libhdf5-fortran-102", "libmpi_usempif08.so.40": "libopenmpi3",
            "libmpi.so.40": "libopenmpi3", "libhdf5_openmpi.so.103": "libhdf5-openmpi-103-1",
            "libhdf5_openmpi_fortran.so.102": "libhdf5-openmpi-fortran-102"}

#: Result and arguments of each function, after the error handle where it has one
WITHOUT_ERROR: dict[str, tuple[Any, list[Any]]] = {
    "version": (c_long, [c_char_p, c_long]),
    "new_error": (c_void_p, []),
    "delete_error": (None, [POINTER(c_void_p)]),
    "error_code": (c_int, [c_void_p]),
    "error_message": (c_long, [c_void_p, c_char_p, c_long]),
    "delete_snapshot": (None, [POINTER(c_void_p)]),
}
WITH_ERROR: dict[str, tuple[Any, list[Any]]] = {
    "new_simulation": (c_void_p, [c_char_p, c_char_p, c_long, POINTER(c_char_p), c_char_p, c_int, c_int]),
    "new_simulation_on_ranks": (c_void_p, [c_int, c_char_p, c_char_p, c_long, POINTER(c_char_p), c_char_p, c_int,
                                           c_int]),
    "delete_simulation": (None, [POINTER(c_void_p)]),
    "advance": (c_long, [c_void_p, c_long, c_double]),
    "real": (c_double, [c_void_p, c_char_p]),
    "integer": (c_long, [c_void_p, c_char_p]),
    "text": (c_long, [c_void_p, c_char_p, c_char_p, c_long]),
    "find_array": (c_int, [c_void_p, c_char_p, POINTER(c_long)]),
    "copy_integers": (None, [c_void_p, c_void_p, c_long]),
    "copy_reals": (None, [c_void_p, c_void_p, c_long]),
    "new_snapshot": (c_void_p, [c_void_p]),
    "restore": (None, [c_void_p, c_void_p]),
    "copy_simulation": (c_void_p, [c_void_p]),
    "act": (None, [c_void_p, c_char_p, c_char_p, c_long, c_void_p, c_long, c_void_p]),
}


def find_library(name: str = NAME) -> Path:
    """The library that an environment variable names, that beside this package, or that of a build of the sources."""
    preset, variable = PRESETS[name]
    given = os.environ.get(variable)
    here = Path(__file__).resolve().parent
    places = [here / name, here.parents[2] / "build" / preset / "src" / "library" / name]
    for place in [Path(given)] if given else places:
        if place.exists():
            return place
    raise PolydemError(f"the library {name} is neither at {' nor at '.join(map(str, [given] if given else places))}: "
                       f"build it with ./polydem build {preset}, or name it in {variable}")


@cache
def load(library: str = NAME) -> ctypes.CDLL:
    """A library, with the types of its functions."""
    place = find_library(library)
    try:
        loaded = ctypes.CDLL(str(place))
    except OSError as error:
        missing = str(error).partition(":")[0]
        where = f"; in Debian and Ubuntu it is in the package {PACKAGES[missing]}" if missing in PACKAGES else ""
        raise PolydemError(f"{place} cannot be loaded: {error}{where}") from error
    for name, (result, arguments) in WITHOUT_ERROR.items():
        _declare(loaded, name, result, arguments)
    for name, (result, arguments) in WITH_ERROR.items():
        _declare(loaded, name, result, [c_void_p, *arguments])
    return loaded


def _declare(library: ctypes.CDLL, name: str, result: Any, arguments: list[Any]) -> None:
    try:
        function = getattr(library, f"polydem_{name}")
    except AttributeError as error:
        raise PolydemError(f"{library._name} has no function polydem_{name}: it is another library, or not of "
                           "the version of this package") from error
    function.restype, function.argtypes = result, arguments


class _Errors(threading.local):
    """An error handle of each library for each thread."""

    def __init__(self) -> None:
        self._handles: dict[str, c_void_p] = {}

    def handle(self, library: str) -> c_void_p:
        """The handle of this thread, made when it is needed first."""
        if library not in self._handles:
            self._handles[library] = c_void_p(load(library).polydem_new_error())
        return self._handles[library]

    def __del__(self) -> None:
        for library, handle in self._handles.items():
            load(library).polydem_delete_error(byref(handle))


_ERRORS = _Errors()


def call(name: str, *arguments: Any, library: str = NAME) -> Any:
    """Call a function that may fail; its error becomes an exception."""
    loaded = load(library)
    error = _ERRORS.handle(library)
    result = getattr(loaded, f"polydem_{name}")(error, *arguments)
    code = loaded.polydem_error_code(error)
    if code != 0:
        size = loaded.polydem_error_message(error, None, 0) + 1
        buffer = ctypes.create_string_buffer(size)
        loaded.polydem_error_message(error, buffer, size)
        raise BY_CODE.get(code, PolydemError)(buffer.value.decode(errors="replace"))
    return result


def version() -> str:
    """Version of the library."""
    buffer = ctypes.create_string_buffer(100)
    load().polydem_version(buffer, len(buffer))
    return buffer.value.decode()


class Handle:
    """A simulation of the library, until it is closed."""

    def __init__(self, pointer: int, ranks: Ranks | None = None):
        self.pointer: c_void_p | None = c_void_p(pointer)
        #: Whether observers are called: after the last step their actions have no effect, since no step follows
        self.observed = False
        #: Processes that share it; None: this one alone
        self.ranks = ranks
        #: Its number among those of these processes
        self.number = 0
        if ranks is not None:
            self.number = ranks.number()
            ranks.handles[self.number] = self

    @property
    def open(self) -> c_void_p:
        """The pointer of a simulation that is not closed."""
        if self.pointer is None:
            raise InputError("the simulation is closed")
        return self.pointer

    def call(self, name: str, *arguments: Any) -> Any:
        """Call a function for this simulation."""
        return call(name, self.open, *arguments, library=library_for(self.ranks))

    def meet(self, method: str, *arguments: Any) -> None:
        """Before a call that all processes must make."""
        if self.ranks is not None and self.open:
            self.ranks.meet(self, method, *arguments)

    def real(self, name: str) -> float:
        """A real value by its name."""
        return float(self.call("real", name.encode()))

    def integer(self, name: str) -> int:
        """A whole number by its name."""
        if name == "contacts":
            self.meet("integer", name)
        return int(self.call("integer", name.encode()))

    def text(self, name: str) -> str:
        """A text by its name."""
        if name in SHARED:
            self.meet("text", name)
        size = self.call("text", name.encode(), None, 0) + 1
        buffer = ctypes.create_string_buffer(size)
        self.call("text", name.encode(), buffer, size)
        return buffer.value.decode(errors="replace")

    def array(self, name: str) -> npt.NDArray[Any] | None:
        """A copy of an array, (rows) or (rows, 2); None: this simulation does not have it."""
        if name.partition("/")[0] in SHARED:
            self.meet("array", name)
        shape = (c_long * 2)()
        kind = self.call("find_array", name.encode(), shape)
        if kind == 0:
            return None
        values = np.empty(shape[0] * shape[1], dtype=np.int64 if kind == 1 else np.float64)
        self.call("copy_integers" if kind == 1 else "copy_reals", c_void_p(values.ctypes.data), values.size)
        return values if shape[1] == 1 else values.reshape(shape[0], shape[1])

    def act(self, kind: str, name: str = "", bodies: npt.ArrayLike = (), values: npt.ArrayLike = ()) -> None:
        """Record an action, which takes effect at the begin of the next step."""
        ids = np.ascontiguousarray(np.asarray(bodies, dtype=np.int64).ravel())
        numbers = np.ascontiguousarray(np.asarray(values, dtype=np.float64).ravel())
        if self.observed and self.integer("is_over") == 1:
            return
        self.meet("act", kind, name, ids, numbers)
        self.call("act", kind.encode(), name.encode(), ids.size, c_void_p(ids.ctypes.data), numbers.size,
                  c_void_p(numbers.ctypes.data))

    def advance(self, steps: int, seconds: float) -> int:
        """Advance by some steps, at most for a moment; several processes all the steps. Return their number."""
        self.meet("advance", steps, seconds)
        return int(self.call("advance", steps, seconds))

    def close(self, failed: bool = False) -> None:
        """End the run and free the simulation, also after an error. A second call does nothing."""
        if self.pointer is None:
            return
        if self.ranks is not None:
            try:
                self.ranks.agree("close after an error" if failed else "close", of=self)
            except InputError:
                if self.pointer is not None or not failed:
                    raise
                return
        self.free()

    def free(self) -> None:
        """Close it, as all processes do."""
        pointer = self.open
        if self.ranks is not None:
            del self.ranks.handles[self.number]
        call("delete_simulation", byref(pointer), library=library_for(self.ranks))
        self.pointer = None


def library_for(ranks: Ranks | None) -> str:
    """Name of the library for some processes."""
    return NAME if ranks is None else MPI_NAME
