"""The manifest of a result: which files belong to it, and what they were when they were closed.

`manifest.txt` is a journal. Each line is a text and the hash of all texts so far:

    polydem-manifest 1 HASH
    owns NAME HASH                                                      the file is about to be made
    closed NAME BYTES FILEHASH [FRAMES FIRST_STEP LAST_STEP] HASH       the file will not change any more
    removed NAME HASH

What a kill left of a last line counts for nothing. Hashes are the program's (`mix_word` in src/base/hash.f90), computed
for many slices of a file at once, since each is a chain of its own.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

#: Name of the manifest in a result folder
MANIFEST = "manifest.txt"

#: Its first line, without the hash
HEADING = "polydem-manifest 1"

#: Words of eight bytes in a slice of a file (src/platform/system/file_checksum.f90), and slices that are hashed at once
SLICE, SLICES = 8192, 2048

_ALL = (1 << 64) - 1
_FACTORS = (0xFF51AFD7ED558CCD, 0xC4CEB9FE1A85EC53)

#: Words of all slices that lie side by side when hashing
_BLOCK = 64


class ManifestError(Exception):
    """What is wrong with a manifest or a file that it names, without the folder."""


@dataclass(frozen=True)
class Closed:
    """A file as it was when it was closed."""

    bytes: int
    #: Hash of all its bytes
    hash: str
    #: Frames, and steps of the first and the last one; None unless it is a segment of a trajectory
    frames: int | None = None
    first_step: int | None = None
    last_step: int | None = None


@dataclass
class Manifest:
    """Files of a result: all that it owns, and those that are closed."""

    owned: set = field(default_factory=set)
    closed: dict = field(default_factory=dict)


def read_manifest(folder: Path) -> Manifest | None:
    """The manifest of a result; None if there is none."""
    try:
        data = (folder / MANIFEST).read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise ManifestError(f"{MANIFEST} cannot be read ({error.strerror})") from error
    manifest, previous = Manifest(), 0
    whole, *_ = data.rpartition(b"\n")  # what stands behind the last end of a line was torn off by a kill
    for number, line in enumerate(whole.split(b"\n") if whole else [], 1):
        text, _, stated = line.rpartition(b" ")
        previous = line_hash(previous, text)
        if stated != f"{previous:016x}".encode():
            raise ManifestError(f"line {number} of {MANIFEST} is not what was written: it was changed or lines are "
                                f"missing")
        _apply(manifest, text.decode("utf-8", errors="replace"), number)
    return manifest


def _apply(manifest: Manifest, text: str, number: int) -> None:
    """Enter a line."""
    if number == 1:
        if text != HEADING:
            raise ManifestError(f"{MANIFEST} begins with {text!r}, not {HEADING!r}; a newer version may have "
                                f"written it")
        return
    words = text.split(" ")
    known = re.fullmatch(r"owns \S+|removed \S+|closed \S+ \d+ [0-9a-f]{16}( \d+ -?\d+ -?\d+)?", text)
    if not known:
        raise ManifestError(f"line {number} of {MANIFEST} is unknown: {text!r}; a newer version may have written it")
    what, name = words[:2]
    manifest.closed.pop(name, None)
    if what == "removed":
        manifest.owned.discard(name)
        return
    manifest.owned.add(name)
    if what == "closed":
        manifest.closed[name] = Closed(int(words[2]), words[3], *map(int, words[4:]))


def check_bytes(folder: Path, names: list, manifest: Manifest) -> None:
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
                                f"extended or "
                                "exchanged")


def check_hashes(folder: Path, names: list, manifest: Manifest) -> None:
    """Compare all bytes of closed files with the manifest; ManifestError if a bit of one is not as it was."""
    for name, each in zip(names, _read_hashes(folder, names)):
        if each != manifest.closed[name].hash:
            raise ManifestError(f"{name} is not what was written: bytes were changed, or it was exchanged")


def _read_hashes(folder: Path, names: list) -> list[str]:
    """Hashes of files; ManifestError names the first that cannot be read."""
    try:
        return file_hashes([folder / name for name in names])
    except OSError as error:
        if len(names) > 1 and error.filename is None:
            return [each for name in names for each in _read_hashes(folder, [name])]
        raise ManifestError(f"{Path(error.filename or names[0]).name} cannot be read ({error.strerror})") from error


# --- hashes ------------------------------------------------------------------------------------------------------


def _finalised(number: int) -> int:
    """The 64-bit finaliser of MurmurHash3."""
    for factor in _FACTORS:
        number = (number ^ number >> 33) * factor & _ALL
    return number ^ number >> 33


def mixed(number: int, words) -> int:
    """The hash of a sequence of words, from that of what was before it."""
    for word in words:
        number = _finalised(_finalised(number) ^ int(word)) + number & _ALL
    return number


def line_hash(previous: int, text: bytes) -> int:
    """Hash of a line of the manifest: that of the line before, its length, its bytes in words, filled up with zeros."""
    padded = text + bytes(-len(text) % 8)
    return mixed(mixed(previous, [len(text)]), np.frombuffer(padded, "<u8"))


def file_hashes(paths: list) -> list[str]:
    """Hash of all bytes of each file, 16 hexadecimal digits."""
    sizes = [Path(path).stat().st_size for path in paths]
    parts: list[list] = [[] for _ in paths]
    rests: list[int] = []
    lengths: list[int] = []
    owners: list[int] = []
    slices = sum(-(-(size // 8) // SLICE) for size in sizes)
    table = np.zeros((min(slices, SLICES), SLICE), dtype="<u8")

    def settle() -> None:
        for owner, each in zip(owners, _slice_hashes(table, lengths)):
            parts[owner].append(each)
        owners.clear()
        lengths.clear()

    for k, path in enumerate(paths):
        left = sizes[k] // 8
        with Path(path).open("rb") as file:
            while left > 0:
                words = min(SLICE, left)
                row = table[len(lengths), :words]
                if file.readinto(row.data) != row.nbytes:
                    raise OSError(0, "it becomes shorter while it is read", str(path))
                owners.append(k)
                lengths.append(words)
                left -= words
                if len(lengths) == SLICES:
                    settle()
            rests.append(int.from_bytes(file.read(sizes[k] % 8), "little"))
    settle()
    return [f"{mixed(size, [*part, rest]):016x}" for size, part, rest in zip(sizes, parts, rests)]


def _slice_hashes(table: np.ndarray, lengths: list) -> list[int]:
    """The hash of the slices in the rows of a table: word by word, all slices at once."""
    if not lengths:
        return []
    order = np.argsort(-np.array(lengths), kind="stable")
    sorted_lengths = np.array(lengths)[order]
    state = sorted_lengths.astype(np.uint64)
    shift = np.full(len(state), 33, dtype=np.uint64)
    work, shifted = np.empty_like(state), np.empty_like(state)
    in_order = bool(np.all(np.diff(order) == 1))
    n = len(state)
    lanes: tuple[np.ndarray, ...] = (state, work, shifted, shift)
    for first in range(0, sorted_lengths[0], _BLOCK):
        columns = table[: len(lengths), first : min(first + _BLOCK, sorted_lengths[0])]
        block = np.ascontiguousarray((columns if in_order else columns[order]).T)
        for k, words in enumerate(block):
            while sorted_lengths[n - 1] <= first + k:
                n -= 1
                lanes = tuple(each[:n] for each in (state, work, shifted, shift))
            _mix_all(words[:n], *lanes)
    hashes = np.empty(len(lengths), dtype=np.uint64)
    hashes[order] = state
    return [int(each) for each in hashes]


_FIRST, _SECOND = (np.uint64(factor) for factor in _FACTORS)


def _mix_all(words, state, work, shifted, shift) -> None:
    """One word into each state."""
    _finalise_all(state, work, shifted, shift)
    np.bitwise_xor(work, words, work)
    _finalise_all(work, work, shifted, shift)
    np.add(state, work, state)


def _finalise_all(source, work, shifted, shift) -> None:
    np.right_shift(source, shift, shifted)
    np.bitwise_xor(source, shifted, work)
    np.multiply(work, _FIRST, work)
    np.right_shift(work, shift, shifted)
    np.bitwise_xor(work, shifted, work)
    np.multiply(work, _SECOND, work)
    np.right_shift(work, shift, shifted)
    np.bitwise_xor(work, shifted, work)
