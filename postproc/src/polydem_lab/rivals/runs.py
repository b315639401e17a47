"""What the codes have in common: series of settings, runs, and workers that make them.

A module of a code has NAME, `series(problem)`, which gives its settings, `omits(problem)`, which says why it is left
out of a problem, and `find(places)`, which gives what runs it or raises Missing.
"""

from __future__ import annotations

import json
import subprocess
import threading
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from .scene import Scene

#: Marks an answer of a worker among what libraries print, as in worker.py
ANSWER = "rivals:"

#: Folder of the workers
WORKERS = Path(__file__).resolve().parent / "workers"

#: Most repetitions of a short run for its time
MOST_RUNS = 20

#: Step of games [s], of which the steps of rivals are halves, quarters, ...
FRAME = 1.0 / 60.0


class Missing(Exception):
    """A code that is not here; says what it would need."""


class RunError(Exception):
    """A run that failed; says how."""


@dataclass(frozen=True)
class Places:
    """Where codes are sought, and where they may be installed."""

    #: Folder of a Python environment and of compiled programs
    environment: Path
    #: Folder for files of runs
    scratch: Path
    #: The program polydem
    program: Path

    @property
    def python(self) -> Path:
        """Python of the environment."""
        return self.environment / "python" / "bin" / "python"


@dataclass(frozen=True)
class Series:
    """Settings of a code that differ in one number, by which they become finer."""

    name: str
    #: Level -> settings; for rivals the level is the exponent of 2, for polydem that of the stiffness
    knobs: dict
    #: How much longer a run takes from one level to the next
    growth: float = 2.0
    #: Whether they belong to a law of polydem that was asked for, which has a column of its own
    column: str = ""


@dataclass(frozen=True)
class Run:
    """A run: states (samples + 1, bodies, 6), processor seconds of stepping of each repetition, and steps."""

    states: np.ndarray
    seconds: tuple
    steps: int


@dataclass(frozen=True)
class Code:
    """A code that is here: what runs it, and its version."""

    run: object
    version: str


def refined(name: str, levels: int, knobs) -> Series:
    """A series with the steps FRAME/1, FRAME/2, FRAME/4, ...; `knobs` has more settings for each factor."""
    return Series(name, {level: {"dt": FRAME / 2**level, **knobs(2**level)} for level in range(levels + 1)})


def steps_per_sample(scene: Scene, dt: float) -> int:
    """Number of steps between two samples that comes nearest to dt."""
    return max(1, round(scene.duration / scene.samples / dt))


class Worker:
    """A program that steps scenes; it is started when it is needed, and again when it died."""

    def __init__(self, command: list, scratch: Path, name: str):
        self.command, self.name = [str(word) for word in command], name
        self._request, self._answer = scratch / f"{name}.json", scratch / f"{name}.bin"
        self._log = scratch / f"{name}.log"
        self._process: subprocess.Popen | None = None

    def __call__(self, scene: Scene, knobs: dict, least_seconds: float, patience: float) -> Run:
        """Step a scene; it is repeated until its time is `least_seconds`, and given up after `patience` seconds."""
        count = steps_per_sample(scene, knobs["dt"])
        described = {**asdict(scene), "restitution": scene.restitution or 0.0}
        request = {"scene": described, "knobs": {key: value for key, value in knobs.items() if key != "dt"},
                   "samples": scene.samples, "steps_per_sample": count,
                   "dt": scene.duration / scene.samples / count, "least_seconds": least_seconds,
                   "most_runs": MOST_RUNS}
        self._request.write_text(json.dumps(request, default=float), encoding="utf-8")
        self._answer.unlink(missing_ok=True)
        seconds = self._ask(patience)
        states = np.fromfile(self._answer).reshape(scene.samples + 1, len(scene.bodies), 6)
        return Run(states, seconds, count * scene.samples)

    def _ask(self, patience: float) -> tuple:
        """Processor seconds of each repetition, as the worker answers."""
        process = self._started()
        given_up = threading.Event()

        def give_up() -> None:
            given_up.set()
            process.kill()

        timer = threading.Timer(patience, give_up)
        timer.start()
        try:
            print(self._request, self._answer, sep="\t", file=process.stdin, flush=True)
            for line in process.stdout or ():
                if line.startswith(ANSWER):
                    return tuple(map(float, line[len(ANSWER) :].split()))
        except BrokenPipeError:
            pass
        finally:
            timer.cancel()
        self.end()
        raise RunError(f"given up after {patience:.0f} s" if given_up.is_set() else self._last_words())

    def _started(self) -> subprocess.Popen:
        if self._process is None or self._process.poll() is not None:
            with self._log.open("w", encoding="utf-8") as log:
                self._process = subprocess.Popen(self.command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                                 stderr=log, text=True)
        return self._process

    def _last_words(self) -> str:
        lines = self._log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
        return f"ended without an answer: {lines[-1] if lines else 'it said nothing'}"

    def end(self) -> None:
        """End the program."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None


def told(command: list, patience: float = 60.0) -> str:
    """What a command prints; Missing if it fails."""
    try:
        return subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True,
                              timeout=patience).stdout.strip()
    except (OSError, subprocess.SubprocessError) as error:
        raise Missing(str(error)) from error
