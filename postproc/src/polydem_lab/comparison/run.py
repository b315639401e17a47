"""Makes the pieces of the comparison that are missing, and keeps on disk what is finished.

A piece is reused if the program, the machine and the settings are those that made it; otherwise its folder is made
again. A call that was killed goes on where it was: benches keep every sample, and so does the study of precision.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
import platform
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from polydem_post.base.result_file import ResultError, cannot_read

from ..bench.samples import read_bench
from ..bench.statistics import number, typical
from .bench_file import BenchFile
from .plan import ROOT, Piece, Rates, estimate

#: File in the folder of the pieces
STATE = "state.json"

#: Exit code of a call that a signal ended
INTERRUPTED = 75

#: Seconds that are left for tables, figures and the page when time is limited
FOR_THE_REPORT = 60.0

#: Least seconds that a piece counts for when time is shared out
SHORTEST = 20.0

#: Bench whose times tell how fast this machine is
TRIAL = """\
&bench
   folder = '{folder}'
   scenes = 'inputs/bench/gas.nml output.trace_start=0.001 output.trace_steps=20 integrate.duration=0.0025'
   names = 'gas'
   finders = 'quadtree', 'sort_and_sweep', 'all_pairs'
   repeats = 1
/
"""


@dataclass
class Tools:
    """The programs that make the pieces."""

    #: Precision -> program; double at least
    programs: dict
    verifier: Path | None = None
    #: Program of the benchmark `exact`
    overlaps: Path | None = None

    @property
    def program(self) -> Path:
        """The program in double precision."""
        return self.programs["double"]

    @property
    def laboratory(self) -> Path:
        """The program of benches and replays, which lies beside it."""
        return self.program.with_name("polydem_lab")


@dataclass
class Comparison:
    """A comparison under way."""

    #: Folder of the pieces, below the folder of the report
    folder: Path
    mode: str
    pieces: list
    tools: Tools
    #: Time at which the last piece must end, on the clock of time.monotonic; absent: never
    deadline: float | None = None
    say: Callable[[str], None] = print
    #: Whether nothing on disk may change
    dry: bool = False
    #: Time at which the present piece must end
    piece_deadline: float | None = None
    #: Names of pieces that are not made in this call
    without: frozenset = frozenset()
    state: dict = field(default_factory=dict)

    @property
    def cores(self) -> int:
        """Cores that this process may use."""
        return len(os.sched_getaffinity(0))

    # --- What is there ------------------------------------------------------------------------------------------------

    def open(self, as_it_is: bool = False) -> None:
        """Read the state of an earlier call; remove what another program or machine made, unless nothing may change.

        As it is: whoever made it, as for a report of what there is.
        """
        try:
            self.state = json.loads((self.folder / STATE).read_text(encoding="utf-8"))
        except FileNotFoundError:
            if self.folder.exists() and any(self.folder.iterdir()):
                raise ResultError(f"{self.folder}: holds files, but no {STATE} of this command; choose another "
                                  "--output") from None
            self.state = {}
        except (OSError, ValueError) as error:
            raise cannot_read(self.folder / STATE, error) from error
        if as_it_is:
            if not self.state:
                raise ResultError(f"{self.folder}: there is nothing to report yet")
            return
        base = base_of(self.tools.program, self.tools.laboratory)
        if self.state.get("base") != base:
            if self.state:
                self.say("what is there was made by another program or machine and is made again")
            for name in [*self.state.get("pieces", {}), "patch"]:
                self._remove(name)
            self.state = {"base": base, "pieces": {}}
        for piece in self.pieces:
            self._drop_stale(piece)
        self._write()

    def _drop_stale(self, piece: Piece) -> None:
        """Remove a piece of other settings, and the pieces that need it."""
        known = self.state["pieces"].get(piece.name)
        if known is None or known["settings"] == self._settings(piece):
            return
        for other in [piece, *(each for each in self.pieces if piece.name in each.needs)]:
            if self.state["pieces"].pop(other.name, None) is not None:
                self.say(f"{other.name}: its settings changed, so it is made again")
                self._remove(other.name)

    def _remove(self, name: str) -> None:
        """Remove the folder of a piece, unless nothing may change."""
        if not self.dry:
            shutil.rmtree(self.folder / name, ignore_errors=True)

    def _settings(self, piece: Piece) -> str:
        return hashlib.sha256(piece.settings(self.folder).encode()).hexdigest()

    def status(self, piece: Piece) -> str:
        """finished, cut (the time was over), begun, failed, left out, or missing."""
        absent = "left out" if piece.name in self.without else "missing"
        return self.state["pieces"].get(piece.name, {}).get("status", absent)

    def seconds(self, piece: Piece) -> float:
        """Seconds that a piece took, in all calls."""
        return float(self.state["pieces"].get(piece.name, {}).get("seconds", 0.0))

    def _note(self, piece: Piece, status: str, seconds: float) -> None:
        entry = self.state["pieces"].setdefault(piece.name, {"settings": self._settings(piece), "seconds": 0.0})
        entry["status"] = status
        entry["seconds"] = round(float(entry["seconds"]) + seconds, 1)
        self._write()

    def _write(self) -> None:
        if self.dry:
            return
        self.folder.mkdir(parents=True, exist_ok=True)
        new = self.folder / (STATE + ".new")
        new.write_text(json.dumps(self.state, indent=1) + "\n", encoding="utf-8")
        os.replace(new, self.folder / STATE)

    # --- What it will take --------------------------------------------------------------------------------------------

    def calibrate(self) -> Rates:
        """Speed of this machine, measured within seconds."""
        if "rates" not in self.state:
            with tempfile.TemporaryDirectory() as place:
                folder = Path(place) / "trial"
                namelist = write(Path(place) / "trial.nml", TRIAL.format(folder=folder))
                log = Path(place) / "trial.txt"
                command = [str(self.tools.laboratory), "bench", str(namelist)]
                if self._call(command, log, ROOT, OMP_NUM_THREADS="1") != 0:
                    raise ResultError(f"the calibration failed: {log.read_text(encoding='utf-8')[-500:]}")
                self.state["rates"] = vars(measured_rates(folder))
            self._write()
        return Rates(**self.state["rates"])

    def announce(self) -> float:
        """Say what is there, what will be made and how long that takes on this machine [s]."""
        rates, total = self.calibrate(), 0.0
        self.say(f"{self.mode} comparison on {self.cores} cores, {self.state['base']['program']}")
        for piece in self.pieces:
            took = estimate(piece, rates, self.cores, self.mode)
            if self.status(piece) == "finished":
                told = f"is there ({number(self.seconds(piece), 2)} s)"
            elif piece.name in self.without:
                told = "is left out"
            else:
                told = f"about {round(took)} s"
                total += took
            self.say(f"  {piece.name:<14}{told:<22}{piece.purpose}")
        self.say(f"about {minutes(total)} in all" + (
            f", and at most {minutes(self.deadline - time.monotonic())}: what does not fit is left undecided"
            if self.deadline else ""))
        return total

    # --- What is made -------------------------------------------------------------------------------------------------

    def run(self) -> None:
        """Make every piece that is missing, then go on with those that were cut, if time is left.

        A signal that ends the call raises KeyboardInterrupt.
        """
        wanted = [piece for piece in self.pieces if piece.name not in self.without]
        self._make_all([piece for piece in wanted if self.status(piece) != "finished"])
        self._make_all([piece for piece in wanted if self.status(piece) == "cut"])

    def _make_all(self, wanted: list) -> None:
        for k, piece in enumerate(wanted):
            self._share_time(wanted[k:])
            left = self._left()
            if left is not None and left < 5.0:
                self.say(f"{piece.name}: left out, since the time is over")
                continue
            lacking = [name for name in piece.needs if not (self.folder / name).exists()]
            if lacking or (piece.bench and not self._available(piece.bench).scenes):
                self.say(f"{piece.name}: left out, since traces of {', '.join(lacking or piece.needs)} are missing")
                continue
            self.say(f"{piece.name}: {piece.purpose}")
            began = time.monotonic()
            self._note(piece, "begun", 0.0)
            try:
                status = self._make(piece)
            except BaseException:
                self._note(piece, "begun", time.monotonic() - began)
                raise
            self._note(piece, status, time.monotonic() - began)
            self.say(f"{piece.name}: {status} after {number(time.monotonic() - began, 3)} s")

    def _share_time(self, wanted: list) -> None:
        """Give the first of some pieces its part of the time that is left, so that a slow machine makes some of all."""
        if self.deadline is None:
            return
        left = self.deadline - FOR_THE_REPORT - time.monotonic()
        needs = [max(SHORTEST, estimate(piece, self.calibrate(), self.cores, self.mode)) for piece in wanted]
        self.piece_deadline = time.monotonic() + left * needs[0] / sum(needs)

    def _left(self) -> float | None:
        """Seconds that the present piece has left; None if time is not limited."""
        return None if self.piece_deadline is None else self.piece_deadline - time.monotonic()

    def _make(self, piece: Piece) -> str:
        """Run the commands of a piece: finished, cut or failed."""
        for command, place, good in self.commands(piece):
            place.mkdir(parents=True, exist_ok=True)
            log = self.folder / f"{piece.name}.txt"
            code = self._call(command, log, place)
            if code is None:
                return "cut"
            if code not in good:
                self.say(f"{piece.name}: its command ended with code {code}; see {log}")
                return "failed"
        return "finished" if piece.bench is None or self._available(piece.bench) == piece.bench else "cut"

    def _available(self, bench: BenchFile) -> BenchFile:
        """A bench without the scenes whose traces a bench that was cut has not recorded."""
        return bench.only([name for name, text in bench.scenes.items()
                           if not text.endswith(".h5") or (ROOT / text).exists()])

    def commands(self, piece: Piece) -> list:
        """[(command, folder in which it runs, exit codes that are good)]"""
        folder, laboratory = self.folder / piece.name, str(self.tools.laboratory)
        own = [sys.executable, "-m", "polydem_post"]
        if piece.bench:
            namelist = write(self.folder / f"{piece.name}.nml", self._available(piece.bench).written(folder))
            return [([laboratory, "bench", str(namelist)], ROOT, (0,))]
        if piece.kind == "cache":
            scenes, finders = piece.options
            traces = self.folder / piece.needs[0]
            made = {path.parent.name for path in (traces / "traces").glob("*/trace.h5")}
            scenes = ",".join(name for name in scenes.split(",") if name in made)
            return [([*own, "cache", str(traces), "--program", laboratory, "--finders", finders, "--scenes", scenes],
                     ROOT, (0,))]
        if piece.kind == "precision":
            repeats, *scenes = piece.options
            programs = [word for name, path in self.tools.programs.items() for word in ("--program", f"{name}={path}")]
            return [([*own, "workprecision", *scenes, "--output", str(folder), "--repeats", str(repeats), *programs],
                     ROOT, (0,))]
        return self._verification(folder.resolve(), piece.options)

    def _verification(self, place: Path, options: tuple) -> list:
        """A row that misses its tolerance ends the benchmarks with code 1; the report shows it."""
        if self.tools.verifier is None:
            raise ResultError("--verifier is missing: call ./polydem paper, which knows it")
        if options != ("--full",):
            return [([str(self.tools.verifier), *options], place, (0, 1))]
        exact = [sys.executable, str(ROOT / "tests/geometry/check_exact_overlap.py"), str(self.tools.overlaps),
                 "--full", "--table", "results/verify", "--behind"]
        return [([str(self.tools.verifier)], place, (0, 1)), (exact, place, (0, 1))]

    def _call(self, command: list, log: Path, place: Path, **variables) -> int | None:
        """Exit code of a command whose output goes to a file; None if the time was over. Shows its last line."""
        words = [os.path.abspath(command[0]), *command[1:]]  # a link to Python in .venv must stay one
        with log.open("w", encoding="utf-8") as file:
            process = subprocess.Popen(words, cwd=place, stdout=file, stderr=subprocess.STDOUT,
                                       stdin=subprocess.DEVNULL, env={**environment(), **variables},
                                       preexec_fn=end_with_parent)  # noqa: PLW1509  there are no threads
            try:
                while process.poll() is None:
                    left = self._left()
                    if left is not None and left < 0.0:
                        return None
                    show(log)
                    time.sleep(0.05 if left is None else min(0.05, left))
                return process.returncode
            finally:
                hide()
                if process.poll() is None:
                    process.send_signal(signal.SIGTERM)
                    try:
                        process.wait(10.0)
                    except subprocess.TimeoutExpired:
                        process.kill()
                        process.wait()


def end_with_parent() -> None:
    """Get SIGTERM when the parent is killed (Linux), so that this process does not go on beside the next call."""
    set_parent_death_signal = 1
    getattr(ctypes.CDLL(None), "prctl", lambda *_: None)(set_parent_death_signal, signal.SIGTERM)


def environment() -> dict:
    """The environment of all pieces: threads that stay where they are."""
    return {"OMP_PROC_BIND": "close", "OMP_PLACES": "cores", **os.environ, "PYTHONDONTWRITEBYTECODE": "1"}


def base_of(program: Path, laboratory: Path) -> dict:
    """The programs and the machine: what pieces must have in common."""
    try:
        told = subprocess.run([str(program), "--version"], capture_output=True, text=True, check=True).stdout
        digest = hashlib.sha256(program.read_bytes() + laboratory.read_bytes()).hexdigest()
    except (OSError, subprocess.CalledProcessError) as error:
        raise ResultError(f"{program}: cannot be run ({error})") from error
    return {
        "program": told.splitlines()[0],
        "digest": digest,
        "host": platform.node(),
        "processor": processor_name(),
        "cores": len(os.sched_getaffinity(0)),
        "waiting": os.environ.get("OMP_WAIT_POLICY", ""),
    }


def processor_name() -> str:
    """Name of the processor."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return platform.processor()
    found = re.search(r"^model name\s*:\s*(.*)$", text, re.MULTILINE)
    return found[1].strip() if found else platform.processor()


def measured_rates(folder: Path) -> Rates:
    """Rates from the bench TRIAL."""
    bench = read_bench([folder])
    log = (folder / "traces" / "gas" / "log.txt").read_text(encoding="utf-8", errors="replace")
    stages = re.findall(r"^(?:boxes|neighbours|overlap|forces|integrate) +\d+ +[\d.]+ +([\d.]+) ", log, re.MULTILINE)
    times = {case.finder: typical(case.time()).value for case in bench.select()}
    boxes, bodies = bench.cases[0].boxes, int(bench.cases[0].facts["bodies"])
    if not stages or "all_pairs" not in times:
        raise ResultError(f"{folder}: the calibration has no times")
    return Rates(1e-6 * sum(map(float, stages)) / bodies, 2e-9 * times["all_pairs"] / boxes,
                 1e-9 * max(times["quadtree"], times["sort_and_sweep"]))


def write(path: Path, text: str) -> Path:
    """Write a file; its path."""
    path.write_text(text, encoding="utf-8")
    return path


def minutes(seconds: float) -> str:
    """A duration for people."""
    seconds = max(0.0, seconds)
    return f"{round(seconds)} s" if seconds < 90.0 else f"{round(seconds / 60.0)} minutes"


def show(log: Path) -> None:
    """The last line of a log, rewritten on a terminal."""
    if not sys.stderr.isatty():
        return
    with log.open("rb") as file:
        file.seek(max(0, log.stat().st_size - 400))
        lines = file.read().decode("utf-8", errors="replace").strip().splitlines()
    sys.stderr.write("\r\x1b[K  " + re.sub(r"[\x00-\x1f\x7f]", "", lines[-1] if lines else "")[:100])
    sys.stderr.flush()


def hide() -> None:
    """Remove the line of `show`."""
    if sys.stderr.isatty():
        sys.stderr.write("\r\x1b[K")
        sys.stderr.flush()
