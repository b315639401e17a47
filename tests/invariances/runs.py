"""Runs of scenes, and what they leave: frames, balance, series, departures.

A play is one run, or several of which each goes on from the one before: from its checkpoint, from its last frame, or by
`--continue`.
"""

import os
import re
import subprocess
from dataclasses import dataclass, field

import h5py
import numpy as np

from scene import BODIES, NAMELIST, write_bodies, write_namelist, write_tables

#: How one small run is started; threads that wait sleep
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1", "OMP_WAIT_POLICY": "passive",
               "OMPI_MCA_rmaps_base_oversubscribe": "1", "OMPI_MCA_mpi_yield_when_idle": "1",
               "OMPI_MCA_hwloc_base_binding_policy": "none", "OMPI_ALLOW_RUN_AS_ROOT": "1",
               "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
#: Seconds after which a run hangs: a thousand times what it takes
PATIENCE = 1200
#: Exit code of a namelist that is refused, and of a run that a guard stops
REFUSED, STOPPED = 2, 1
#: What a program writes that has lost control
CRASH = re.compile(r"Fortran runtime|At line \d|Error termination|Backtrace|Program received signal|Sanitizer|"
                   r"runtime error:|Traceback")


@dataclass
class Play:
    """One run of a play."""

    scene: object
    #: '', 'checkpoint', 'frame' or 'continue': how it goes on from the run before
    begins: str = ""


@dataclass
class Frame:
    """State at one time, by body."""

    step: int
    time: float
    id: np.ndarray
    position: np.ndarray
    angle: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    #: Of a periodic cell: lower corner, size, and how far the copy above is shifted
    low: np.ndarray = None
    size: np.ndarray = None
    shift: float = 0.0
    #: Rows of contacts: identifiers of the two bodies
    contacts: np.ndarray = None
    #: Sum of the forces on all walls [N/m]
    wall_force: np.ndarray = None

    def row(self, identifier):
        found = np.flatnonzero(self.id == identifier)
        return int(found[0]) if len(found) else -1


@dataclass
class Answer:
    """What a play gave."""

    code: int = 0
    message: str = ""
    log: str = ""
    frames: list = field(default_factory=list)
    #: Columns of the balance (per frame), of the series (per row) and of departures
    balance: dict = field(default_factory=dict)
    series: dict = field(default_factory=dict)
    departures: dict = field(default_factory=dict)
    #: Of all bodies that were ever there: mass and inertia by identifier; 0: infinite
    mass: dict = field(default_factory=dict)
    inertia: dict = field(default_factory=dict)
    fixed: set = field(default_factory=set)
    #: World polygons at angle 0 relative to the centre of mass, by identifier
    outline: dict = field(default_factory=dict)
    state_hash: str = ""

    @property
    def refused(self):
        return self.code == REFUSED

    @property
    def crashed(self):
        return self.code not in (0, REFUSED, STOPPED) or bool(CRASH.search(self.message))

    @property
    def degenerate(self):
        """Whether there were contacts without a direction."""
        return bool(re.search(r"^contacts without direction +[1-9]", self.log, re.MULTILINE))

    @property
    def reason(self):
        """First line of the message, without the place."""
        lines = [line for line in self.message.splitlines() if line.startswith("polydem: ")]
        return re.sub(r"^\S+\.nml:\d+: ", "", (lines or self.message.splitlines() or [""])[0].removeprefix("polydem: "))


def play(command, parts, folder):
    """Run a play in a folder that does not exist; give the answer of its last run.

    `command` is the program, with what stands before it.
    """
    folder.mkdir(parents=True)
    answer, before = None, None
    for number, part in enumerate(parts):
        scene = part.scene
        groups = {name: dict(group) for name, group in scene.groups.items()}
        target = before if part.begins == "continue" else f"result_{number}"
        groups.setdefault("scene", {})
        if part.begins in ("", "continue"):
            groups["scene"]["name"] = "parts"
            groups["scene"]["bodies_file"] = BODIES
        else:
            groups["scene"] = {"name": "result", "start_from": before + ":-1"*(part.begins == "frame"),
                               **{key: groups["scene"][key] for key in ("density",) if key in groups["scene"]}}
            groups["scene"].pop("density", None)
            for name in list(groups):
                if name.startswith("wall."):
                    wall = groups[name]
                    groups[name] = {"outline": "result",
                                    **{key: wall[key] for key in wall if key not in ("outline", "bodies")}}
            if "stress_controlled" in groups.get("cell", {}):
                groups["cell"].update(last_cell(folder/before))
        groups.setdefault("output", {}).update(folder=target)
        name = f"{number}_{NAMELIST}"
        write_namelist(folder / name, groups)
        if not part.begins:
            write_bodies(folder / BODIES, scene)
        write_tables(folder, scene)
        answer = one_run(command, folder, name, ["--continue"] if part.begins == "continue" else [])
        if answer.code != 0:
            break
        before = target
    if answer.code == 0 and not answer.crashed:
        read(folder / before, answer)
    return answer


def last_cell(folder):
    """Entries of a cell that has got another size."""
    with h5py.File(folder/"trajectory_0001.h5", "r") as file:
        return {"low": list(file["frames/cell_low"][-1]), "size": list(file["frames/cell_size"][-1])}


def one_run(command, folder, name, options):
    """Run the program once."""
    command = [*command, "run", name, "--threads", "1", *options]
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, env=ENVIRONMENT,
                              timeout=PATIENCE, stdin=subprocess.DEVNULL)
    except subprocess.TimeoutExpired:
        return Answer(code=-1, message=f"does not end within {PATIENCE} s")
    found = re.search(r"^state hash: (\S+)", done.stdout, re.MULTILINE)
    return Answer(code=done.returncode, message=done.stderr, log=done.stdout,
                  state_hash=found.group(1) if found else "")


def read(folder, answer):
    """Read all segments of a result."""
    for path in sorted(folder.glob("trajectory_*.h5*")):
        with h5py.File(path, "r") as file:
            if "bodies" not in file:
                # All have left before.
                continue
            read_bodies(file, answer)
            read_frames(file, answer)
            for name, target in (("energy_balance", answer.balance), ("series", answer.series),
                                 ("departures", answer.departures)):
                for key, values in file.get(name, {}).items():
                    old = target.get(key)
                    target[key] = values[()] if old is None else np.concatenate([old, values[()]])


def read_bodies(file, answer):
    group = file["bodies"]
    start, vertex = group["vertex_start"][()], group["vertex"][()]
    pieces = group["piece"][()] if "piece" in group else np.zeros(len(vertex), dtype=int)
    mass, inertia, fixed = group["mass"][()], group["inertia"][()], group["fixed"][()]
    for k, identifier in enumerate(group["id"][()]):
        identifier = int(identifier)
        rows = slice(start[k], start[k + 1])
        answer.mass[identifier], answer.inertia[identifier] = float(mass[k]), float(inertia[k])
        if fixed[k]:
            answer.fixed.add(identifier)
        answer.outline[identifier] = [vertex[rows][pieces[rows] == p] for p in np.unique(pieces[rows])]


def read_frames(file, answer):
    group, cell = file["frames"], file.get("cell")
    step, time = group["step"][()], group["time"][()]
    data = {key: group[key][()] for key in ("position", "angle", "velocity", "angular_velocity")}
    starts = group["start"][()]
    # Without identifiers, all frames have the same bodies.
    identifiers = group["id"][()] if "id" in group else np.tile(file["bodies/id"][()], len(step))
    contacts = file.get("contacts")
    if contacts is not None:
        where = contacts["start"][()]
        pairs = np.stack([contacts["first"][()], contacts["second"][()]], axis=1)
    known = {frame.step for frame in answer.frames}
    present = file["walls/present"][()] if "walls/present" in file else None
    force = file["walls/force"][()].sum(axis=1) if "walls" in file else np.zeros((len(step), 2))
    for k in range(len(step)):
        if int(step[k]) in known:
            continue
        rows = slice(starts[k], starts[k + 1])
        names = identifiers[rows]
        # Walls that have vanished are no bodies of the frame.
        there = ~np.isin(names, file["walls/id"][()][present[k] == 0]) if present is not None else slice(None)
        frame = Frame(int(step[k]), float(time[k]), names[there],
                      *(data[key][rows][there] for key in ("position", "angle", "velocity", "angular_velocity")))
        if cell is not None:
            frame.low = group["cell_low"][k] if "cell_low" in group else cell["low"][()]
            frame.size = group["cell_size"][k] if "cell_size" in group else cell["size"][()]
            frame.shift = float(group["shift"][k]) if "shift" in group else 0.0
        frame.wall_force = force[k]
        if contacts is not None:
            frame.contacts = pairs[where[k]:where[k + 1]]
        answer.frames.append(frame)
