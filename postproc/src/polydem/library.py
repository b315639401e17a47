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

#: Name of the file
NAME = "libpolydem.so.0"

#: Debian packages of the libraries that it may want
PACKAGES = {"libgomp.so.1": "libgomp1", "libgfortran.so.5": "libgfortran5", "libhdf5_serial.so.103": "libhdf5-103-1",
            "libhdf5_serial_fortran.so.102": "libhdf5-fortran-102"}

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


def find_library() -> Path:
    """The library that POLYDEM_LIBRARY names, that beside this package, or that of the release build of the sources."""
    given = os.environ.get("POLYDEM_LIBRARY")
    here = Path(__file__).resolve().parent
    places = [here / NAME, here.parents[2] / "build" / "release" / "src" / "library" / NAME]
    for place in [Path(given)] if given else places:
        if place.exists():
            return place
    raise PolydemError(f"the library {NAME} is neither at {' nor at '.join(map(str, [given] if given else places))}: "
                       "build it with ./polydem build release, or name it in POLYDEM_LIBRARY")


@cache
def load() -> ctypes.CDLL:
    """The library, with the types of its functions."""
    place = find_library()
    try:
        library = ctypes.CDLL(str(place))
    except OSError as error:
        missing = str(error).partition(":")[0]
        where = f"; in Debian and Ubuntu it is in the package {PACKAGES[missing]}" if missing in PACKAGES else ""
        raise PolydemError(f"{place} cannot be loaded: {error}{where}") from error
    for name, (result, arguments) in WITHOUT_ERROR.items():
        _declare(library, name, result, arguments)
    for name, (result, arguments) in WITH_ERROR.items():
        _declare(library, name, result, [c_void_p, *arguments])
    return library


def _declare(library: ctypes.CDLL, name: str, result: Any, arguments: list[Any]) -> None:
    function = getattr(library, f"polydem_{name}")
    function.restype, function.argtypes = result, arguments


class _Errors(threading.local):
    """An error handle for each thread."""

    def __init__(self) -> None:
        self._handle: c_void_p | None = None

    def handle(self) -> c_void_p:
        """The handle of this thread, made when it is needed first."""
        if self._handle is None:
            self._handle = c_void_p(load().polydem_new_error())
        return self._handle

    def __del__(self) -> None:
        if self._handle is not None:
            load().polydem_delete_error(byref(self._handle))


_ERRORS = _Errors()


def call(name: str, *arguments: Any) -> Any:
    """Call a function that may fail; its error becomes an exception."""
    library = load()
    error = _ERRORS.handle()
    result = getattr(library, f"polydem_{name}")(error, *arguments)
    code = library.polydem_error_code(error)
    if code != 0:
        size = library.polydem_error_message(error, None, 0) + 1
        buffer = ctypes.create_string_buffer(size)
        library.polydem_error_message(error, buffer, size)
        raise BY_CODE.get(code, PolydemError)(buffer.value.decode(errors="replace"))
    return result


def version() -> str:
    """Version of the library."""
    buffer = ctypes.create_string_buffer(100)
    load().polydem_version(buffer, len(buffer))
    return buffer.value.decode()


class Handle:
    """A simulation of the library, until it is closed."""

    def __init__(self, pointer: int):
        self.pointer: c_void_p | None = c_void_p(pointer)
        #: Whether observers are called: after the last step their actions have no effect, since no step follows
        self.observed = False

    @property
    def open(self) -> c_void_p:
        """The pointer of a simulation that is not closed."""
        if self.pointer is None:
            raise InputError("the simulation is closed")
        return self.pointer

    def real(self, name: str) -> float:
        """A real value by its name."""
        return float(call("real", self.open, name.encode()))

    def integer(self, name: str) -> int:
        """A whole number by its name."""
        return int(call("integer", self.open, name.encode()))

    def text(self, name: str) -> str:
        """A text by its name."""
        size = call("text", self.open, name.encode(), None, 0) + 1
        buffer = ctypes.create_string_buffer(size)
        call("text", self.open, name.encode(), buffer, size)
        return buffer.value.decode(errors="replace")

    def array(self, name: str) -> npt.NDArray[Any] | None:
        """A copy of an array, (rows) or (rows, 2); None: this simulation does not have it."""
        shape = (c_long * 2)()
        kind = call("find_array", self.open, name.encode(), shape)
        if kind == 0:
            return None
        values = np.empty(shape[0] * shape[1], dtype=np.int64 if kind == 1 else np.float64)
        call("copy_integers" if kind == 1 else "copy_reals", self.open, c_void_p(values.ctypes.data), values.size)
        return values if shape[1] == 1 else values.reshape(shape[0], shape[1])

    def act(self, kind: str, name: str = "", bodies: npt.ArrayLike = (), values: npt.ArrayLike = ()) -> None:
        """Record an action, which takes effect at the begin of the next step."""
        ids = np.ascontiguousarray(np.asarray(bodies, dtype=np.int64).ravel())
        numbers = np.ascontiguousarray(np.asarray(values, dtype=np.float64).ravel())
        if self.observed and self.integer("is_over") == 1:
            return
        call("act", self.open, kind.encode(), name.encode(), ids.size, c_void_p(ids.ctypes.data), numbers.size,
             c_void_p(numbers.ctypes.data))

    def close(self) -> None:
        """End the run and free the simulation. A second call does nothing."""
        if self.pointer is None:
            return
        pointer = self.pointer
        call("delete_simulation", byref(pointer))
        self.pointer = None
