"""What a scene can switch on, in pieces that fit together: any two of them make a scene.

A capability says what it adds to groups of the namelist. Grains fly about in a box of four walls, in a channel that is
periodic along x, or in a cell without walls.
"""

import re
from dataclasses import dataclass
from itertools import combinations

#: Containers: groups, and the capabilities that choose one
BOX = """\
&wall name = 'floor' outline = 'rectangle' low = -0.06, -0.07 high = 0.06, -0.05 {wall} /
&wall name = 'left' outline = 'rectangle' low = -0.07, -0.05 high = -0.05, 0.09 {wall} /
&wall name = 'right' outline = 'rectangle' low = 0.05, -0.05 high = 0.07, 0.09 /
&wall name = 'lid' outline = 'rectangle' low = -0.049, 0.05 high = 0.049, 0.06 /
"""
CHANNEL = """\
&cell periodic = 'x' low = -0.05, 0 size = 0.1, 0 /
&wall name = 'floor' outline = 'line' from = -0.08, -0.05 to = 0.08, -0.05 thickness = 0.01 {wall} /
&wall name = 'lid' outline = 'line' from = 0.08, 0.05 to = -0.08, 0.05 thickness = 0.01 /
"""
CELL = "&cell periodic = 'xy' low = -0.05, -0.05 size = 0.1, 0.1 /\n"
SHEARED = CELL.replace("/", "shear_rate = 60 shear_ramp = 5e-3 profile = .true. /")
CONTROLLED = CELL.replace("/", "stress_controlled = 'xy' stress = 2e4, 3e4 mass = 0.1 damping_ratio = 0.5 /")

#: Cells without walls
WITHOUT_WALLS = (CELL, SHEARED, CONTROLLED)

#: Grains in the lower and in the upper half
GRAINS = """\
&grains name = 'lower' region = 'box' low = -0.05, -0.05 high = 0.05, -0.006 number = 25 arrangement = 'spread'
   speed = 1 spin = 30 {lower} /
&grains name = 'upper' region = 'box' low = -0.05, 0.006 high = 0.05, 0.05 number = 25 arrangement = 'spread'
   speed = 1 spin = 30 {upper} /
"""


@dataclass(frozen=True)
class Capability:
    """Whole groups, and entries of groups that every scene has."""

    groups: str = ""
    container: str = ""
    forces: str = ""
    integrate: str = ""
    output: str = ""
    #: Entries of some walls and of the two groups of grains
    wall: str = ""
    lower: str = ""
    upper: str = ""
    #: Longest duration [s]
    duration: float = 0.02
    #: Whether it needs a floor and a lid
    needs_walls: bool = False


CAPABILITIES = {
    "channel": Capability(container=CHANNEL),
    "cell": Capability(container=CELL),
    "shear": Capability(container=SHEARED),
    "controlled": Capability(container=CONTROLLED),
    "materials": Capability(
        groups="&material name = 'hard' stiffness = 8e5 restitution = 0.9 friction_coefficient = 0.1 /\n"
               "&material name = 'soft' density = 900 restitution = 0.3 friction_coefficient = 0.8 /\n"
               "&contact_pair name = 'both' materials = 'hard', 'soft' friction_coefficient = 0.4 restitution = 0.6 /\n"
               "&scene material = 'hard' /\n",
        wall="material = 'soft'", upper="material = 'soft'"),
    "random_shapes": Capability(lower="shape = 'random' corners = 3, 9 diameter = 5e-3, 7e-3 elongation = 1.5"
                                      " sizes = 'log_normal' size_spread = 1.1",
                                # Thin grains have short steps: several thousand of them
                                duration=0.006),
    "blocks": Capability(groups="&grains name = 'blocks' region = 'box' low = 0.022, -0.005 high = 0.048, 0.005"
                                " arrangement = 'voronoi' number = 6 gap = 5e-4 lloyd_steps = 2 speed = 1 /\n"),
    "cohesion": Capability(forces="cohesion = 200"),
    "rolling": Capability(forces="rolling_friction = 0.3"),
    "drag": Capability(forces="drag = 4"),
    "local_damping": Capability(forces="local_damping = 0.2"),
    "shaken_gravity": Capability(forces="shake = 30, 20 shake_frequency = 90"),
    "hunt_crossley": Capability(forces="damping = 'hunt_crossley' damping_coefficient = 1"),
    "area_law": Capability(forces="law = 'area'"),
    "exact_friction": Capability(forces="friction = 'exact'"),
    "gear": Capability(integrate="scheme = 'gear' safety_factor = 0.6"),
    "compensated": Capability(integrate="accumulation = 'compensated'"),
    "load": Capability(
        groups="&load name = 'press' wall = 'lid' direction = 'y' stress = -2e3 width = 0.1 mass = 3 ramp = 2e-3 /\n",
        needs_walls=True),
    "gate": Capability(groups="&wall name = 'shelf' outline = 'rectangle' low = -0.02, -1e-3 high = 0.02, 1e-3"
                              " vanish_at = 7e-3 /\n", needs_walls=True),
    "belt": Capability(groups="&motion name = 'belt' wall = 'floor' kind = 'conveyor' velocity = 2, 0 ramp = 3e-3 /\n",
                       needs_walls=True),
    "shake": Capability(groups="&motion name = 'shake' wall = 'floor' kind = 'oscillation' amplitude = 0, 1e-3"
                               " frequency = 150 /\n", needs_walls=True),
    "stages": Capability(
        groups="&stage name = 'smooth' until = 'kinetic' below = 1e3 hold = 7e-3 longest = 1 check = 7"
               " friction_scale = 0 /\n"
               "&stage name = 'rough' duration = 0.011 gravity = 20, -20 /\n"),
    "pieces": Capability(upper="shape = 'cross' width = 0.009 arm = 0.003"),
    "sources_and_sinks": Capability(
        groups="&source name = 'feed' low = -0.045, 0.01 high = 0.045, 0.045 count = 50 interval = 20"
               " velocity = 0, -1 /\n"
               "&sink name = 'bin' low = -0.05, -0.05 high = 0.05, -0.035 interval = 20 /\n"),
    "series": Capability(groups="&sample area = 'rectangle' low = -0.04, -0.04 high = 0.03, 0.04 /\n",
                         output="series_interval = 2e-4 csv = .true."),
}

#: Pairs that the program refuses, and a part of its message
REFUSED = {
    ("exact_friction", "shear"): "does not know the velocity of the border",
    ("exact_friction", "controlled"): "does not know how the cell grows",
    ("sources_and_sinks", "controlled"): "do not move with the cell",
    ("exact_friction", "local_damping"): "whose forces depend on the motion without it",
    ("exact_friction", "gear"): "velocity_verlet",
    ("compensated", "gear"): "accumulation",
    ("hunt_crossley", "materials"): "'restitution' in &material hard is not used",
}

#: Choices of the table of entries that no capability has: what they do beside others is what another one does
LEFT_OUT = {
    "cell.periodic=y": "x", "cell.stress_controlled=x": "xy", "cell.stress_controlled=y": "xy",
    "motion.kind=rotation": "oscillation", "motion.kind=translation": "oscillation", "motion.kind=table": "oscillation",
    "load.direction=x": "y", "load.direction=angle": "y",
    "grains.shape=regular": "random", "grains.shape=rectangle": "random", "grains.shape=outline": "cross",
    "grains.sizes=octaves": "log_normal", "grains.sizes=grading": "log_normal",
    "forces.law=conservative": "polar", "forces.damping=matuttis_chen": "hunt_crossley", "forces.damping=none": "rate",
    "forces.friction=none": "cundall_strack", "forces.turn_rate": "shake",
    "forces.stiffness_over_pressure": "stiffness", "integrate.scheme=gear_3_20": "gear",
}
#: Groups that do not change what happens
WITHOUT_EFFECT = ("boxes", "neighbours", "overlap", "guards", "bench")


def choices(groups, rows):
    """What the table of entries lets a scene switch on: groups, words, and numbers of &forces that are 0 or absent."""
    yield from (group for group in groups if group not in WITHOUT_EFFECT)
    for row in rows:
        if row.type == "word" and (row.group in ("cell", "motion", "load", "forces", "integrate")
                                   or (row.group, row.key) in (("grains", "shape"), ("grains", "sizes"))):
            yield from (f"{row.group}.{row.key}={word}" for word in row.allowed.split() if word != row.default)
        elif row.group == "forces" and not row.default.strip("0, "):
            yield f"{row.group}.{row.key}"


def switched_on(name):
    """Groups, entries and words in the namelist of a capability."""
    for group, entries in re.findall(r"&(\w+)(.*?) /\n", text((name,)), re.DOTALL):
        yield group
        for key, value in re.findall(r"(\w+) = ('\w+'|\S+)", entries):
            yield from (f"{group}.{key}", f"{group}.{key}={value.strip(chr(39))}")


def pairs():
    """All pairs of names that make a scene: no two containers, no wall that a cell lacks."""
    for two in combinations(sorted(CAPABILITIES), 2):
        chosen = [CAPABILITIES[name] for name in two]
        without_walls = any(part.container in WITHOUT_WALLS for part in chosen)
        if all(part.container for part in chosen) or (without_walls and any(part.needs_walls for part in chosen)):
            continue
        yield two


def text(names):
    """The namelist of a scene that has these capabilities."""
    chosen = [CAPABILITIES[name] for name in names]

    def joined(entry):
        return " ".join(value for value in (getattr(part, entry) for part in chosen) if value)

    container = joined("container") or BOX
    gravity = "0, 0" if container in WITHOUT_WALLS else "0, -40"
    groups = "".join(part.groups for part in chosen)
    if container == CONTROLLED:
        # Such a cell has no gravity, in no stage
        groups = groups.replace(" gravity = 20, -20", "")
    duration = "" if "stages" in names else f"duration = {min(part.duration for part in chosen)}"
    return (container.format(wall=joined("wall")) + GRAINS.format(lower=joined("lower"), upper=joined("upper"))
            + groups
            + f"&forces gravity = {gravity} stiffness = 4e5 {joined('forces')} /\n"
            + f"&integrate {duration} {joined('integrate')} /\n"
            + f"&output frame_interval = 1e-3 frames_per_segment = 6 contacts = .true. {joined('output')} /\n"
            + "&decomposition margin = 1e-4 imbalance = 1 /\n&checkpoint steps = 60 /\n")
