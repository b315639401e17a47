"""Files that the package writes: whole or not at all, and pictures never in place of what others made."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py

from .result_file import ResultError, cannot_write

#: What the package writes into its pictures, films and pages, so that it knows them again
MARK = "polydem_post"

#: Bytes at both ends of a file in which the mark is
ENDS = 2**20

#: Bytes of chunks that a data set holds in memory while it is written: files may have many data sets
CHUNK_CACHE = 2**18


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """A hidden file beside a path, to be written: it takes the name when it is complete, and goes if that fails."""
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        yield part
        os.replace(part, path)
    except OSError as error:
        raise cannot_write(path, error) from error
    finally:
        part.unlink(missing_ok=True)


def insist_on_own(path: Path) -> None:
    """Refuse to replace a picture, film or page without the mark."""
    if not path.exists():
        return
    if not path.is_file():
        raise ResultError(f"{path}: cannot be written (it is a folder or a device)")
    try:
        with path.open("rb") as file:
            ends = file.read(ENDS)
            file.seek(max(path.stat().st_size - ENDS, 0))
            ends += file.read(ENDS)
    except OSError as error:
        raise cannot_write(path, error) from error
    if ends and MARK.encode() not in ends:
        raise ResultError(f"{path}: exists, and this version of polydem did not make it; choose another name or remove "
                          "it")


class NewHdf5(h5py.File):
    """An HDF5 file that is written. If there is no room for it, `check` and `close` raise the error of the system.

    The HDF5 library itself can neither go on nor close a file after a failed write.
    """

    def __init__(self, path: Path):
        self._bytes = _Bytes(path, "w+")
        super().__init__(self._bytes, "w", rdcc_nbytes=CHUNK_CACHE)

    def check(self) -> None:
        """Raise the error of a failed write."""
        if self._bytes.failure:
            raise self._bytes.failure

    def close(self) -> None:
        """Write what is not yet written, and close the file."""
        super().close()
        self._bytes.close()
        self.check()


class _Bytes(io.FileIO):
    """The bytes of a file; a failed write is kept, and the following ones are left out."""

    failure: OSError | None = None

    def write(self, data: Any) -> int:
        """Write all bytes."""
        rest = memoryview(data)
        count = rest.nbytes
        try:
            while self.failure is None and rest.nbytes:
                rest = rest[super().write(rest) or 0 :]
        except OSError as error:
            self.failure = error
        return count

    def truncate(self, size: int | None = None) -> int:
        """Set the size."""
        try:
            return super().truncate(size) if self.failure is None else size or 0
        except OSError as error:
            self.failure = error
            return size or 0
