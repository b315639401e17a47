"""The data of a run as the viewer holds them: rounded to stated quanta, differences between frames, deflated."""

from __future__ import annotations

import base64
import tempfile
import zlib
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..base.result_file import ResultError, reason
from ..read.frames import Frame
from ..read.trajectory import Trajectory
from .drawing import OVERLAYS
from .limits import Span
from .quantities import QUANTITIES, range_of
from .tree_cells import cell_grid

#: Quantum of positions as a share of the median equivalent diameter, of angles [rad], and of velocities as a share of
#: the greatest
POSITION_SHARE, ANGLE_QUANTUM, VELOCITY_SHARE = 1e-3, 2.0**-10, 1.0 / 2047.0

#: Steps of the magnitude of a force (its square root is rounded), of its direction, and of the arm of a contact
FORCE_STEPS, DIRECTION_STEPS, ARM_STEPS = 255, 256, 127

#: Most contacts of two bodies of several pieces that are told apart
MOST_CONTACTS = 2**10

#: Deflate level: higher ones gain little
LEVEL = 6

#: Bytes of one kind of values that wait in memory rather than in a temporary file
MOST_KEPT = 2**20


@dataclass
class Packed:
    """What goes into the page: facts, and blocks of bytes."""

    facts: dict = field(default_factory=dict)
    blocks: dict = field(default_factory=dict)

    def add(self, name: str, data: np.ndarray) -> None:
        """Deflate a block; numbers are in the order of bytes of all usual processors."""
        little = data.astype(data.dtype.newbyteorder("<"), copy=False)
        self.blocks[name] = base64.b64encode(zlib.compress(little.tobytes(), LEVEL)).decode("ascii")

    def add_series(self, name: str, values: np.ndarray, quantum: float) -> None:
        """Add one number per frame and body, rounded to a multiple of the quantum: differences in planes of bytes."""
        whole = np.rint(values / quantum).astype(np.int64)
        whole[1:] -= whole[:-1].copy()
        folded = np.where(whole >= 0, 2 * whole, -2 * whole - 1).astype(np.uint64).ravel()
        del whole
        planes = max(1, (int(folded.max(initial=0)).bit_length() + 7) // 8)
        if planes > 6:
            raise OverflowError(f"{name} spans more than the viewer can hold")
        self.add(name, np.stack([(folded >> np.uint64(8 * k)).astype(np.uint8) for k in range(planes)]))
        self.facts["series"][name] = {"quantum": quantum, "planes": planes}


class _Rows:
    """Values of all frames; many wait in a temporary file without a name: together they are larger than the rest."""

    def __init__(self, kind) -> None:
        self.kind = np.dtype(kind)
        self.count: list[int] = []
        self.file = tempfile.SpooledTemporaryFile(MOST_KEPT)  # noqa: SIM115  open as long as the values are needed

    def add(self, values: np.ndarray) -> None:
        """Append the values of a frame."""
        self.count.append(len(values))
        try:
            self.file.write(values.astype(self.kind).tobytes())
            self.file.flush()
        except OSError as error:
            where = "temporary files, in TMPDIR or /tmp"
            raise ResultError(f"{where}: cannot be written ({reason(error)})") from error

    def read(self) -> np.ndarray:
        """All values."""
        self.file.seek(0)
        return np.frombuffer(self.file.read(), dtype=self.kind)


class _Contacts:
    """The contacts of all frames, each with one row in the list of all pairs of the run."""

    def __init__(self) -> None:
        self.keys, self.arms, self.forces = _Rows(np.int64), _Rows(np.float32), _Rows(np.float32)
        self.bodies = 0

    def add(self, frame: Frame) -> None:
        """Append those of a frame. The arm goes from a free body, the first if both are."""
        contacts = frame.contacts
        self.bodies = len(frame.id)
        order = np.lexsort((contacts.second_index, contacts.first_index))
        first, second = contacts.first_index[order], contacts.second_index[order]
        pair = first.astype(np.int64) * self.bodies + second
        # Two bodies of several pieces may have several contacts, each with a row of its own in the list of pairs.
        self.keys.add(pair * MOST_CONTACTS + np.minimum(np.arange(len(pair)) - np.searchsorted(pair, pair),
                                                        MOST_CONTACTS - 1))
        # The point lies at the first body, and in a periodic cell perhaps at another copy of the second one.
        self.arms.add(np.where(frame.fixed[first][:, None], contacts.second_arm[order], contacts.first_arm[order]))
        self.forces.add(contacts.force[order])

    def pack(self, packed: Packed, reach: float) -> None:
        """Write the list of pairs, which of them each frame has, and arms and forces of these."""
        pairs = self._pack_pairs(packed)
        for name, arm in zip(("arm_x", "arm_y"), self.arms.read().reshape(-1, 2).T):
            packed.add(name, np.clip(np.rint(arm * (ARM_STEPS / reach)), -127, 127).astype(np.int8))
        forces = self.forces.read().reshape(-1, 2)
        size = np.hypot(forces[:, 0], forces[:, 1])
        greatest = float(size.max(initial=0.0)) or 1.0
        packed.add("force", np.rint(np.sqrt(size / greatest) * FORCE_STEPS).astype(np.uint8))
        direction = np.rint(np.arctan2(forces[:, 1], forces[:, 0]) * (DIRECTION_STEPS / (2.0 * np.pi)))
        packed.add("direction", (direction.astype(np.int16) % DIRECTION_STEPS).astype(np.uint8))
        covered = float(np.percentile(size, 99.0)) if len(size) else 0.0
        packed.facts["contacts"] = {"count": self.keys.count, "pairs": pairs, "reach": reach,
                                    "greatest": greatest, "covered": covered or greatest}

    def _pack_pairs(self, packed: Packed) -> int:
        """Write all pairs and which of them each frame has; returns their number."""
        keys, count = self.keys.read(), self.keys.count
        pairs = np.unique(keys)
        changed = np.zeros((len(count), -(-len(pairs) // 8)), dtype=np.uint8)
        before = changed[0]
        for row, those in zip(changed, np.split(keys, np.cumsum(count)[:-1])):
            present = np.zeros(len(pairs), dtype=bool)
            present[np.searchsorted(pairs, those)] = True
            bits = np.packbits(present, bitorder="little")
            row[:] = bits ^ before
            before = bits
        packed.add("pair_first", (pairs // MOST_CONTACTS // self.bodies).astype(np.uint32))
        packed.add("pair_second", (pairs // MOST_CONTACTS % self.bodies).astype(np.uint32))
        packed.add("present", changed)
        return len(pairs)


class _Everybody:
    """All bodies that some frames have: those that a frame lacks lie far outside, since the viewer has one list."""

    def __init__(self, frames: Trajectory):
        outlines: dict[int, tuple] = {}
        low, high = np.full(2, np.inf), np.full(2, -np.inf)
        before, lists = None, 0
        self._bodies: dict[str, Any] | None = None
        for frame in frames:
            if before is not None and np.array_equal(before, frame.id):
                continue
            before, lists = frame.id, lists + 1
            low, high = np.minimum(low, frame.vertex.min(axis=0)), np.maximum(high, frame.vertex.max(axis=0))
            for k in np.flatnonzero(~np.isin(frame.id, list(outlines))):
                part = slice(frame.vertex_start[k], frame.vertex_start[k + 1])
                outlines[int(frame.id[k])] = (frame.fixed[k], frame.mass[k], frame.inertia[k], frame.material[k],
                                              frame.shape[part])
        if lists <= 1:
            return
        ids = np.array(sorted(outlines))
        names = ("fixed", "mass", "inertia", "material")
        self._bodies = {name: np.array([outlines[key][k] for key in ids]) for k, name in enumerate(names)}
        shapes = [outlines[key][4] for key in ids]
        self._bodies |= {"id": ids, "shape": np.concatenate(shapes),
                         "vertex_start": np.concatenate([[0], np.cumsum([len(shape) for shape in shapes])])}
        self._far = low - 4.0 * (high - low)

    def with_absent(self, frame: Frame) -> tuple[Frame, np.ndarray | None]:
        """A frame with all bodies, and which of them it lacks; None if all frames have all of them."""
        if self._bodies is None:
            return frame, None
        present = np.isin(self._bodies["id"], frame.id)
        columns: dict[str, Any] = {}
        for name in ("position", "angle", "velocity", "angular_velocity", "image", "shear_offset"):
            values = getattr(frame, name)
            if values is None:
                continue
            columns[name] = np.zeros((len(present), *values.shape[1:]), dtype=values.dtype)
            columns[name][present] = values
        columns["position"][~present] = self._far
        return replace(frame, **self._bodies, **columns), ~present


def pack_run(trajectory: Trajectory, numbers: list[int], contacts: bool = True, progress=None) -> Packed:
    """Read frames and pack them."""
    contacts = contacts and trajectory.has_contacts
    packed = Packed({"series": {}})
    columns = {name: _Rows(np.float64) for name in ("x", "y", "angle", "vx", "vy", "spin")}
    values = {name: _Rows(np.float32) for name, each in QUANTITIES.items() if contacts or not each.needs_contacts}
    table, first, span = _Contacts(), None, Span(trajectory[0])
    everybody = _Everybody(trajectory[numbers])
    cells: list[list[float]] = []
    for present in trajectory[numbers]:
        frame, absent = everybody.with_absent(present)
        if first is None:
            first = frame
            _pack_bodies(packed, frame)
        for name, column in zip(columns, (*frame.position.T, frame.angle, *frame.velocity.T, frame.angular_velocity)):
            columns[name].add(column)
        for name, collected in values.items():
            if not (QUANTITIES[name].constant and collected.count):
                found = QUANTITIES[name].values(frame)
                if absent is not None and not QUANTITIES[name].constant:
                    found = np.where(absent, np.nan, found)
                collected.add(found[~frame.fixed])
        span.add(present)
        cells.append([*map(float, (*present.cell_low, *present.cell_size, present.shift))])
        if contacts:
            table.add(frame)
        if progress:
            progress()
    if first is None:
        raise ResultError(f"{trajectory.folder}: there are no frames to show")
    reach = _pack_columns(packed, columns, first)
    if contacts:
        table.pack(packed, reach)
    _describe(packed, trajectory, numbers, values)
    if present.cell_size.any():
        packed.facts["cells"] = cells
    packed.facts["limits"] = [float(side) for corner in span.limits() for side in corner]
    return packed


def _pack_bodies(packed: Packed, frame: Frame) -> None:
    """What does not change."""
    packed.add("shape", frame.shape.astype(np.float32))
    packed.add("start", frame.vertex_start.astype(np.uint32))
    packed.add("id", frame.id.astype(np.int32))
    packed.add("fixed", frame.fixed.astype(np.uint8))
    packed.add("mass", np.where(np.isfinite(frame.mass), frame.mass, np.nan).astype(np.float32))
    packed.add("material", frame.material.astype(np.int32))
    grid = cell_grid(frame)
    in_tree = np.zeros(len(frame.id), dtype=np.uint8)
    if grid is not None:
        in_tree[grid.bodies] = 1
        packed.facts["grid"] = {"finest": grid.finest, "origin": list(grid.origin)}
    packed.add("in_tree", in_tree)
    packed.facts["bodies"] = len(frame.id)


def _pack_columns(packed: Packed, columns: dict[str, _Rows], first: Frame) -> float:
    """Positions, angles and velocities; returns the greatest radius of the free bodies."""
    free = ~first.fixed
    chosen = free if free.any() else np.ones(len(free), dtype=bool)
    diameter = float(np.median(first.equivalent_diameter[chosen]))
    quanta = {"x": POSITION_SHARE * diameter, "y": POSITION_SHARE * diameter, "angle": ANGLE_QUANTUM}
    for name, collected in columns.items():
        series = collected.read().reshape(len(collected.count), -1)
        quantum = quanta.get(name) or (float(np.abs(series).max(initial=0.0)) * VELOCITY_SHARE or 1.0)
        packed.add_series(name, series, quantum)
    packed.facts["size"] = diameter
    return float(first.radius[chosen].max())


def _describe(packed: Packed, trajectory: Trajectory, numbers: list[int],
              values: dict[str, _Rows]) -> None:
    """Times, names, ranges, colours and curves."""
    import matplotlib

    facts = packed.facts
    facts["times"] = [float(time) for time in trajectory.times[numbers]]
    facts["frames"] = [int(number) % len(trajectory) for number in numbers]
    facts["name"] = trajectory.folder.resolve().name.encode("utf-8", "replace").decode()
    facts["overlays"] = {name: OVERLAYS[name] for name in ("forces", "contacts", "boxes", "cells")
                         if "contacts" in facts or name in ("boxes", "cells")}
    facts["quantities"], maps = {}, {}
    for name, collected in values.items():
        quantity = QUANTITIES[name]
        facts["quantities"][name] = {"title": quantity.title, "unit": quantity.unit, "map": quantity.colours,
                                     "range": range_of(quantity, collected.read()), "count": quantity.count}
        colours = matplotlib.colormaps[quantity.colours]
        table = colours(np.linspace(0.0, 1.0, 256)) if not quantity.count else colours(
            np.minimum(np.arange(256) * quantity.count // 256, colours.N - 1))
        maps[quantity.colours] = base64.b64encode((255.0 * table[:, :3] + 0.5).astype(np.uint8).tobytes()).decode()
    facts["maps"] = maps
    units = trajectory.balance_units
    facts["curves"] = {name: {"unit": units.get(name, ""), "values": [_number(value) for value in series[numbers]]}
                       for name, series in trajectory.energy_balance.items()}


def _number(value: float):
    """A number that JSON can hold."""
    return float(f"{value:.7g}") if np.isfinite(value) else None
