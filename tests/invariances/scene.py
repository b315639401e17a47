"""A scene as data, and the files that the program reads.

A scene has bodies, which may be walls, and groups of entries. One table says what kind of quantity each entry is, so
that a scene can be turned, mirrored, shifted, or written in other units, without a line for each entry.
"""

import copy
from dataclasses import dataclass, field

import h5py
import numpy as np

#: Kind of each entry that has a unit or a direction, and the powers of length, mass and time in its unit. A mass is per
#: unit depth, so a density is mass over area, and a stress is a force over a length.
KINDS = {
    "scene.density": ("scalar", -2, 1, 0),
    "wall.vanish_at": ("scalar", 0, 0, 1),
    "cell.periodic": ("axes", 0, 0, 0), "cell.low": ("low", 1, 0, 0), "cell.size": ("extent", 1, 0, 0),
    "cell.shear_rate": ("spin", 0, 0, -1), "cell.shear_ramp": ("scalar", 0, 0, 1),
    "cell.stress_controlled": ("axes", 0, 0, 0),
    "cell.stress": ("extent", 0, 1, -2), "cell.stress_ramp": ("scalar", 0, 0, 1), "cell.mass": ("scalar", 0, 1, 0),
    "motion.pivot": ("point", 1, 0, 0), "motion.rate": ("spin", 0, 0, -1), "motion.velocity": ("vector", 1, 0, -1),
    "motion.amplitude": ("vector", 1, 0, 0), "motion.frequency": ("scalar", 0, 0, -1),
    "motion.start": ("scalar", 0, 0, 1), "motion.end": ("scalar", 0, 0, 1), "motion.ramp": ("scalar", 0, 0, 1),
    "load.direction": ("axes", 0, 0, 0), "load.force": ("along", 1, 1, -2), "load.stress": ("along", 0, 1, -2),
    "load.width": ("scalar", 1, 0, 0), "load.torque": ("spin", 2, 1, -2), "load.pivot": ("point", 1, 0, 0),
    "load.mass": ("scalar", 0, 1, 0), "load.start": ("scalar", 0, 0, 1), "load.end": ("scalar", 0, 0, 1),
    "load.ramp": ("scalar", 0, 0, 1),
    "source.low": ("low", 1, 0, 0), "source.high": ("high", 1, 0, 0), "source.rate": ("scalar", 0, 0, -1),
    "source.velocity": ("vector", 1, 0, -1), "source.outline": ("outline", 1, 0, 0),
    "source.density": ("scalar", -2, 1, 0),
    "sink.low": ("low", 1, 0, 0), "sink.high": ("high", 1, 0, 0),
    "stage.duration": ("scalar", 0, 0, 1), "stage.longest": ("scalar", 0, 0, 1), "stage.hold": ("scalar", 0, 0, 1),
    "stage.gravity": ("vector", 1, 0, -2), "stage.drag": ("scalar", 0, 0, -1), "stage.low": ("low", 1, 0, 0),
    "stage.high": ("high", 1, 0, 0),
    "sample.low": ("low", 1, 0, 0), "sample.high": ("high", 1, 0, 0),
    "forces.gravity": ("vector", 1, 0, -2), "forces.stiffness": ("scalar", 0, 1, -2),
    "forces.cohesion": ("scalar", 0, 1, -2), "forces.drag": ("scalar", 0, 0, -1), "forces.shake": ("vector", 1, 0, -2),
    "forces.shake_frequency": ("scalar", 0, 0, -1), "forces.turn_rate": ("spin", 0, 0, -1),
    "material.density": ("scalar", -2, 1, 0), "material.stiffness": ("scalar", 0, 1, -2),
    "material.cohesion": ("scalar", 0, 1, -2), "contact_pair.stiffness": ("scalar", 0, 1, -2),
    "contact_pair.cohesion": ("scalar", 0, 1, -2),
    "integrate.dt": ("scalar", 0, 0, 1), "integrate.duration": ("scalar", 0, 0, 1),
    "output.frame_interval": ("scalar", 0, 0, 1), "output.series_interval": ("scalar", 0, 0, 1),
}
#: Entries without unit and direction
PLAIN = set("""wall.outline wall.bodies motion.kind motion.wall motion.file motion.stage load.wall load.damping_ratio
load.stage cell.damping_ratio cell.stage cell.profile source.count source.interval source.shape source.angle
source.stage source.material source.outline_corners sink.interval sink.stage stage.until stage.below stage.above
stage.check stage.at_limit stage.friction_scale stage.sink sample.area forces.law forces.damping forces.restitution
forces.damping_coefficient forces.damping_from_touch forces.tilt_damping forces.friction forces.friction_coefficient
forces.tangential_stiffness forces.stiffness_over_pressure forces.midstep_slip forces.rolling_friction
forces.local_damping material.restitution material.damping_coefficient material.friction_coefficient
material.tangential_stiffness material.rolling_friction
contact_pair.materials contact_pair.restitution contact_pair.friction_coefficient contact_pair.rolling_friction
integrate.scheme integrate.accumulation output.contacts output.frames_per_segment checkpoint.wall_interval
scene.name scene.bodies_file scene.start_from scene.material neighbours.finder guards.overlap guards.tunnelling
guards.step""".split())
#: Groups without a name
SINGLE = {"scene", "cell", "sample", "forces", "integrate", "output", "checkpoint", "guards", "neighbours"}
NAMELIST, BODIES, RESULT = "scene.nml", "bodies.h5", "result"


@dataclass
class Body:
    """A body: its pieces in the world, and how it moves at the start."""

    id: int
    pieces: list
    fixed: bool = False
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(2))
    spin: float = 0.0
    density: float = 0.0
    #: Position of its material among the groups &material, from 1; 0: none
    material: int = 0

    def area_and_centre(self):
        """Area, and centre of mass."""
        total, moment = 0.0, np.zeros(2)
        origin = self.pieces[0][0]
        for piece in self.pieces:
            x, y = (piece - origin).T
            cross = x*np.roll(y, -1) - np.roll(x, -1)*y
            total += 0.5*abs(cross.sum())
            moment += np.sign(cross.sum())*np.array([((x + np.roll(x, -1))*cross).sum(),
                                                     ((y + np.roll(y, -1))*cross).sum()])/6
        return total, origin + moment/total

    @property
    def centre(self):
        return self.area_and_centre()[1]

    def copied(self, identifier):
        """A copy with another identifier."""
        return Body(identifier, [piece.copy() for piece in self.pieces], self.fixed, self.velocity.copy(), self.spin,
                    self.density, self.material)

    def move(self, by):
        self.pieces = [piece + by for piece in self.pieces]

    @property
    def reach(self):
        """Greatest distance of a corner from the centre."""
        return max(np.hypot(*(piece - self.centre).T).max() for piece in self.pieces)


@dataclass
class Map:
    """A change of coordinates and units: a point x becomes length*(matrix x) + shift."""

    matrix: np.ndarray = field(default_factory=lambda: np.eye(2))
    shift: np.ndarray = field(default_factory=lambda: np.zeros(2))
    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    def unit(self, powers):
        return self.length**powers[0]*self.mass**powers[1]*self.time**powers[2]

    @property
    def sense(self):
        """1, or -1 if it is a mirror image."""
        return float(round(np.linalg.det(self.matrix)))

    @property
    def turns_axes(self):
        return abs(self.matrix[0, 0]) < 0.5

    def point(self, x):
        return self.length*(np.asarray(x) @ self.matrix.T) + self.shift

    def vector(self, x, powers):
        return self.unit(powers)*(np.asarray(x) @ self.matrix.T)


@dataclass
class Scene:
    """Bodies, groups of entries, and how long the run is."""

    dt: float
    steps: int
    #: Steps between two frames
    every: int
    bodies: list = field(default_factory=list)
    #: Group or group.name -> key -> value; a value is a number, a word, a truth value or a list of numbers or words
    groups: dict = field(default_factory=dict)
    #: Columns time, x, y, angle of the files of motions, by file name
    tables: dict = field(default_factory=dict)
    #: Tags of what it uses, as in the table of exceptions
    tags: set = field(default_factory=set)
    #: Tags that act on single bodies, by identifier; all others act everywhere
    acts: dict = field(default_factory=dict)
    #: What the run starts from after `prelude` steps of another: '', 'checkpoint' or 'frame'
    start: str = ""
    prelude: int = 0
    #: Greatest length of a grain
    size: float = 0.0
    #: Kind of scene: any, or an impact that is compared by its restitution
    kind: str = "any"

    def copy(self):
        return copy.deepcopy(self)

    def body(self, identifier):
        return next(body for body in self.bodies if body.id == identifier)

    def named(self, kind):
        """Names of the groups of a kind, in their order."""
        return [name.split(".", 1)[1] for name in self.groups if name.startswith(kind + ".")]

    def get(self, group, key, default=None):
        return self.groups.get(group, {}).get(key, default)

    def put(self, group, **entries):
        self.groups.setdefault(group, {}).update(entries)

    @property
    def periodic(self):
        """Axes along which it repeats: some of 0 and 1."""
        word = self.get("cell", "periodic", "none")
        return [axis for axis in (0, 1) if "xy"[axis] in word and word != "none"]

    @property
    def free(self):
        return [body for body in self.bodies if not body.fixed]

    def wall_bodies(self, name):
        return [self.body(k) for k in self.groups[f"wall.{name}"]["bodies"]]

    def mapped(self, change):
        """The same scene in other coordinates and units."""
        scene = self.copy()
        scene.dt *= change.time
        scene.size *= change.length
        for body in scene.bodies:
            body.pieces = [change.point(piece)[::int(change.sense)] for piece in body.pieces]
            body.velocity = change.vector(body.velocity, (1, 0, -1))
            body.spin *= change.sense/change.time
            body.density *= change.unit((-2, 1, 0))
        for name, group in scene.groups.items():
            map_group(name.split(".")[0], group, change)
        for name, rows in scene.tables.items():
            new = rows.copy()
            new[:, 0] *= change.time
            new[:, 1:3] = change.vector(rows[:, 1:3], (1, 0, 0))
            new[:, 3] *= change.sense
            scene.tables[name] = new
        return scene


def map_group(kind, group, change):
    """Map the entries of a group in place."""
    old = dict(group)
    if old.get("until") == "kinetic":
        for key in {"below", "above"} & set(old):
            group[key] = change.unit((2, 1, -2))*old[key]
    for key, value in old.items():
        if f"{kind}.{key}" not in PLAIN:
            what, *powers = KINDS[f"{kind}.{key}"]
            if what not in ("low", "high"):
                group[key] = MAPPED[what](value, powers, change, old)
    if "outline" in group and kind == "source" and change.sense < 0 and "outline_corners" in group:
        group["outline_corners"] = group["outline_corners"][::-1]
    if "low" in old:
        low, other = np.asarray(old["low"]), np.asarray(old["high"] if "high" in old else old["size"])
        ends = change.point([low, other if "high" in old else low + other])
        group["low"] = list(ends.min(axis=0))
        if "high" in old:
            group["high"] = list(ends.max(axis=0))


def mapped_outline(value, powers, change, _):
    """Corners relative to a place, anticlockwise again."""
    return list(change.vector(np.asarray(value).reshape(-1, 2), powers)[::int(change.sense)].ravel())


#: How an entry of each kind is mapped: from value, powers of its unit, change, and the other entries of its group
MAPPED = {
    "scalar": lambda value, powers, change, _: change.unit(powers)*value,
    "spin": lambda value, powers, change, _: change.unit(powers)*change.sense*value,
    "point": lambda value, powers, change, _: list(change.point(value)),
    "vector": lambda value, powers, change, _: list(change.vector(value, powers)),
    "extent": lambda value, powers, change, _: list(change.unit(powers)*(np.abs(change.matrix) @ np.asarray(value))),
    "along": lambda value, powers, change, group: (
        change.unit(powers)*value*change.matrix[:, "xy".find(group["direction"])].sum()),
    "axes": lambda value, powers, change, _: {"x": "y", "y": "x"}.get(value, value) if change.turns_axes else value,
    "outline": mapped_outline,
}


def text_of(value):
    """A value as a namelist has it; a real number with all its digits."""
    if isinstance(value, (bool, np.bool_)):
        return ".true." if value else ".false."
    if isinstance(value, str):
        return f"'{value}'"
    if isinstance(value, (list, tuple, np.ndarray)):
        return ", ".join(text_of(item) for item in value)
    return str(int(value)) if isinstance(value, (int, np.integer)) else repr(float(value))


def write_namelist(path, groups):
    """Write groups to a namelist."""
    lines = []
    for name, entries in groups.items():
        kind, _, instance = name.partition(".")
        words = [f"name = '{instance}'"] if instance else []
        words += [f"{key} = {text_of(value)}" for key, value in entries.items()]
        lines.append(f"&{kind}\n   " + "\n   ".join(words) + "\n/\n")
    path.write_text("".join(lines), encoding="utf-8")


def write_bodies(path, scene):
    """Write the bodies file of a scene."""
    corners, start, piece_numbers = [], [0], []
    for body in scene.bodies:
        for number, piece in enumerate(body.pieces):
            corners.append(piece)
            piece_numbers += [number]*len(piece)
        start.append(len(piece_numbers))
    with h5py.File(path, "w") as file:
        file["vertex"] = np.concatenate(corners)
        file["vertex_start"] = start
        if any(len(body.pieces) > 1 for body in scene.bodies):
            file["piece"] = piece_numbers
        file["fixed"] = np.array([body.fixed for body in scene.bodies], dtype="int8")
        file["velocity"] = np.array([body.velocity for body in scene.bodies])
        file["angular_velocity"] = np.array([body.spin for body in scene.bodies])
        file["id"] = [body.id for body in scene.bodies]
        if any(body.density > 0 for body in scene.bodies):
            default = scene.get("scene", "density", 2500.0)
            file["density"] = [body.density or default for body in scene.bodies]
        names = scene.named("material")
        if names:
            file["material"] = [body.material for body in scene.bodies]
            file["material_names"] = " ".join(names)


def write_tables(folder, scene):
    """Write the files of motions."""
    for name, rows in scene.tables.items():
        lines = [",".join(repr(float(value)) for value in row) for row in rows]
        (folder / name).write_text("time,x,y,angle\n" + "\n".join(lines) + "\n", encoding="utf-8")
