"""Command line: python -m polydem_post plot RESULT, python -m polydem_post table RESULT."""

from __future__ import annotations

import argparse
import sys
import warnings
from pathlib import Path

from . import __version__
from .table import FORMATS, timing_table
from .trajectory import ResultError, Trajectory

#: Exit code of a result that cannot be used, as in the program itself
INPUT_ERROR = 2


def main(arguments: list[str] | None = None) -> int:
    """Do what the command line says; return the exit code."""
    options = _parser().parse_args(arguments)
    warnings.showwarning = lambda message, *_: print(f"warning: {message}", file=sys.stderr)
    try:
        options.action(options)
    except ResultError as error:
        print(f"error: {error}", file=sys.stderr)
        return INPUT_ERROR
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="polydem_post", description="Draws and tabulates results of polydem.")
    parser.add_argument("--version", action="version", version=f"polydem_post {__version__}")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")

    plot = verbs.add_parser("plot", help="draw frames as a picture")
    plot.set_defaults(action=_plot)
    plot.add_argument("result", type=Path, metavar="RESULT", help="folder of a result, or one segment")
    which = plot.add_mutually_exclusive_group()
    which.add_argument("--frame", type=int, metavar="K", help="frame, counted from 0; -1, the last one, if absent")
    which.add_argument("--frames", type=_numbers, metavar="A,B,C", help="frames to draw side by side")
    plot.add_argument("--output", type=Path, metavar="FILE", help="picture; frame_K.png in the result if absent")
    plot.add_argument("--colour", choices=("speed", "angle", "id", "none"), default="speed", help="colour by this")
    plot.add_argument("--contacts", action="store_true", help="draw the forces of the contacts")

    table = verbs.add_parser("table", help="print the table of times")
    table.set_defaults(action=_table)
    table.add_argument("result", type=Path, metavar="RESULT", help="folder of a result")
    table.add_argument("--format", choices=FORMATS, default="text", help="form of the table")
    return parser


def _numbers(text: str) -> list[int]:
    try:
        return [int(word) for word in text.split(",")]
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of whole numbers like 0,10,-1") from error


def _plot(options: argparse.Namespace) -> None:
    from .plot import plot_frames, save  # matplotlib takes long to load and a table does not need it

    trajectory = Trajectory(options.result)
    if len(trajectory) == 0:
        raise ResultError(f"{options.result}: holds no frames")
    numbers = options.frames if options.frames else [-1 if options.frame is None else options.frame]
    figure = plot_frames(trajectory, numbers, options.colour, options.contacts)
    path = options.output or trajectory.folder / _picture_name(trajectory, numbers)
    save(figure, path)
    print(path)


def _picture_name(trajectory: Trajectory, numbers: list[int]) -> str:
    counted = [number % len(trajectory) for number in numbers]
    return "frame_" + "_".join(f"{number:04d}" for number in counted) + ".png"


def _table(options: argparse.Namespace) -> None:
    print(timing_table(Trajectory(options.result), options.format))


if __name__ == "__main__":
    sys.exit(main())
