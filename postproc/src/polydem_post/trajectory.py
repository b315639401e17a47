"""The one place that knows how results are laid out in files and what things are called there."""

from __future__ import annotations

import re
import warnings
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import h5py
import numpy as np

from .former_names import COUNTERS, STAGES, balance_of, present
from .manifest import MANIFEST, ManifestError, check_bytes, check_hashes, read_manifest

#: Newest layout of files that this reader knows
SCHEMA_VERSION = 3

#: Name of a segment: trajectory_0001.h5, or trajectory_0001.h5.open while it is written
SEGMENT_NAME = re.compile(r"trajectory_(\d{4,})\.h5(\.open)?")

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

#: Segments are compared with their hashes as they are needed, with those that follow up to so many bytes: many at once
#: take hardly longer than one
CHECKED_AT_ONCE = 2**26

#: Bytes that one byte of a file can stand for at most: deflate makes a thousand zeros one byte
MOST_COMPRESSED = 1100

#: Deepest nesting of groups, and most objects, of a file of polydem
DEEPEST, MOST_OBJECTS = 8, 10000


class NoManifest(UserWarning):
    """A result without a manifest is read: whether its files are what the run wrote is not known."""


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

    @property
    def name(self) -> str:
        """Name of the segment when it is closed."""
        return self.path.name.removesuffix(OPEN_SUFFIX)


class Trajectory:
    """The frames of a run, joined from the segments in a folder, or those of one segment.

    `times` and `steps` hold one entry per frame; frames are numbered from 0, negative numbers count from the end.
    Names, sizes, numbers and steps of the segments are compared with the manifest of the result at once, all their
    bytes when a segment is first used; `check=False` leaves that out. A result without a manifest is read with a
    warning.
    """

    def __init__(self, path, check: bool = True):
        path = Path(path)
        if not path.exists():
            raise ResultError(f"{path}: there is no such file or folder")
        if path.is_file() and path.name == "profile.h5":
            path = path.parent
        self.folder = path if path.is_dir() else path.parent
        self._segments = _find_segments(path) if path.is_dir() else [_read_segment(path)]
        if not self._segments and not self._profile_path.exists():
            raise ResultError(f"{path}: holds no result (neither trajectory_0001.h5 nor profile.h5)")
        self._manifest, self._unchecked = None, {}
        if check:
            self._check_manifest(path.is_dir())
        self.times = np.concatenate([np.empty(0)] + [s.times for s in self._segments])
        self.steps = np.concatenate([np.empty(0, dtype=np.int64)] + [s.steps for s in self._segments])

    def __len__(self) -> int:
        return len(self.times)

    def _check_manifest(self, whole: bool) -> None:
        """Compare what is there with the manifest, but for the bytes of the segments."""
        try:
            self._manifest = read_manifest(self.folder)
            if self._manifest is None:
                warnings.warn(f"{self.folder}: has no {MANIFEST}, since an older version made it; whether its files "
                              f"are "
                              "what was written is not known", NoManifest, stacklevel=3)
                return
            _check_names(self._segments, self._manifest, whole)
            names = sorted(set(self._manifest.closed) & {segment.name for segment in self._segments})
            if whole:
                names = sorted(name for name in self._manifest.closed if SEGMENT_NAME.fullmatch(name))
            check_bytes(self.folder, names, self._manifest)
            for segment in self._segments:
                _check_steps(segment, self._manifest.closed.get(segment.name))
        except ManifestError as error:
            raise ResultError(f"{self.folder}: {error}. The result is not what the run wrote: take it from a copy "
                              f"or run it "
                              "again; Trajectory(..., check=False) reads it as it is") from error
        sizes = {segment.name: self._manifest.closed[segment.name].bytes
                 for segment in self._segments if segment.name in self._manifest.closed}
        self._unchecked = dict(sorted(sizes.items(), key=lambda item: _number_of(item[0])))
        if "profile.h5" in self._manifest.closed:
            self._unchecked["profile.h5"] = self._manifest.closed["profile.h5"].bytes

    def _check_bytes(self, name: str) -> None:
        """Compare all bytes of a file with the manifest when it is first used, and those of some that follow."""
        if name not in self._unchecked:
            return
        names, total = [], 0
        for each in list(self._unchecked)[list(self._unchecked).index(name) :]:
            total += self._unchecked[each]
            if names and total > CHECKED_AT_ONCE:
                break
            names.append(each)
        for chosen in (names, [name]):  # if a later one is wrong, it is told when it is used
            try:
                check_bytes(self.folder, chosen, self._manifest)
                check_hashes(self.folder, chosen, self._manifest)
            except ManifestError as error:
                if chosen == [name]:
                    raise ResultError(f"{self.folder}: {error}") from error
            else:
                for each in chosen:
                    del self._unchecked[each]
                return

    def frame(self, number: int) -> Frame:
        """The bodies of a frame."""
        segment, row = self._locate(number)
        self._check_bytes(segment.name)
        with _reading(segment.path) as file:
            bodies, frames = file["bodies"], file["frames"]
            return _sound_frame(segment.path, Frame(
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
            ))

    def contacts(self, number: int) -> Contacts:
        """The contacts of a frame."""
        segment, row = self._locate(number)
        self._check_bytes(segment.name)
        with _reading(segment.path) as file:
            if "contacts" not in file:
                raise ResultError(f"{segment.path}: holds no contacts; run with output.contacts = .true.")
            group = file["contacts"]
            low, high = group["start"][row : row + 2]
            names = ("first", "second", "area", "point", "normal", "force")
            contacts = Contacts(**{name: group[name][low:high] for name in names})
            wide = {"point": 2, "normal": 2, "force": 2}
            shapes = {name: (int(high - low), *([2] if name in wide else [])) for name in names}
            _insist(segment.path, "contacts", {name: getattr(contacts, name) for name in names}, shapes)
            return contacts

    def walls(self, number: int) -> Walls:
        """Forces and torques on the fixed bodies in a frame; empty if there are none."""
        segment, row = self._locate(number)
        self._check_bytes(segment.name)
        with _reading(segment.path) as file:
            if "walls" not in file:
                return Walls(np.empty(0, dtype=np.int32), np.empty((0, 2)), np.empty(0))
            group = file["walls"]
            walls = Walls(group["id"][:], group["force"][row], group["torque"][row])
            n = len(walls.id)
            _insist(segment.path, "walls", vars(walls), {"id": (n,), "force": (n, 2), "torque": (n,)})
            return walls

    @cached_property
    def energy_balance(self) -> dict[str, np.ndarray]:
        """Entries of the energy and momentum balance, one value per frame; empty if it was not computed."""
        columns: dict[str, list[np.ndarray]] = {}
        for segment in self._segments:
            self._check_bytes(segment.name)
            with _reading(segment.path) as file:
                for name, values in balance_of(file).items():
                    part = values[: len(segment.times)]
                    _insist(segment.path, "energy_balance", {name: part}, {name: (len(segment.times),)}, finite=False)
                    columns.setdefault(name, []).append(part)
        lengths = {sum(map(len, parts)) for parts in columns.values()}
        if lengths - {len(self)}:
            raise ResultError(f"{self.folder}: the energy balance lacks entries in some of its segments")
        return {name: np.concatenate(parts) for name, parts in columns.items()}

    @cached_property
    def balance_units(self) -> dict[str, str]:
        """Unit of each entry of the energy balance."""
        units: dict[str, str] = {}
        for segment in self._segments:
            with _reading(segment.path) as file:
                for name, values in balance_of(file).items():
                    units[name] = str(values.attrs.get("unit", ""))
        return units

    @cached_property
    def profile(self) -> dict:
        """Per stage: `stage` (list), `calls`, `total`, `least`, `most` [s]; of the run `seconds`, `memory` [KiB]."""
        with self._open_profile() as file:
            group = file["profile"]
            profile = {name: group[name][:] for name in ("calls", "total", "least", "most")}
            profile["stage"] = [present(STAGES, str(name)) for name in group["stage"].asstr()[:]]
            n = len(profile["stage"])
            columns = {name: profile[name] for name in ("calls", "total", "least", "most")}
            _insist(self._profile_path, "profile", columns, dict.fromkeys(columns, (n,)), finite=False)
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
            names = [present(COUNTERS, str(name)) for name in group["name"].asstr()[:]]
            return dict(zip(names, map(int, group["value"][:])))

    @cached_property
    def provenance(self) -> dict:
        """Where the result comes from: program, build, machine, input."""
        path = self._profile_path if self._profile_path.exists() else self._segments[0].path
        self._check_bytes(path.name.removesuffix(OPEN_SUFFIX))
        with _reading(path) as file:
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

    def _open_profile(self):
        if not self._profile_path.exists():
            raise ResultError(f"{self._profile_path}: there is no such file; it is written when a run ends")
        self._check_bytes(self._profile_path.name)
        return _reading(self._profile_path)

    def _locate(self, number: int) -> tuple[_Segment, int]:
        row = number + len(self) if number < 0 else number
        if not 0 <= row < len(self):
            raise ResultError(f"{self.folder}: there is no frame {number}, only {len(self)} frames counted from 0")
        for segment in self._segments:
            if row < len(segment.times):
                return segment, row
            row -= len(segment.times)
        raise AssertionError("frames are counted over the same segments")


def status_of(folder: Path) -> str:
    """How the run of a result folder ended; empty if there is no readable profile.h5."""
    try:
        with _reading(folder / "profile.h5") as file:
            return str(_plain(file["status"]))
    except ResultError:
        return ""


def input_of(folder: Path) -> str:
    """The resolved input of a result folder; empty if there is no readable profile.h5 that has it."""
    try:
        with _reading(folder / "profile.h5") as file:
            return str(_plain(file["provenance/resolved_input"]))
    except ResultError:
        return ""


def _number_of(name: str) -> int:
    match = SEGMENT_NAME.fullmatch(name)
    return int(match.group(1)) if match else -1


def _check_names(segments: list, manifest, whole: bool) -> None:
    """All segments must belong to the result, and be numbered without gaps."""
    for segment in segments:
        if segment.name not in manifest.owned:
            raise ManifestError(f"{segment.path.name} does not belong to this result ({MANIFEST} does not have it)")
    numbers = sorted(_number_of(name) for name in manifest.closed if SEGMENT_NAME.fullmatch(name))
    if whole and numbers != list(range(1, len(numbers) + 1)):
        raise ManifestError(f"{MANIFEST} has the segments {', '.join(map(str, numbers))}, not 1 to {len(numbers)}")


def _check_steps(segment: _Segment, closed) -> None:
    """A closed segment must hold the frames and steps that it held when it was closed."""
    if closed is None or closed.frames is None:
        return
    held = (len(segment.steps), *(int(step) for step in segment.steps[[0, -1]])) if len(segment.steps) else (0, 0, 0)
    if held != (closed.frames, *((closed.first_step, closed.last_step) if closed.frames else (0, 0))):
        raise ManifestError(
            f"{segment.name} has {held[0]} frames of the steps {held[1]} to {held[2]}, but had {closed.frames} of "
            f"{closed.first_step} to {closed.last_step} when it was closed: it was changed or exchanged"
        )


def _check_order(folder: Path, segments: list) -> None:
    """Segments must be numbered without gaps, and their steps must ascend."""
    numbers = [_number_of(segment.name) for segment in segments]
    for before, after in zip(numbers, numbers[1:]):
        if after != before + 1:
            raise ResultError(f"{folder}: a segment is missing between number {before} and {after}")
    last = None
    for segment in segments:
        steps = segment.steps
        if len(steps) and (np.any(np.diff(steps) <= 0) or (last is not None and steps[0] <= last)):
            raise ResultError(f"{segment.path}: its steps do not ascend from those of the segment before it; the "
                              f"segments "
                              "are of different runs, or were exchanged")
        last = steps[-1] if len(steps) else last


def _insist(path: Path, group: str, arrays: dict, shapes: dict, finite: bool = True) -> None:
    """Insist on numbers of these shapes, which must be finite unless that is left open."""
    for name, values in arrays.items():
        values = np.asarray(values)
        if values.dtype.kind not in "iufb":
            raise ResultError(f"{path}: {group}/{name} does not hold numbers")
        if values.shape != shapes[name]:
            raise ResultError(f"{path}: {group}/{name} has the shape {values.shape}, not {shapes[name]}")
        if finite and values.dtype.kind == "f" and not np.isfinite(values).all():
            raise ResultError(f"{path}: {group}/{name} holds what is no number (NaN or infinite)")


def _sound_frame(path: Path, frame: Frame) -> Frame:
    """The frame, if its arrays fit together."""
    n, vertices = len(np.atleast_1d(frame.id)), len(np.atleast_1d(frame.shape))
    names = ("id", "fixed", "position", "angle", "velocity", "angular_velocity", "shape", "vertex_start")
    arrays = {name: getattr(frame, name) for name in names}
    shapes = {"position": (n, 2), "velocity": (n, 2), "shape": (vertices, 2), "vertex_start": (n + 1,)}
    _insist(path, "frame", arrays, {name: shapes.get(name, (n,)) for name in arrays})
    start = frame.vertex_start
    if start[0] != 0 or start[-1] != vertices or np.any(np.diff(start) < 3):
        raise ResultError(f"{path}: bodies/vertex_start does not fit the vertices")
    return frame


def _find_segments(folder: Path) -> list[_Segment]:
    """Segments of a folder in order; of an open segment what can be read."""
    found = {}
    try:
        paths = sorted(folder.iterdir(), reverse=True)
    except OSError as error:
        raise ResultError(f"{folder}: cannot be read ({error.strerror})") from error
    for path in paths:
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
    _check_order(folder, segments)
    return segments


def _read_segment(path: Path) -> _Segment:
    with _reading(path) as file:
        if "frames" not in file:
            raise ResultError(f"{path}: is not a segment of a trajectory")
        n = _complete_frames(file)
        segment = _Segment(path, file["frames/step"][:n], file["frames/time"][:n])
        _insist(path, "frames", {"step": segment.steps, "time": segment.times}, {"step": (n,), "time": (n,)})
        if segment.steps.dtype.kind not in "iu":
            raise ResultError(f"{path}: frames/step does not hold integers")
        return segment


def _complete_frames(file: h5py.File) -> int:
    """Number of frames that are there in all data sets and whose last one can be read.

    A program that dies while it writes a frame may leave some data sets one row longer than others.
    """
    growing = list(file["frames"].values()) + list(balance_of(file).values())
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
    try:
        version = int(file.attrs.get("schema_version", 0))
        if not 1 <= version <= SCHEMA_VERSION:
            raise ResultError(f"{path}: is not a file of polydem, or of a newer version than this reader")
        insist_on_own_data(path, file)
    except UNREADABLE as error:
        file.close()
        raise ResultError(f"{path}: cannot be read ({error})") from error
    except ResultError:
        file.close()
        raise
    return file


@contextmanager
def _reading(path: Path):
    """A file to read; whatever is wrong with what it holds is told in a sentence."""
    with open_file(path) as file:
        try:
            yield file
        except UNREADABLE as error:
            raise ResultError(f"{path}: cannot be read ({_reason(error)})") from error


def _reason(error: Exception) -> str:
    """What an exception says, in one line."""
    words = " ".join(str(error).split()).strip("'\"")
    return words or type(error).__name__


def insist_on_own_data(path: Path, file: h5py.File) -> None:
    """Refuse a file whose data lie in other files: what it shows would depend on what is there, or belong to others."""
    waiting, seen = [(file, "", 0)], 0
    most_bytes = MOST_COMPRESSED * Path(file.filename).stat().st_size + 2**20
    while waiting:
        group, place, depth = waiting.pop()
        for name in group:
            seen += 1
            if depth >= DEEPEST or seen > MOST_OBJECTS:
                raise ResultError(f"{path}: has groups in groups as no file of polydem has")
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
                                  f"files")


def _open_hdf5(path: Path) -> h5py.File:
    try:
        return h5py.File(path, "r", locking=False)
    except (TypeError, ValueError):
        return h5py.File(path, "r")


def _plain(entry: h5py.Dataset):
    """A stored text or number as Python's own."""
    value = entry[()]
    return value.decode("utf-8", errors="replace") if isinstance(value, bytes) else value.item()
