"""The manifest of a result: which files belong to it, and what they were when they were closed.

`manifest.txt` is a list with a CRC-32 of its own (src/platform/results/manifest.f90):

    polydem-manifest 1, run 3f2a9c0d1b4e5f60
    NAME open 0 00000000 0 0 0                                 the run may still make or change the file
    NAME closed BYTES CRC32 FRAMES FIRST_STEP LAST_STEP        the file does not change any more
    crc32 5a6b7c8d
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field
from pathlib import Path

from ..base.result_file import insist_on_file

#: Name of the manifest in a result folder
MANIFEST = "manifest.txt"

#: Its first words, before the identifier of the run
HEADING = "polydem-manifest 1, run "

#: Bytes of a file that are read at once
_BLOCK = 2**20


class ManifestError(Exception):
    """What is wrong with a manifest or a file that it names, without the folder."""


@dataclass(frozen=True)
class Closed:
    """A file as it was when it was closed."""

    bytes: int
    #: CRC-32 of all its bytes
    checksum: str
    #: Frames, and steps of the first and the last one; 0 unless it is a segment of a trajectory
    frames: int
    first_step: int
    last_step: int


@dataclass
class Manifest:
    """Files of a result: all that it owns, and those that are closed."""

    #: Identifier of the run, which the files repeat
    run: str
    owned: set = field(default_factory=set)
    closed: dict = field(default_factory=dict)


def read_manifest(folder: Path) -> Manifest | None:
    """The manifest of a result; None if there is none."""
    try:
        insist_on_file(folder / MANIFEST)
        data = (folder / MANIFEST).read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise ManifestError(f"{MANIFEST} cannot be read ({error.strerror})") from error
    lines, _, stated = data.rpartition(b"crc32 ")
    if stated != f"{zlib.crc32(lines):08x}\n".encode():
        raise ManifestError(f"{MANIFEST} is not what was written: it was cut or changed")
    heading, *rows = lines.decode("utf-8", errors="replace").splitlines()
    if not heading.startswith(HEADING):
        raise ManifestError(f"{MANIFEST} begins with {heading!r}, not {HEADING!r}; another version wrote it")
    manifest = Manifest(heading.removeprefix(HEADING).strip())
    for row in rows:
        name, state, size, checksum, *frames = row.split()
        manifest.owned.add(name)
        if state == "closed":
            manifest.closed[name] = Closed(int(size), checksum, *map(int, frames))
    return manifest


def check_sizes(folder: Path, names: list, manifest: Manifest) -> None:
    """Compare the sizes of closed files with the manifest; ManifestError if one is missing or has another size."""
    for name in names:
        try:
            size = (folder / name).stat().st_size
        except FileNotFoundError as error:
            raise ManifestError(f"{name} is missing, but {MANIFEST} has it ({error.strerror})") from error
        except OSError as error:
            raise ManifestError(f"{name} cannot be read ({error.strerror})") from error
        expected = manifest.closed[name].bytes
        if size != expected:
            raise ManifestError(f"{name} has {size} bytes, but had {expected} when it was closed: it was cut, "
                                "extended or exchanged")


def check_bytes(folder: Path, name: str, manifest: Manifest) -> None:
    """Compare all bytes of a closed file with the manifest; ManifestError if a bit of it is not as it was."""
    check_sizes(folder, [name], manifest)
    try:
        checksum = file_checksum(folder / name)
    except OSError as error:
        raise ManifestError(f"{name} cannot be read ({error.strerror})") from error
    if checksum != manifest.closed[name].checksum:
        raise ManifestError(f"{name} is not what was written: bytes were changed, or it was exchanged")


def file_checksum(path: Path) -> str:
    """CRC-32 of all bytes of a file, eight hexadecimal digits."""
    insist_on_file(path)
    checksum = 0
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            checksum = zlib.crc32(block, checksum)
    return f"{checksum:08x}"
