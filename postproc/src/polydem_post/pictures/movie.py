"""Films of a run: frames drawn by several processes and written as MP4 or GIF."""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ..base.new_file import insist_on_own, new_file
from ..base.result_file import ResultError
from ..read.trajectory import Trajectory
from . import drawing
from .drawing import Look, SettledLook
from .film_files import write_gif, write_mp4
from .plot import add_scale, add_scale_bar, finish_axes, prepare

#: Ends of the names of films, and what writes them
FORMS = {".mp4": write_mp4, ".gif": write_gif}

#: Picture elements up to which letters have their natural size; in greater films they grow
NATURAL_SIZE, NATURAL_DPI = (1280, 720), 100.0

#: Frames for which another process pays
FRAMES_PER_PROCESS = 8


@dataclass(frozen=True)
class Film:
    """How a film looks, alike for all its frames."""

    look: SettledLook
    #: Width and height [pixels], even
    size: tuple[int, int]
    #: Digits behind the point of the time
    digits: int
    #: Arrows of the scale of colours
    extend: str


class Painter:
    """Draws frames one after the other into one figure, of which only bodies, overlays and time are drawn anew."""

    def __init__(self, trajectory: Trajectory, film: Film, first: int):
        self._trajectory, self._film = trajectory, film
        width, height = film.size
        dpi = NATURAL_DPI * max(width / NATURAL_SIZE[0], height / NATURAL_SIZE[1], 1.0)
        self._figure = Figure(figsize=(width / dpi, height / dpi), dpi=dpi, layout="compressed")
        self._canvas = FigureCanvasAgg(self._figure)
        self._axis = self._figure.subplots()
        frame = trajectory[first]
        prepare(self._axis, film.look, self._title(frame.time))
        if film.look.scale_bar:
            add_scale_bar(self._axis, film.look)
        walls, grains = drawing.draw_bodies(self._axis, frame, film.look)
        outline = drawing.CellOutline(self._axis, frame, film.look)
        self._moving: list[drawing.Bodies | drawing.CellOutline] = [walls, grains, outline]
        add_scale(self._figure, [self._axis], [grains], film.look, film.extend, frame.material_names)
        finish_axes(self._figure, [self._axis], frame, film.look)
        drawing.fit_outlines(grains, frame, drawing.points_per_metre(self._axis))
        for artist in (*self._artists(), self._axis.title):
            artist.set_animated(True)
        self._figure.set_layout_engine("none")
        self._canvas.draw()
        self._background = self._canvas.copy_from_bbox(self._figure.bbox)

    def paint(self, number: int) -> bytes:
        """A frame as red, green and blue of each picture element."""
        look = self._film.look
        frame = self._trajectory[number]
        for each in self._moving:
            each.move(frame, look)
        self._axis.title.set_text(self._title(frame.time))
        self._canvas.restore_region(self._background)
        overlays = drawing.overlays(self._axis, frame, look)
        for artist in (*self._artists(), *overlays, self._axis.title):
            self._axis.draw_artist(artist)
        for artist in overlays:
            artist.remove()
        return np.ascontiguousarray(np.asarray(self._canvas.buffer_rgba())[..., :3]).tobytes()

    def _artists(self) -> Iterator[Artist]:
        """What is drawn anew in each frame below the overlays."""
        return (artist for each in self._moving for artist in each.artists)

    def _title(self, moment: float) -> str:
        return f"t = {moment:.{self._film.digits}f} s"


def make_movie(trajectory: Trajectory, numbers: list[int], path: Path, look: Look, fps: float = 25.0,
               size: tuple | None = None, processes: int | None = None) -> Film:
    """Write the frames of these numbers as a film; the end of its name says in which form."""
    write = FORMS[check_film(path)]
    insist_on_own(path)
    processes = max(1, min(processes or len(os.sched_getaffinity(0)), len(numbers) // FRAMES_PER_PROCESS))
    progress = _Progress(len(numbers))
    progress.say("measuring the frames")
    settled = drawing.settle(trajectory, numbers, look)
    film = Film(settled, _even(size or _fitting(settled)), _digits(trajectory.times[numbers]), _arrows(settled))
    try:
        with new_file(path) as part, _Frames(trajectory, numbers, film, processes) as frames:
            write(part, film.size, fps, progress.count(frames))
    finally:
        progress.end()
    return film


def check_film(path: Path) -> str:
    """The end of the name of a film."""
    if path.suffix.lower() not in FORMS:
        hint = "; ./polydem plot draws pictures" if path.suffix.lower() in (".png", ".pdf", ".svg") else ""
        raise ResultError(f"{path}: cannot be written: the name must end with {' or '.join(FORMS)}{hint}")
    return path.suffix.lower()


class _Frames:
    """The painted frames in order, from this process or from several; never many more than are written."""

    def __init__(self, trajectory: Trajectory, numbers: list[int], film: Film, processes: int):
        self._arguments, self._numbers, self._processes = (trajectory, film, numbers[0]), numbers, processes
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> _Frames:
        if self._processes > 1:
            self._pool = ProcessPoolExecutor(self._processes, multiprocessing.get_context("fork"), _start,
                                             self._arguments)
            # All processes start here: later ones would hold the pipe to ffmpeg open, whose end it waits for.
            self._pool.submit(int).result()
        return self

    def __exit__(self, *_) -> None:
        if self._pool:
            self._pool.shutdown(cancel_futures=True)

    def __iter__(self) -> Iterator[bytes]:
        if not self._pool:
            painter = Painter(*self._arguments)
            yield from map(painter.paint, self._numbers)
            return
        waiting: deque = deque()
        for number in self._numbers:
            waiting.append(self._pool.submit(_paint, number))
            if len(waiting) > 3 * self._processes:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


#: The painter of a process of a pool
_painter: list[Painter] = []


def _start(*arguments) -> None:
    _painter[:] = [Painter(*arguments)]


def _paint(number: int) -> bytes:
    return _painter[0].paint(number)


class _Progress:
    """A line on a terminal that says how far the film is."""

    def __init__(self, frames: int):
        self._frames, self._shown, self._began = frames, sys.stderr.isatty(), time.monotonic()

    def say(self, text: str) -> None:
        """Show a line in place of the last one."""
        if self._shown:
            print(f"\r{text:<60}", end="", file=sys.stderr, flush=True)

    def count(self, frames) -> Iterator[bytes]:
        """Pass frames on and say how many there were."""
        began = time.monotonic()
        for number, frame in enumerate(frames, 1):
            yield frame
            rate = number / max(time.monotonic() - began, 1e-3)
            self.say(f"frame {number} of {self._frames}, {rate:.1f} per second, "
                     f"{(self._frames - number) / rate:.0f} s left")

    def end(self) -> None:
        """Clear the line."""
        if self._shown:
            print(f"\r{'':<60}\r", end="", file=sys.stderr, flush=True)


def _digits(times: np.ndarray) -> int:
    """Digits that tell frames apart."""
    interval = float(np.min(np.diff(times))) if len(times) > 1 else 0.0
    return int(np.clip(np.ceil(-np.log10(interval)) if interval > 0.0 else 3, 0, 9))


def _arrows(look: Look) -> str:
    """Arrows of the scale of colours: the ends that some values may lie beyond."""
    span = look.quantity.span if look.quantity else "class"
    return {"zero": "max", "both": "both", "data": "max"}.get(span, "neither")


def _even(size: tuple) -> tuple[int, int]:
    """Widths and heights of the usual films are even."""
    return int(size[0]) // 2 * 2, int(size[1]) // 2 * 2


def _fitting(look: SettledLook) -> tuple[float, float]:
    """Picture elements in which the scene and its scale have room: at most 1280 x 720."""
    x0, x1, y0, y1 = look.limits
    aside, above = (220.0 if look.quantity else 110.0), (150.0 if look.show else 110.0)
    scale = min((1280.0 - aside) / (x1 - x0), (720.0 - above) / (y1 - y0))
    return max(scale * (x1 - x0) + aside, 400.0), max(scale * (y1 - y0) + above, 300.0)
