"""The windows of a study: short runs of one scene, laid out and run as a sweep."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from ..base.result_file import ResultError
from ..read.stable_share import stable_share
from ..read.trajectory import Trajectory
from ..sweep.batch import Row, Run, Sweep, lay_out
from ..sweep.runner import FINISHED, Runner, last_words, state_of
from .scene import Checked, check, rows_of, stiffness_entries

#: Relative change of the stiffness that changes the last bits of forces and nothing else
LAST_BITS = 2.0**-48

#: Greatest share of the stable step of the contacts that a recommended step may have; above it a run warns
MOST_SHARE = 0.5

#: Steps of the scene, as multiples of its own, at which a coarse window is tried
COARSE = (2.0, 4.0, 8.0)


@dataclass(frozen=True)
class Window:
    """A run: factors of stiffness and time step; another scheme; the number of a change of the last bits."""

    stiffness: float = 1.0
    step: float = 1.0
    scheme: str = ""
    bits: int = 0

    @property
    def name(self) -> str:
        """Name of its run."""
        words = [f"E{self.stiffness:.4g}", f"dt{self.step:g}", self.scheme, f"bits{self.bits:+d}" if self.bits else ""]
        return "_".join(filter(None, words))


BASE = Window()
#: Factor of the stiffnesses beside that of the scene
BESIDE = 1.03

#: Windows without which nothing can be said; those with changed last bits, and beside; those that may fail
NEEDED = (Window(step=0.5), Window(stiffness=4.0), Window(stiffness=16.0))
CHANGED = (Window(bits=1), Window(bits=-1))
NEAR = (Window(stiffness=BESIDE), Window(stiffness=1.0 / BESIDE))
TRIED = (Window(stiffness=0.25), *(Window(step=step) for step in COARSE))


@dataclass
class Study:
    """A scene, and the windows of it that were run."""

    program: Path
    #: Namelist with all entries of the scene
    scene: Path
    checked: Checked
    folder: Path
    #: Simulated time of a window [s]
    duration: float
    #: Greatest relative depth of a contact at the start that a window has; 0: as the scene starts
    depth: float
    cores: int
    threads: int
    say: Callable[[str], None]
    runs: dict[Window, Run] = field(default_factory=dict)
    _stable: dict[tuple[float, str], float] = field(default_factory=dict)
    _results: dict[Window, Trajectory] = field(default_factory=dict)

    @property
    def rows(self) -> int:
        """Rows of the series, and frames, of each window."""
        return rows_of(self.duration / self.checked.dt)

    def stable(self, stiffness: float, scheme: str = "") -> float:
        """Stable step at a factor of stiffness [s]."""
        key = stiffness, scheme
        if key not in self._stable:
            entries = [f"{entry}={value}" for entry, value in self.entries_of(stiffness, scheme).items()]
            self._stable[key] = check(self.program, self.scene, entries).stable
        return self._stable[key]

    def entries_of(self, stiffness: float, scheme: str = "") -> dict[str, str]:
        """Entries that make the scene stiffer, and choose a scheme."""
        found = stiffness_entries(self.checked.settings, stiffness)
        if scheme:
            found["integrate.scheme"] = scheme
        return found

    def steps_of(self, window: Window) -> int:
        """Steps of a window: all windows reach all rows of the series at a step."""
        grid = int(max(COARSE)) * self.rows
        base = grid * max(1, math.ceil(self.duration / self.checked.dt / grid - 1e-6))
        ratio = self.checked.stable / self.stable(window.stiffness)
        if window.stiffness == 1.0 or window in NEAR:
            ratio = 1.0
        stiff = 2 * self.rows * math.ceil(base * ratio / (2 * self.rows) - 1e-6)
        return max(self.rows, round(stiff / window.step))

    def run(self, windows: tuple[Window, ...] | list[Window], name: str) -> None:
        """Run windows as the sweep of a name; a window that fails is left out, or is an error if it is needed."""
        if not windows:
            return
        rows = []
        columns = ["integrate.dt", *self.entries_of(1.0), "integrate.scheme"]
        columns += ["scene.remove_overlap"] if self.depth > 0.0 else []
        for window in windows:
            stiffness = window.stiffness * (1.0 + window.bits * LAST_BITS)
            entries = {"integrate.dt": repr(self.duration / self.steps_of(window)),
                       "scene.remove_overlap": repr(self.depth / window.stiffness),
                       **self.entries_of(stiffness, window.scheme)}
            rows.append(Row(window.name, tuple(entries.get(column, "") for column in columns), name))
        sweep = self._sweep(columns, rows, self.folder / name)
        total = sum(self.steps_of(window) for window in windows)
        self.say(f"{len(windows)} windows of {self.duration:g} s, {total} steps in total")
        runner = Runner(self.program, self.cores, self.threads, self._say_progress)
        code = runner.run(sweep.runs)
        if code not in (0, 1):
            raise ResultError(f"{sweep.folder}: the windows were not finished; the same command goes on")
        for window, run in zip(windows, sweep.runs):
            if state_of(run) == FINISHED:
                self.runs[window] = run
            elif window in (BASE, *NEEDED, *CHANGED, *NEAR):
                raise ResultError(f"the window {run.name} failed: {last_words(run)}")

    def _say_progress(self, line: str) -> None:
        if line.startswith("running: "):
            self.say(line)

    def _sweep(self, columns: list[str], rows: list[Row], folder: Path) -> Sweep:
        """The sweep of a folder if it was laid out before, else a new one."""
        if not folder.exists():
            return lay_out(self.scene, folder, columns, rows)
        sweep = Sweep(folder)
        wanted = {row.name: dict(zip(columns, row.values)) for row in rows}
        if {run.name: run.values for run in sweep.runs} != wanted:
            raise ResultError(f"{folder}: holds windows of another scene, or with other options; give another folder "
                              "with --output, or remove this one")
        return sweep

    def is_stable(self, window: Window) -> bool:
        """Whether a window was run, far enough from the stable step of its contacts."""
        return window in self.runs and not stable_share(self.runs[window].result / "log.txt") > MOST_SHARE

    def result(self, window: Window) -> Trajectory:
        """Result of a window that was run."""
        if window not in self._results:
            self._results[window] = Trajectory(self.runs[window].result)
        return self._results[window]
