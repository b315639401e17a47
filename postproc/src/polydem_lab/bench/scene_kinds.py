"""What a scene is, from the settings that its samples record: never from its name.

A bench stores with every sample the resolved input of the run that made the boxes. A drum is what was made as a
rotating drum, whatever it is called; boxes of which nobody recorded how they were made are `unknown`, and no claim
about drums, gases or beds counts them.
"""

from __future__ import annotations

import math
import re

from polydem_post.base.result_file import ResultError

#: Boxes of which it is not recorded how they were made
UNKNOWN = "unknown"

#: A scene that is none of the kinds that claims are about
OTHER = "other"

#: Entries that scenes of one family may differ in: those that set the size, and when and how it was recorded
SIZE_ENTRIES = re.compile(r"scene\.(boxes|bodies|radius|width)|integrate\.duration|output\..*|checkpoint\..*")

#: Entries that decide neither over the boxes nor over when they are recorded
REST_OF_ENTRIES = re.compile(r"integrate\.duration|output\.(?!trace_start$).*|checkpoint\..*")

#: A bed whose boxes were recorded so long after the start has settled [s]
SETTLED = 0.5

#: A range of at least so many long axes of a grain is long; `boxes.margin` is half the range
LONG_RANGE = 1.0

#: Length over width of slender grains, and height over width of a column
SLENDER, TALL = 10.0, 3.0

#: Share of a settled bed that grains cover, for the height of a column
COVERED = 0.8


def settings_of(text: str) -> dict[str, str]:
    """'group.key', or 'group.name.key', -> value of a resolved input; strings without their quotes."""
    settings, group = {}, ""
    for line in text.splitlines():
        words = line.strip()
        if words.startswith("&"):
            group = words[1:].strip()
        key, equals, value = words.partition("=")
        key, value = key.strip(), value.strip().strip("'")
        if key == "name" and group != "scene":
            group += f".{value}"
        if group and equals:
            settings[f"{group}.{key}"] = value
    return settings


def number_in(settings: dict, entry: str, default: float = 0.0) -> float:
    """A number of the settings; the default if it is not there or no number."""
    try:
        value = float(settings[entry].lower().replace("d", "e"))
    except (KeyError, ValueError):
        return default
    return value if math.isfinite(value) else default


def long_axes_in(settings: dict) -> tuple[float, float]:
    """Smallest and largest long axis of the grains of a recipe [m]; zeros if they are not there."""
    if "scene.long_axis_min" in settings:
        raise ResultError("a sample is of an earlier revision: `long_axis_min` and `long_axis_max` in its &scene are "
                          "the two values of `long_axis` today; run the bench again")
    words = settings.get("scene.long_axis", "").split(",")
    least, most = (words if len(words) == 2 else ("", ""))
    return number_in({"axis": least}, "axis"), number_in({"axis": most}, "axis")


def kind_of(settings: dict) -> str:
    """Kind of a scene: drum, bed, column, hopper, line, gas, sizes, rods, soft, range, worst, rest; OTHER; UNKNOWN."""
    name = settings.get("scene.name", "")
    if not name:
        return UNKNOWN
    if number_in(settings, "boxes.margin") > 0.0:
        long = 2.0 * number_in(settings, "boxes.margin") >= LONG_RANGE * long_axes_in(settings)[1]
        return "range" if name == "gas" and long else OTHER
    if name in ("hopper", "channel"):
        return {"hopper": "hopper", "channel": "line"}[name]
    if name == "gas":
        return _kind_of_gas(settings)
    if settings.get("scene.order", "natural") != "natural":
        return OTHER
    if name == "drum":
        return "drum" if any(rate != 0.0 for rate in rates_of_walls(settings)) else OTHER
    if name == "bed":
        return _kind_of_bed(settings)
    return OTHER


def family_of(settings: dict) -> tuple:
    """What scenes have in common that differ in their size alone."""
    return tuple(sorted((entry, value) for entry, value in settings.items() if not SIZE_ENTRIES.fullmatch(entry)))


def making_of(settings: dict) -> tuple:
    """What decides over the boxes of a scene: all settings but where its result lies and how long it runs."""
    return tuple(sorted((entry, value) for entry, value in settings.items() if not REST_OF_ENTRIES.fullmatch(entry)))


def rates_of_walls(settings: dict) -> list[float]:
    """The rates of all rotations of walls."""
    return [number_in(settings, entry) for entry in settings if re.fullmatch(r"motion\.\w+\.rate", entry)]


def _kind_of_gas(settings: dict) -> str:
    if settings.get("scene.order", "natural") == "descending":
        return "worst"
    if number_in(settings, "scene.moving_grains") > 0.0:
        return "rest"
    if long_axes_in(settings)[0] >= SLENDER * number_in(settings, "scene.short_axis", math.inf):
        return "rods"
    if settings.get("scene.overlap", "").lower() in (".true.", "t"):
        return "soft" if number_in(settings, "scene.solid_fraction") >= 1.0 else OTHER
    if number_in(settings, "scene.size_ratio", 1.0) > 1.0:
        return "sizes"
    weightless = not any(float_or_one(word) for word in settings.get("forces.gravity", "0").split(","))
    return "gas" if weightless and number_in(settings, "scene.speed") > 0.0 else OTHER


def float_or_one(word: str) -> float:
    """A number, or 1 for what is none: something that is not known to be 0."""
    try:
        return float(word)
    except ValueError:
        return 1.0


def _kind_of_bed(settings: dict) -> str:
    moves = any(entry.startswith("motion.") for entry in settings)
    if number_in(settings, "scene.size_ratio", 1.0) > 1.0 or moves:
        return OTHER
    if number_in(settings, "output.trace_start") < SETTLED:
        return OTHER
    width = number_in(settings, "scene.width")
    grain = 0.25 * math.pi * number_in(settings, "scene.short_axis") * 0.5 * sum(long_axes_in(settings))
    area = number_in(settings, "scene.bodies") * grain / COVERED
    return "column" if width > 0.0 and area > TALL * width**2 else "bed"
