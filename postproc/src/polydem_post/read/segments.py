"""Segments of a trajectory: finding them, how many frames they hold, and whether they belong together."""

from __future__ import annotations

import os
import re
import warnings
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from ..base.result_file import (
    OPEN_SUFFIX,
    SCHEMA_VERSION,
    ResultError,
    balance_of,
    cannot_read,
    entries_of,
    insist,
    is_refused,
    plain,
    present_path,
    reading,
)
from .manifest import MANIFEST, Closed, Manifest, ManifestError

#: Name of a segment: trajectory_0001.h5, or trajectory_0001.h5.open while it is written
SEGMENT_NAME = re.compile(r"trajectory_(\d{4,})\.h5(\.open)?")


@dataclass(frozen=True)
class Segment:
    """A readable file of the trajectory, and what of it counts."""

    path: Path
    steps: np.ndarray
    times: np.ndarray

    @property
    def name(self) -> str:
        """Name of the segment when it is closed."""
        return self.path.name.removesuffix(OPEN_SUFFIX)


def find_segments(folder: Path, closed: dict[str, Closed]) -> list[Segment]:
    """Segments of a folder in order; of an open segment what can be read. `closed` are those of the manifest."""
    found = {}
    try:
        paths = sorted(folder.iterdir(), reverse=True)
    except OSError as error:
        raise cannot_read(folder, error) from error
    for path in paths:
        match = SEGMENT_NAME.fullmatch(path.name)
        if match:
            found[int(match.group(1))] = path  # the name of a closed segment, if a renaming shows both, comes last
    segments = []
    for _, path in sorted(found.items()):
        try:
            segments.append(_read_closed(path, closed.get(path.name)) or read_segment(path))
        except ResultError as error:
            if not present_path(path).name.endswith(OPEN_SUFFIX):
                raise
            warnings.warn(f"left out: {error}", stacklevel=4)
    _check_order(folder, segments)
    return segments


def _read_closed(path: Path, closed: Closed | None) -> Segment | None:
    """Steps and times of a segment whose frames the manifest counts, in a millisecond; None if anything is unusual.

    Its other data sets are looked at when the segment is used.
    """
    columns = []
    try:
        if closed is None or path.stat().st_size != closed.bytes:
            return None
        file = h5py.h5f.open(os.fsencode(path), h5py.h5f.ACC_RDONLY)
        try:
            layout = np.empty((), np.int64)
            h5py.h5a.open(file, b"schema_version").read(layout)
            if layout != SCHEMA_VERSION:
                return None
            for name in (b"frames", b"frames/step", b"frames/time"):
                if file.links.get_info(name).type != h5py.h5l.TYPE_HARD:
                    return None
            for name in (b"frames/step", b"frames/time"):
                dataset = h5py.h5d.open(file, name)
                made = dataset.get_create_plist()
                if made.get_layout() == h5py.h5d.VIRTUAL or made.get_external_count():
                    return None
                if dataset.shape != (closed.frames,):
                    return None
                columns.append(np.empty(dataset.shape, dataset.dtype))
                dataset.read(h5py.h5s.ALL, h5py.h5s.ALL, columns[-1])
        finally:
            file.close()
    except (OSError, KeyError, ValueError, RuntimeError, TypeError):
        return None
    steps, times = columns
    usual = steps.dtype.kind in "iu" and times.dtype.kind == "f" and np.isfinite(times).all()
    return Segment(path, steps, times) if usual else None


def read_segment(path: Path) -> Segment:
    """Steps and times of a segment, of the frames that are complete."""
    with reading(path) as file:
        if "frames" not in file:
            raise ResultError(f"{path}: is not a segment of a trajectory")
        layout = int(file.attrs["schema_version"])
        if layout != SCHEMA_VERSION:
            raise ResultError(f"{path}: has file layout {layout} of an earlier version of polydem, but this one reads "
                              f"only layout {SCHEMA_VERSION}; run its scene again, or use the version that wrote it")
        n = _complete_frames(file)
        segment = Segment(path, file["frames/step"][:n], file["frames/time"][:n])
        insist(path, "frames", {"step": segment.steps, "time": segment.times}, {"step": (n,), "time": (n,)})
        if segment.steps.dtype.kind not in "iu":
            raise ResultError(f"{path}: frames/step does not hold integers")
        return segment


#: Columns of /frames with one row per frame; the others have one per body of each frame
ROWS_OF_FRAMES = ("step", "time", "shift", "jump", "cell_low", "cell_size")


def _complete_frames(file: h5py.File) -> int:
    """Number of frames that are there in all data sets and whose last one can be read.

    A program that dies while it writes a frame may leave some data sets one row longer than others.
    """
    growing = [values for name, values in entries_of(file["frames"]) if name in ROWS_OF_FRAMES]
    growing += [values for _, values in entries_of(balance_of(file))]
    if "walls" in file:
        growing += [values for name, values in entries_of(file["walls"]) if name != "id"]
    n = min(len(values) for values in growing)
    listed = {name: [values for key, values in entries_of(file[name]) if key not in ("start", *ROWS_OF_FRAMES)]
              for name in ("frames", "contacts") if name in file}
    starts = {name: file[f"{name}/start"][:] for name in listed}
    for name, columns in listed.items():
        n = min(n, int(np.searchsorted(starts[name], min(map(len, columns)), side="right")) - 1)
    while n > 0:
        try:
            for values in growing:
                values[n - 1]
            for values in listed["frames"]:
                values[slice(*starts["frames"][n - 1:n + 1])]
            return n
        except OSError as error:
            if is_refused(error):
                raise
            n -= 1
    return n


def number_of(name: str) -> int:
    """Number of a segment; -1 for any other file name."""
    match = SEGMENT_NAME.fullmatch(name)
    return int(match.group(1)) if match else -1


def check_names(segments: list, manifest: Manifest, whole: bool) -> None:
    """All segments must belong to the result, and be numbered without gaps."""
    for segment in segments:
        if segment.name not in manifest.owned:
            raise ManifestError(f"{segment.path.name} does not belong to this result ({MANIFEST} does not have it)")
        if segment.name not in manifest.closed and _origin(segment.path) != [manifest.run, segment.name]:
            raise ManifestError(f"{segment.path.name} was written by another run, or under another name")
    numbers = sorted(number_of(name) for name in manifest.closed if SEGMENT_NAME.fullmatch(name))
    if whole and numbers != list(range(1, len(numbers) + 1)):
        raise ManifestError(f"{MANIFEST} has the segments {', '.join(map(str, numbers))}, not 1 to {len(numbers)}")


def _origin(path: Path) -> list[str]:
    """The run that wrote a file, and its name then."""
    with reading(path) as file:
        return [plain(file["provenance"][name]) for name in ("run", "file")]


def check_steps(segment: Segment, closed) -> None:
    """A closed segment must hold the frames and steps that it held when it was closed."""
    if closed is None:
        return
    held = (len(segment.steps), *(int(step) for step in segment.steps[[0, -1]])) if len(segment.steps) else (0, 0, 0)
    if held != (closed.frames, *((closed.first_step, closed.last_step) if closed.frames else (0, 0))):
        raise ManifestError(
            f"{segment.name} has {held[0]} frames of the steps {held[1]} to {held[2]}, but had {closed.frames} of "
            f"{closed.first_step} to {closed.last_step} when it was closed: it was changed or exchanged"
        )


def _check_order(folder: Path, segments: list) -> None:
    """Segments must be numbered without gaps, and their steps must ascend."""
    numbers = [number_of(segment.name) for segment in segments]
    for before, after in zip(numbers, numbers[1:]):
        if after != before + 1:
            raise ResultError(f"{folder}: a segment is missing between number {before} and {after}")
    last = None
    for segment in segments:
        steps = segment.steps
        if len(steps) and (np.any(np.diff(steps) <= 0) or (last is not None and steps[0] <= last)):
            raise ResultError(f"{segment.path}: its steps do not ascend from those of the segment before it; the "
                              "segments are of different runs, or were exchanged")
        last = steps[-1] if len(steps) else last
