"""What came out of a sweep, in one table: parameters, final energy balance, state hash, times, exit code, revision."""

from __future__ import annotations

import csv
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

from ..base.new_file import NewHdf5, new_file
from ..base.result_file import ResultError, cannot_write
from ..read.trajectory import Trajectory, warnings_of
from .batch import NAME, Run, Sweep
from .runner import FAILING, FINISHED, RUNNING, describe, last_words, runs_with_warnings, state_of

#: Names of the two files in the folder of a sweep
CSV_FILE, HDF5_FILE = "results.csv", "results.h5"

#: Columns of every run, with unit and meaning
COLUMNS = {
    "state": ("1", "finished, failed, stopped (can go on), interrupted, running, or not run"),
    "exit_code": ("1", "of the last attempt that a sweep saw end; negative: the signal that ended it"),
    "attempts": ("1", "how often it was started"),
    "wall": ("s", "elapsed time of the attempts that a sweep saw end, start of the program included"),
    "threads": ("1", "of the last attempt"),
    "revision": ("1", "commit of the program"),
    "state_hash": ("1", "hash of the bits of the last state"),
    "message": ("1", "why it did not finish"),
    "warnings": ("1", "numbers of its warnings of each kind, in words; empty without one"),
}

#: Columns that hold numbers; the others hold texts
NUMBERS = ("exit_code", "attempts", "wall", "threads")

#: Groups of the namelist that change no bit of a state: runs that differ only in them are meant to agree
WITHOUT_EFFECT = ("neighbours", "decomposition", "output", "checkpoint", "guards")

#: So many runs with the same state are named
MOST_NAMED = 4


@dataclass
class Outcome:
    """All that is known of a run; what is not known is left out."""

    name: str
    #: Values of the columns of the table
    parameters: dict[str, str]
    #: Values of COLUMNS
    facts: dict[str, object] = field(default_factory=dict)
    #: Time in each stage [s], entries of the energy balance at the end, exact counts
    stages: dict[str, float] = field(default_factory=dict)
    energy_balance: dict[str, float] = field(default_factory=dict)
    counters: dict[str, int] = field(default_factory=dict)
    #: Units of the entries of the energy balance
    units: dict[str, str] = field(default_factory=dict)

    def groups(self) -> dict[str, dict]:
        """The three kinds of columns that depend on the runs."""
        return {"stage": self.stages, "energy_balance": self.energy_balance, "counter": self.counters}


def collect_sweep(sweep: Sweep, say=print) -> list[Outcome]:
    """Write results.csv and results.h5 into the folder of a sweep; tell which runs are missing."""
    outcomes = []
    for run in sweep.runs:
        outcomes.append(read_outcome(run))
        if outcomes[-1].facts["state"] != FINISHED:
            say(describe(run))
    try:
        with new_file(sweep.folder / CSV_FILE) as path:
            _write_csv(path, sweep, outcomes)
        with new_file(sweep.folder / HDF5_FILE) as path:
            _write_hdf5(path, sweep, outcomes)
    except OSError as error:
        raise cannot_write(sweep.folder, error) from error
    finished = [outcome for outcome in outcomes if outcome.facts["state"] == FINISHED]
    say(f"{len(finished)} of {len(outcomes)} runs are finished")
    for line in runs_with_warnings(sweep.runs) + same_states(finished):
        say(line)
    return outcomes


def same_states(outcomes: list[Outcome]) -> list[str]:
    """One line for all runs that ended in the same state, to the last bit, although it should differ."""
    groups: dict[object, list[Outcome]] = {}
    for outcome in outcomes:
        if state := outcome.facts.get("state_hash"):
            groups.setdefault(state, []).append(outcome)
    lines = []
    for group in groups.values():
        varied = [entry for entry in group[0].parameters if len({run.parameters[entry] for run in group}) > 1]
        acting = [entry for entry in varied if entry.lower().partition(".")[0] not in WITHOUT_EFFECT]
        if len(group) == 1 or (varied and not acting):
            continue
        names = [run.name for run in group[:MOST_NAMED]]
        if len(group) > MOST_NAMED:
            names.append(f"{len(group) - MOST_NAMED} more")
        why = f"{', '.join(acting)} had no effect" if acting else "their entries are the same"
        if "scene.seed" in (entry.lower() for entry in acting):
            why += " (a group with a seed of its own does not use it)"
        lines.append(f"{', '.join(names)}: the same state hash: {why}; error bars must count them as one run")
    return lines


def read_outcome(run: Run) -> Outcome:
    """All that is known of a run."""
    outcome = Outcome(run.name, run.values)
    attempts = run.attempts()
    facts = outcome.facts
    facts.update(state=state_of(run), attempts=len(attempts))
    if facts["state"] == RUNNING or (not attempts and facts["state"] != FINISHED):
        return outcome
    if attempts:
        facts.update(exit_code=attempts[-1]["exit_code"], threads=attempts[-1]["threads"],
                     wall=sum(attempt["seconds"] for attempt in attempts))
    if facts["state"] == FAILING:
        facts["message"] = last_words(run)
    try:
        result = Trajectory(run.result)
        facts.update(revision=result.provenance["revision"], state_hash=result.state_hash,
                     warnings=warnings_of(run.result))
        profile = result.profile
        outcome.stages = {stage: float(total) for stage, total, calls in
                          zip(profile["stage"], profile["total"], profile["calls"]) if calls > 0}
        outcome.stages["all"] = profile["seconds"]
        outcome.counters = result.counters
        outcome.units = result.balance_units
        balance = result.energy_balance
        outcome.energy_balance = {name: float(values[-1]) for name, values in balance.items() if len(values)}
    except (ResultError, KeyError, OSError) as error:
        facts.setdefault("message", str(error))
        if facts["state"] == FINISHED:
            raise ResultError(f"{run.name}: is finished, but its result cannot be read: {error}") from error
    return outcome


def _all_names(outcomes: list[Outcome], group: str) -> list[str]:
    """Columns of a group that any run has, in the order in which they occur."""
    return list(dict.fromkeys(name for outcome in outcomes for name in outcome.groups()[group]))


def _write_csv(path: Path, sweep: Sweep, outcomes: list[Outcome]) -> None:
    groups = {group: _all_names(outcomes, group) for group in ("stage", "energy_balance", "counter")}
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([NAME, *sweep.columns, *COLUMNS,
                         *(f"{group}.{name.replace(' ', '_')}" for group in groups for name in groups[group])])
        for outcome in outcomes:
            writer.writerow([outcome.name, *outcome.parameters.values(),
                             *(outcome.facts.get(column, "") for column in COLUMNS),
                             *(outcome.groups()[group].get(name, "") for group in groups for name in groups[group])])


def _write_hdf5(path: Path, sweep: Sweep, outcomes: list[Outcome]) -> None:
    with NewHdf5(path) as file:
        file.attrs["content"] = "results of a sweep of polydem, one value per run"
        file.attrs["schema_version"] = 1
        _put(file, NAME, [outcome.name for outcome in outcomes], "1", "name of the run")
        for column in sweep.columns:
            values = [outcome.parameters[column] for outcome in outcomes]
            _put(file, f"parameter/{column}", _as_numbers(values), "", "entry; empty: as in the namelist")
        for column, (unit, meaning) in COLUMNS.items():
            missing = np.nan if column in NUMBERS else ""
            _put(file, column, [outcome.facts.get(column, missing) for outcome in outcomes], unit, meaning)
        units = {name: unit for outcome in outcomes for name, unit in outcome.units.items()}
        for group, unit, meaning in (("stage", "s", "time in this stage; all: of the whole run"),
                                     ("energy_balance", "", "entry of the energy balance at the end"),
                                     ("counter", "1", "exact count")):
            for name in _all_names(outcomes, group):
                values = [outcome.groups()[group].get(name, np.nan) for outcome in outcomes]
                _put(file, f"{group}/{name.replace(' ', '_')}", values, unit or units.get(name, ""), meaning)


def _as_numbers(values: list[str]) -> list:
    """Numbers, if all values are; else the texts."""
    try:
        return [float(value.lower().replace("d", "e")) for value in values]
    except ValueError:
        return values


def _put(file: h5py.File, name: str, values: list, unit: str, meaning: str) -> None:
    texts = any(isinstance(value, str) for value in values)
    if texts:
        dataset = file.create_dataset(name, data=[str(value) for value in values], dtype=h5py.string_dtype())
    else:
        dataset = file.create_dataset(name, data=np.asarray(values, dtype=float))
    if unit:
        dataset.attrs["unit"] = unit
    dataset.attrs["meaning"] = meaning
