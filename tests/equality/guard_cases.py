"""The runs that the guard compares, in the names of the present tree.

What there is to choose is read from the table of namelist entries in the manual, so that no entry and no choice is
left out: one that needs a value of its own and has none in VARIED is an error.
"""

import itertools
import re
from dataclasses import dataclass

#: Small scenes with contacts from the start to the end, by the word of scene.name; bodies are soft, so steps are large
SOFT = {"forces.gravity": "0, -80", "forces.stiffness": "2e5"}
SCENES = {
    "drum": {**SOFT, "scene.name": "drum", "scene.bodies": "80", "scene.speed": "1.0", "motion.turn.kind": "rotation",
             "motion.turn.rate": "2", "integrate.duration": "0.03"},
    "hopper": {**SOFT, "scene.name": "hopper", "scene.bodies": "60", "scene.opening": "0.04", "scene.slope": "60",
               "scene.speed": "1.0", "integrate.duration": "0.03"},
    "gas": {**SOFT, "scene.name": "gas", "scene.bodies": "80", "scene.solid_fraction": "0.35", "scene.speed": "1.0",
            "scene.spin": "50", "integrate.duration": "0.02"},
    "bed": {**SOFT, "scene.name": "bed", "scene.bodies": "80", "scene.speed": "2.0", "integrate.duration": "0.03"},
    "heap": {**SOFT, "scene.name": "heap", "scene.bodies": "60", "scene.speed": "1.0", "integrate.duration": "0.03"},
    "channel": {**SOFT, "scene.name": "channel", "scene.bodies": "60", "scene.solid_fraction": "0.3",
                "scene.speed": "1.0", "integrate.duration": "0.03"},
    "incline": {**SOFT, "scene.name": "incline", "scene.width": "0.02", "scene.height": "0.01", "scene.slope": "30",
                "scene.speed": "0.1", "integrate.duration": "0.03"},
    "stack": {**SOFT, "scene.name": "stack", "scene.bodies": "6", "scene.width": "0.01", "scene.height": "0.01",
              "integrate.duration": "0.03"},
    "parts": {**SOFT, "wall.one.outline": "ring", "wall.one.radius": "0.1", "wall.one.segments": "40",
              "wall.one.thickness": "0.01", "grains.one.region": "box", "grains.one.low": "-0.06, -0.06",
              "grains.one.high": "0.06, 0.06", "grains.one.number": "10", "grains.one.speed": "1.0",
              "integrate.duration": "0.02"},
    "file": {**SOFT, "scene.name": "file", "scene.bodies_file": "results/workprecision/bodies/stack.h5",
             "integrate.duration": "0.01"},
}
#: Grains of many sizes under a shaking wall: every finder, several processes
SIZES = {**SCENES["bed"], "scene.bodies": "200", "scene.size_ratio": "10", "motion.shake.kind": "oscillation",
         "motion.shake.amplitude": "1e-3, 2e-3", "motion.shake.frequency": "100"}
#: Frames with everything in them, some to a segment; nothing that depends on the time that something takes
OUTPUT = {"output.contacts": ".true.", "output.frames_per_segment": "4", "decomposition.balance": "counted"}
N_FRAMES = 10

#: Coefficients of order one for each damping
COEFFICIENTS = {"rate": "0.1", "hunt_crossley": "5", "matuttis_chen": "0.1", "none": None}
#: Entries that make contacts second order: a condition, and their value where a case does not say another. Their
#: default differs between revisions.
SECOND_ORDER = {"forces.damping_from_touch": (("forces.damping", "rate"), ".true."),
                "forces.midstep_slip": (("forces.friction", "cundall_strack"), ".true.")}
FIRST_ORDER = dict.fromkeys(SECOND_ORDER, ".false.")
#: Switches of models beside law, damping, friction and scheme
SWITCHES = {
    "first_order": FIRST_ORDER,
    "touch": {**FIRST_ORDER, "forces.damping_from_touch": ".true."},
    "restitution": {"forces.restitution": "0.5"},
    "tilt": {"forces.tilt_damping": "0.5"},
    "midstep": {**FIRST_ORDER, "forces.midstep_slip": ".true."},
    "compensated": {"integrate.accumulation": "compensated"},
    "all": {"forces.damping_from_touch": ".true.", "forces.tilt_damping": "0.5", "forces.midstep_slip": ".true."},
}
#: Runs that warn, that a guard stops or that begin otherwise
GUARDS = {
    "displacement_stops": {"forces.gravity": "0, -5e5"},
    "displacement_warns": {"guards.displacement": "warn", "guards.displacement_limit": "1e-3"},
    "step_stops": {"integrate.dt": "1e-2"},
    "step_warns": {"guards.step": "warn", "integrate.safety_factor": "0.6"},
    "overlap_stops": {"guards.overlap": "stop", "guards.overlap_limit": "1e-3"},
    "overlap_warns": {"guards.overlap": "warn", "guards.overlap_limit": "1e-3"},
    "energy_stops": {"guards.energy": "stop", "guards.energy_limit": "1e-9", "forces.damping": "none"},
    "energy_warns": {"guards.energy": "warn", "guards.energy_limit": "1e-9", "forces.damping": "none"},
    "relaxed": {**SCENES["gas"], "scene.overlap": ".true.", "scene.remove_overlap": "0.05"},
    "listed": {**SCENES["gas"], "scene.overlap": ".true.", "guards.listed_depth": "1e-4", "guards.step": "warn",
               "guards.displacement": "off"},
}
#: Name of the group in cases of a group that may be there several times
NAME = "one"
#: Groups that have numbers of &forces
PAIRS = ("material", "contact_pair")
#: Beginnings of the entries of parts, which need a scene of parts
PARTS = (f"grains.{NAME}.", f"wall.{NAME}.")
#: A value other than the default for each entry that is neither a word nor logical; by entry, or entry@scene. Those of
#: materials and of pairs are those of &forces
VARIED = {
    "scene.seed": "7", "scene.boxes": "150", "scene.bodies": "50", "scene.corners": "3, 20",
    "scene.short_axis": "7.5e-3", "scene.long_axis": "9e-3, 15e-3", "scene.remove_overlap": "1e-3",
    "scene.size_ratio": "5", "scene.density": "1000", "scene.radius": "0.08",
    "scene.width": "0.15",
    "scene.width@heap": "1.0", "scene.width@incline": "0.03", "scene.width@stack": "0.02", "scene.height": "0.015",
    "scene.opening": "0.05", "scene.slope": "40", "scene.solid_fraction": "0.25", "scene.speed": "1.5",
    "scene.spin": "20", "scene.moving_grains": "5",
    "motion.one.bodies": "82, 84", "motion.one.pivot": "0.01, 0.02", "motion.one.rate": "1",
    "motion.one.velocity": "0.1, 0.2", "motion.one.amplitude": "1e-3, 0", "motion.one.frequency": "50",
    "motion.one.start": "0.005", "motion.one.ramp": "0.01", "motion.one.end": "0.02",
    "wall.one.from": "-0.2, -0.2", "wall.one.to": "0.2, -0.2", "wall.one.low": "-0.2, -0.2",
    "wall.one.high": "0.2, -0.11", "wall.one.angle": "3", "wall.one.centre": "0.01, 0", "wall.one.radius": "0.12",
    "wall.one.segments": "30", "wall.one.vertices": "-0.2, -0.3, 0.2, -0.3, 0, -0.15", "wall.one.thickness": "0.02",
    "wall.one.vanish_at": "0.01", "motion.one.wall": "one",
    "load.one.wall": "one", "load.one.force": "20", "load.one.stress": "200", "load.one.width": "0.2",
    "load.one.torque": "1", "load.one.pivot": "0.01, 0.02", "load.one.mass": "2",
    "load.one.damping_ratio": "0.3", "load.one.start": "0.005", "load.one.end": "0.015", "load.one.ramp": "0.01",
    "grains.one.low": "-0.05, -0.05", "grains.one.high": "0.05, 0.05", "grains.one.centre": "0.01, 0",
    "grains.one.radius": "0.08", "grains.one.vertices": "-0.05, -0.05, 0.05, -0.05, 0, 0.05", "grains.one.wall": "one",
    "grains.one.at": "0.01, 0", "grains.one.number": "30", "grains.one.number@at": None,
    "grains.one.solid_fraction": "0.2", "grains.one.corners": "5, 9",
    "grains.one.short_axis": "7e-3", "grains.one.long_axis": "9e-3, 12e-3", "grains.one.diameter": "8e-3, 9e-3",
    "grains.one.width": "6e-3", "grains.one.height": "4e-3", "grains.one.arm": "2e-3",
    "grains.one.outline": "-4e-3, -4e-3, 4e-3, -4e-3, 0, 5e-3", "grains.one.angle": "30, 40",
    "grains.one.outline_corners": "3, 4", "grains.one.outline_pieces": "1, 1, 2",
    "grains.one.elongation": "2",
    "grains.one.lloyd_steps": "3", "grains.one.gap": "2e-4",
    "grains.one.size_spread": "1.3", "grains.one.grading": "1, 0, 1.5, 0.4, 2, 1",
    "grains.one.size_ratio": "2", "grains.one.velocity": "0.1, 0.2", "grains.one.speed": "1.5",
    "grains.one.moving_grains": "5", "grains.one.spin": "20", "grains.one.density": "1000", "grains.one.seed": "7",
    "cell.low": "-0.3, -0.3", "cell.size": "0.6, 0.6",
    "wall.one.corners": "6",
    "stage.one.duration": "0.02", "stage.one.below": "1e-3",
    "stage.one.above": "1e-3", "stage.one.hold": "1e-3", "stage.one.longest": "0.02", "stage.one.check": "7",
    "stage.one.low": "-0.01, -0.01", "stage.one.high": "0.01, 0.01",
    "stage.one.gravity": "1, -20", "stage.one.friction_scale": "0.5", "stage.one.drag": "2",
    "sample.low": "-0.05, -0.05", "sample.high": "0.05, 0.05",
    "boxes.largest_ratio": "2", "boxes.margin": "1e-4", "neighbours.skin": "1e-3",
    "forces.gravity": "10, -40", "forces.stiffness": "1e6", "forces.stiffness_over_pressure": "2e3",
    "forces.damping_coefficient": "0.2",
    "forces.restitution": "0.3",
    "forces.tilt_damping": "0.5", "forces.friction_coefficient": "0.6", "forces.tangential_stiffness": "0.5",
    "forces.tangential_damping": "0.5", "forces.friction_tolerance": "1e-6",
    "forces.local_damping": "0.3", "forces.shake": "5, 20", "forces.shake_frequency": "50", "forces.turn_rate": "2",
    "forces.drag": "2", "forces.cohesion": "2e4", "forces.rolling_friction": "0.2", "forces.rolling_damping": "0.8",
    "scene.material": "one", "scene.wall_material": "one", "grains.one.material": "one",
    "wall.one.material": "one", "material.one.density": "1000", "contact_pair.one.materials": "one', 'one",
    "guards.displacement_limit": "0.2", "guards.overlap_limit": "0.5", "guards.energy_limit": "0.5",
    "guards.listed_depth": "1e-4",
    "integrate.dt": "5e-5", "integrate.safety_factor": "0.1", "integrate.speed": "3", "integrate.duration": "0.025",
    "decomposition.margin": "1e-3", "decomposition.imbalance": "2",
    "output.frame_interval": "0.002", "output.frames_per_segment": "3",
    "output.log_interval": "1e-3",
    "output.series_interval": "1e-3", "output.trace_steps": "20", "output.trace_start": "0.01",
    "checkpoint.steps": "50", "checkpoint.interval": "0.01",
}
#: A triangle and a square
TWO_OUTLINES = "-4e-3, -4e-3, 4e-3, -4e-3, 0, 5e-3, -3e-3, -3e-3, 3e-3, -3e-3, 3e-3, 3e-3, -3e-3, 3e-3"
#: Two rectangles that make an L
BAR_AND_FOOT = ", 0, 0, 2e-3, 0, 2e-3, 6e-3, 0, 6e-3, 2e-3, 0, 5e-3, 0, 5e-3, 2e-3, 2e-3, 2e-3"
#: What an entry needs beside it to have an effect
BESIDE = {"output.trace_start": {"output.trace_steps": "10"}, "guards.energy_limit": {"guards.energy": "warn"},
          **{name: {"material.one.density": "1000", "material.one.stiffness": "3e5"} for name in (
              "scene.material", "scene.wall_material", "grains.one.material", "wall.one.material")},
          "contact_pair.one.materials": {"material.one.density": "1000", "scene.material": "one",
                                         "contact_pair.one.friction_coefficient": "0.6"},
          "grains.one.outline_corners": {"grains.one.outline": TWO_OUTLINES},
          "grains.one.outline_pieces": {"grains.one.outline": TWO_OUTLINES + BAR_AND_FOOT,
                                        "grains.one.outline_corners": "3, 4, 4, 4"},
          "grains.one.outline_choice": {"grains.one.outline": TWO_OUTLINES, "grains.one.outline_corners": "3, 4"},
          "grains.one.lloyd_steps": {"grains.one.gap": "1e-4"},
          "load.one.width": {"load.one.stress": "300"}, "load.one.stress": {"load.one.width": "0.1"},
          "load.one.weight": {"load.one.direction": "y"},
          **{f"load.one.{key}": {"load.one.torque": VARIED["load.one.torque"]} for key in ("direction", "pivot")},
          **{f"sample.{key}": {"output.series_interval": "1e-3"} for key in ("area", "low", "high")},
          "forces.shake": {"forces.shake_frequency": "40"}, "forces.shake_frequency": {"forces.shake": "5, 10"},
          "forces.rolling_damping": {"forces.rolling_friction": "0.2"},
          "output.csv": {"output.series_interval": "1e-3"}}
#: Where entries without a value above are tried
ELSEWHERE = {"scene.packing": "packed/...", "scene.bodies_file": "inputs/precision/...", "output.folder": "every case",
             **dict.fromkeys(("motion.one.stage", "load.one.stage",
                               "scene.start_from", "stage.one.wall", "stage.one.opposite", "stage.one.sink"),
                             "check_stages.py"),
             **dict.fromkeys(("stage.one.component", "sample.sides", "sample.ends"), "test_time_series.py"),
             "motion.one.file": "test_motion_file.pf", "load.one.between": "inputs/biaxial.nml",
             "wall.one.bodies": "as motion.one.bodies", "cell.shear_rate": "tests/ranks: not with walls",
             "cell.shear_ramp": "as cell.shear_rate",
             "grains.one.packing": "as scene.packing",
             "grains.one.number": "blocks of scene.name = stack", "grains.one.outlines": "test_shapes.pf",
             "checkpoint.wall_interval": "nowhere: what it does depends on the time that steps take"}

#: Words of parts that need a file, or several other entries; the recipes drum and stack try the same code
UNTRIED = {*(("cell.stress_controlled", axes) for axes in ("x", "y", "xy")),
           *(("source.one.shape", shape) for shape in ("regular", "random", "rectangle", "outline")),
           *(("source.one.sizes", sizes) for sizes in ("log_normal", "grading")),
           ("grains.one.shape", "outline"), ("grains.one.arrangement", "voronoi"),
           ("wall.one.outline", "bodies"), ("wall.one.outline", "result"), ("scene.name", "result"),
           ("stage.one.until", "strain"), ("stage.one.until", "stress"), ("stage.one.until", "departed"),
           ("sample.area", "walls"),
           ("motion.one.kind", "table"), ("grains.one.arrangement", "packing"),
           ("grains.one.arrangement", "column")}

#: Numbers of ranks of the program with MPI
RANKS = (1, 2, 3)
#: Ranks of the attempts of a run that is interrupted twice; None: the program without MPI
ATTEMPTS = {"serial": (None, None, None), "3-2-serial": (3, 2, None), "serial-2-3": (None, 2, 3), "2-3-1": (2, 3, 1)}


@dataclass
class Case:
    """One comparison."""

    name: str
    #: Entries, group.key or group.name.key -> value; beside a namelist they override it
    settings: dict
    #: A namelist below inputs, without its suffix; None: `settings` is all
    source: str | None = None
    ranks: int | None = None
    threads: int = 1
    #: Ranks of each attempt, if the run is interrupted
    attempts: tuple = ()
    #: Whether everything is compared, or only what does not depend on how long steps take
    whole: bool = True
    #: Finder of a replay of what the run recorded
    replay: str | None = None


@dataclass(frozen=True)
class Entry:
    """A row of the table of namelist entries."""

    name: str
    type: str
    choices: tuple
    default: str
    #: What it is used with: an entry and words of it, or nothing
    condition: tuple


def read_entries(manual):
    """The table of namelist entries in the text of inputs/entries.md."""
    rows = re.findall(r"^\| &(\w+) \| `(\w+)` \|(.*)\|$", manual, re.MULTILINE)
    entries, named = [], set()
    for group, key, rest in rows:
        kind, _, default, allowed, used, _ = re.split(r"\s*\|\s*", rest.strip(), maxsplit=5)
        if key == "name" and kind == "name":
            named.add(group)
            continue
        group = f"{group}.{NAME}" if group in named else group
        condition = ()
        if used:
            needed, _, words = used.rpartition(" = ")
            condition = (f"{group}.{needed or 'name'}", tuple(words.split(", ")))
        choices = tuple(allowed.split(", ")) if kind == "word" else (".true.", ".false.") if kind == "logical" else ()
        entries.append(Entry(f"{group}.{key}", kind, choices, default.strip("`'"), condition))
    if len(entries) < 50:
        raise ValueError("inputs/entries.md: the table of namelist entries was not understood")
    return entries


def choices(entries, name):
    """All words of an entry."""
    return next(entry.choices for entry in entries if entry.name == name)


def generated(name, settings, **others):
    """A case without a namelist file, with frames."""
    interval = float(settings.get("integrate.duration", "0.02")) / N_FRAMES
    order = {name: value for name, ((key, word), value) in SECOND_ORDER.items() if settings.get(key, word) == word}
    settings = {**OUTPUT, "output.frame_interval": f"{interval:.6g}", **order, **settings}
    # How work that was timed is shared differs from run to run, and with it the counters of ranks.
    whole = settings["decomposition.balance"] != "measured"
    return Case(name, {key: value for key, value in settings.items() if value is not None}, whole=whole, **others)


def model_cases(entries):
    """Every elastic law with every damping, friction and integrator, and with every switch."""
    laws, dampings, frictions, schemes = (choices(entries, name) for name in (
        "forces.law", "forces.damping", "forces.friction", "integrate.scheme"))
    for law, damping, friction, scheme in itertools.product(laws, dampings, frictions, schemes):
        yield generated(f"models/{law}-{damping}-{friction}-{scheme}", {
            **SCENES["drum"], "forces.law": law, "forces.damping": damping, "forces.friction": friction,
            "forces.damping_coefficient": COEFFICIENTS.get(damping, "0.1"), "integrate.scheme": scheme})
    for (switch, added), law, scheme in itertools.product(SWITCHES.items(), laws, schemes):
        yield generated(f"switches/{switch}-{law}-{scheme}",
                        {**SCENES["drum"], "forces.law": law, "integrate.scheme": scheme, **added})
    for name, added in GUARDS.items():
        yield generated(f"guards/{name}", {**SCENES["drum"], **added})


def entry_cases(entries):
    """Each entry with each of its words, or another value than its default."""
    turn = itertools.count()
    for entry in entries:
        if entry.name.startswith("bench."):
            continue
        condition, words = entry.condition or ("", ())
        known = [word for word in words if word in SCENES] or ["drum"]
        scene = known[next(turn) % len(known)] if condition == "scene.name" else "drum"
        scene = "parts" if entry.name.startswith((*PARTS, f"motion.{NAME}.wall", "cell.", "load.")) else scene
        base = dict(SCENES[scene])
        if condition and condition != "scene.name" and OUTPUT.get(condition) not in words:
            base[condition] = words[0]
            base = {key: value for key, value in base.items() if fits(key, base, entries)}
        base = base_of(entry, base)
        for value in values_of(entry, "at" if base.get(f"grains.{NAME}.region") == "at" else scene):
            settings = {**base, **beside(entry.name), entry.name: value}
            if scene == "parts":
                settings = fitting_parts(settings, entries)
            if entry.name == "scene.name":
                settings = dict(SCENES[value])
            settings.update(companions(settings, entry.name, entries))
            if settings.get(f"stage.{NAME}.until", "duration") != "duration" and entry.name != f"stage.{NAME}.above":
                settings.setdefault(f"stage.{NAME}.below", VARIED[f"stage.{NAME}.below"])
            if entry.name == "scene.boxes":
                settings.pop("scene.bodies")
            name = f"entries/{entry.name}={value.replace(', ', ',')}" + f"@{scene}" * (scene != "drum")
            name += "".join(f"-{word}" for word in words[:1] if scene == "parts" or entry.name.startswith("stage."))
            yield generated(name, settings, ranks=3 if entry.name.startswith("decomposition.") else None)


def base_of(entry, base):
    """Settings without what excludes an entry, and with what its group needs."""
    if entry.name == "forces.stiffness_over_pressure":
        base = {key: value for key, value in base.items() if key != "forces.stiffness"}
    if entry.name.startswith("stage."):
        del base["integrate.duration"]
        base.setdefault(f"stage.{NAME}.until", "duration")
    if entry.name.startswith("motion."):
        base = {key: value for key, value in base.items() if not key.startswith("motion.")}
        base.setdefault(f"motion.{NAME}.kind", "rotation")
    if entry.name.startswith("load."):
        base = {f"load.{NAME}.wall": NAME, f"load.{NAME}.direction": "x", **base}
        if not entry.name.endswith((".stress", ".width")):
            base[f"load.{NAME}.force"] = VARIED[f"load.{NAME}.force"]
    return base


def fitting_parts(settings, entries):
    """Entries of a scene of parts without those that others replace."""
    settings = {key: value for key, value in settings.items() if fits(key, settings, entries)}
    if settings.get(f"grains.{NAME}.region") == "at":
        settings[f"grains.{NAME}.number"] = "1"
    if f"grains.{NAME}.solid_fraction" in settings:
        settings.pop(f"grains.{NAME}.number")
    return settings


def fits(key, settings, entries):
    """Whether an entry is in force: of its rows one has its condition met."""
    rows = [entry for entry in entries if entry.name == key]
    return any(not row.condition or settings.get(row.condition[0], default_of(row.condition[0], entries))
               in row.condition[1] for row in rows)


def default_of(name, entries):
    """The default of an entry."""
    return next(entry.default for entry in entries if entry.name == name)


def companions(settings, name, entries):
    """Entries that are required with these settings and not given."""
    return {entry.name: VARIED.get(entry.name) for entry in entries
            if entry.default == "required" and entry.name not in settings and entry.name != name
            and entry.name.startswith(("motion.", "stage.", "load.", "sample.", *PARTS))
            and entry.condition
            and settings.get(entry.condition[0], "none") in entry.condition[1]}


def values_of(entry, scene):
    """Values to try of an entry."""
    if entry.choices:
        return [value for value in entry.choices if value != OUTPUT.get(entry.name, entry.default)
                and (entry.name, value) not in UNTRIED]
    key = f"{entry.name}@{scene}" if f"{entry.name}@{scene}" in VARIED else entry.name
    group, _, number = key.partition(f".{NAME}.")
    value = VARIED.get(key, VARIED.get(f"forces.{number}") if group in PAIRS else None)
    if value is None and not elsewhere(entry):
        raise ValueError(f"{entry.name} has no value in VARIED of guard_cases.py, and ELSEWHERE does not say where it "
                         "is tried: add one")
    if value == entry.default:
        raise ValueError(f"{entry.name} has its default as value in VARIED of guard_cases.py: give it another")
    return [] if value is None else [value]


def elsewhere(entry):
    """Where an entry without a value is tried; empty: nowhere."""
    if entry.name.startswith((f"source.{NAME}.", f"sink.{NAME}.")):
        return "tests/ranks: scene flow"
    if entry.condition and entry.condition[0] == "cell.stress_controlled":
        return "tests/ranks: scene controlled"
    return ELSEWHERE.get(entry.name, "")


def beside(name):
    """What an entry needs beside it to have an effect."""
    group, _, number = name.partition(f".{NAME}.")
    if name in BESIDE or group not in PAIRS:
        return BESIDE.get(name, {})
    damping = {"forces.damping_coefficient": "0.1"} if number == "damping_coefficient" else {}
    if group == "material":
        return {"scene.material": NAME, **damping}
    materials = f"{group}.{NAME}.materials"
    return {"material.one.density": "1000", "scene.material": NAME, **damping, materials: VARIED[materials]}


def finder_cases(entries):
    """Every finder on one scene, on one and two threads; and on what that scene recorded."""
    for finder, threads in itertools.product(choices(entries, "neighbours.finder"), (1, 2)):
        yield generated(f"finders/{finder}-{threads}", {
            **SIZES, "neighbours.finder": finder, "output.trace_steps": "50", "output.step_profile": ".true."},
            threads=threads)
        yield generated(f"replay/{finder}-{threads}", {**SIZES, "output.trace_steps": "50"},
                        threads=threads, replay=finder)


def process_cases():
    """Several processes and threads, and runs that are interrupted and go on."""
    several = {**{name: SCENES[name] for name in ("drum", "gas", "hopper", "stack")}, "sizes": SIZES}
    harder = {"drum": {}, "gas": {"forces.law": "conservative", "forces.damping": "hunt_crossley"},
              "hopper": {"integrate.scheme": "gear", "forces.midstep_slip": ".true."},
              "stack": {"forces.friction": "none", "forces.tilt_damping": "0.5"},
              "sizes": {"integrate.accumulation": "compensated", "forces.damping_from_touch": ".true."}}
    often = {"decomposition.margin": "1e-4", "decomposition.imbalance": "1"}
    for name, scene in several.items():
        settings = {**scene, **harder[name], **often}
        yield generated(f"threads/{name}-2", settings, threads=2)
        for ranks in RANKS:
            yield generated(f"ranks/{name}-{ranks}", settings, ranks=ranks, threads=1 + (ranks == 2))
    yield generated("ranks/measured-3", {**SIZES, **often, "decomposition.balance": "measured"}, ranks=3)
    yield generated("ranks/exact-friction-2", {**SCENES["drum"], **often, "forces.friction": "exact"}, ranks=2)
    for name, scene in (("drum", SCENES["drum"]), ("sizes", SIZES), ("gas", SCENES["gas"])):
        longer = 10 * float(scene["integrate.duration"]) * 80 / float(scene["scene.bodies"])
        settings = {**scene, **harder[name], **often, "integrate.duration": f"{longer:.6g}", "checkpoint.steps": "100",
                    "forces.gravity": "0, -20"}
        for attempts, ranks in ATTEMPTS.items():
            yield generated(f"continued/{name}-{attempts}", settings, attempts=ranks)


def generated_cases(manual):
    """All cases that need no namelist file."""
    entries = read_entries(manual)
    return [*model_cases(entries), *entry_cases(entries), *finder_cases(entries), *process_cases()]
