"""The verbs that draw: plot, movie and view, with their options."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from ..base.result_file import ResultError
from ..read.trajectory import Trajectory


def add_picture_verbs(verbs) -> None:
    """Add the parsers of these verbs."""
    _add_plot(verbs)
    _add_movie(verbs)
    _add_view(verbs)


def _add_plot(verbs) -> None:
    plot = verbs.add_parser("plot")
    plot.set_defaults(action=_plot)
    plot.add_argument("result", type=Path, metavar="RESULT")
    which = plot.add_mutually_exclusive_group()
    which.add_argument("--frame", type=int, metavar="K")
    which.add_argument("--frames", metavar="A,B,C")
    which.add_argument("--times", type=_reals, metavar="T,...")
    plot.add_argument("--output", "-o", type=Path, metavar="FILE")
    plot.add_argument("--separate", action="store_true")
    plot.add_argument("--columns", type=int, metavar="N")
    _add_look(plot)
    plot.add_argument("--contacts", action="store_true")
    plot.add_argument("--size", type=_reals, metavar="W,H")
    plot.add_argument("--dpi", type=float, default=150)


def _add_movie(verbs) -> None:
    movie = verbs.add_parser("movie")
    movie.set_defaults(action=_movie)
    movie.add_argument("result", type=Path, metavar="RESULT")
    movie.add_argument("--output", "-o", type=Path, metavar="FILE")
    movie.add_argument("--frames", metavar="FIRST:END:STEP")
    movie.add_argument("--every", type=int, default=1, metavar="N")
    movie.add_argument("--fps", type=float, default=25, metavar="N")
    movie.add_argument("--size", type=_reals, metavar="W,H")
    movie.add_argument("--processes", type=int, metavar="N")
    _add_look(movie)


def _add_view(verbs) -> None:
    view = verbs.add_parser("view")
    view.set_defaults(action=_view)
    view.add_argument("result", type=Path, metavar="RESULT")
    view.add_argument("--output", "-o", type=Path, metavar="FILE")
    view.add_argument("--frames", metavar="FIRST:END:STEP")
    view.add_argument("--every", type=int, default=1, metavar="N")
    view.add_argument("--colour", "--color", metavar="QUANTITY", default="speed")
    view.add_argument("--no-contacts", action="store_true")


def _add_look(parser) -> None:
    parser.add_argument("--colour", "--color", metavar="QUANTITY")
    parser.add_argument("--range", type=_reals, metavar="LOW,HIGH")
    parser.add_argument("--map", metavar="NAME")
    parser.add_argument("--show", type=lambda text: tuple(filter(None, text.split(","))), metavar="A,B,C")
    parser.add_argument("--limits", type=_reals, metavar="X0,X1,Y0,Y1")
    parser.add_argument("--no-title", action="store_true")
    parser.add_argument("--scale-bar", action="store_true")


def _reals(text: str) -> list[float]:
    try:
        values = [float(word) for word in text.split(",")]
        if np.isfinite(values).all():
            return values
    except ValueError:
        pass
    raise argparse.ArgumentTypeError(f"'{text}' is not a list of numbers like 0,0.5")


def look_of(options: argparse.Namespace):
    """What the options say of the look of pictures."""
    from ..pictures.drawing import Look

    if options.limits is not None:
        _expect(options.limits, 4, "--limits", "X0,X1,Y0,Y1")
        _expect_order(options.limits[:2], "--limits")
        _expect_order(options.limits[2:], "--limits")
    if options.range is not None:
        _expect(options.range, 2, "--range", "LOW,HIGH")
        _expect_order(options.range, "--range")
    show = options.show or ()
    if getattr(options, "contacts", False) and "forces" not in show:
        show = (*show, "forces")
    colour = options.colour or ("none" if show else "speed")
    look = Look(colour, show, options.limits and tuple(options.limits), options.range and tuple(options.range),
                options.map, title=not options.no_title, scale_bar=options.scale_bar)
    look.check()
    return look


def _expect(values: list, count: int, name: str, form: str) -> None:
    if len(values) != count:
        raise ResultError(f"{name} takes {count} numbers, as in {form}")


def _expect_order(values: list, name: str) -> None:
    if not values[0] < values[1]:
        raise ResultError(f"{name}: {values[0]:g} is not below {values[1]:g}")


def chosen_frames(text: str, count: int) -> list[int]:
    """Numbers of frames of a list like 0,10,-1 or 0:100:10, counted from 0."""
    numbers: list[int] = []
    for word in text.split(","):
        try:
            if ":" in word:
                numbers += range(count)[slice(*(int(part) if part else None for part in word.split(":")))]
            else:
                numbers.append(int(word))
        except (ValueError, TypeError) as error:
            raise ResultError(f"--frames: '{word}' is neither the number of a frame nor a range "
                              "FIRST:END:STEP") from error
    if not numbers:
        raise ResultError(f"--frames: {text} contains none of the {count} frames")
    return numbers


def open_frames(path: Path) -> Trajectory:
    """A trajectory with at least one frame."""
    trajectory = Trajectory(path)
    if len(trajectory) == 0:
        raise ResultError(f"{path}: holds no frames")
    return trajectory


def _nearest(trajectory: Trajectory, times: list[float]) -> list[int]:
    """Frames nearest to times, which must not lie more than an interval outside the run."""
    interval = float(np.max(np.diff(trajectory.times), initial=0.0))
    for time in times:
        if not trajectory.times[0] - interval <= time <= trajectory.times[-1] + interval:
            raise ResultError(f"--times: there is no frame near {time:g} s; the frames are from "
                              f"{trajectory.times[0]:g} to {trajectory.times[-1]:g} s")
    return [int(np.argmin(np.abs(trajectory.times - time))) for time in times]


def _plot(options: argparse.Namespace) -> None:
    from ..pictures.drawing import settle
    from ..pictures.plot import (
        check_form,
        plot_frames,
        save,
    )  # matplotlib takes long to load and a table does not need it

    look = look_of(options)
    if options.size is not None:
        _expect(options.size, 2, "--size", "W,H")
    if options.size is not None and not all(30.0 <= side <= 2000.0 for side in options.size):
        raise ResultError("--size takes a width and a height from 30 to 2000 mm")
    if not 10.0 <= options.dpi <= 2400.0 or (options.columns is not None and options.columns < 1):
        raise ResultError("--dpi takes a number from 10 to 2400, --columns an integer of at least 1")
    if options.output:
        check_form(options.output)
    trajectory = open_frames(options.result)
    if options.times:
        numbers = _nearest(trajectory, options.times)
    elif options.frames:
        numbers = chosen_frames(options.frames, len(trajectory))
    else:
        numbers = [-1 if options.frame is None else options.frame]
    groups = [numbers]
    if options.separate:
        look, groups = settle(trajectory, numbers, look), [[number] for number in numbers]
    for group in groups:
        figure = plot_frames(trajectory, group, look, options.size, options.columns, options.dpi)
        path = _picture_path(options, trajectory, group)
        save(figure, path, options.dpi, tight=options.size is None)
        print(path)


def _movie(options: argparse.Namespace) -> None:
    from ..pictures.movie import check_film, make_movie

    look = look_of(options)
    if options.output:
        check_film(options.output)
    if options.size is not None:
        _expect(options.size, 2, "--size", "W,H")
        if not all(160.0 <= side <= 7680.0 for side in options.size):
            raise ResultError("--size takes a width and a height from 160 to 7680 pixels")
    if not 0.1 <= options.fps <= 240.0:
        raise ResultError("--fps takes a number from 0.1 to 240")
    if options.every < 1 or (options.processes is not None and options.processes < 1):
        raise ResultError("--every and --processes take integers of at least 1")
    trajectory = open_frames(options.result)
    numbers = chosen_frames(options.frames or ":", len(trajectory))[:: options.every]
    path = options.output or trajectory.folder / "movie.mp4"
    make_movie(trajectory, numbers, path, look, options.fps, options.size, options.processes)
    print(path)


def _view(options: argparse.Namespace) -> None:
    from ..pictures.quantities import QUANTITIES
    from ..pictures.view import write_view

    if options.colour != "none" and options.colour not in QUANTITIES:
        raise ResultError(f"there is no colour {options.colour}; there are {', '.join(QUANTITIES)} and none")
    if options.every < 1:
        raise ResultError("--every takes an integer of at least 1")
    if options.output and options.output.suffix.lower() not in (".html", ".htm"):
        raise ResultError(f"{options.output}: cannot be written: the name must end with .html")
    trajectory = open_frames(options.result)
    numbers = chosen_frames(options.frames or ":", len(trajectory))[:: options.every]
    path = options.output or trajectory.folder / "view.html"
    write_view(trajectory, numbers, path, not options.no_contacts, options.colour)
    print(path)


def _picture_path(options: argparse.Namespace, trajectory: Trajectory, numbers: list[int]) -> Path:
    """The name given, with the number of the frame if each has a file of its own; else one in the result."""
    name = "_".join(f"{number % len(trajectory):04d}" for number in numbers)
    if options.output is None:
        return trajectory.folder / (f"frame_{name}.png" if len(numbers) <= 20 else f"frames_{name[:4]}_{name[-4:]}.png")
    if options.separate:
        return options.output.with_name(f"{options.output.stem}_{name}{options.output.suffix}")
    return options.output
