"""The verbs that print the times of a run, take results to other programs, and polygons from them."""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np

from ..base.emit import FORMATS
from ..base.new_file import insist_on_own
from ..base.result_file import ResultError
from ..read.timing_table import timing_table
from ..read.trajectory import Trajectory
from .arguments import numbers, say

#: Frames between two messages of progress on a terminal
EVERY = 10
#: Necks that --split cuts, as a share of the width of the smaller grain
SPLIT = 0.7


def add_data_verbs(verbs: Any) -> None:
    """Add `table`, `export` and `import` to the verbs of the command line."""
    table = verbs.add_parser("table")
    table.set_defaults(action=_table)
    table.add_argument("result", type=Path, metavar="RESULT")
    table.add_argument("--format", choices=FORMATS, default="text")

    export = verbs.add_parser("export")
    export.set_defaults(action=_export)
    export.add_argument("result", type=Path, metavar="RESULT")
    export.add_argument("--to", choices=("vtkhdf", "vtp", "xdmf", "gsd", "csv"), required=True, metavar="FORMAT")
    export.add_argument("-o", "--output", type=Path, metavar="FILE")
    export.add_argument("--frames", type=_frames, metavar="FRAMES")
    export.add_argument("--no-contacts", action="store_true")
    export.add_argument("--force", action="store_true")

    bodies = verbs.add_parser("import")
    bodies.set_defaults(action=_import)
    bodies.add_argument("file", type=Path, metavar="FILE")
    bodies.add_argument("-o", "--output", type=Path, required=True, metavar="BODIES.h5")
    bodies.add_argument("--from", choices=("wkt", "geojson", "text", "picture", "dxf", "svg"), dest="form",
                        metavar="FORMAT")
    bodies.add_argument("--scale", type=float, metavar="S")
    bodies.add_argument("--picture", type=Path, metavar="FILE")
    bodies.add_argument("--origin", type=_origin, metavar="ORIGIN")
    bodies.add_argument("--fixed", type=numbers, default=[], metavar="A,B,C")
    bodies.add_argument("--decompose", action="store_true")
    bodies.add_argument("--tolerance", type=float, metavar="T")
    bodies.add_argument("--threshold", type=_threshold, metavar="GREY")
    bodies.add_argument("--dark", action="store_true", default=None)
    bodies.add_argument("--uneven", type=float, metavar="PIXELS")
    bodies.add_argument("--smooth", type=float, metavar="PIXELS")
    bodies.add_argument("--split", type=float, nargs="?", const=SPLIT, metavar="SHARE")
    bodies.add_argument("--least", type=float, metavar="PIXELS")
    bodies.add_argument("--border", action="store_true", default=None)
    bodies.add_argument("--convex", action="store_true", default=None)
    bodies.add_argument("--force", action="store_true")


def _frames(text: str) -> slice | list[int]:
    """A slice like 10:100:5, or numbers like 0,10,-1."""
    if re.fullmatch(r"-?\d*:-?\d*(:-?\d*)?", text) and text.split(":")[2:] != ["0"]:
        return slice(*(int(word) if word else None for word in text.split(":")))
    return numbers(text)


def _origin(text: str) -> str | tuple[float, float]:
    """The word centre, or a point like 500000,5400000."""
    if text == "centre":
        return text
    try:
        x, y = (float(word) for word in text.split(","))
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"'{text}' is neither centre nor like 500000,5400000") from error
    return x, y


def _threshold(text: str) -> str | float:
    """The word otsu, or a grey value."""
    try:
        return text if text == "otsu" else float(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"'{text}' is neither otsu nor a grey value like 128") from error


def _table(options: argparse.Namespace) -> None:
    print(timing_table(Trajectory(options.result), options.format))


def _export(options: argparse.Namespace) -> None:
    from ..export import FORMATS, export_result

    run = Trajectory(options.result)
    output = options.output or run.folder / f"{run.folder.resolve().name}{FORMATS[options.to]}"
    if options.frames is not None:
        run = run[options.frames]
    for path in export_result(run, options.to, output, contacts=not options.no_contacts, overwrite=options.force,
                              report=_progress if sys.stderr.isatty() else None):
        print(path)


def _progress(done: int, total: int) -> None:
    if done % EVERY == 0 or done == total:
        print(f"\rframe {done} of {total}", end="\n" if done == total else "", file=sys.stderr, flush=True)


def _import(options: argparse.Namespace) -> None:
    from ..bodies_file import import_bodies, origin_of, pieces_of
    from ..pictures.imported import draw_import
    from ..pictures.plot import check_form, save
    from ..tracing import Tracing

    if options.scale is not None and not np.isfinite(options.scale):
        raise ResultError("--scale takes a number above 0")
    if options.picture:
        check_form(options.picture)
        insist_on_own(options.picture)
    tracing = Tracing(options.tolerance, options.threshold, options.dark, options.smooth, options.split, options.least,
                      options.border, options.uneven, options.convex)
    told: list[str] = []
    n = import_bodies(options.file, options.output, form=options.form or "", scale=options.scale, fixed=options.fixed,
                      decomposed=options.decompose, overwrite=options.force, origin=options.origin, tracing=tracing,
                      say=told.append)
    for sentence in told:
        say(f"{options.file}: {sentence}")
    if options.picture:
        save(draw_import(options.file, options.output, form=options.form or "", scale=options.scale), options.picture)
        say(f"{options.picture}: the outlines of the bodies")
    if options.origin is not None:
        x, y = origin_of(options.output)
        print(f"{options.output}: its origin is at ({x!r}, {y!r}) m; export adds this to the coordinates")
    several, most, thinnest = pieces_of(options.output)
    if several and not told:
        print(f"{options.output}: bodies of several pieces: {several}; most pieces of a body: {most}; thickness of the "
              f"thinnest piece: {thinnest:.3g} m, which makes the time step short if it is small")
    bodies, quoted = "1 body" if n == 1 else f"{n} bodies", str(options.output).replace("'", "''")
    print(f"{options.output}: {bodies}; in the namelist: &scene name = 'file', bodies_file = '{quoted}'")
