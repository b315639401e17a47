"""CSV files that hold records, with what is wrong with them told in sentences."""

from __future__ import annotations

import csv
import math
from dataclasses import MISSING, asdict, astuple, fields
from pathlib import Path

from polydem_post.base.new_file import new_file
from polydem_post.base.result_file import ResultError, cannot_read, insist_on_file

_KINDS = {"str": str, "int": int, "float": float}


def read_lines(path: Path) -> list[dict]:
    """The rows of a CSV file with a heading; ResultError if it cannot be read."""
    return _read(path)[1]


def heading_of(path: Path) -> list[str]:
    """The names of the columns of a CSV file; none if it is empty."""
    return _read(path)[0]


def _read(path: Path) -> tuple:
    try:
        insist_on_file(Path(path))
        with Path(path).open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            rows = list(reader)
            return list(reader.fieldnames or []), rows
    except FileNotFoundError as error:
        raise ResultError(f"{path}: there is no such file") from error
    except OSError as error:
        raise cannot_read(path, error) from error
    except UnicodeDecodeError as error:
        raise ResultError(f"{path}: is not text, or was damaged") from error
    except csv.Error as error:
        raise ResultError(f"{path}: is not CSV ({error})") from error


def read_records(path: Path, record, maker: str, unfinished: tuple = ()) -> list:
    """The rows of a CSV file as records of a data class; ResultError names the line and the column that is wrong.

    Numbers must be finite, but for the columns in `unfinished`.
    """
    rows, found = read_lines(path), []
    not_it = f"{path}: is not a file of {maker}, or was damaged:"
    heading = heading_of(path)
    lacking = {each.name for each in fields(record) if each.default is MISSING} - set(heading)
    if heading and lacking:
        raise ResultError(f"{not_it} its heading lacks {', '.join(sorted(lacking))}")
    for number, row in enumerate(rows, 2):
        values = {}
        for each in fields(record):
            text = row.get(each.name, MISSING if each.default is MISSING else str(each.default))
            if text is None or text is MISSING or None in row:
                raise ResultError(f"{not_it} line {number} does not fit its heading, or lacks {each.name}")
            try:
                value = _KINDS[str(each.type)](text)
            except ValueError as error:
                raise ResultError(f"{not_it} line {number}: {each.name} is {text[:40]!r}, not a number") from error
            if isinstance(value, float) and not math.isfinite(value) and each.name not in unfinished:
                raise ResultError(f"{not_it} line {number}: {each.name} is {text[:40]!r}, not a finite number")
            values[each.name] = value
        found.append(record(**values))
    return found


def write_records(path: Path, records: list) -> None:
    """Write records of one data class as CSV; an interruption leaves the former file or the new one."""
    with new_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(asdict(records[0]))
        writer.writerows(astuple(record) for record in records)
