"""polydem itself: its default settings over stiffness, and other laws beside them.

Its time is the processor time of the process, less that of a run of the same scene with as many frames, but with a
single step between two of them: start-up, reading and output cost the same in both.
"""

from __future__ import annotations

import math
import re
import resource
import shutil
import subprocess
from pathlib import Path

import h5py
import numpy as np
from polydem_post.base.result_file import ResultError
from polydem_post.read.trajectory import Trajectory

from ..problems import Problem
from ..runs import Code, Places, Run, RunError, Series, told
from ..scene import Scene

NAME = "polydem"

#: Exponent of the stiffness that is as stiff, under its weight, as a grain of 1 cm with the default of the program
DEFAULT = 9

#: The step goes with the root of the stiffness.
GROWTH = math.sqrt(10.0)

#: Safety factors of the step beside that of the program
FINER = (0.1, 0.03, 0.01)

#: Least restitution that is run, since the step of a smaller one becomes many times shorter
LEAST_RESTITUTION = 0.1

#: Most repetitions of a run for its time; how often start-up is measured
REPETITIONS, STARTS = 7, 5

#: Where start-up takes nearly all of the time, its noise must not make steps faster than this [s]
FASTEST = 1e-6

NAMELIST = """&scene
   name = 'file'
   bodies_file = '{bodies}'
   density = {density!r}
/
&forces
   gravity = {gravity[0]!r}, {gravity[1]!r}
   stiffness = {stiffness!r}
   {law}
   {restitution}
   {friction}
/
&integrate
   duration = {duration!r}
   {step}
/
&output
   folder = '{result}'
   frame_interval = {interval!r}
   energy_balance = .false.
   log_interval = {duration!r}
/
&checkpoint
   at_end = .false.
   wall_interval = 0
/
&guards
   displacement = 'warn'
   step = 'warn'
   overlap = 'off'
   tunnelling = 'off'
/
"""


def series(problem: Problem) -> list[Series]:
    """The default settings over stiffness; shorter steps at one stiffness where the error is one of the step."""
    first, last = problem.stiffness
    found = [Series("polydem", {level: {"stiffness": 10.0**level} for level in range(first, last + 1)}, GROWTH)]
    if problem.finer_steps:
        found.append(Series("polydem, shorter steps", {
            DEFAULT + number: {"stiffness": 10.0**DEFAULT, "safety_factor": factor}
            for number, factor in enumerate(FINER, 1)}, GROWTH))
    return found


def series_of_law(problem: Problem, law: str) -> list[Series]:
    """The same with an elastic law that is named."""
    column = f"polydem, {law}"
    return [Series(each.name.replace("polydem", column), {level: {**knobs, "law": law}
                                                          for level, knobs in each.knobs.items()}, GROWTH, column)
            for each in series(problem)]


def omits(_: Problem) -> str:
    """It takes part everywhere."""
    return ""


def find(places: Places) -> Code:
    """The program."""
    version = told([places.program, "info"]).splitlines()[0]
    return Code(Polydem(places.program, places.scratch), version.partition(", ")[0])


def namelist(scene: Scene, knobs: dict, bodies: Path, result: Path, dt: float = 0.0) -> str:
    """The input of a run, or with dt of one with a step per frame."""
    interval = dt or scene.duration / scene.samples
    restitution = scene.restitution
    damping = "" if restitution is None else f"restitution = {max(restitution, LEAST_RESTITUTION)!r}"
    step = f"dt = {dt!r}" if dt else f"safety_factor = {knobs['safety_factor']!r}" if "safety_factor" in knobs else ""
    return NAMELIST.format(
        bodies=bodies, result=result, density=scene.density, gravity=[float(each) for each in scene.gravity],
        stiffness=knobs["stiffness"], law=f"law = '{knobs['law']}'" if "law" in knobs else "",
        restitution="damping = 'none'" if restitution == 1.0 else damping,
        friction=f"friction_coefficient = {scene.friction!r}" if scene.friction > 0.0 else "friction = 'none'",
        duration=interval * scene.samples, step=step, interval=interval)


def write_scene(scene: Scene, path: Path) -> None:
    """Write the bodies file of a scene."""
    corners = [body.corners() for body in scene.bodies]
    with h5py.File(path, "w") as file:
        file["vertex"] = np.concatenate(corners)
        file["vertex_start"] = np.concatenate([[0], np.cumsum([len(each) for each in corners])])
        file["fixed"] = np.array([body.fixed for body in scene.bodies], dtype="int8")
        file["velocity"] = np.array([(body.vx, body.vy) for body in scene.bodies])
        file["angular_velocity"] = np.array([body.spin for body in scene.bodies])


class Polydem:
    """Runs of the program."""

    def __init__(self, program: Path, scratch: Path):
        self.program, self.scratch = program, scratch
        self._bodies, self._input = scratch / "polydem.h5", scratch / "polydem.nml"
        self._result = scratch / "polydem"

    def check(self, scene: Scene, knobs: dict) -> None:
        """ResultError if the program does not accept the input."""
        write_scene(scene, self._bodies)
        self._input.write_text(namelist(scene, knobs, self._bodies, self._result), encoding="utf-8")
        done = subprocess.run([str(self.program), "check", str(self._input)], capture_output=True, text=True,
                              check=False)
        if done.returncode != 0:
            raise ResultError(f"polydem refuses this: {(done.stderr or done.stdout).strip().splitlines()[-1]}")

    def __call__(self, scene: Scene, knobs: dict, least_seconds: float, patience: float) -> Run:
        """Run a scene; it is repeated until its time is `least_seconds`, and given up after `patience` seconds."""
        write_scene(scene, self._bodies)
        spent, said = self._call(namelist(scene, knobs, self._bodies, self._result), patience)
        states, steps, dt = self._states(scene), *_steps(said)
        times = [spent]
        if least_seconds > 0.0:
            alone = namelist(scene, knobs, self._bodies, self._result, dt)
            start = float(np.median([self._call(alone, patience)[0] for _ in range(STARTS)]))
            while sum(times) < len(times) * start + least_seconds and len(times) < REPETITIONS:
                times.append(self._call(namelist(scene, knobs, self._bodies, self._result), patience)[0])
            times = [_of_steps(each, start, steps, scene.samples) for each in times]
        return Run(states, tuple(times), steps)

    def end(self) -> None:
        """Nothing goes on between runs."""

    def _call(self, text: str, patience: float) -> tuple:
        """Processor seconds and output of a run."""
        self._input.write_text(text, encoding="utf-8")
        shutil.rmtree(self._result, ignore_errors=True)
        before = _children()
        try:
            done = subprocess.run([str(self.program), "run", str(self._input), "--threads", "1"], capture_output=True,
                                  text=True, timeout=patience, check=False)
        except subprocess.TimeoutExpired as error:
            raise RunError(f"given up after {patience:.0f} s") from error
        if done.returncode != 0:
            raise RunError((done.stderr or done.stdout).strip().splitlines()[-1])
        return _children() - before, done.stdout

    def _states(self, scene: Scene) -> np.ndarray:
        """States of the last run, as those of the rivals."""
        states = np.empty((scene.samples + 1, len(scene.bodies), 6))
        run = Trajectory(self._result, check=False)
        if len(run) != scene.samples + 1:
            raise RunError(f"wrote {len(run)} frames instead of {scene.samples + 1}")
        for number, frame in enumerate(run):
            states[number, frame.id - 1] = np.column_stack([frame.position, frame.angle, frame.velocity,
                                                            frame.angular_velocity])
        states[:, :, 2] += [body.angle for body in scene.bodies]
        return states


def _of_steps(spent: float, start: float, steps: int, frames: int) -> float:
    """Time of all steps of a run, from its time and that of one with as many frames and as many steps as frames."""
    return max((spent - start) * steps / max(steps - frames, 1), FASTEST * steps)


def _children() -> float:
    """Processor seconds of processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _steps(said: str) -> tuple:
    """Number of steps of a run, and the last step [s]."""
    steps, dt = re.search(r"duration\s+\S+ s, (\d+) steps", said), re.search(r"dt = ([0-9.Ee+-]+) s", said)
    if not steps or not dt:
        raise RunError("the log does not tell the steps")
    return int(steps.group(1)), float(dt.group(1))
