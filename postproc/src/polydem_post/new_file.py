"""Files that the package writes: whole or not at all, and pictures never in place of what others made."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .result_file import ResultError, cannot_write

#: What the package writes into its pictures, films and pages, so that it knows them again
MARK = "polydem_post"

#: Bytes at both ends of a file in which the mark is
ENDS = 2**20


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
