"""Pictures of frames."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure

from .trajectory import Frame, ResultError, Trajectory

#: What bodies may be coloured by
COLOURS = ("speed", "angle", "id", "none")

WALL_COLOUR = "0.55"
PLAIN_COLOUR = "#d9b98a"
CONTACT_COLOUR = "#a01020"
#: Bodies slower than this are at rest: the scale of speeds does not end below it [m/s]
REST_SPEED = 1e-6
#: Longest side of the picture of one frame [inch]
LONGEST_SIDE = 7.0


def plot_frames(trajectory: Trajectory, numbers: list[int], colour: str = "speed", contacts: bool = False) -> Figure:
    """Draw frames side by side on one scale of colours."""
    frames = [trajectory.frame(number) for number in numbers]
    low, high = _limits(frames)
    width, height = _size(low, high)
    figure = Figure(figsize=(width * len(frames) + 1.2, height + 0.8), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(1, len(frames), squeeze=False, sharey=True)[0]
    norm = _scale(frames, colour)
    for axis, frame in zip(axes, frames):
        grains = _draw_bodies(axis, frame, colour, norm)
        axis.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xlabel="x [m]")
        axis.set_title(f"t = {frame.time:.4g} s")
        axis.spines[["top", "right"]].set_visible(False)
    axes[0].set_ylabel("y [m]")
    if contacts:
        _draw_contacts(axes, trajectory, numbers, frames)
    if colour in ("speed", "angle"):
        label = {"speed": "speed [m/s]", "angle": "angle [rad]"}[colour]
        figure.colorbar(grains, ax=list(axes), label=label, shrink=0.8, pad=0.02)
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write a figure without anything in it that changes from run to run."""
    try:
        figure.savefig(path, dpi=150, metadata={"Software": None} if path.suffix == ".png" else None)
    except (OSError, ValueError) as error:
        raise ResultError(f"{path}: cannot be written ({error})") from error


def _draw_bodies(axis, frame: Frame, colour: str, norm: Normalize) -> PolyCollection:
    fixed = np.flatnonzero(frame.fixed)
    free = np.flatnonzero(~frame.fixed)
    walls = PolyCollection([frame.vertices[k] for k in fixed], facecolor=WALL_COLOUR, edgecolor="none")
    line = float(np.clip(20.0 / np.sqrt(len(free) + 1), 0.1, 0.8))
    grains = PolyCollection([frame.vertices[k] for k in free], edgecolor="black", linewidth=line)
    if colour == "none":
        grains.set_facecolor(PLAIN_COLOUR)
    else:
        grains.set(array=_values(frame, colour)[free], cmap=_map(colour), norm=norm)
    axis.add_collection(walls)
    axis.add_collection(grains)
    return grains


def _draw_contacts(axes, trajectory: Trajectory, numbers: list[int], frames: list[Frame]) -> None:
    """Draw each contact as lines from the two centres to its point, as wide as its force is large."""
    tables = [trajectory.contacts(number) for number in numbers]
    for frame, table in zip(frames, tables):
        if not np.isin(np.concatenate([table.first, table.second]), frame.id).all():
            raise ResultError(f"{trajectory.folder}: contacts of step {frame.step} name bodies that are not there")
    forces = [np.hypot(table.force[:, 0], table.force[:, 1]) for table in tables]
    largest = max((force.max() for force in forces if len(force)), default=0.0)
    for axis, frame, table, force in zip(axes, frames, tables, forces):
        if largest == 0.0:
            continue
        first = frame.position[np.searchsorted(frame.id, table.first)]
        second = frame.position[np.searchsorted(frame.id, table.second)]
        # A wall is large, and its centre may be anywhere: draw no line to it.
        first = np.where(_of(frame, table.first)[:, None], table.point, first)
        second = np.where(_of(frame, table.second)[:, None], table.point, second)
        lines = np.stack([first, table.point, second], axis=1)
        axis.add_collection(LineCollection(lines, linewidths=4.0 * force / largest, colors=CONTACT_COLOUR))


def _of(frame: Frame, identifiers: np.ndarray) -> np.ndarray:
    """Whether the bodies of these identifiers are fixed."""
    return frame.fixed[np.searchsorted(frame.id, identifiers)]


def _values(frame: Frame, colour: str) -> np.ndarray:
    if colour == "speed":
        return np.hypot(frame.velocity[:, 0], frame.velocity[:, 1])
    if colour == "angle":
        return np.mod(frame.angle, 2.0 * np.pi)
    return np.mod(frame.id, 20).astype(float)


def _map(colour: str):
    if colour == "id":
        # Light and dark halves of matplotlib's tab20, so that neighbours differ and edges stay visible.
        import matplotlib

        return ListedColormap(matplotlib.colormaps["tab20"].colors)
    return {"speed": "viridis", "angle": "twilight"}[colour]


def _scale(frames: list[Frame], colour: str) -> Normalize:
    """One scale for all frames; a few fast bodies do not darken the rest."""
    if colour == "angle":
        return Normalize(0.0, 2.0 * np.pi)
    if colour == "speed":
        speeds = np.concatenate([_values(frame, colour)[~frame.fixed] for frame in frames])
        greatest = np.percentile(speeds, 99.5) if len(speeds) else 0.0
        return Normalize(0.0, max(greatest, REST_SPEED))
    return Normalize(-0.5, 19.5)


def _limits(frames: list[Frame]) -> tuple[np.ndarray, np.ndarray]:
    corners = np.concatenate([outline for frame in frames for outline in frame.vertices])
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = 0.02 * max(high - low)
    return low - margin, high + margin


def _size(low: np.ndarray, high: np.ndarray) -> tuple[float, float]:
    extent = high - low
    return tuple(np.maximum(LONGEST_SIDE * extent / extent.max(), 1.5))
