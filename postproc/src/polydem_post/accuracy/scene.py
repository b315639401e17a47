"""The scene of a study: a namelist with all entries, which windows of it override, and what the program says of it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from ..base.result_file import ResultError, cannot_write
from ..bodies_file import write_frame
from ..read.settings import Group, Groups, Settings, Value
from ..read.trajectory import Trajectory, wall_bodies
from ..sweep.batch import check_namelist, copy_tables

#: The namelist of a study in its folder, and the bodies with which it starts
SCENE, BODIES = "scene.nml", "start.h5"

#: Rows of the series and frames of a window: at most, and one for so many steps
MOST_ROWS, STEPS_PER_ROW = 64, 80
LEAST_ROWS = 4

#: The line of `check` that names the step, with its stable step
STEP = re.compile(r"^step +dt = (\S+) s, \S+ of the stable time step (\S+) s", re.MULTILINE)

#: Entries of &scene that have a meaning when bodies come from a file
KEPT = ("seed", "density", "material", "wall_material")


#: What `check` says of the deepest contact at the start
DEEPEST = re.compile(r"overlap by \S+ m, (\S+) of the thinner body")


@dataclass(frozen=True)
class Checked:
    """A namelist that the program accepts."""

    settings: Settings
    #: Time step, and the stable one that the program expects [s]
    dt: float
    stable: float
    #: Greatest depth of a contact at the start, relative to the thinner body, if the program tells it; else 0
    depth: float


def check(program: Path, namelist: Path, entries: list[str]) -> Checked:
    """Let the program check a namelist with some entries."""
    problem, said = check_namelist(program, namelist, entries)
    if problem:
        raise ResultError(problem)
    step = STEP.search(said)
    if step is None:
        raise ResultError(f"{namelist}: check prints no time step")
    depth = DEEPEST.search(said)
    return Checked(Settings(said[: said.rindex("\n/\n") + 3]), float(step[1]), float(step[2]),
                   float(depth[1]) if depth else 0.0)


def window_of(settings: Settings) -> float:
    """Simulated time of the windows [s]."""
    stages = settings.get("stage", {})
    for name, stage in stages.items():
        if stage["until"] != "duration":
            raise ResultError(f"&stage {name} ends upon a condition, in each window at another time; accuracy needs "
                              "stages with a duration, or a namelist without stages")
    return float(sum(stage["duration"] for stage in stages.values()) or settings.integrate.duration)


def rows_of(steps: float) -> int:
    """Rows of the series of a window of so many steps."""
    return max(LEAST_ROWS, min(MOST_ROWS, int(steps) // STEPS_PER_ROW))


def stiffness_entries(settings: Settings, factor: float) -> dict[str, str]:
    """Every stiffness that the namelist gives, times a factor."""
    found = {"forces.stiffness": settings.forces.stiffness}
    for kind in ("material", "contact_pair"):
        for name, group in settings.get(kind, {}).items():
            if "stiffness" in group:
                found[f"{kind}.{name}.stiffness"] = group["stiffness"]
    return {entry: repr(float(value) * factor) for entry, value in found.items()}


def write_scene(namelist: Path, checked: Checked, folder: Path, window: float, rows: int) -> Path:
    """Write the namelist of a study, in which windows have so many rows and frames, into its folder."""
    output = {"series_interval": window / rows, "frame_interval": window / rows, "energy_balance": True, "folder": "",
              "csv": False, "trace_steps": 0, "step_profile": False}
    text = _text(checked.settings, {"output": output, "checkpoint": {"at_end": False}})
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / SCENE
        if path.is_file() and path.read_text(encoding="utf-8") != text:
            raise ResultError(f"{folder}: holds windows of another scene, or with other options; give another folder "
                              "with --output, or remove this one")
        path.write_text(text, encoding="utf-8")
        if namelist.parent.resolve() != folder.resolve():
            copy_tables(namelist, [], folder)
    except OSError as error:
        raise cannot_write(folder, error) from error
    return path


def write_start(place: str, namelist: Path, checked: Checked, folder: Path) -> Path:
    """Write a namelist whose bodies are those of a frame of a result, given as RESULT or RESULT:FRAME.

    Contacts begin anew.
    """
    result, _, frame_number = place.rpartition(":")
    if not re.fullmatch(r"-?\d+", frame_number) or not result:
        result, frame_number = place, "-1"
    run = Trajectory(result)
    frame = run.frame(int(frame_number))
    path = folder / BODIES
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(folder, error) from error
    write_frame(frame, path, run.origin_for(frame), overwrite=True)
    walls = wall_bodies(run.settings, frame.id[frame.fixed])
    changes: dict[str, dict[str, dict[str, Value]]] = {"wall": {}}
    for name in checked.settings.get("wall", {}):
        if name not in walls:
            raise ResultError(f"{result}: has no wall {name}, which {namelist} has; it has "
                              f"{', '.join(walls) or 'none with a name'}")
        changes["wall"][name] = {"name": name, "outline": "bodies", "bodies": [int(each) for each in walls[name]]}
    scene = {key: value for key, value in checked.settings.scene.items() if key in KEPT}
    scene.update(name="parts", bodies_file=str(path))
    settings = {"scene": Group("scene", scene)}
    settings.update({kind: group for kind, group in checked.settings.items() if kind not in ("scene", "grains")})
    text = _text(settings, {}, changes)
    begun = folder / "start.nml"
    begun.write_text(text, encoding="utf-8")
    copy_tables(namelist, [], folder)
    return begun


def _text(settings, changes: dict, replaced: dict | None = None) -> str:
    """A namelist: all groups, some entries changed, some groups replaced altogether."""
    lines = []
    for kind, found in settings.items():
        groups = found.values() if isinstance(found, Groups) else [found]
        for group in groups:
            entries = {**group, **changes.get(kind, {})}
            if replaced and kind in replaced:
                entries = replaced[kind][group["name"]]
            lines.append(repr(Group(kind, entries)))
    return "\n".join(lines) + "\n"
