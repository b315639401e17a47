"""Batches: a table of runs that differ in some entries of one namelist.

A sweep is a folder, made once and then filled by runs:

    table.csv                 one row per run: its name, and its value of each entry
    runs/NAME/input.nml       the namelist, as it was when the sweep was made
    runs/NAME/...             tables of motions beside or below the namelist, whose paths are relative to it
    runs/NAME/overrides.txt   the entries of this run, one group.key=value to a line
    runs/NAME/attempts.csv    when it was run, for how long, with which exit code (see runner)
    runs/NAME/output.txt      what it printed
    runs/NAME/result          its result
    results.csv, results.h5   everything in one table (see collect)
"""

from __future__ import annotations

import csv
import itertools
import os
import re
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from ..base.result_file import ResultError, cannot_read, cannot_write, insist_on_file, reason

TABLE, RUNS = "table.csv", "runs"
INPUT, OVERRIDES, ATTEMPTS, OUTPUT, RESULT = "input.nml", "overrides.txt", "attempts.csv", "output.txt", "result"

#: Column of the names
NAME = "name"

#: What names become part of paths
SAFE_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._+-]{0,99}")

#: An entry of the namelist, group.key or group.name.key, and one with the list of its values
ENTRY = re.compile(r"[A-Za-z]\w*(?:\.\w+)?\.[A-Za-z]\w*")
LISTED_ENTRY = re.compile(rf"({ENTRY.pattern})=(.*)", re.DOTALL)

#: The sweep itself says where results go
OWN_ENTRY = "output.folder"

#: The table of a motion in a namelist or a list of overrides
TABLE_OF_MOTION = re.compile(r"""\bfile\s*=\s*['"]?([^'"\s,/][^'"\n,]*)""", re.IGNORECASE)

#: Values as in other programs, from:to or from:to:step
RANGE = re.compile(r"[-+.\deE]+(:[-+.\deE]+){1,2}")

#: How values are listed
LISTING = ("as in forces.friction_coefficient=0.1,0.2, or with semicolons if they have commas: "
           "'forces.gravity=0,-9.81;0,-1'")

#: So many wrong rows are told
MOST_TOLD = 100


@dataclass(frozen=True)
class Row:
    """A run to be."""

    name: str
    #: Values of the columns as they were written; empty: as in the namelist
    values: tuple[str, ...]
    #: Where it was asked for, for messages
    place: str


@dataclass(frozen=True)
class Run:
    """A run of a sweep, and its files."""

    name: str
    folder: Path
    #: Value of each entry, as in values["scene.seed"], as it was written; empty: as in the namelist
    values: dict[str, str]

    @property
    def result(self) -> Path:
        """Folder of its result."""
        return self.folder / RESULT

    def overrides(self) -> list[str]:
        """The entries that it changes, each group.key=value."""
        path = self.folder / OVERRIDES
        try:
            insist_on_file(path)
            return path.read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise cannot_read(path, error) from error

    def attempts(self) -> list[dict]:
        """What was tried so far: `started` (UTC), `seconds`, `exit_code` and `threads` of each attempt."""
        path = self.folder / ATTEMPTS
        if not path.exists():
            return []
        try:
            insist_on_file(path)
            with path.open(newline="", encoding="utf-8") as file:
                return [{"started": row["started"], "seconds": float(row["seconds"]),
                         "exit_code": int(row["exit_code"]), "threads": int(row["threads"])}
                        for row in csv.DictReader(file)]
        except (KeyError, TypeError, ValueError, OSError, csv.Error) as error:
            raise ResultError(f"{path}: is not a list of attempts ({error})") from error


class Sweep:
    """A sweep that was made: `columns` (entries that differ) and `runs`, in the order of its table."""

    def __init__(self, folder):
        self.folder = Path(folder)
        if not (self.folder / TABLE).is_file():
            raise ResultError(f"{folder}: is not a sweep (holds no {TABLE}); ./polydem sweep make makes one")
        try:
            self.columns, rows = read_table(self.folder / TABLE)
        except ResultError as error:
            # The program wrote this table, so it was damaged, and the first defect says enough.
            raise ResultError(str(error).splitlines()[0]) from error
        self.runs = [Run(row.name, self.folder / RUNS / row.name, dict(zip(self.columns, row.values))) for row in rows]

    def choose(self, numbers: list[int] | None = None, names: list[str] | None = None) -> list[Run]:
        """The runs of some rows, counted from 1, and of some names; all if neither is given."""
        if not numbers and not names:
            return self.runs
        known = {run.name: run for run in self.runs}
        for number in numbers or []:
            if not 1 <= number <= len(self.runs):
                raise ResultError(f"{self.folder}: there is no row {number}, only 1 to {len(self.runs)}")
        for name in names or []:
            if name not in known:
                raise ResultError(f"{self.folder}: there is no run {name}")
        chosen = {self.runs[number - 1].name for number in numbers or []} | set(names or [])
        return [run for run in self.runs if run.name in chosen]


# --- tables ------------------------------------------------------------------------------------------------------


def read_table(path: Path) -> tuple[list[str], list[Row]]:
    """Columns, apart from the name, and rows of a CSV table; messages name file and line."""
    lines = _read_lines(path)
    if not lines:
        raise ResultError(f"{path}: is empty; its first line must name the columns, as in name,scene.seed")
    first, header = lines[0]
    problems = _problems_of_header(f"{path}:{first}", header)
    place_of_name = header.index(NAME) if NAME in header else 0
    raise_all(problems if len(header) == 1 else [])
    columns = [word for word in header if word != NAME]
    rows = []
    for number, words in lines[1:]:
        place = f"{path}:{number}"
        if len(words) != len(header):
            problems.append(f"{place}: has {len(words)} values, but the table has {len(header)} columns; a value "
                            'with commas stands in double quotes: "0, -9.81"')
        elif NAME in header:
            values = tuple(word for k, word in enumerate(words) if k != place_of_name)
            rows.append(Row(words[place_of_name], values, place))
    problems += problems_of_names(rows)
    if not lines[1:]:
        problems.append(f"{path}: has no rows below its heading")
    raise_all(problems)
    return columns, rows


def _read_lines(path: Path) -> list[tuple[int, list[str]]]:
    """Number and words of each line that is not blank."""
    lines = []
    try:
        insist_on_file(Path(path))
        with Path(path).open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file, strict=True)
            number = 1
            for words in reader:
                if any("\0" in word for word in words):
                    raise ResultError(f"{path}:{number}: holds a byte 0, which no value has; save the table as text in "
                                      "UTF-8")
                if any(word.strip() for word in words):
                    lines.append((number, [" ".join(word.split()) for word in words]))
                number = reader.line_num + 1
    except FileNotFoundError as error:
        raise ResultError(f"{path}: there is no such file") from error
    except (OSError, UnicodeDecodeError) as error:
        raise cannot_read(path, error) from error
    except csv.Error as error:
        raise ResultError(f"{path}:{reader.line_num}: is not CSV ({error})") from error
    return lines


def raise_all(problems: list[str]) -> None:
    """Raise an error with one line for each problem, if there are any; of many only the first are listed."""
    problems = list(dict.fromkeys(problems))
    if problems:
        more = [f"and {len(problems) - MOST_TOLD} more"] if len(problems) > MOST_TOLD else []
        raise ResultError("\n".join(problems[:MOST_TOLD] + more))


def _problems_of_header(place: str, header: list[str]) -> list[str]:
    if len(header) == 1 and re.search(r"[; ]", header[0]):
        return [f"{place}: separate the columns with commas, as in name,scene.seed"]
    problems = []
    if NAME not in header:
        problems.append(f"{place}: the table needs a column {NAME}, apart from those of entries like scene.seed")
    if "" in header:
        problems.append(f"{place}: column {header.index('') + 1} has no name; remove the comma too many from each line")
    for word in filter(None, dict.fromkeys(header)):
        if header.count(word) > 1:
            problems.append(f"{place}: the column {word!r} is there twice")
        if word != NAME:
            problems += _problems_of_entry(place, word)
    return problems


def _problems_of_entry(place: str, entry: str) -> list[str]:
    if not ENTRY.fullmatch(entry):
        return [f"{place}: {entry!r} is not an entry of the namelist, group.key as in scene.seed"]
    if entry.lower() == OWN_ENTRY:
        return [f"{place}: {OWN_ENTRY} cannot vary, since the sweep gives every run its own folder"]
    return []


def problems_of_names(rows: list[Row]) -> list[str]:
    """Names must be fit for folders, and different also where letters have no size."""
    seen: dict = {}
    problems: list[str] = []
    for row in rows:
        if not SAFE_NAME.fullmatch(row.name):
            problems.append(f"{row.place}: {row.name!r} cannot be a name: letters, digits and . _ + - up to 100")
        other = seen.setdefault(row.name.lower(), row)
        if other is not row:
            problems.append(f"{row.place}: the name {row.name} is given twice (first in {other.place})")
    return problems


def expand(columns: list[str], rows: list[Row], lists: list[str]) -> tuple[list[str], list[Row]]:
    """Every row with every combination of the values listed as group.key=A,B,C: a full factorial table.

    Between values that have commas stand semicolons: forces.gravity=0,-9.81;0,-1.62. The names of the runs tell the
    values that differ; where they cannot, runs are numbered.
    """
    entries: list[str] = []
    choices: list[list[str]] = []
    problems: list[str] = []
    for text in lists:
        match = LISTED_ENTRY.fullmatch(text)
        if match is None:
            problems.append(f"{text} is not like scene.seed=1,2,3")
            continue
        entry, values = match.group(1), match.group(2)
        problems += _problems_of_entry(text, entry)
        if re.search(r"[\[\](){}]", values):
            problems.append(f"{text}: values stand without brackets, {LISTING}")
            continue
        if RANGE.fullmatch(values):
            problems.append(f"{text}: is no range; write the values out, {LISTING}")
            continue
        if entry in columns + entries:
            problems.append(f"{text}: {entry} is given twice")
        entries.append(entry)
        choices.append([value.strip() for value in values.split(";" if ";" in values else ",") if value.strip()])
        if not choices[-1]:
            problems.append(f"{text}: a value is missing, as in scene.seed=1,2,3")
        problems += [f"{text}: the value {value} is given twice" for value in dict.fromkeys(choices[-1])
                     if choices[-1].count(value) > 1]
    raise_all(problems)
    product = []
    for row in rows or [Row("", (), " ".join(lists))]:
        for combination in itertools.product(*choices):
            words = [f"{entry.partition('.')[2]}_{value}" for entry, value, values in zip(entries, combination, choices)
                     if len(values) > 1]
            name = "-".join(filter(None, [row.name, *(re.sub(r"[^A-Za-z0-9._+-]+", "_", word) for word in words)]))
            product.append(Row(name, row.values + combination, row.place))
    names = {row.name.lower() for row in product}
    if len(names) < len(product) or not all(SAFE_NAME.fullmatch(name) for name in names):
        product = [Row(f"run_{k:04d}", row.values, row.place) for k, row in enumerate(product, 1)]
    return columns + entries, product


# --- making a sweep ----------------------------------------------------------------------------------------------


def make_sweep(base: Path, folder: Path, program: Path, table: Path | None = None, lists: list[str] | None = None,
               cores: int = 1) -> Sweep:
    """Check every row of the table, times the lists, and lay out the folders of the runs."""
    problems: list[str] = []
    columns: list = []
    rows: list = []
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        problems.append(f"{folder}: exists already; choose another folder")
    if not base.is_file():
        problems.append(f"{base}: there is no such file")
    try:
        columns, rows = read_table(table) if table else ([], [])
    except ResultError as error:
        problems += str(error).splitlines()
    try:
        columns, rows = expand(columns, rows, lists or []) if lists else (columns, rows)
    except ResultError as error:
        problems += str(error).splitlines()
    if not table and not lists:
        problems.append("a sweep needs a table, or lists of values like scene.seed=1,2,3")
    raise_all(problems)
    overrides = [[f"{column}={value}" for column, value in zip(columns, row.values) if value] for row in rows]
    raise_all([*problems_of_names(rows), *_problems_of_rows(base, program, rows, overrides, cores)])
    return lay_out(base, folder, columns, rows)


def lay_out(base: Path, folder: Path, columns: list[str], rows: list[Row]) -> Sweep:
    """Make the folder of a sweep of rows that need no check."""
    overrides = [[f"{column}={value}" for column, value in zip(columns, row.values) if value] for row in rows]
    new = folder.with_name(folder.name + ".unfinished")
    try:
        if new.exists():
            shutil.rmtree(new)
        for row, entries in zip(rows, overrides):
            place = new / RUNS / row.name
            place.mkdir(parents=True)
            shutil.copyfile(base, place / INPUT)
            (place / OVERRIDES).write_text("".join(f"{entry}\n" for entry in entries), encoding="utf-8")
            copy_tables(base, entries, place)
        with (new / TABLE).open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow([NAME, *columns])
            writer.writerows([row.name, *row.values] for row in rows)
        os.replace(new, folder)
    except OSError as error:
        raise cannot_write(folder, error) from error
    return Sweep(folder)


def copy_tables(base: Path, entries: list[str], place: Path) -> None:
    """Copy the tables of motions: the program looks for them in the folder of the namelist."""
    text = "\n".join([base.read_text(encoding="utf-8", errors="replace"), *entries])
    for name in {found.strip() for found in TABLE_OF_MOTION.findall(re.sub("!.*", "", text))}:
        if (base.parent / name).is_file() and ".." not in Path(name).parts:
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(base.parent / name, place / name)


def check_namelist(program: Path, base: Path, entries: list[str]) -> tuple[str, str]:
    """What the program finds wrong with a namelist and some entries, empty if it can run, and what it prints of it."""
    command = [str(program), "check", str(base), "--threads", "1"]
    for entry in entries:
        command += ["--set", entry]
    try:
        answer = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace",
                                check=False)
    except OSError as error:
        raise ResultError(f"{program}: cannot be run ({reason(error)})") from error
    if answer.returncode == 0:
        return "", answer.stdout
    said = [line for line in answer.stderr.splitlines() if line.strip()]
    problem = said[-1].replace("polydem: ", "", 1) if said else f"check ended with exit code {answer.returncode}"
    return problem, answer.stdout


def _problems_of_rows(base: Path, program: Path, rows: list[Row], overrides: list[list[str]], cores: int) -> list[str]:
    """Let the program check the namelist with the entries of every row. It names one wrong entry at a time."""

    def all_problems(entries: list[str]) -> list[str]:
        found: list[str] = []
        while said := check_namelist(program, base, entries)[0]:
            found.append(said)
            others = [entry for entry in entries if not said.startswith(f"--set {entry}: ")]
            if len(others) == len(entries):
                break
            entries = others
        return found

    with ThreadPoolExecutor(max(1, cores)) as pool:
        return [f"{row.place}: {text}{_advice(row, text)}"
                for row, texts in zip(rows, pool.map(all_problems, overrides)) for text in texts]


def _advice(row: Row, text: str) -> str:
    """What was probably meant by a wrong number of values."""
    if LISTED_ENTRY.match(row.place) and re.search(r"takes \d+ values, but 1 value is given", text):
        return f"; values are listed {LISTING}"
    if not LISTED_ENTRY.match(row.place) and re.search(r"takes 1 value, but \d+ values are given", text):
        return f"; a row is one run, and lists of values stand behind the namelist, {LISTING}"
    return ""
