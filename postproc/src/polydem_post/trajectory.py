"""A trajectory: the frames of a run, joined from the segments in its folder, with profile and provenance."""

from __future__ import annotations

import warnings
from functools import cached_property
from pathlib import Path

import numpy as np

from .former_names import COUNTERS, STAGES, balance_of, present
from .frames import Contacts, Frame, Walls, sound_frame
from .manifest import MANIFEST, ManifestError, check_bytes, check_hashes, read_manifest
from .result_file import (
    OPEN_SUFFIX,
    UNREADABLE,
    ResultError,
    insist,
    insist_on_own_data,
    open_file,
    plain,
    reading,
)
from .segments import SEGMENT_NAME, Segment, check_names, check_steps, find_segments, number_of, read_segment

__all__ = ["UNREADABLE", "Contacts", "Frame", "NoManifest", "ResultError", "Trajectory", "Walls", "input_of",
           "insist_on_own_data", "open_file", "status_of"]

#: Segments are compared with their hashes as they are needed, with those that follow up to so many bytes: many at once
#: take hardly longer than one
CHECKED_AT_ONCE = 2**26


class NoManifest(UserWarning):
    """A result without a manifest is read: whether its files are what the run wrote is not known."""


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
        self._segments = find_segments(path) if path.is_dir() else [read_segment(path)]
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
                warnings.warn(f"{self.folder}: has no {MANIFEST}, since an older version made it; whether its "
                              "files are what was written is not known", NoManifest, stacklevel=3)
                return
            check_names(self._segments, self._manifest, whole)
            names = sorted(set(self._manifest.closed) & {segment.name for segment in self._segments})
            if whole:
                names = sorted(name for name in self._manifest.closed if SEGMENT_NAME.fullmatch(name))
            check_bytes(self.folder, names, self._manifest)
            for segment in self._segments:
                check_steps(segment, self._manifest.closed.get(segment.name))
        except ManifestError as error:
            raise ResultError(f"{self.folder}: {error}. The result is not what the run wrote: take it from a copy "
                              "or run it again; Trajectory(..., check=False) reads it as it is") from error
        sizes = {segment.name: self._manifest.closed[segment.name].bytes
                 for segment in self._segments if segment.name in self._manifest.closed}
        self._unchecked = dict(sorted(sizes.items(), key=lambda item: number_of(item[0])))
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
        with reading(segment.path) as file:
            bodies, frames = file["bodies"], file["frames"]
            return sound_frame(segment.path, Frame(
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
        with reading(segment.path) as file:
            if "contacts" not in file:
                raise ResultError(f"{segment.path}: holds no contacts; run with output.contacts = .true.")
            group = file["contacts"]
            low, high = group["start"][row : row + 2]
            names = ("first", "second", "area", "point", "normal", "force")
            contacts = Contacts(**{name: group[name][low:high] for name in names})
            wide = {"point": 2, "normal": 2, "force": 2}
            shapes = {name: (int(high - low), *([2] if name in wide else [])) for name in names}
            insist(segment.path, "contacts", {name: getattr(contacts, name) for name in names}, shapes)
            return contacts

    def walls(self, number: int) -> Walls:
        """Forces and torques on the fixed bodies in a frame; empty if there are none."""
        segment, row = self._locate(number)
        self._check_bytes(segment.name)
        with reading(segment.path) as file:
            if "walls" not in file:
                return Walls(np.empty(0, dtype=np.int32), np.empty((0, 2)), np.empty(0))
            group = file["walls"]
            walls = Walls(group["id"][:], group["force"][row], group["torque"][row])
            n = len(walls.id)
            insist(segment.path, "walls", vars(walls), {"id": (n,), "force": (n, 2), "torque": (n,)})
            return walls

    @cached_property
    def energy_balance(self) -> dict[str, np.ndarray]:
        """Entries of the energy and momentum balance, one value per frame; empty if it was not computed."""
        columns: dict[str, list[np.ndarray]] = {}
        for segment in self._segments:
            self._check_bytes(segment.name)
            with reading(segment.path) as file:
                for name, values in balance_of(file).items():
                    part = values[: len(segment.times)]
                    insist(segment.path, "energy_balance", {name: part}, {name: (len(segment.times),)}, finite=False)
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
            with reading(segment.path) as file:
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
            insist(self._profile_path, "profile", columns, dict.fromkeys(columns, (n,)), finite=False)
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
        with reading(path) as file:
            return {name: plain(entry) for name, entry in file["provenance"].items()}

    @property
    def state_hash(self) -> str:
        """Hash of the bits of the last state, 16 hexadecimal digits."""
        with self._open_profile() as file:
            return plain(file["state_hash"])

    @property
    def status(self) -> str:
        """How the run ended."""
        with self._open_profile() as file:
            return plain(file["status"])

    @property
    def _profile_path(self) -> Path:
        return self.folder / "profile.h5"

    def _open_profile(self):
        if not self._profile_path.exists():
            raise ResultError(f"{self._profile_path}: there is no such file; it is written when a run ends")
        self._check_bytes(self._profile_path.name)
        return reading(self._profile_path)

    def _locate(self, number: int) -> tuple[Segment, int]:
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
        with reading(folder / "profile.h5") as file:
            return str(plain(file["status"]))
    except ResultError:
        return ""


def input_of(folder: Path) -> str:
    """The resolved input of a result folder; empty if there is no readable profile.h5 that has it."""
    try:
        with reading(folder / "profile.h5") as file:
            return str(plain(file["provenance/resolved_input"]))
    except ResultError:
        return ""
