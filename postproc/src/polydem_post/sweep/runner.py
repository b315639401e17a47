"""Running a sweep: several runs at once within the cores given, what is finished never again.

While a run is under way its list of attempts is locked, by the sweep and by the run itself, which inherits the lock. So
a run that outlives its sweep (killed with -9, say) is still known to be running: no call starts it a second time, and
what it leaves counts.
"""

from __future__ import annotations

import csv
import fcntl
import os
import platform
import re
import signal
import subprocess
import time
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from ..base.result_file import ResultError, insist_on_file, reason
from ..read.settings import Settings
from ..read.trajectory import input_of, status_of, warnings_of
from .batch import ATTEMPTS, INPUT, OUTPUT, Run

#: Exit code of a run that was asked to end and can go on from a checkpoint
STOPPED = 75

#: Exit code of a sweep in which a run failed
FAILED = 1

#: States of a run
NOT_RUN, FINISHED, FAILING, STOPPED_EARLY, INTERRUPTED = "not run", "finished", "failed", "stopped", "interrupted"
RUNNING = "running"

#: The lock of a result folder, with the number of the process and the name of the machine that write there
LOCK = "running.lock"

#: How often, and how long apart [s], a lock is tried: another call may just look whether a run is under way
TRIES, PAUSE = 5, 0.02

#: Signals that end a sweep; a second one does not wait for checkpoints
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGUSR1)

#: Time between two looks at the runs [s]
INTERVAL = 0.05

#: Silence after which a sweep says how far its runs are: at first, and at most; each time it doubles [s]
SILENCE, LONGEST_SILENCE = 10.0, 600.0

#: So many runs are named with their progress
MOST_NAMED = 8

#: The share of its steps that a run has done, at the end of a line of its log
SHARE = re.compile(r"\d+\.\d%$")


def state_of(run: Run) -> str:
    """What became of a run so far, also of one that outlived its sweep."""
    attempts = run.attempts()
    if is_running(run):
        return RUNNING
    if not attempts or attempts[-1]["exit_code"] != 0:
        if status_of(run.result) == FINISHED:
            return FINISHED
    if not attempts:
        return NOT_RUN
    code = attempts[-1]["exit_code"]
    if code < 0:
        return INTERRUPTED
    return {0: FINISHED, STOPPED: STOPPED_EARLY}.get(code, FAILING)


def is_running(run: Run) -> bool:
    """Whether some process is at a run now: this sweep, another one, or a run that outlived its sweep."""
    try:
        insist_on_file(run.folder / ATTEMPTS)
        with (run.folder / ATTEMPTS).open("rb") as record:
            fcntl.flock(record, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        pass
    return bool(lock_holder(run.result))


def lock_holder(result: Path) -> str:
    """Who writes into a result folder, as its lock says: empty if nobody does, or only a process that has ended."""
    try:
        insist_on_file(result / LOCK)
        words = (result / LOCK).read_text(encoding="utf-8", errors="replace").split()
    except OSError:
        return ""
    if len(words) < 2 or not words[0].isdigit():
        return ""
    if words[1] != platform.node():
        return f"process {words[0]} on {words[1]}"
    try:
        os.kill(int(words[0]), 0)
    except (ProcessLookupError, OverflowError):
        return ""
    except PermissionError:
        pass
    return f"process {words[0]}"


def reads_bodies(result: Path) -> bool:
    """Whether a result was made of bodies from a file, or from another result."""
    settings = Settings(input_of(result))
    groups = [settings.get("scene", {}), *settings.get("grains", {}).values()]
    return any(group.get("bodies_file") or group.get("packing") for group in groups)


def last_words(run: Run) -> str:
    """The last line that a run printed."""
    path = run.folder / OUTPUT
    if not path.is_file():
        return ""
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - 4096))
        lines = file.read().decode("utf-8", errors="replace").replace("\r", "\n").splitlines()
    said = [line.strip() for line in lines if line.strip()]
    return said[-1].replace("polydem: ", "", 1) if said else ""


def describe(run: Run) -> str:
    """A run in a message: name, state, and why it failed."""
    state, attempts = state_of(run), run.attempts()
    if state == FAILING:
        return f"{run.name}: failed with exit code {attempts[-1]['exit_code']}: {last_words(run)}"
    told = warnings_of(run.result) if state == FINISHED else ""
    return (f"{run.name}: {state}" + (f" after {attempts[-1]['seconds']:.1f} s" if attempts else "")
            + (f" with warnings: {told}" if told else ""))


def runs_with_warnings(runs: list[Run]) -> list[str]:
    """One line about the finished runs that have warnings; none if there is none."""
    names = [run.name for run in runs if state_of(run) == FINISHED and warnings_of(run.result)]
    if not names:
        return []
    more = [f"{len(names) - MOST_NAMED} more"] if len(names) > MOST_NAMED else []
    return [f"{len(names)} of {len(runs)} runs have warnings, which their logs and the column warnings of a collected "
            f"table tell: {', '.join([*names[:MOST_NAMED], *more])}"]


def progress_of(runs: list[Run], waiting: int) -> str:
    """How far some runs are, as they say in their logs, and how many wait."""
    shares = ((run.name, SHARE.search(last_words(run))) for run in runs[:MOST_NAMED])
    named = [f"{name} {share[0]}" if share else name for name, share in shares]
    more = [f"{len(runs) - MOST_NAMED} more"] if len(runs) > MOST_NAMED else []
    return f"running: {', '.join([*named, *more])}; {waiting} not started"


def available_cores() -> list[int]:
    """Numbers of the cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return sorted(os.sched_getaffinity(0))
    return list(range(os.cpu_count() or 1))


def can_continue(program: Path) -> bool:
    """Whether the program goes on from checkpoints."""
    try:
        answer = subprocess.run([str(program), "run", "--help"], capture_output=True, text=True, check=False)
    except OSError as error:
        raise ResultError(f"{program}: cannot be run ({reason(error)})") from error
    return "--continue" in answer.stdout


class Runner:
    """Runs that take their turns on some cores."""

    def __init__(self, program: Path, cores: int, threads: int, say=print):
        if threads > cores:
            raise ResultError(f"runs of {threads} threads do not fit on {cores} cores")
        self.command = [str(program), "run"]
        self.continues = can_continue(program)
        self.threads = threads
        self.slots = [_Slot(environment(cores, threads, slot)) for slot in range(cores // threads)]
        self.say = say
        self.stopping = False

    def run(self, runs: list[Run], retry: bool = False) -> int:
        """Do what is left of some runs; gives 0 if all are finished, STOPPED if some can go on, else FAILED."""
        due = []
        for run in runs:
            known = len(run.attempts())
            state = state_of(run)
            if state == FAILING and not retry:
                self.say(f"{describe(run)} (--retry runs it again)")
            elif state != FINISHED or self._asks_again(run):
                due.append((run, known))
        self.say(f"{len(runs)} runs, {len(due)} to do, {len(self.slots)} at once, "
                 f"threads of each run: {self.threads}")
        try:
            with self._signals():
                self._turns(due)
        except OSError as error:
            raise ResultError(f"the sweep cannot go on: {error.filename}: {reason(error)}") from error
        finally:
            for slot in self.slots:
                slot.give_up()
        return self._verdict(runs)

    def _asks_again(self, run: Run) -> bool:
        """Whether the program has to say that a finished run still is.

        So it is if nobody saw the run end, and if it read bodies from a file, which may have changed since.
        """
        attempts = run.attempts()
        if not self.continues:
            return False
        return not attempts or attempts[-1]["exit_code"] != 0 or reads_bodies(run.result)

    def _turns(self, due: list[tuple[Run, int]]) -> None:
        """Let runs, of which so many attempts are known, take their turns, until all are over or a signal comes."""
        spoke, silence = time.monotonic(), SILENCE
        while (due and not self.stopping) or any(slot.is_busy for slot in self.slots):
            for slot in self.slots:
                if slot.is_busy and slot.has_ended():
                    self.say(describe(slot.end()))
                    spoke = time.monotonic()
                while due and not slot.is_busy and not self.stopping:
                    self._start(slot, *due.pop(0))
            if time.monotonic() - spoke > silence:
                self.say(progress_of([slot.run for slot in self.slots if slot.run], len(due)))
                spoke, silence = time.monotonic(), min(2.0 * silence, LONGEST_SILENCE)
            time.sleep(INTERVAL)

    def _start(self, slot: _Slot, run: Run, known: int) -> None:
        command = [*self.command, str(run.folder / INPUT), "--threads", str(self.threads)]
        for entry in [*run.overrides(), f"output.folder={run.result}"]:
            command += ["--set", entry]
        if self.continues:
            command.append("--continue")
        elif run.result.exists():
            command.append("--force")
        if not slot.start(run, known, command, self.threads):
            self.say(f"{run.name}: left out: another call runs it, or has left it running")

    def _verdict(self, runs: list[Run]) -> int:
        states = [state_of(run) for run in runs]
        self.say(", ".join(f"{states.count(state)} {state}" for state in dict.fromkeys(states)))
        for line in runs_with_warnings(runs):
            self.say(line)
        if all(state == FINISHED for state in states):
            return 0
        if all(state in (FINISHED, FAILING) for state in states):
            return FAILED
        self.say("the same command continues the remaining runs")
        return STOPPED

    @contextmanager
    def _signals(self):
        """Pass signals on to the runs, which then end with a checkpoint where they can."""

        def stop(number, _):
            if not self.stopping:
                self.say(f"{signal.Signals(number).name}: waiting for the runs to end; a second signal ends them "
                         "at once")
            self.stopping = True
            for slot in self.slots:
                slot.signal(signal.SIGUSR1 if self.continues else signal.SIGTERM)

        former = {number: signal.getsignal(number) for number in SIGNALS}
        for number in SIGNALS:
            if former[number] is not signal.SIG_IGN:
                signal.signal(number, stop)
        try:
            yield
        finally:
            for number, handler in former.items():
                signal.signal(number, handler)


def environment(cores: int, threads: int, slot: int) -> dict[str, str]:
    """Environment of the runs in a slot.

    Runs that have all cores of the machine, or of a job, are bound, each to its own: threads that wander lose their
    caches. On a part of the cores they are not, since another sweep would choose the same ones.
    """
    names = dict(os.environ, OMP_NUM_THREADS=str(threads))
    names.pop("OMP_PLACES", None)
    own = available_cores()
    if cores == len(own):
        names["OMP_PLACES"] = ",".join(f"{{{core}}}" for core in own[slot * threads : (slot + 1) * threads])
        names["OMP_PROC_BIND"] = "close"
    else:
        names["OMP_PROC_BIND"] = "false"
    if cores > len(own):
        names["OMP_WAIT_POLICY"] = "passive"
    return names


@dataclass
class _Slot:
    """A place where one run at a time runs."""

    environment: dict[str, str]
    run: Run | None = None
    process: subprocess.Popen | None = None
    #: List of attempts of the run; locked, so that no other sweep runs it
    record: TextIO | None = None
    began: float = 0.0
    started: str = ""
    threads: int = 0

    @property
    def is_busy(self) -> bool:
        return self.process is not None

    def start(self, run: Run, known: int, command: list[str], threads: int) -> bool:
        """Start a run, unless somebody runs it now, or did so since `known` attempts were counted."""
        self.record = (run.folder / ATTEMPTS).open("a", newline="", encoding="utf-8")
        is_free = _locked(self.record) and len(run.attempts()) == known and not lock_holder(run.result)
        if not is_free:
            self.record.close()
            return False
        self.run, self.threads, self.began = run, threads, time.monotonic()
        self.started = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
        with (run.folder / OUTPUT).open("ab") as output:
            # A session of its own: the terminal's Ctrl-C goes to the sweep, which passes it on. The run inherits the
            # locked list of attempts: if the sweep is killed the lock stays as long as the run goes on.
            self.process = subprocess.Popen(command, env=self.environment, stdin=subprocess.DEVNULL, stdout=output,
                                            stderr=subprocess.STDOUT, start_new_session=True,
                                            pass_fds=(self.record.fileno(),))
        return True

    def signal(self, number: int) -> None:
        """Send a signal to the run, if there is one."""
        if self.process:
            self.process.send_signal(number)

    def give_up(self) -> None:
        """End the run, if there is one, since nobody will wait for it."""
        if self.process:
            self.process.terminate()
            self.process.wait()
            self.process = None
        if self.record:
            self.record.close()

    def has_ended(self) -> bool:
        """Whether the run is over."""
        return self.process is None or self.process.poll() is not None

    def end(self) -> Run:
        """Book the attempt, and give the run back."""
        if self.process is None or self.record is None or self.run is None:
            raise RuntimeError("an attempt ends that was not started")
        writer = csv.writer(self.record, lineterminator="\n")
        if self.record.tell() == 0:
            writer.writerow(["started", "seconds", "exit_code", "threads"])
        writer.writerow([self.started, f"{time.monotonic() - self.began:.3f}", self.process.returncode, self.threads])
        self.record.close()
        run, self.run, self.process = self.run, None, None
        return run


def _locked(record: TextIO) -> bool:
    """Lock a list of attempts; False if somebody has it."""
    for _ in range(TRIES):
        try:
            fcntl.flock(record, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            time.sleep(PAUSE)
    return False
