"""Arguments of options that several verbs have, and lines that verbs print."""

from __future__ import annotations

import argparse
import math

from ..base.emit import printable


def positives(text: str) -> list[float]:
    """Numbers above 0, between commas."""
    return [positive(word) for word in text.split(",")]


def positive(text: str) -> float:
    """A number above 0."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number above 0")
    return value


def count(text: str) -> int:
    """An integer from 1 on."""
    if not text.isdigit() or not 0 < int(text) < 1000000:
        raise argparse.ArgumentTypeError(f"'{text}' is not an integer from 1 on")
    return int(text)


def numbers(text: str) -> list[int]:
    """Integers between commas."""
    try:
        return [int(word) for word in text.split(",")]
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of integers like 0,10,-1") from error


def words(text: str) -> list[str]:
    """Words between commas."""
    return [word for word in text.split(",") if word]


def say(line: str) -> None:
    """Print a line at once, whatever the terminal can show."""
    print(printable(line), flush=True)
