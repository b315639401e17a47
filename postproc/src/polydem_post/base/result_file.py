"""HDF5 files of results: opening them, and what is wrong with them told in sentences."""

from __future__ import annotations

import errno
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

#: Newest layout of files that this reader knows
SCHEMA_VERSION = 8

#: End of the name of a segment that is being written
OPEN_SUFFIX = ".open"

#: What h5py and numpy raise for files that are incomplete or not what they should be
UNREADABLE = (
    OSError,
    KeyError,
    RuntimeError,
    ValueError,
    TypeError,
    IndexError,
    AttributeError,
    OverflowError,
    MemoryError,
)

#: Message of the HDF5 library if the system does not tell the state of a file
NO_STATE = "can't retrieve stat info"

#: Parts of messages of the HDF5 library, and what they mean
HDF5_REASONS = {"file signature not found": "it is not an HDF5 file",
                "truncated file": "it is truncated: its end is missing",
                NO_STATE: "the system tells nothing about it"}

#: Errors of the system that tell that there is no file of this name, or that another program has locked it
ANSWERS = errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.ELOOP, errno.ENAMETOOLONG, errno.EAGAIN

#: Bytes that one byte of a file can stand for at most: deflate makes a thousand zeros one byte
MOST_COMPRESSED = 1100

#: Deepest nesting of groups, and most objects, of a file of polydem
DEEPEST, MOST_OBJECTS = 8, 10000


class ResultError(Exception):
    """A result that is not there, not complete or not a result; the message says which and what to do."""


def cannot_read(path: Path, error: Exception) -> ResultError:
    """The error that a file cannot be read, with the reason in a few words."""
    if isinstance(error, UnicodeDecodeError):
        return ResultError(f"{path}: is not text in UTF-8 (byte {error.start}); save it in UTF-8")
    again = "; a run may be writing this file: try again" if Path(path).name.endswith(OPEN_SUFFIX) else ""
    return ResultError(f"{path}: cannot be read ({reason(error)}){again}")


def cannot_write(path: Path, error: Exception) -> ResultError:
    """The error that a file cannot be written, with the reason in a few words."""
    folder = Path(path).parent
    why = reason(error) if folder.is_dir() else f"there is no folder {folder}"
    return ResultError(f"{path}: cannot be written ({why})")


def reason(error: Exception) -> str:
    """The reason that an exception gives, in one line; of the system's errors without their number."""
    words = " ".join(str(getattr(error, "strerror", None) or error).split()).strip("'\"")
    for said, meaning in HDF5_REASONS.items():
        if said in words:
            return meaning
    inner = re.search(r"error message = '([^']+)'", words)
    return inner.group(1) if inner else words or type(error).__name__


def is_refused(error: BaseException | None) -> bool:
    """Whether the system refused to read or write a file, which tells nothing of what the file holds."""
    while error is not None:
        number = getattr(error, "errno", None)
        said = re.search(r"errno = (\d+)", str(error))
        number = int(said.group(1)) if said else number
        if (number and number not in ANSWERS) or NO_STATE in str(error):
            return True
        error = error.__cause__
    return False


def entries_of(group) -> Iterator[tuple[str, Any]]:
    """Names and entries of a group. (h5py's `items` gives None for an entry that cannot be read.)"""
    return ((name, group[name]) for name in group)


def balance_of(file):
    """Group of the energy balance in an open segment; empty if the run did not compute it."""
    if "energy_balance" not in file:
        return {}
    return file["energy_balance"]


def series_of(file):
    """Group of the rows of the series in a segment; empty if it has none."""
    if "series" not in file:
        return {}
    return file["series"]


def open_file(path: Path, known: dict[Path, tuple[int, ...]] | None = None) -> h5py.File:
    """Open a file, also one that a run is still writing or has just closed and renamed.

    A file that `known` lists as it is now was looked through before, and is not looked through again.
    """
    identity = _identity(path)
    try:
        try:
            file = open_hdf5(path)
        except OSError:
            if present_path(path) == path:
                raise
            file = open_hdf5(present_path(path))
    except OSError as error:
        raise cannot_read(path, error) from error
    try:
        version = int(file.attrs.get("schema_version", 0))
        if not 1 <= version <= SCHEMA_VERSION:
            raise ResultError(f"{path}: is not a file of polydem, or of a newer version than this reader")
        if known is None or identity is None or known.get(path) != identity:
            insist_on_own_data(path, file)
            if known is not None and identity is not None:
                known[path] = identity
    except UNREADABLE as error:
        file.close()
        raise cannot_read(path, error) from error
    except ResultError:
        file.close()
        raise
    return file


def is_of_run(path: Path) -> bool:
    """Whether a file is one of those that a run writes."""
    try:
        with open_hdf5(path) as file:
            return "schema_version" in file.attrs
    except UNREADABLE:
        return False


@contextmanager
def reading(path: Path, known: dict[Path, tuple[int, ...]] | None = None):
    """A file to read; whatever is wrong with what it holds is told in a sentence. `known` as for `open_file`."""
    with open_file(path, known) as file:
        try:
            yield file
        except UNREADABLE as error:
            raise cannot_read(path, error) from error


@contextmanager
def reading_any(path: Path):
    """An HDF5 file to read, which need not be of a run; whatever is wrong with it is told in a sentence."""
    try:
        with open_hdf5(path) as file:
            yield file
    except UNREADABLE as error:
        raise cannot_read(path, error) from error


def insist_on_own_data(path: Path, file: h5py.File) -> None:
    """Refuse a file whose data lie in other files: what it shows would depend on what is there, or belong to others."""
    waiting, seen = [(file, "", 0)], 0
    most_bytes = MOST_COMPRESSED * Path(file.filename).stat().st_size + 2**20
    while waiting:
        group, place, depth = waiting.pop()
        for name in group:
            seen += 1
            if depth >= DEEPEST or seen > MOST_OBJECTS:
                raise ResultError(f"{path}: has more nested or more numerous groups than any file of polydem")
            link = group.get(name, getlink=True)
            if not isinstance(link, h5py.HardLink):
                raise ResultError(f"{path}: {place}/{name} is a link, perhaps to another file; polydem writes none")
            entry = group[name]
            if isinstance(entry, h5py.Group):
                waiting.append((entry, f"{place}/{name}", depth + 1))
            elif isinstance(entry, h5py.Dataset) and entry.nbytes > most_bytes:
                raise ResultError(f"{path}: {place}/{name} claims {entry.nbytes} bytes, more than the file can hold; "
                                  "it is damaged")
            elif isinstance(entry, h5py.Dataset) and (entry.is_virtual or entry.external):
                raise ResultError(f"{path}: the data of {place}/{name} lie in other files; polydem writes no such "
                                  "files")


def insist(path: Path, group: str, arrays: dict, shapes: dict, finite: bool = True) -> None:
    """Insist on numbers of these shapes, which must be finite unless that is left open."""
    for name, values in arrays.items():
        values = np.asarray(values)
        if values.dtype.kind not in "iufb":
            raise ResultError(f"{path}: {group}/{name} does not hold numbers")
        if values.shape != shapes[name]:
            raise ResultError(f"{path}: {group}/{name} has the shape {values.shape}, not {shapes[name]}")
        if finite and values.dtype.kind == "f" and not np.isfinite(values).all():
            raise ResultError(f"{path}: {group}/{name} holds values that are not finite numbers")


def plain(entry: h5py.Dataset):
    """A stored text or number as Python's own."""
    value = entry[()]
    return value.decode("utf-8", errors="replace") if isinstance(value, bytes) else value.item()


def present_path(path: Path) -> Path:
    """The path, or that of the closed segment if a run has closed the segment since it was found."""
    if path.name.endswith(OPEN_SUFFIX) and not path.exists():
        return path.with_suffix("")
    return path


def _identity(path: Path) -> tuple[int, ...] | None:
    """What changes when a file does; nothing if there is none."""
    try:
        state = path.stat()
    except OSError:
        return None
    return state.st_dev, state.st_ino, state.st_size, state.st_mtime_ns, state.st_ctime_ns


def insist_on_file(path: Path) -> None:
    """Refuse a pipe or a device: whoever opens a pipe without a writer waits for ever."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise OSError(errno.EEXIST, "it is a pipe or a device; write what it gives to a file first")


def open_hdf5(path: Path) -> h5py.File:
    """Open any HDF5 file to read."""
    insist_on_file(path)
    try:
        try:
            return h5py.File(path, "r", locking=False)
        except OSError as error:
            if NO_STATE not in str(error):
                raise
            return h5py.File(path, "r", locking=False)  # HDF5 does not tell why; this call may
    except (TypeError, ValueError):
        return h5py.File(path, "r")
