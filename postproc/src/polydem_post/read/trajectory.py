"""A trajectory: the frames of a run, joined from the segments in its folder, with profile and provenance."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any, Union, overload

import h5py
import numpy as np
import numpy.typing as npt

from ..base.polygons import join_pieces
from ..base.result_file import (
    ResultError,
    balance_of,
    entries_of,
    insist,
    plain,
    reading,
    series_of,
)
from .contacts import Contacts, Walls
from .frames import CONTACT_FIELDS, Frame, find_contacts, sound_frame
from .result_folder import ResultFolder
from .segments import Segment
from .settings import Settings
from .tables import OTHER_BODIES, trajectory_dataset, trajectory_table

#: Columns of bodies that change from frame to frame
GROWING = ("position", "angle", "velocity", "angular_velocity")

#: Several frames: a slice, or numbers or truth values of frames
Choice = Union[slice, list[int], npt.NDArray[Any]]


class NoFrame(ResultError, IndexError):
    """A frame that a trajectory does not have."""


class Trajectory:
    """The frames of a run, joined from the segments in a folder, or those of one segment.

    A trajectory is a sequence of frames that are read when they are used, one at a time: `len(run)`, `run[0]`,
    `run[-1]`, `for frame in run`, `run.at(0.5)`. `run[10:20]`, `run[::5]` and `run[run.times > 1.0]` are trajectories
    of some of the frames; nothing is read for them.

        folder  [path]  folder of the result
        times   [s]     simulated time of each frame, (frames)
        steps   [1]     number of the time step of each frame, (frames)

    `path` is the folder of a result, or one of its segments. Names, sizes, numbers and steps of the segments are
    compared with the manifest of the result at once, all their bytes when a segment is first used; `check=False` leaves
    that out. A result without a manifest is read with a warning.
    """

    def __init__(self, path: str | PathLike[str], check: bool = True):
        self._files = ResultFolder(Path(path), check)
        self.folder = self._files.folder
        self.times = self._files.times
        self.steps = self._files.steps
        #: Numbers of the frames of this trajectory in the whole run
        self._numbers = np.arange(len(self.times))
        #: Segment that was read last, with its bodies and the first row of each of its frames
        self._bodies: tuple[Path | None, dict[str, Any], Any] = (None, {}, ())
        #: What is added to positions and points of contact [m], (2); None if nothing is
        self._shift: npt.NDArray[np.float64] | None = None

    # --- a sequence of frames -------------------------------------------------------------------------------------

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.times)

    def __iter__(self) -> Iterator[Frame]:
        """All frames in turn. Each segment is opened once."""
        numbers = list(self._numbers)
        while numbers:
            segment, _ = self._files.locate(int(numbers[0]))
            with self._files.open_segment(segment) as file:
                while numbers:
                    here, row = self._files.locate(int(numbers[0]))
                    if here is not segment:
                        break
                    yield self._frame_in(file, segment, row, int(numbers.pop(0)))

    @overload
    def __getitem__(self, which: int) -> Frame: ...

    @overload
    def __getitem__(self, which: Choice) -> Trajectory: ...

    def __getitem__(self, which: Any) -> Frame | Trajectory:
        """A frame by its number, or the trajectory of several: a slice, numbers, or a truth value for each frame."""
        if isinstance(which, (int, np.integer)):
            return self.frame(int(which))
        chosen = copy.copy(self)
        chosen.__dict__.pop("energy_balance", None)
        index = which if isinstance(which, slice) else np.asarray(which)
        try:
            chosen.times, chosen.steps = self.times[index], self.steps[index]
            chosen._numbers = self._numbers[index]
        except IndexError as error:
            if isinstance(index, np.ndarray) and index.dtype.kind == "i":
                for number in index.ravel():
                    self._whole_number(int(number))  # says which frame is not there
            raise NoFrame(f"{self.folder}: {error}") from error
        return chosen

    def __repr__(self) -> str:
        """Folder, number of frames, times, bodies, contacts, and whether the run has ended."""
        if len(self) == 0:
            return f"<Trajectory {self.folder}: no frames>"
        try:
            first = self.frame(0)
            bodies = f"{len(first)} bodies ({int(first.free.sum())} free)"
            contacts = "with contacts" if self.has_contacts else "without contacts"
        except ResultError as error:
            return f"<Trajectory {self.folder}: {len(self)} frames that cannot be read: {error}>"
        ended = "finished" if status_of(self.folder) == "finished" else "not finished"
        return (f"<Trajectory {self.folder}: {len(self)} frames, {self.times[0]:.6g} to {self.times[-1]:.6g} s, "
                f"{bodies}, {contacts}, {ended}>")

    def frame(self, number: int) -> Frame:
        """A frame by its number in this trajectory, from 0; negative numbers count from the end."""
        whole = self._whole_number(number)
        segment, row = self._files.locate(whole)
        with self._files.open_segment(segment) as file:
            return self._frame_in(file, segment, row, whole)

    def at(self, time: float) -> Frame:
        """The frame that is nearest to a time [s]; of two equally near ones the earlier.

        The time may lie at most one interval between frames outside the span of the trajectory.
        """
        if len(self) == 0:
            raise NoFrame(f"{self.folder}: there are no frames")
        interval = float(np.max(np.diff(self.times))) if len(self) > 1 else 0.0
        if not self.times[0] - interval <= time <= self.times[-1] + interval:
            raise NoFrame(f"{self.folder}: there is no frame near {time:g} s, but from {self.times[0]:g} to "
                          f"{self.times[-1]:g} s")
        return self.frame(int(np.argmin(np.abs(self.times - time))))

    def contacts(self, number: int) -> Contacts:
        """The contacts of a frame by its number in this trajectory, as `frame(number).contacts`."""
        return self.frame(number).contacts

    def walls(self, number: int) -> Walls:
        """Forces and torques on the fixed bodies in a frame by its number; empty if there are none."""
        return self._read_walls(self._whole_number(number))

    @cached_property
    def has_contacts(self) -> bool:
        """Whether the run wrote its contacts."""
        if not self._files.segments:
            return False
        with self._files.open_segment(self._files.segments[0]) as file:
            return "contacts" in file

    def series(self, name: str, index: Any = None) -> npt.NDArray[Any]:
        """A column of all frames as one array in the unit of the column, (frames, n, ...).

        `name` is that of any column of Frame with one value or vector per body; `index` chooses bodies by index or
        truth value. All of it is in memory at once: 16 bytes per frame and body for positions.
        """
        parts = []
        identifiers = None
        for frame in self:
            if identifiers is not None and not np.array_equal(identifiers, frame.id):
                raise ResultError(f"{self.folder}: {OTHER_BODIES}")
            identifiers = frame.id
            column = np.asarray(getattr(frame, name))
            if len(column) != len(frame):
                raise ResultError(f"{name} is not one value per body")
            parts.append(column if index is None else column[index])
        if not parts:
            raise NoFrame(f"{self.folder}: there are no frames")
        return np.stack(parts)

    def to_pandas(self) -> Any:
        """The bodies of all frames as one pandas table, indexed by time [s] and identifier; all of it is in memory.

        Columns and units are those of Frame; vectors become two columns (position_x, position_y).
        """
        return trajectory_table(self)

    def to_xarray(self) -> Any:
        """The bodies of all frames as an xarray data set with the dimensions time, id and axis, and with units."""
        return trajectory_dataset(self)

    # --- what belongs to the run ----------------------------------------------------------------------------------

    @cached_property
    def settings(self) -> Settings:
        """The stored namelist with all defaults filled in: run.settings.forces.stiffness."""
        text = str(self.provenance.get("resolved_input", ""))
        return Settings(text)

    @cached_property
    def energy_balance(self) -> dict[str, npt.NDArray[Any]]:
        """Entries of the energy and momentum balance by name, each (frames); empty if it was not computed.

        `balance_units` has their units: J/m for energies and work, N s/m for momentum, N s for angular momentum.
        """
        columns: dict[str, list[npt.NDArray[Any]]] = {}
        for segment in self._files.segments:
            with self._files.open_segment(segment) as file:
                for name, values in entries_of(balance_of(file)):
                    part = values[: len(segment.times)]
                    insist(segment.path, "energy_balance", {name: part}, {name: (len(segment.times),)}, finite=False)
                    columns.setdefault(name, []).append(part)
        lengths = {sum(map(len, parts)) for parts in columns.values()}
        if lengths - {len(self._files.times)}:
            raise ResultError(f"{self.folder}: the energy balance lacks entries in some of its segments")
        return {name: np.concatenate(parts)[self._numbers] for name, parts in columns.items()}

    @cached_property
    def time_series(self) -> dict[str, npt.NDArray[Any]]:
        """The series of walls and loads by name, each (rows); empty without `series_interval` in &output.

        Its columns are `time`, `step`, `<wall>.force_x` and the like, with all rows of the run, also of some frames.
        `time_series_units` has their units.
        """
        columns: dict[str, list[npt.NDArray[Any]]] = {}
        for segment in self._files.segments:
            with self._files.open_segment(segment) as file:
                parts = {name: values[:] for name, values in entries_of(series_of(file))}
                if not parts or not len(segment.steps):
                    continue
                # A program that dies while it writes rows may leave some columns longer than others.
                n = min(map(len, parts.values()))
                n = int(np.searchsorted(parts["step"][:n], segment.steps[-1], side="right"))
                insist(segment.path, "series", {name: part[:n] for name, part in parts.items()},
                       dict.fromkeys(parts, (n,)), finite=False)
                for name, part in parts.items():
                    columns.setdefault(name, []).append(part[:n])
        if len({sum(map(len, parts)) for parts in columns.values()}) > 1:
            raise ResultError(f"{self.folder}: the series lacks columns in some of its segments")
        return {name: np.concatenate(parts) for name, parts in columns.items()}

    @cached_property
    def departures(self) -> dict[str, npt.NDArray[Any]]:
        """Bodies that have left through a &sink, by name, each (rows); empty if there are none.

        step        [1]     first step without the body
        time        [s]     time of this step
        sink        [1]     number of the sink among the groups &sink, from 1
        id          [1]     identifier of the body
        mass        [kg/m]  its mass
        velocity_x, velocity_y  [m/s]  its velocity when it left
        x, y        [m]     place of its centre of mass then
        """
        columns: dict[str, list[npt.NDArray[Any]]] = {}
        for segment in self._files.segments:
            with self._files.open_segment(segment) as file:
                if "departures" not in file or not len(segment.steps):
                    continue
                parts = {name: values[:] for name, values in entries_of(file["departures"])}
                n = min(map(len, parts.values()))
                n = int(np.searchsorted(parts["step"][:n], segment.steps[-1], side="right"))
                insist(segment.path, "departures", {name: part[:n] for name, part in parts.items()},
                       dict.fromkeys(parts, (n,)))
                for name, part in parts.items():
                    whole = name in ("sink", "id")
                    columns.setdefault(name, []).append(part[:n].astype(np.int64) if whole else part[:n])
        return {name: np.concatenate(parts) for name, parts in columns.items()}

    @cached_property
    def time_series_units(self) -> dict[str, str]:
        """Unit of each column of `time_series` by name."""
        units: dict[str, str] = {}
        for segment in self._files.segments:
            with reading(segment.path) as file:
                for name, values in entries_of(series_of(file)):
                    units[name] = str(values.attrs.get("unit", ""))
        return units

    @cached_property
    def balance_units(self) -> dict[str, str]:
        """Unit of each entry of `energy_balance` by name."""
        units: dict[str, str] = {}
        for segment in self._files.segments:
            with reading(segment.path) as file:
                for name, values in entries_of(balance_of(file)):
                    units[name] = str(values.attrs.get("unit", ""))
        return units

    @cached_property
    def profile(self) -> dict[str, Any]:
        """Times of the stages of a time step, and of the whole run.

        Per stage: `stage` (names), `calls` [1], `total`, `least` and `most` [s], each (stages). Of the run: `seconds`
        [s], and `memory`, the greatest [KiB].
        """
        with self._files.open_profile() as file:
            group = file["profile"]
            profile: dict[str, Any] = {name: group[name][:] for name in ("calls", "total", "least", "most")}
            profile["stage"] = [str(name) for name in group["stage"].asstr()[:]]
            n = len(profile["stage"])
            columns = {name: profile[name] for name in ("calls", "total", "least", "most")}
            insist(self._files.profile_path, "profile", columns, dict.fromkeys(columns, (n,)), finite=False)
            profile["seconds"] = float(group["seconds"][()])
            if "memory" in group:
                profile["memory"] = int(group["memory"][()])
            return profile

    @cached_property
    def counters(self) -> dict[str, int]:
        """Exact counts of the run by name [1], such as `pairs began` and `finder tests`; a run prints them."""
        with self._files.open_profile() as file:
            if "counters" not in file:
                return {}
            group = file["counters"]
            names = [str(name) for name in group["name"].asstr()[:]]
            return dict(zip(names, map(int, group["value"][:])))

    @cached_property
    def provenance(self) -> dict[str, Any]:
        """Where the result comes from, by name: program, revision, compiler, machine, input and others."""
        with self._files.open_any() as file:
            return {name: plain(entry) for name, entry in entries_of(file["provenance"])}

    @cached_property
    def origin(self) -> tuple[float, float]:
        """The point (x, y) that `import --origin` made the origin of this run [m]; (0, 0) if it did not."""
        return float(self.provenance.get("origin_x", 0.0)), float(self.provenance.get("origin_y", 0.0))

    def in_world(self) -> Trajectory:
        """The trajectory with `origin` added to positions, vertices and points of contact.

        Energies, angular momenta and torques of walls remain those about the origin of the run.
        """
        world = copy.copy(self)
        world._shift = np.array(self.origin) if any(self.origin) else None
        return world

    @property
    def state_hash(self) -> str:
        """Hash of the bits of the last state, 16 hexadecimal digits."""
        with self._files.open_profile() as file:
            return str(plain(file["state_hash"]))

    @property
    def status(self) -> str:
        """How the run ended: `finished`, what interrupted it, or `not ended` if it goes on or was killed."""
        if not self._files.profile_path.exists():
            return "not ended"
        with self._files.open_profile() as file:
            return str(plain(file["status"]))

    # --- reading --------------------------------------------------------------------------------------------------

    def _whole_number(self, number: int) -> int:
        """Number in the whole run of a frame of this trajectory."""
        row = number + len(self) if number < 0 else number
        if not 0 <= row < len(self):
            raise NoFrame(f"{self.folder}: there is no frame {number}, only {len(self)} frames counted from 0")
        return int(self._numbers[row])

    def _frame_in(self, file: h5py.File, segment: Segment, row: int, number: int) -> Frame:
        frames = file["frames"]
        bodies_change = "id" in frames
        # A run that goes on appends frames, and perhaps bodies, to its open segment.
        if (self._bodies[0] != segment.path or row + 1 >= len(self._bodies[2])
                or (bodies_change and len(file["bodies/id"]) != len(self._bodies[1]["id"]))):
            self._bodies = (segment.path, _bodies_in(file), frames["start"][:])
        _, bodies, start = self._bodies
        rows = slice(int(start[row]), int(start[row + 1]))
        if "cell_size" in frames:
            bodies = {**bodies, "cell_low": frames["cell_low"][row], "cell_size": frames["cell_size"][row]}
        if bodies_change:
            bodies = chosen_bodies(_present(segment.path, frames["id"][rows], bodies["id"]), bodies)
        others = [name for name in ("image", "shear_offset", "damping_work", "friction_work") if name in frames]
        columns = {name: frames[name][rows] for name in (*GROWING, *others)}
        shift = float(frames["shift"][row]) if "shift" in frames else 0.0
        jump = self._jump(bodies["cell_size"][1], float(segment.times[row])) if "shift" in frames else 0.0
        if self._shift is not None:
            columns["position"] = columns["position"] + self._shift
            bodies = {**bodies, "cell_low": bodies["cell_low"] + self._shift} if "cell_low" in bodies else bodies
        if "present" in file.get("walls", ()):
            columns, bodies = _without(file["walls/id"][:][file["walls/present"][row] == 0], columns, bodies)
        names = tuple(self.settings.get("material", {})) if "material" in bodies else ()
        return sound_frame(segment.path, Frame(
            step=int(segment.steps[row]), time=float(segment.times[row]), number=number, shift=shift, jump=jump,
            material_names=names, **columns, **bodies, _source=self))

    def _jump(self, height: float, time: float) -> float:
        """Velocity along x of the copy above a sheared cell of this height [m/s]; `find_shear` of cell.f90."""
        cell = self.settings.cell
        share = min(time / cell.shear_ramp, 1.0) if cell.get("shear_ramp", 0.0) > 0.0 else 1.0
        return float(cell.get("shear_rate", 0.0) * height * share**2 * (3.0 - 2.0 * share))

    def contacts_of(self, frame: Frame) -> Contacts:
        """The contacts of a frame of this run; `frame.contacts` calls it."""
        segment, row = self._files.locate(frame.number)
        with self._files.open_segment(segment) as file:
            if "contacts" not in file:
                raise ResultError(f"{segment.path}: holds no contacts; run with output.contacts = .true.")
            group = file["contacts"]
            low, high = (int(each) for each in group["start"][row : row + 2])
            others = [name for name in group if name not in (*CONTACT_FIELDS, "start")]
            columns = {name: group[name][low:high] for name in (*CONTACT_FIELDS, *others)}
            shapes = {name: (high - low, *([2] if name in ("point", "normal", "force") else []))
                      for name in CONTACT_FIELDS}
            shapes |= {name: (high - low, *group[name].shape[1:]) for name in others}
            insist(segment.path, "contacts", columns, shapes)
        if self._shift is not None:
            columns["point"] = columns["point"] + self._shift
        try:
            return find_contacts(frame, columns)
        except ResultError as error:
            raise ResultError(f"{segment.path}: contacts: {error}") from error

    def walls_of(self, frame: Frame) -> Walls:
        """Forces and torques on the fixed bodies in a frame of this run; `frame.walls` calls it."""
        return self._read_walls(frame.number)

    def _read_walls(self, number: int) -> Walls:
        segment, row = self._files.locate(number)
        with self._files.open_segment(segment) as file:
            if "walls" not in file:
                return Walls(np.empty(0, dtype=np.int32), np.empty((0, 2)), np.empty(0))
            group = file["walls"]
            kept = group["present"][row] == 1 if "present" in group else slice(None)
            walls = Walls(group["id"][:][kept], group["force"][row][kept], group["torque"][row][kept])
            n = len(walls.id)
            insist(segment.path, "walls", vars(walls), {"id": (n,), "force": (n, 2), "torque": (n,)})
            return walls

    def driven_of(self, frame: Frame) -> npt.NDArray[np.bool_]:
        """Which bodies the stored namelist moves, (n): all fixed ones, or those that a motion lists."""
        if self.settings.get("scene", {}).get("motion", "none") != "none":
            raise ResultError(f"{self.folder}: is of an earlier revision: `motion` in its &scene is a group &motion "
                              "today, so which walls move cannot be read; run the scene again")
        bodies = {"id": frame.id, "fixed": frame.fixed, **self._bodies[1]}
        walls = wall_bodies(self.settings, bodies["id"][bodies["fixed"]])
        chosen = [walls[motion["wall"]] if motion.get("wall") else motion.get("bodies")
                  for motion in self.settings.get("motion", {}).values()]
        chosen += [walls[load["wall"]] for load in self.settings.get("load", {}).values()]
        if any(ids is None for ids in chosen):
            return frame.fixed
        return frame.fixed & np.isin(frame.id, np.concatenate([np.atleast_1d(ids) for ids in [[], *chosen]]))

    def origin_for(self, frame: Frame) -> tuple[float, float]:
        """The point that the coordinates of a frame lack [m]: `origin`, and (0, 0) in a trajectory in the world."""
        return self.origin if self._shift is None else (0.0, 0.0)


def wall_bodies(settings: Settings, ids: npt.NDArray[Any]) -> dict[str, Any]:
    """Identifiers of the bodies of each group &wall: the last fixed ones, wall after wall, or those it lists."""
    counts = {}
    for name, wall in settings.get("wall", {}).items():
        corners = np.size(wall.get("vertices", [])) // 2
        counts[name] = {"bodies": 0, "ring": wall.get("segments"), "row": wall.get("segments"),
                        "polyline": corners - (not wall.get("closed"))}.get(wall["outline"], 1)
    ends = len(ids) - sum(counts.values()) + np.cumsum([0, *counts.values()])
    found = {name: np.sort(ids)[first:last] for name, first, last in zip(counts, ends, ends[1:])}
    listed = {name: np.atleast_1d(wall["bodies"]) for name, wall in settings.get("wall", {}).items()
              if wall["outline"] == "bodies"}
    return {**found, **listed}


def _without(gone: Any, columns: dict[str, Any], bodies: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Columns of a frame, and of its bodies, without bodies that are gone."""
    kept = ~np.isin(bodies["id"], gone)
    if kept.all():
        return columns, bodies
    return {name: values[kept] for name, values in columns.items()}, chosen_bodies(kept, bodies)


def _present(path: Path, ids: npt.NDArray[Any], known: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Which of the bodies of a segment a frame has."""
    kept: npt.NDArray[np.bool_] = np.isin(known, ids)
    if np.count_nonzero(kept) != len(ids):
        raise ResultError(f"{path}: frames/id names bodies that bodies/id does not have")
    return kept


def chosen_bodies(kept: npt.NDArray[np.bool_], bodies: dict[str, Any]) -> dict[str, Any]:
    """Columns of some bodies."""
    corners = np.diff(bodies["vertex_start"])
    start = np.concatenate([[0], np.cumsum(corners[kept])]).astype(bodies["vertex_start"].dtype)
    shape = bodies["shape"][np.repeat(kept, corners)]
    rows = {name: values if name.startswith("cell_") else values[kept]
            for name, values in bodies.items() if name not in ("shape", "vertex_start")}
    return {**rows, "shape": shape, "vertex_start": start}


def _bodies_in(file: h5py.File) -> dict[str, Any]:
    """Columns of bodies that do not change; a stored mass of 0 is an infinite one."""
    bodies = file["bodies"]
    columns = {"id": bodies["id"][:], "fixed": bodies["fixed"][:].astype(bool), "shape": bodies["vertex"][:],
               "vertex_start": bodies["vertex_start"][:]}
    if "piece" in bodies:
        columns["shape"], columns["vertex_start"] = join_pieces(columns["shape"], columns["vertex_start"],
                                                                bodies["piece"][:])
    for name in ("mass", "inertia"):
        values = bodies[name][:]
        columns[name] = np.where(values == 0.0, np.inf, values)
    if "material" in bodies:
        columns["material"] = bodies["material"][:].astype(np.int64)
    if "cell" in file:
        columns.update(cell_low=file["cell/low"][:], cell_size=file["cell/size"][:])
    return columns


def status_of(folder: Path) -> str:
    """How the run of a result folder ended; empty if there is no readable profile.h5."""
    return _entry_of(folder, "status")


def input_of(folder: Path) -> str:
    """The resolved input of a result folder; empty if there is no readable profile.h5 that has it."""
    return _entry_of(folder, "provenance/resolved_input")


def warnings_of(folder: Path) -> str:
    """Numbers of warnings of each kind of the run of a result folder, in words; empty if there is none."""
    return _entry_of(folder, "warnings")


def _entry_of(folder: Path, name: str) -> str:
    try:
        with reading(folder / "profile.h5") as file:
            return str(plain(file[name])) if name in file else ""
    except ResultError:
        return ""
