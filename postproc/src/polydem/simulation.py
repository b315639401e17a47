"""A simulation that is advanced step by step."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from ctypes import byref, c_char_p, c_void_p
from os import PathLike, fspath
from types import MappingProxyType, TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import InputError
from .library import Handle, call, library_for, load
from .live import LiveSource, live_frame
from .namelist import override, write_namelist
from .parts import BODY_COLUMNS, CONTACT_COLUMNS, Bodies, Columns, Load, Named, Strict, Wall, numbers, walls_of
from .ranks import Ranks, ranks_of

#: Elapsed time of a call of the library, after which Python looks for Ctrl-C [s]
PATIENCE = 0.1
#: More steps than a run has
FOREVER = 2**62
#: What becomes of a result that is in the folder, as in polydem.h
NEW, FORCE, CONTINUE = 0, 1, 2
#: Added to one of them: bodies may enter and leave
EXCHANGE = 4

Observer = Callable[["Simulation"], Any]


class Snapshot:
    """A state of a simulation, to which it can return as often as wanted."""

    def __init__(self, pointer: int, ranks: Ranks | None = None):
        self._pointer, self._ranks = c_void_p(pointer), ranks
        self._number = 0 if ranks is None else ranks.number()

    def __del__(self) -> None:
        if self._pointer:
            load(library_for(self._ranks)).polydem_delete_snapshot(byref(self._pointer))


class Simulation(Strict):
    """A simulation in this process, or shared by several.

        source     path of a namelist, its text, or a dictionary {"forces": {"gravity": (0, -9.81)}, ...}
        overrides  {"forces.friction_coefficient": 0.4, ...}
        threads    number of OpenMP threads
        folder     folder of the result, which is that of `polydem run`; None: nothing is written
        force, resume  whether a result in the folder is replaced, or continued
        exchange   whether bodies may be added and removed
        comm       communicator of mpi4py whose processes share the simulation; None: this one alone

    Use it in a `with` statement, or call `close`. A simulation with a folder that is closed before its end is
    interrupted and can be resumed. Values are copies. One thread at a time may use a simulation. With `comm` all
    processes call it alike, but for plain numbers and names; observers run on the root alone.
    """

    def __init__(self, source: str | PathLike[str] | Mapping[str, Any],
                 overrides: Mapping[str, Any] | None = None, *, threads: int = 1,
                 folder: str | PathLike[str] | None = None, force: bool = False, resume: bool = False,
                 exchange: bool = False, comm: Any = None):
        self._observers: list[tuple[int, Observer]] = []
        self._stop: str | None = None
        if force and resume:
            raise InputError("force starts the run again, resume goes on with it: choose one")
        if (force or resume) and folder is None:
            raise InputError("force and resume need a folder")
        words = [override(entry, value).encode() for entry, value in (overrides or {}).items()]
        file, text = _name_and_text(source)
        mode = (CONTINUE if resume else FORCE if force else NEW) + EXCHANGE * bool(exchange)
        arguments = (file.encode(), None if text is None else text.encode(), len(words),
                     (c_char_p * len(words))(*words), None if folder is None else fspath(folder).encode(), mode,
                     int(threads))
        ranks = ranks_of(comm)
        if ranks is None:
            self._handle = Handle(call("new_simulation", *arguments))
            return
        ranks.agree("Simulation", file, text, words, folder, mode)
        pointer = call("new_simulation_on_ranks", ranks.comm.py2f(), *arguments, library=library_for(ranks))
        self._handle = Handle(pointer, ranks)

    # --- life ---------------------------------------------------------------------------------------------------------

    def __enter__(self) -> Simulation:
        """The simulation."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Close it."""
        self._handle.close(kind is not None)

    def __del__(self) -> None:
        # Several processes may not come here at the same time: theirs are closed at the end of the program.
        if hasattr(self, "_handle") and self._handle.ranks is None:
            self.close()

    def __repr__(self) -> str:
        """Time, step and bodies."""
        if self._handle.pointer is None:
            return "<Simulation: closed>"
        ranks = self._handle.ranks
        last = f"{len(self.contacts)} contacts" if ranks is None else f"{ranks.comm.size} processes"
        return (f"<Simulation: t = {self.time:.6g} s, step {self.step} of {self.n_steps}, {len(self.bodies)} bodies, "
                f"{last}>")

    def _repr_png_(self) -> Any:
        """The present state in a notebook."""
        return self.frame()._repr_png_()

    def close(self) -> None:
        """End the run, complete its files and free its memory; a second call does nothing."""
        self._handle.close()

    # --- steps --------------------------------------------------------------------------------------------------------

    def run(self, steps: int | None = None, *, until: float | None = None,
            duration: float | None = None) -> int:
        """Run through all stages; return the number of steps done.

        Without arguments to the end of the run; else `steps` steps, `duration` seconds of simulated time from now, or
        up to the first step that is not before the time `until`. Ctrl-C, and an exception of an observer, end it
        between two steps in a good state; all processes of a `comm` get the exception.
        """
        ranks = self._handle.ranks
        if ranks is None:
            return self._run(steps, until, duration)
        self._stop = None
        done, self._stop = ranks.run(self._handle, (steps, until, duration),
                                     lambda: (self._run(steps, until, duration), self._stop))
        return int(done)

    def _run(self, steps: int | None, until: float | None, duration: float | None) -> int:
        """Run on this process, or on the root of several."""
        if sum(each is not None for each in (steps, until, duration)) > 1:
            raise InputError("give one of steps, until and duration")
        begin, dt = self.step, self.dt
        end = None
        if steps is not None:
            if steps != int(steps) or steps < 0:
                raise InputError(f"steps must be a whole number, not {steps}")
            end = begin + int(steps)
        elif until is not None or duration is not None:
            time = float(until) if until is not None else self.time + float(duration or 0.0)
            if not math.isfinite(time):
                raise InputError("the time at which to stop must be finite")
            # Rounding does not make a whole number of steps one step longer.
            end = max(begin, math.ceil(time / dt * (1.0 - 1e-12)))
        self._stop = None
        now, done = begin, 1
        while self._stop is None and done > 0 and (end is None or now < end):
            done = self._advance(now, FOREVER if end is None else end)
            now += done
        return now - begin

    def _advance(self, now: int, end: int) -> int:
        """Advance to the next call of an observer, or to a step, at most for a moment; call what is due.

        Return the number of steps done; 0: the run is over.
        """
        for interval, _ in self._observers:
            end = min(end, (now // interval + 1) * interval)
        done = self._handle.advance(end - now, PATIENCE)
        self._handle.observed = True
        try:
            for interval, observer in list(self._observers):
                if done > 0 and (now + done) % interval == 0:
                    observer(self)
        finally:
            self._handle.observed = False
        return done

    def every(self, steps: int | None = None, *, seconds: float | None = None) -> Callable[[Observer], Observer]:
        """A decorator: call a function with the simulation after each step whose number is a multiple.

        `seconds` is rounded to a whole number of steps.
        """
        if (steps is None) == (seconds is None):
            raise InputError("give one of steps and seconds")
        interval = int(steps) if steps is not None else max(1, round(float(seconds or 0.0) / self.dt))
        if interval < 1:
            raise InputError(f"an interval has at least one step, not {interval}")

        def add(observer: Observer) -> Observer:
            self._observers.append((interval, observer))
            return observer

        return add

    def stop(self, reason: str = "stopped") -> None:
        """Let `run` return after the present step; `stopped` has the reason."""
        self._stop = str(reason)

    @property
    def stopped(self) -> str | None:
        """Why the last `run` returned early; None: it did not."""
        return self._stop

    # --- values -------------------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._handle.real("time")

    @property
    def dt(self) -> float:
        """Time step [s]."""
        return self._handle.real("dt")

    @property
    def step(self) -> int:
        """Number of steps done."""
        return self._handle.integer("step")

    @property
    def n_steps(self) -> int:
        """Number of steps of the whole run; with stages the greatest possible one."""
        return self._handle.integer("n_steps")

    @property
    def is_over(self) -> bool:
        """Whether all steps are done."""
        return self._handle.integer("is_over") == 1

    @property
    def stage(self) -> str:
        """Name of the present stage; empty: there are none."""
        return self._handle.text("stage")

    @property
    def state_hash(self) -> str:
        """Hash of the bits of all bodies, 16 hexadecimal digits."""
        return self._handle.text("state_hash")

    @property
    def settings(self) -> Any:
        """The settings with all defaults, as of a `polydem_post` trajectory."""
        from polydem_post import Settings

        return Settings(self._handle.text("settings"))

    @property
    def energy(self) -> dict[str, float]:
        """The energy and momentum balance of this step by name [J/m, N s/m, N s]; empty if it is switched off."""
        values = self._handle.array("energy/value")
        found = {} if values is None else dict(zip(self._labels("energy"), map(float, values)))
        return Named("term of the balance", found)

    @property
    def series(self) -> dict[str, npt.NDArray[Any]]:
        """Rows of the series by name, with `step` and `time`; with a folder, those that no file has yet."""
        step, time = self._handle.array("series/step"), self._handle.array("series/time")
        values = self._handle.array("series/value")
        if step is None or time is None or values is None:
            return {}
        values = values.reshape(len(step), -1)
        return {"step": step, "time": time, **dict(zip(self._labels("series"), values.T))}

    def _labels(self, table: str) -> list[str]:
        return [line.split("\t")[0] for line in self._handle.text(table).splitlines()]

    @property
    def bodies(self) -> Bodies:
        """Columns of the bodies, with the names and units of a `polydem_post` frame."""
        return Bodies(self, "bodies", BODY_COLUMNS)

    @property
    def contacts(self) -> Columns:
        """Columns of the contacts, likewise."""
        return Columns(self, "contacts", CONTACT_COLUMNS)

    @property
    def walls(self) -> Mapping[str, Wall]:
        """The walls by name."""
        walls = walls_of(self._handle.text("walls"))
        return MappingProxyType(Named("wall", {name: Wall(self, name, ids) for name, ids in walls}))

    @property
    def loads(self) -> Mapping[str, Load]:
        """The loads by name."""
        names = self._handle.text("loads").splitlines()
        return MappingProxyType(Named("load", {name: Load(self, name, k) for k, name in enumerate(names)}))

    @property
    def gravity(self) -> tuple[float, float]:
        """Acceleration of gravity [m/s2] without what shakes or turns it; set it to change it from the next step on."""
        return self._handle.real("gravity_x"), self._handle.real("gravity_y")

    @gravity.setter
    def gravity(self, gravity: npt.ArrayLike) -> None:
        self._handle.act("gravity", values=numbers(gravity, 2, "gravity"))

    @property
    def drag(self) -> float:
        """Rate of the drag [1/s]; set it to change it from the next step on."""
        return self._handle.real("drag")

    @drag.setter
    def drag(self, rate: float) -> None:
        self._handle.act("drag", values=[float(rate)])

    @property
    def friction_scale(self) -> float:
        """Factor of the friction coefficients; set it to change it from the next step on."""
        return self._handle.real("friction")

    @friction_scale.setter
    def friction_scale(self, factor: float) -> None:
        self._handle.act("friction", values=[float(factor)])

    def add(self, outlines: Sequence[npt.ArrayLike], *, velocity: npt.ArrayLike = (0.0, 0.0),
            angular_velocity: npt.ArrayLike = 0.0, material: str = "", density: float = 0.0) -> npt.NDArray[np.int64]:
        """Let free bodies enter before the next step; return their identifiers.

        Each outline is convex, (corners, 2) [m], and overlaps no other body. Velocities (2) or (n, 2) [m/s], angular
        velocities [rad/s]. `density` [kg/m3] is by default that of the material or of &scene. `exchange=True` is needed
        when the simulation is made, unless it has sources or sinks.
        """
        bodies = [np.asarray(outline, dtype=float) for outline in outlines]
        for outline in bodies:
            if outline.ndim != 2 or outline.shape[1] != 2:
                raise InputError(f"outlines are a list, each of (corners, 2) numbers; one has {outline.shape}")
        if not isinstance(material, str):
            raise InputError(f"a material is a name, not {material!r}")
        n = len(bodies)
        velocities = np.broadcast_to(np.asarray(velocity, dtype=float), (n, 2))
        spins = np.broadcast_to(np.asarray(angular_velocity, dtype=float), (n,))
        first = self._handle.integer("next_id")
        values = [[*v, spin, *outline.ravel()] for outline, v, spin in zip(bodies, velocities, spins)]
        if n:
            self._handle.act("add", material or "-", [len(outline) for outline in bodies],
                             np.concatenate([[density], *values]))
        return np.arange(first, first + n)

    def remove(self, ids: npt.ArrayLike) -> None:
        """Let free bodies leave before the next step; `exchange=True` as for `add`."""
        which = np.asarray(ids, dtype=np.int64).ravel()
        if which.size:
            self._handle.act("remove", bodies=which)

    def end_stage(self) -> None:
        """Let the next step be the last of the present stage."""
        self._handle.act("end_stage")

    def end(self) -> None:
        """Let the next step be the last of the run, whose result is then complete."""
        self._handle.act("end_run")

    @property
    def actions(self) -> list[str]:
        """All actions so far, a line each."""
        return self._handle.text("actions").splitlines()

    def save_actions(self, path: str | PathLike[str]) -> None:
        """Write all actions so far to a file: `polydem run --actions FILE` repeats the run to the same bits."""
        with open(path, "w", encoding="utf-8") as file:
            file.writelines(f"{line}\n" for line in self.actions)

    def frame(self) -> Any:
        """The present state as a `polydem_post` frame, for every measure and picture."""
        return live_frame(self._handle, self.settings, LiveSource(self._handle))

    # --- states -------------------------------------------------------------------------------------------------------

    def snapshot(self) -> Snapshot:
        """The present state."""
        self._agree("snapshot")
        return Snapshot(self._handle.call("new_snapshot"), self._handle.ranks)

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a state, of this simulation or of one with the same settings; what follows has the same bits."""
        if snapshot._ranks is not self._handle.ranks:
            raise InputError("the snapshot is of a simulation on other processes")
        self._agree("restore", snapshot._number)
        self._handle.call("restore", snapshot._pointer)

    def copy(self) -> Simulation:
        """Another simulation, without a folder and without observers, that goes on from this state."""
        self._agree("copy")
        other = Simulation.__new__(Simulation)
        other._observers, other._stop = [], None
        other._handle = Handle(self._handle.call("copy_simulation"), self._handle.ranks)
        return other

    def _agree(self, what: str, *arguments: Any) -> None:
        """Before a call that all processes must make, outside of observers."""
        if self._handle.ranks is not None and self._handle.open:
            self._handle.ranks.agree(what, *arguments, of=self._handle)


def _name_and_text(source: str | PathLike[str] | Mapping[str, Any]) -> tuple[str, str | None]:
    """Path and no text of a namelist, or its name in messages and its text."""
    if isinstance(source, Mapping):
        return "dictionary", write_namelist(source)
    name = fspath(source)
    return ("text", name) if isinstance(source, str) and "&" in name else (name, None)
