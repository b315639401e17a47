"""The bodies of a trajectory at one time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any, ClassVar, Protocol

import numpy as np
import numpy.typing as npt

from ..base.polygons import FloatArray, IntArray, following, join, moments
from ..base.result_file import ResultError, insist
from ..bodies_file import write_frame
from .contacts import Contacts, Walls
from .graphs import contact_graph, freud_system
from .tables import body_table

#: What a contact has of its own; the rest follows from the bodies
CONTACT_FIELDS = ("first", "second", "area", "point", "normal", "length", "force", "couple")

#: Distances of vertices that are held in memory at once
MOST_DISTANCES = 2**20


class FrameSource(Protocol):
    """What gives the contacts and walls of a frame when they are asked for."""

    def contacts_of(self, frame: Frame) -> Contacts:
        """The contacts of a frame."""
        ...

    def walls_of(self, frame: Frame) -> Walls:
        """The loads on the fixed bodies of a frame."""
        ...

    def driven_of(self, frame: Frame) -> npt.NDArray[np.bool_]:
        """Which bodies have a prescribed motion."""
        ...

    def origin_for(self, frame: Frame) -> tuple[float, float]:
        """The point that was subtracted from the coordinates of a frame [m]."""
        ...


@dataclass(frozen=True, eq=False, repr=False)
class Frame:
    """The bodies at one time, in ascending order of identifiers: n bodies; SI units with unit depth.

    Read from the file:

        step              [1]      number of the time step
        time              [s]      simulated time
        id                [1]      identifiers, (n)
        fixed             [1]      whether each body is fixed, at rest or in prescribed motion, (n)
        position          [m]      centres of mass, (n, 2)
        angle             [rad]    angles since the start, anticlockwise, (n)
        velocity          [m/s]    velocities of the centres of mass, (n, 2)
        angular_velocity  [rad/s]  angular velocities, anticlockwise, (n)
        shape             [m]      vertices of all bodies relative to the centres of mass at angle 0, (nv, 2)
        vertex_start      [1]      first row of each body in `shape`, from 0; at the end nv, (n + 1)
        mass              [kg/m]   masses; infinite for a fixed body without a mass of its own, (n)
        inertia           [kg m]   moments of inertia about the centres of mass; infinite likewise, (n)
        number            [1]      number of the frame in the run, from 0
        material          [1]      numbers of the materials: position in `material_names`, from 1; 0: none, (n)
        material_names    [1]      list of the names of the materials of the run
        image             [1]      cells crossed along each axis, (n, 2); None in the plane
        shear_offset              [m]      shifts of the borders of a sheared cell that each body has crossed, (n)
        damping_work      [J/m]    works of the normal damping on each body so far, (n); None without `body_works`
        friction_work     [J/m]    works of the tangential forces, likewise, (n)
        shift             [m]      displacement of the copy of a sheared cell above it, along x as of vectors
        cell_low          [m]      x and y of the lower left corner of the periodic cell, as of vectors
        cell_size         [m]      width and height of the periodic cell, as of vectors; 0 along an axis without period

    Found from the namelist:

        jump              [m/s]    velocity of the copy of a sheared cell above it, along x as of vectors

    Everything else is computed from these when it is first asked for.
    """

    step: int
    time: float
    id: npt.NDArray[np.integer[Any]]
    fixed: npt.NDArray[np.bool_]
    position: FloatArray
    angle: FloatArray
    velocity: FloatArray
    angular_velocity: FloatArray
    shape: FloatArray
    vertex_start: npt.NDArray[np.integer[Any]]
    mass: FloatArray
    inertia: FloatArray
    number: int = 0
    material: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    material_names: tuple[str, ...] = ()
    image: IntArray | None = None
    shear_offset: FloatArray | None = None
    damping_work: FloatArray | None = None
    friction_work: FloatArray | None = None
    shift: float = 0.0
    cell_low: FloatArray = field(default_factory=lambda: np.zeros(2))
    cell_size: FloatArray = field(default_factory=lambda: np.zeros(2))
    jump: float = 0.0
    _source: FrameSource | None = field(default=None)
    #: What a notebook draws, as PNG; pictures are a layer above, so the package sets it
    _repr_png_: ClassVar[Callable[[Frame], bytes]]

    def __post_init__(self) -> None:
        """Bodies without materials have number 0."""
        if not len(self.material):
            object.__setattr__(self, "material", np.zeros(len(self.id), dtype=np.int64))

    def __len__(self) -> int:
        """Number of bodies."""
        return len(self.id)

    def __repr__(self) -> str:
        """Number, time, step and bodies."""
        return (f"<Frame {self.number}: t = {self.time:.6g} s, step {self.step}, {len(self)} bodies "
                f"({int(self.free.sum())} free)>")

    @classmethod
    def from_polygons(cls, outlines: list[Any], *, fixed: Any = None, velocity: Any = None,
                      angular_velocity: Any = None, density: float = 2500.0, time: float = 0.0) -> Frame:
        """A frame of bodies with the given outlines in the world [m], each (k, 2); identifiers are 1 to n.

        For analyses of data of other programs. `fixed` has a truth value per body, `velocity` [m/s] is (n, 2),
        `angular_velocity` [rad/s] is (n); without them all bodies are free and at rest. Masses and inertias follow from
        the density [kg/m3]; those of fixed bodies are infinite. `time` is in s.
        """
        vertex, start = join([np.asarray(outline, dtype=float) for outline in outlines])
        area, centre, second = moments(vertex, start)
        n = len(outlines)
        held = np.zeros(n, dtype=bool) if fixed is None else np.asarray(fixed, dtype=bool)
        return cls(
            step=0, time=time, id=np.arange(1, n + 1), fixed=held, position=centre, angle=np.zeros(n),
            velocity=np.zeros((n, 2)) if velocity is None else np.asarray(velocity, dtype=float),
            angular_velocity=np.zeros(n) if angular_velocity is None else np.asarray(angular_velocity, dtype=float),
            shape=vertex - np.repeat(centre, np.diff(start), axis=0), vertex_start=start,
            mass=np.where(held, np.inf, density * np.abs(area)),
            inertia=np.where(held, np.inf, density * np.abs(second)))

    def with_contacts(self, first: Any, second: Any, force: Any, point: Any, normal: Any = None, area: Any = None,
                      length: Any = None, couple: Any = None) -> Frame:
        """The same frame with contacts of these identifiers, (m) each.

        `force` on the first body [N/m] and `point` [m] are (m, 2). `normal`, (m, 2), is the direction of the line of
        centres; `area` [m2], `length` [m] and `couple` on the first body [N], (m), are 0, unless they are given.
        """
        names = np.asarray(first), np.asarray(second)
        index = [_index_of(self, each) for each in names]
        line = self.position[index[1]] - self.position[index[0]]
        contacts = find_contacts(self, {
            "first": names[0], "second": names[1], "force": np.asarray(force, dtype=float).reshape(-1, 2),
            "point": np.asarray(point, dtype=float).reshape(-1, 2),
            "normal": unit_vectors(line if normal is None else np.asarray(normal, dtype=float).reshape(-1, 2)),
            **{name: np.zeros(len(names[0])) if given is None else np.asarray(given, dtype=float)
               for name, given in (("area", area), ("length", length), ("couple", couple))}})
        return replace(self, _source=_Given(contacts))

    @cached_property
    def contacts(self) -> Contacts:
        """The contacts of this frame, m rows; the run needs output.contacts = .true. Read when first asked for."""
        return self._given_source("contacts").contacts_of(self)

    @cached_property
    def walls(self) -> Walls:
        """Forces and torques on the fixed bodies, w rows. Read when first asked for."""
        return self._given_source("walls").walls_of(self)

    def _given_source(self, what: str) -> FrameSource:
        if self._source is None:
            raise ResultError(f"this frame was made without {what}")
        return self._source

    @property
    def free(self) -> npt.NDArray[np.bool_]:
        """Whether each body is free, moved by forces [1], (n)."""
        return ~self.fixed

    @cached_property
    def driven(self) -> npt.NDArray[np.bool_]:
        """Whether each body is fixed and has a prescribed motion (&motion of the stored namelist) [1], (n)."""
        return self._given_source("prescribed motions").driven_of(self)

    @property
    def static(self) -> npt.NDArray[np.bool_]:
        """Whether each body is fixed without a prescribed motion [1], (n)."""
        return self.fixed & ~self.driven

    @property
    def unwrapped(self) -> FloatArray:
        """Centres of mass on their paths through the copies of a periodic cell [m], (n, 2)."""
        if self.image is None:
            return self.position
        path = self.position + self.image * self.cell_size
        return path if self.shear_offset is None else path + np.column_stack([self.shear_offset, np.zeros(len(self))])

    @property
    def shifts(self) -> FloatArray:
        """Vectors to the m copies of the periodic cell around it [m], (m, 2): none in the plane."""
        copies = self._copies
        return copies * self.cell_size + np.outer(copies[:, 1], [self.shift, 0.0])

    @property
    def copy_velocities(self) -> FloatArray:
        """Velocities of these copies relative to the cell [m/s], (m, 2): 0 unless it is sheared."""
        return np.outer(self._copies[:, 1], [self.jump, 0.0])

    @property
    def _copies(self) -> FloatArray:
        """Number of cells along x and y to each of the copies around the cell, (m, 2)."""
        steps = [(-1, 0, 1) if size > 0.0 else (0,) for size in self.cell_size]
        copies = np.array([(x, y) for x in steps[0] for y in steps[1] if x or y], dtype=float).reshape(-1, 2)
        # A copy that slides by up to a width needs another one behind it.
        return np.concatenate([copies, [(-2.0, 1.0), (2.0, -1.0)]]) if self.shift > 0.0 else copies

    @cached_property
    def spans(self) -> npt.NDArray[np.bool_]:
        """Whether each body is a fixed one about as long as the cell, without copies along it [1], (n, 2)."""
        reach = np.abs(self.bounds.reshape(-1, 2, 2) - self.position[:, None, :]).max(axis=1)
        return self.fixed[:, None] & (self.cell_size > 0.0) & (4.0 * reach >= self.cell_size)

    def nearest(self, first: IntArray, second: IntArray, vectors: FloatArray) -> FloatArray:
        """Vectors between bodies of these indices as those to the nearest copies [m], (k, 2).

        Fixed bodies that are about as long as the cell have no copies along it.
        """
        nearest = vectors.copy()
        if self.shift > 0.0:
            nearest[:, 0] -= np.rint(vectors[:, 1] / self.cell_size[1]) * self.shift
        for axis in np.flatnonzero(self.cell_size > 0.0):
            size = self.cell_size[axis]
            repeats = ~(self.spans[first, axis] | self.spans[second, axis])
            nearest[repeats, axis] -= np.rint(nearest[repeats, axis] / size) * size
        return nearest

    @cached_property
    def vertex(self) -> FloatArray:
        """Vertices of all bodies in the world, anticlockwise; rows as in `shape` [m], (nv, 2)."""
        count = np.diff(self.vertex_start)
        cosine = np.repeat(np.cos(self.angle), count)
        sine = np.repeat(np.sin(self.angle), count)
        x, y = self.shape[:, 0], self.shape[:, 1]
        turned = np.column_stack([cosine * x - sine * y, sine * x + cosine * y])
        return turned + np.repeat(self.position, count, axis=0)

    @cached_property
    def vertices(self) -> list[FloatArray]:
        """Outline of each body in the world, anticlockwise: a list of (k, 2) arrays [m]."""
        return np.split(self.vertex, self.vertex_start[1:-1])

    @property
    def corners(self) -> IntArray:
        """Number of vertices of each body [1], (n)."""
        return np.diff(self.vertex_start).astype(np.int64)

    @cached_property
    def area(self) -> FloatArray:
        """Area of each polygon [m2], (n)."""
        return moments(self.shape, self.vertex_start)[0]

    @cached_property
    def density(self) -> FloatArray:
        """Density of each body: mass over area; infinite where the mass is [kg/m3], (n)."""
        return self.mass / self.area

    @cached_property
    def radius(self) -> FloatArray:
        """Distance of the farthest vertex of each body from its centre of mass [m], (n)."""
        size = np.hypot(self.shape[:, 0], self.shape[:, 1])
        return np.maximum.reduceat(size, self.vertex_start[:-1]) if len(self) else np.empty(0)

    @cached_property
    def thickness(self) -> FloatArray:
        """Twice the smallest distance of an edge of each body from its centre of mass [m], (n)."""
        after = self.shape[following(self.vertex_start)]
        edge = after - self.shape
        cross = self.shape[:, 0] * after[:, 1] - self.shape[:, 1] * after[:, 0]
        distance = cross / np.hypot(edge[:, 0], edge[:, 1])
        return 2.0 * np.minimum.reduceat(distance, self.vertex_start[:-1]) if len(self) else np.empty(0)

    @cached_property
    def diameter(self) -> FloatArray:
        """Largest distance between two vertices of each body [m], (n)."""
        largest = np.empty(len(self))
        for corners in np.unique(self.corners):
            rows = np.flatnonzero(self.corners == corners)
            most = max(1, MOST_DISTANCES // int(corners) ** 2)
            for part in np.array_split(rows, -(-len(rows) // most)):
                points = self.shape[self.vertex_start[part][:, None] + np.arange(corners)]
                apart = points[:, :, None, :] - points[:, None, :, :]
                largest[part] = np.sqrt((apart**2).sum(-1).max(axis=(1, 2)))
        return largest

    @property
    def equivalent_diameter(self) -> FloatArray:
        """Diameter of the circle with the area of each body [m], (n)."""
        return np.sqrt(4.0 * self.area / np.pi)

    @cached_property
    def bounds(self) -> FloatArray:
        """Bounding box of each body: least x, least y, greatest x, greatest y [m], (n, 4)."""
        if len(self) == 0:
            return np.empty((0, 4))
        low = np.minimum.reduceat(self.vertex, self.vertex_start[:-1], axis=0)
        high = np.maximum.reduceat(self.vertex, self.vertex_start[:-1], axis=0)
        return np.column_stack([low, high])

    @property
    def speed(self) -> FloatArray:
        """Magnitude of each velocity [m/s], (n)."""
        return np.hypot(self.velocity[:, 0], self.velocity[:, 1])

    @property
    def kinetic_energy(self) -> FloatArray:
        """Kinetic energy of each free body, translation and rotation [J/m], (n); 0 for fixed bodies."""
        mass, inertia = (np.where(self.free, each, 0.0) for each in (self.mass, self.inertia))
        return 0.5 * (mass * self.speed**2 + inertia * self.angular_velocity**2)

    @cached_property
    def force(self) -> FloatArray:
        """Sum of the contact forces on each body, without gravity [N/m], (n, 2).

        Of free bodies it is the sum over the stored contacts, which the run must have written; of fixed bodies the
        stored load of walls.
        """
        total = np.zeros((len(self), 2))
        np.add.at(total, self.contacts.first_index, self.contacts.force)
        np.subtract.at(total, self.contacts.second_index, self.contacts.force)
        total[_index_of(self, self.walls.id)] = self.walls.force
        return total

    @cached_property
    def torque(self) -> FloatArray:
        """Sum of the torques of contacts on each body about its centre of mass [N], (n), from what `force` needs."""
        total, contacts = np.zeros(len(self)), self.contacts
        np.add.at(total, contacts.first_index, _cross(contacts.first_arm, contacts.force) + contacts.couple)
        np.subtract.at(total, contacts.second_index, _cross(contacts.second_arm, contacts.force) + contacts.couple)
        total[_index_of(self, self.walls.id)] = self.walls.torque
        return total

    @cached_property
    def coordination(self) -> IntArray:
        """Number of bodies that each body touches [1], (n); the run must have written contacts."""
        n, once = len(self), self.contacts.is_first
        return (np.bincount(self.contacts.first_index[once], minlength=n)
                + np.bincount(self.contacts.second_index[once], minlength=n)).astype(np.int64)

    def index_of(self, identifiers: Any) -> IntArray:
        """Indices of bodies in the columns of this frame from their k identifiers [1], (k)."""
        return _index_of(self, np.atleast_1d(identifiers))

    def write_bodies(self, path: str | PathLike[str], *, overwrite: bool = False) -> int:
        """Write the bodies as a bodies file, from which a run can start; return their number.

        In the namelist: &scene name = 'file', bodies_file = the path. The file has vertices in the world, identifiers,
        fixed bodies, velocities, angular velocities, masses, moments of inertia and materials, all to the last bit;
        the centres of mass of the run follow from the vertices, within rounding. Angles and time begin at 0, and
        friction begins without history: to continue a run to the same bits, use its checkpoints. Fixed bodies have no
        velocity in the file: give a `&motion` in the namelist. `bodies_file.write_bodies` writes other outlines and
        columns.
        """
        return write_frame(self, path, self._source.origin_for(self) if self._source else (0.0, 0.0), overwrite)

    def to_pandas(self) -> Any:
        """The bodies as a pandas table with the identifiers as index; vectors become two columns (position_x)."""
        return body_table(self)

    def to_networkx(self) -> Any:
        """Bodies and contacts as a `networkx.MultiGraph`: nodes are identifiers, with the columns as attributes."""
        return contact_graph(self)

    def to_freud(self) -> Any:
        """((box, points), neighbours) of the free bodies for freud: `RDF().compute(system, neighbors=neighbours)`."""
        return freud_system(self)


@dataclass(frozen=True)
class _Given:
    """Contacts that are given with a frame; there are no walls and no motions."""

    contacts: Contacts

    def contacts_of(self, frame: Frame) -> Contacts:
        return self.contacts

    def walls_of(self, frame: Frame) -> Walls:
        return Walls(np.empty(0, dtype=np.int64), np.empty((0, 2)), np.empty(0))

    def driven_of(self, frame: Frame) -> npt.NDArray[np.bool_]:
        return np.zeros(len(frame), dtype=bool)

    def origin_for(self, frame: Frame) -> tuple[float, float]:
        return 0.0, 0.0


def find_contacts(frame: Frame, columns: dict[str, Any]) -> Contacts:
    """Contacts from their own columns (CONTACT_FIELDS) and the bodies of the frame; indices count from 0.

    Columns of other names become those of `others`.
    """
    first, second = (_index_of(frame, columns[name]) for name in ("first", "second"))
    branch = frame.position[first] - frame.position[second]
    first_arm, second_arm = (columns["point"] - frame.position[rows] for rows in (first, second))
    if frame.cell_size.any():
        branch = frame.nearest(first, second, branch)
        second_arm = first_arm + branch
    return Contacts(
        **{name: columns[name] for name in CONTACT_FIELDS},
        others={name: values for name, values in columns.items() if name not in CONTACT_FIELDS},
        first_index=first, second_index=second, branch=branch, first_arm=first_arm, second_arm=second_arm,
        with_fixed=frame.fixed[first] | frame.fixed[second])


def unit_vectors(vectors: FloatArray) -> FloatArray:
    """Vectors of length 1 along others, (k, 2); 0 where these are 0."""
    size = np.hypot(vectors[:, 0], vectors[:, 1])[:, None]
    return np.divide(vectors, size, out=np.zeros_like(vectors), where=size > 0.0)


def _cross(first: FloatArray, second: FloatArray) -> FloatArray:
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]


def _index_of(frame: Frame, identifiers: npt.NDArray[np.integer[Any]]) -> IntArray:
    index = np.minimum(np.searchsorted(frame.id, identifiers), max(len(frame) - 1, 0)).astype(np.int64)
    if len(identifiers) and (len(frame) == 0 or np.any(frame.id[index] != identifiers)):
        raise ResultError(f"unknown bodies are named at step {frame.step}")
    return index


def sound_frame(path: Path, frame: Frame) -> Frame:
    """The frame, if its arrays fit together."""
    n, vertices = len(np.atleast_1d(frame.id)), len(np.atleast_1d(frame.shape))
    names = ("id", "fixed", "position", "angle", "velocity", "angular_velocity", "shape", "vertex_start", "material")
    arrays = {name: getattr(frame, name) for name in names}
    shapes: dict[str, tuple[int, ...]] = {
        "position": (n, 2), "velocity": (n, 2), "shape": (vertices, 2), "vertex_start": (n + 1,)}
    insist(path, "frame", arrays, {name: shapes.get(name, (n,)) for name in arrays})
    cell = {"cell_low": frame.cell_low, "cell_size": frame.cell_size}
    insist(path, "cell", cell, dict.fromkeys(cell, (2,)))
    if frame.image is not None:
        insist(path, "frames", {"image": frame.image}, {"image": (n, 2)})
    for name in ("shear_offset", "damping_work", "friction_work"):
        if getattr(frame, name) is not None:
            insist(path, "frames", {name: getattr(frame, name)}, {name: (n,)})
    masses = {"mass": frame.mass, "inertia": frame.inertia}
    if np.any(frame.material < 0) or np.any(frame.material > len(frame.material_names)):
        raise ResultError(f"{path}: bodies/material has numbers of materials that the namelist does not have")
    insist(path, "bodies", masses, dict.fromkeys(masses, (n,)), finite=False)
    if np.isnan(frame.mass).any() or np.isnan(frame.inertia).any() or np.any(np.diff(frame.id) <= 0):
        raise ResultError(f"{path}: bodies holds masses that are not numbers, or identifiers that do not ascend")
    start = frame.vertex_start
    if start[0] != 0 or start[-1] != vertices or np.any(np.diff(start) < 3):
        raise ResultError(f"{path}: bodies/vertex_start does not fit the vertices")
    return frame
