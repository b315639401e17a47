"""The one place that knows how results are laid out in files and what things are called there."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import h5py
import numpy as np

#: Newest layout of files that this reader knows
SCHEMA_VERSION = 1

#: Name of a segment: trajectory_0001.h5, or trajectory_0001.h5.open while it is written
SEGMENT_NAME = re.compile(r"trajectory_(\d{4,})\.h5(\.open)?")

#: End of the name of a segment that is being written
OPEN_SUFFIX = ".open"

#: What h5py raises for files that are incomplete or not what they should be
UNREADABLE = (OSError, KeyError, RuntimeError, ValueError)


class ResultError(Exception):
    """A result that is not there, not complete or not a result; the message says which and what to do."""


@dataclass(frozen=True)
class Frame:
    """The bodies at one time. Arrays are in the order of the identifiers; SI units."""

    #: Number of the time step
    step: int
    #: Simulated time [s]
    time: float
    #: Identifiers, (n)
    id: np.ndarray
    #: Whether each body is fixed: moved by prescription or not at all, (n)
    fixed: np.ndarray
    #: Centres of mass [m], (n, 2)
    position: np.ndarray
    #: Angles since the start [rad], (n)
    angle: np.ndarray
    #: Velocities [m/s], (n, 2)
    velocity: np.ndarray
    #: Angular velocities [rad/s], (n)
    angular_velocity: np.ndarray
    #: Vertices relative to the centres of mass at angle 0 [m], (total, 2), and where each body's begin, (n + 1)
    shape: np.ndarray
    vertex_start: np.ndarray

    @cached_property
    def vertices(self) -> list[np.ndarray]:
        """Outline of each body in the world [m]: a list of (m, 2) arrays, anticlockwise."""
        count = np.diff(self.vertex_start)
        cosine = np.repeat(np.cos(self.angle), count)
        sine = np.repeat(np.sin(self.angle), count)
        x, y = self.shape[:, 0], self.shape[:, 1]
        turned = np.column_stack([cosine * x - sine * y, sine * x + cosine * y])
        world = turned + np.repeat(self.position, count, axis=0)
        return np.split(world, self.vertex_start[1:-1])


@dataclass(frozen=True)
class Contacts:
    """The overlapping pairs of bodies at one time."""

    #: Identifier of the first body, the lower one, (n)
    first: np.ndarray
    #: Identifier of the second body, (n)
    second: np.ndarray
    #: Area of the overlap [m2], (n)
    area: np.ndarray
    #: Centroid of the overlap [m], (n, 2)
    point: np.ndarray
    #: Integral of the outward normal over the outline of the first body inside the second [m], (n, 2)
    normal: np.ndarray
    #: Force on the first body [N/m], (n, 2); the second feels the opposite
    force: np.ndarray

    def __len__(self) -> int:
        return len(self.first)


@dataclass(frozen=True)
class Walls:
    """What acts on the fixed bodies at one time."""

    #: Identifiers of the fixed bodies, (w)
    id: np.ndarray
    #: Forces of the other bodies on them [N/m], (w, 2)
    force: np.ndarray
    #: Torques about their centres of mass [N], (w)
    torque: np.ndarray


@dataclass(frozen=True)
class _Segment:
    """A readable file of the trajectory, and what of it counts."""

    path: Path
    steps: np.ndarray
    times: np.ndarray


class Trajectory:
    """The frames of a run, joined from the segments in a folder, or those of one segment.

    `times` and `steps` hold one entry per frame; frames are numbered from 0, negative numbers count from the end.
    """

    def __init__(self, path):
        path = Path(path)
        if not path.exists():
            raise ResultError(f"{path}: there is no such file or folder")
        if path.is_file() and path.name == "profile.h5":
            path = path.parent
        self.folder = path if path.is_dir() else path.parent
        self._segments = _find_segments(path) if path.is_dir() else [_read_segment(path)]
        if not self._segments and not self._profile_path.exists():
            raise ResultError(f"{path}: holds no result (neither trajectory_0001.h5 nor profile.h5)")
        self.times = np.concatenate([np.empty(0)] + [s.times for s in self._segments])
        self.steps = np.concatenate([np.empty(0, dtype=np.int64)] + [s.steps for s in self._segments])

    def __len__(self) -> int:
        return len(self.times)

    def frame(self, number: int) -> Frame:
        """The bodies of a frame."""
        segment, row = self._locate(number)
        with open_file(segment.path) as file:
            bodies, frames = file["bodies"], file["frames"]
            return Frame(
                step=int(segment.steps[row]),
                time=float(segment.times[row]),
                id=bodies["id"][:],
                fixed=bodies["fixed"][:].astype(bool),
                position=frames["position"][row],
                angle=frames["angle"][row],
                velocity=frames["velocity"][row],
                angular_velocity=frames["angular_velocity"][row],
                shape=bodies["vertex"][:],
                vertex_start=bodies["vertex_start"][:],
            )

    def contacts(self, number: int) -> Contacts:
        """The contacts of a frame."""
        segment, row = self._locate(number)
        with open_file(segment.path) as file:
            if "contacts" not in file:
                raise ResultError(f"{segment.path}: holds no contacts; run with output.contacts = .true.")
            group = file["contacts"]
            low, high = group["start"][row : row + 2]
            names = ("first", "second", "area", "point", "normal", "force")
            return Contacts(**{name: group[name][low:high] for name in names})

    def walls(self, number: int) -> Walls:
        """Forces and torques on the fixed bodies in a frame; empty if there are none."""
        segment, row = self._locate(number)
        with open_file(segment.path) as file:
            if "walls" not in file:
                return Walls(np.empty(0, dtype=np.int32), np.empty((0, 2)), np.empty(0))
            group = file["walls"]
            return Walls(group["id"][:], group["force"][row], group["torque"][row])

    @cached_property
    def ledger(self) -> dict[str, np.ndarray]:
        """Entries of the energy and momentum ledger, one value per frame; empty if it was not kept."""
        columns: dict[str, list[np.ndarray]] = {}
        for segment in self._segments:
            with open_file(segment.path) as file:
                for name, values in file.get("ledger", {}).items():
                    columns.setdefault(name, []).append(values[: len(segment.times)])
        return {name: np.concatenate(parts) for name, parts in columns.items()}

    @cached_property
    def ledger_units(self) -> dict[str, str]:
        """Unit of each entry of the ledger."""
        units: dict[str, str] = {}
        for segment in self._segments:
            with open_file(segment.path) as file:
                for name, values in file.get("ledger", {}).items():
                    units[name] = str(values.attrs.get("unit", ""))
        return units

    @cached_property
    def profile(self) -> dict:
        """Per stage: `stage` (list), `calls`, `total`, `least`, `most` [s]; of the run `seconds`, `memory` [KiB]."""
        with self._open_profile() as file:
            group = file["profile"]
            profile = {name: group[name][:] for name in ("calls", "total", "least", "most")}
            profile["stage"] = [str(name) for name in group["stage"].asstr()[:]]
            profile["seconds"] = float(group["seconds"][()])
            if "memory" in group:
                profile["memory"] = int(group["memory"][()])
            return profile

    @cached_property
    def counters(self) -> dict[str, int]:
        """Exact counts of the run."""
        with self._open_profile() as file:
            if "counters" not in file:
                return {}
            group = file["counters"]
            return {str(name): int(value) for name, value in zip(group["name"].asstr()[:], group["value"][:])}

    @cached_property
    def provenance(self) -> dict:
        """Where the result comes from: program, build, machine, input."""
        path = self._profile_path if self._profile_path.exists() else self._segments[0].path
        with open_file(path) as file:
            return {name: _plain(entry) for name, entry in file["provenance"].items()}

    @property
    def state_hash(self) -> str:
        """Hash of the bits of the last state, 16 hexadecimal digits."""
        with self._open_profile() as file:
            return _plain(file["state_hash"])

    @property
    def status(self) -> str:
        """How the run ended."""
        with self._open_profile() as file:
            return _plain(file["status"])

    @property
    def _profile_path(self) -> Path:
        return self.folder / "profile.h5"

    def _open_profile(self) -> h5py.File:
        if not self._profile_path.exists():
            raise ResultError(f"{self._profile_path}: there is no such file; it is written when a run ends")
        return open_file(self._profile_path)

    def _locate(self, number: int) -> tuple[_Segment, int]:
        row = number + len(self) if number < 0 else number
        if not 0 <= row < len(self):
            raise ResultError(f"{self.folder}: there is no frame {number}, only {len(self)} frames counted from 0")
        for segment in self._segments:
            if row < len(segment.times):
                return segment, row
            row -= len(segment.times)
        raise AssertionError("frames are counted over the same segments")


def _find_segments(folder: Path) -> list[_Segment]:
    """Segments of a folder in order; of an open segment what can be read."""
    found = {}
    for path in sorted(folder.iterdir(), reverse=True):
        match = SEGMENT_NAME.fullmatch(path.name)
        if match:
            found[int(match.group(1))] = path  # the name of a closed segment, if a renaming shows both, comes last
    segments = []
    for _, path in sorted(found.items()):
        try:
            segments.append(_read_segment(path))
        except ResultError as error:
            if not _present_path(path).name.endswith(OPEN_SUFFIX):
                raise
            warnings.warn(f"left out: {error}", stacklevel=3)
    return segments


def _read_segment(path: Path) -> _Segment:
    with open_file(path) as file:
        try:
            if "frames" not in file:
                raise ResultError(f"{path}: is not a segment of a trajectory")
            n = _complete_frames(file)
            return _Segment(path, file["frames/step"][:n], file["frames/time"][:n])
        except UNREADABLE as error:
            raise ResultError(f"{path}: cannot be read ({error})") from error


def _complete_frames(file: h5py.File) -> int:
    """Number of frames that are there in all data sets and whose last one can be read.

    A program that dies while it writes a frame may leave some data sets one row longer than others.
    """
    growing = list(file["frames"].values()) + list(file.get("ledger", {}).values())
    growing += [values for name, values in file.get("walls", {}).items() if name != "id"]
    n = min(len(values) for values in growing)
    if "contacts" in file:
        start = file["contacts/start"][:]
        rows = min(len(values) for name, values in file["contacts"].items() if name != "start")
        n = min(n, int(np.searchsorted(start, rows, side="right")) - 1)
    while n > 0:
        try:
            for values in growing:
                values[n - 1]
            return n
        except OSError:
            n -= 1
    return n


def _present_path(path: Path) -> Path:
    """The path, or that of the closed segment if a run has closed the segment since it was found."""
    if path.name.endswith(OPEN_SUFFIX) and not path.exists():
        return path.with_suffix("")
    return path


def open_file(path: Path) -> h5py.File:
    """Open a file, also one that a run is still writing or has just closed and renamed."""
    try:
        try:
            file = _open_hdf5(path)
        except OSError:
            if _present_path(path) == path:
                raise
            file = _open_hdf5(_present_path(path))
    except OSError as error:
        raise ResultError(f"{path}: cannot be read ({error})") from error
    version = int(file.attrs.get("schema_version", 0))
    if not 1 <= version <= SCHEMA_VERSION:
        file.close()
        raise ResultError(f"{path}: is not a file of polydem, or of a newer version than this reader")
    return file


def _open_hdf5(path: Path) -> h5py.File:
    try:
        return h5py.File(path, "r", locking=False)
    except (TypeError, ValueError):
        return h5py.File(path, "r")


def _plain(entry: h5py.Dataset):
    """A stored text or number as Python's own."""
    value = entry[()]
    return value.decode("utf-8") if isinstance(value, bytes) else value.item()
