"""Small scenes that leave nothing out: every law, integrator and kind of wall, contacts from the start to the end."""

#: Namelists by name, without the groups that `write_scene` adds
SCENES = {
    # Grains fall in a drum that already turns, with segments that also shake; friction with memory. Grains on two
    # segments share the dashpot of the default restitution.
    "drum": """\
&scene name = 'drum' bodies = 300 speed = 1.0 /
&motion name = 'turn' kind = 'rotation' rate = 2.0 /
&motion name = 'shake' kind = 'oscillation' amplitude = 2e-4, 1e-3 frequency = 100 bodies = 316, 317, 318 /
&forces gravity = 0, -80 stiffness = 2e5 midstep_slip = .false. /
&integrate duration = 0.03 /
""",
    # Grains that fly about between two walls that shake and two that turn; most change their region several times.
    "gas": """\
&scene name = 'gas' bodies = 120 solid_fraction = 0.35 speed = 1.0 spin = 50 /
&motion name = 'shake' kind = 'oscillation' bodies = 121, 124 amplitude = 1e-3, 2e-3 frequency = 100 /
&motion name = 'turn' kind = 'rotation' bodies = 122, 123 rate = 2.0 ramp = 5e-3 /
&forces
   gravity = 0, 0 stiffness = 2e5
   law = 'conservative' damping = 'hunt_crossley' damping_coefficient = 1
/
&integrate safety_factor = 0.1 duration = 0.012 /
""",
    # Long oblique walls, and an integrator that remembers and moves bodies twice a step.
    "hopper": """\
&scene name = 'hopper' bodies = 150 opening = 0.04 slope = 60 speed = 1.0 /
&forces gravity = 0, -80 stiffness = 1e5 damping_from_touch = .false. midstep_slip = .true. /
&integrate scheme = 'gear' duration = 0.012 /
""",
    # Grains of sizes 1 to 10, of which the large ones reach over several regions; sums with their remainders.
    "bed": """\
&scene name = 'bed' bodies = 200 size_ratio = 10 speed = 2.0 /
&forces gravity = 0, -80 stiffness = 2e5 damping_from_touch = .true. damping_coefficient = 0.2 midstep_slip = .false. /
&integrate accumulation = 'compensated' safety_factor = 0.2 duration = 0.02 /
""",
    # A turning ring and a funnel of parts; three groups of grains, each placed around walls and earlier ones; drag; a
    # stiffness that follows from the pressure of the grains of all ranks.
    "parts": """\
&wall name = 'drum' outline = 'ring' radius = 0.1 segments = 30 thickness = 0.01 /
&wall name = 'funnel' outline = 'polyline' vertices = -0.06, 0.02, -0.01, -0.03 thickness = 0.004 /
&wall name = 'side' outline = 'line' from = 0.02, -0.03 to = 0.06, 0.02 thickness = 0.004 /
&grains name = 'rods' region = 'inside' wall = 'drum' number = 60 speed = 1
   shape = 'rectangle' width = 4e-3 height = 8e-3 /
&grains name = 'stones' region = 'inside' wall = 'drum' number = 60 order = 'descending' speed = 1 /
&grains name = 'fines' region = 'box' low = -0.06, 0.03 high = 0.06, 0.07 number = 60 arrangement = 'random'
   shape = 'regular' corners = 5, 8 diameter = 3e-3, 5e-3 momentum = 'zero' speed = 1 spin = 30 /
&motion name = 'turn' kind = 'rotation' rate = 2.0 wall = 'drum' /
&forces gravity = 0, -40 stiffness_over_pressure = 50 drag = 2 /
&integrate duration = 0.01 /
""",
    # Crosses of three pieces and pebbles of one in a ring that turns; both laws of history: friction and dashpots.
    "pieces": """\
&wall name = 'drum' outline = 'ring' radius = 0.1 segments = 30 thickness = 0.01 /
&grains name = 'crosses' region = 'inside' wall = 'drum' number = 70 arrangement = 'random' speed = 1 spin = 20
   shape = 'cross' width = 0.014 arm = 0.004 angle = 0, 360 /
&grains name = 'pebbles' region = 'inside' wall = 'drum' number = 30 speed = 1 /
&motion name = 'turn' kind = 'rotation' rate = 2.0 wall = 'drum' /
&forces gravity = 0, -40 stiffness = 1e6 damping_from_touch = .false. /
&integrate duration = 0.02 /
""",
    # Grains of two materials, of which one is softer and lighter, between walls of a third one, and a pair of its own.
    "materials": """\
&scene wall_material = 'steel' /
&material name = 'glass' stiffness = 4e5 restitution = 0.9 friction_coefficient = 0.1 rolling_friction = 0.1 /
&material name = 'rubber' density = 900 stiffness = 1e5 restitution = 0.3 friction_coefficient = 0.9 cohesion = 300
   rolling_friction = 0.3 /
&material name = 'steel' stiffness = 1e6 tangential_stiffness = 0.8 /
&contact_pair name = 'dust' materials = 'steel', 'rubber' friction_coefficient = 0.05 restitution = 0.7 cohesion = 100 /
&wall name = 'drum' outline = 'ring' radius = 0.1 segments = 30 thickness = 0.01 /
&wall name = 'shelf' outline = 'line' from = -0.04, -0.02 to = 0.04, -0.02 thickness = 0.004 material = 'glass' /
&grains name = 'heavy' region = 'inside' wall = 'drum' number = 80 speed = 1 material = 'glass' /
&grains name = 'light' region = 'inside' wall = 'drum' number = 80 speed = 1 material = 'rubber' /
&motion name = 'turn' kind = 'rotation' rate = 2.0 wall = 'drum' /
&forces gravity = 0, -40 /
&integrate duration = 0.02 /
""",
    # Grains that fly around a cell that is periodic along both axes, over its edges and corners.
    "cell": """\
&cell periodic = 'xy' low = -0.05, -0.03 size = 0.1, 0.1 /
&grains name = 'sample' region = 'box' low = -0.05, -0.03 high = 0.05, 0.07 number = 70 arrangement = 'spread'
   speed = 1 spin = 50 momentum = 'zero' /
&forces gravity = 0, 0 stiffness = 2e5 /
&integrate safety_factor = 0.1 duration = 0.03 /
""",
    # The same, sheared: the cell's copies above and below slide past it several times.
    "shear": """\
&cell periodic = 'xy' low = -0.05, -0.03 size = 0.1, 0.1 shear_rate = 100 shear_ramp = 0.01 profile = .true. /
&grains name = 'sample' region = 'box' low = -0.05, -0.03 high = 0.05, 0.07 number = 70 arrangement = 'spread'
   speed = 1 spin = 50 momentum = 'zero' /
&forces gravity = 0, 0 stiffness = 1e6 /
&integrate safety_factor = 0.1 duration = 0.02 /
""",
    # A cell whose height is stress-controlled across the shear: it shrinks to less than a half.
    "controlled": """\
&cell periodic = 'xy' low = -0.05, -0.03 size = 0.1, 0.1 shear_rate = 60 profile = .true.
   stress_controlled = 'y' stress = 0, 2e4 mass = 0.02 damping_ratio = 0.5 /
&grains name = 'sample' region = 'box' low = -0.05, -0.03 high = 0.05, 0.07 number = 70 arrangement = 'spread'
   speed = 1 spin = 50 momentum = 'zero' /
&forces gravity = 0, 0 stiffness = 1e6 /
&integrate safety_factor = 0.1 duration = 0.02 /
""",
    # What happens at the border of a sheared cell: bodies start beyond it, enter, leave and are counted across it, and
    # feel forces that depend on their velocity.
    "border": """\
&cell periodic = 'xy' low = -0.05, -0.03 size = 0.1, 0.1 shear_rate = 60 profile = .true. /
&grains name = 'sample' region = 'box' low = -0.02, 0.01 high = 0.08, 0.11 number = 70 arrangement = 'spread'
   speed = 1 spin = 50 momentum = 'zero' /
&source name = 'feed' low = -0.08, 0.04 high = -0.02, 0.1 count = 90 interval = 30 velocity = 0.5, -1 size_ratio = 2 /
&sink name = 'hole' low = 0.03, 0.05 high = 0.07, 0.09 interval = 40 /
&sample area = 'rectangle' low = 0, 0.03 high = 0.09, 0.09 /
&forces gravity = 0, 0 stiffness = 1e6 drag = 5 local_damping = 0.1 /
&integrate safety_factor = 0.1 duration = 0.01 /
""",
    # A load carries a rough base over the border several times.
    "carried": """\
&cell periodic = 'x' low = 0.1, 0 size = 0.1, 0 /
&wall name = 'base' outline = 'row' from = 0, 0 to = 0.1, 0 segments = 9 radius = 4e-3 corners = 7 /
&wall name = 'floor' outline = 'line' from = 0, -5e-3 to = 0.3, -5e-3 thickness = 0.01 /
&grains name = 'grains' region = 'box' low = 0, 6e-3 high = 0.1, 0.06 number = 30 speed = 1 /
&load name = 'pull' wall = 'base' direction = 'x' force = 4e3 mass = 2 damping_ratio = 0.02 /
&forces gravity = 40, -60 stiffness = 2e6 /
&integrate duration = 0.015 /
""",
    # A chute: grains slide over a rough base that moves itself, and a shaking floor that spans the cell.
    "chute": """\
&cell periodic = 'x' low = 0.1, 0 size = 0.2, 0 /
&wall name = 'base' outline = 'row' from = 0, 0 to = 0.2, 0 segments = 12 radius = 4e-3 corners = 7 /
&wall name = 'floor' outline = 'line' from = 0, -5e-3 to = 0.4, -5e-3 thickness = 0.01 /
&grains name = 'grains' region = 'box' low = 0, 6e-3 high = 0.2, 0.06 number = 80 speed = 1 /
&motion name = 'belt' kind = 'translation' velocity = 2, 0 wall = 'base' /
&motion name = 'shake' kind = 'oscillation' amplitude = 0, 1e-3 frequency = 100 wall = 'floor' /
&forces gravity = 40, -60 stiffness = 2e6 /
&integrate accumulation = 'compensated' duration = 0.02 /
""",
    # Stages that conditions end, with changes of gravity, friction and drag; a lid moves in one of them.
    "stages": """\
&wall name = 'floor' outline = 'rectangle' low = -0.1, -0.02 high = 0.1, 0 /
&wall name = 'left' outline = 'rectangle' low = -0.07, 0 high = -0.05, 0.3 /
&wall name = 'right' outline = 'rectangle' low = 0.05, 0 high = 0.07, 0.3 /
&wall name = 'lid' outline = 'rectangle' low = -0.049, 0.1 high = 0.049, 0.11 /
&grains name = 'sand' region = 'box' low = -0.05, 0 high = 0.05, 0.1 number = 75 arrangement = 'spread' speed = 0.5 /
&forces stiffness = 2e5 friction_coefficient = 0.5 /
&motion name = 'down' wall = 'lid' kind = 'translation' velocity = 0, -2 ramp = 2e-3 stage = 'press' /
&stage name = 'fall' until = 'kinetic' above = 4e-2 hold = 5e-4 longest = 1 check = 5 gravity = 0, -90
   friction_scale = 0 /
&stage name = 'press' until = 'strain' wall = 'lid' opposite = 'floor' above = 0.05 longest = 1 check = 7 drag = 3 /
&stage name = 'rest' until = 'unbalanced' below = 4 longest = 1 gravity = 20, -20 /
&stage name = 'float' gravity = 0, 0 duration = 0.004 /
""",
    # Walls under a stress, a force and a torque, a belt, a gate, and the record of all of them.
    "walls": """\
&wall name = 'left' outline = 'rectangle' low = -0.12, -0.1 high = -0.1, 0.1 /
&wall name = 'right' outline = 'rectangle' low = 0.1, -0.1 high = 0.12, 0.1 /
&wall name = 'belt' outline = 'line' from = -0.12, -0.1 to = 0.12, -0.1 thickness = 0.02 /
&wall name = 'lid' outline = 'line' from = 0.12, 0.1 to = -0.12, 0.1 thickness = 0.02 /
&wall name = 'flap' outline = 'polyline' vertices = -0.03, 0.03, 0, 0, 0.03, 0.03 thickness = 0.004 /
&wall name = 'gate' outline = 'rectangle' low = -0.1, -0.05 high = -0.02, -0.045 vanish_at = 6e-3 /
&grains name = 'stones' region = 'box' low = -0.1, -0.1 high = 0.1, 0.1 number = 120 speed = 2 spin = 30 /
&load name = 'squeeze' wall = 'right' direction = 'x' stress = -2e4 between = 'belt', 'lid' mass = 5 /
&load name = 'press' wall = 'lid' direction = 'y' force = -3e3 mass = 3 damping_ratio = 0.1 start = 2e-3 end = 1e-2
   ramp = 1e-3 /
&load name = 'twist' wall = 'flap' direction = 'angle' torque = 20 mass = 2 weight = .true. /
&motion name = 'run' wall = 'belt' kind = 'conveyor' velocity = 1, 0 ramp = 3e-3 end = 9e-3 /
&motion name = 'shake' wall = 'right' kind = 'oscillation' amplitude = 0, 1e-3 frequency = 100 /
&forces gravity = 0, -40 stiffness = 1e6 /
&integrate duration = 0.012 /
""",
    # A scene that starts empty: bodies of two materials, some of several pieces, enter in two ways, and leave from the
    # air and out of the heap.
    "flow": """\
&wall name = 'floor' outline = 'rectangle' low = -0.1, -0.02 high = 0.1, 0 /
&wall name = 'left' outline = 'line' from = -0.05, 0.3 to = -0.04, 0 thickness = 0.01 /
&wall name = 'right' outline = 'line' from = 0.04, 0 to = 0.05, 0.3 thickness = 0.01 /
&material name = 'heavy' density = 3000 /
&source name = 'feed' low = -0.04, 0.08 high = 0.04, 0.16 count = 70 velocity = 0.1, -1 interval = 30 size_ratio = 2 /
&source name = 'rain' low = -0.04, 0.18 high = 0.04, 0.22 rate = 3000 interval = 70 material = 'heavy' velocity = 0, -2
   shape = 'cross' width = 8e-3 arm = 3e-3 angle = 0, 360 /
&sink name = 'hole' low = -0.02, -1 high = 0.02, 0.02 interval = 150 /
&sink name = 'draught' low = -0.05, 0.06 high = 0, 0.07 interval = 60 /
&forces gravity = 0, -80 stiffness = 1e6 drag = 2 /
&stage name = 'calm' until = 'departed' sink = 'draught' above = 4 longest = 1 check = 7 /
&stage name = 'storm' gravity = 30, -80 duration = 0.01 /
""",
    # At rest: nothing goes over a border unless the border moves.
    "stack": """\
&scene name = 'stack' bodies = 9 width = 0.01 height = 0.01 /
&forces stiffness = 1e5 midstep_slip = .true. tilt_damping = 0.5 /
&integrate duration = 0.03 /
""",
}

#: Frames with everything in them, some to a segment; regions that change as often as possible
OTHER_GROUPS = """\
&output {series}frame_interval = {interval} frames_per_segment = 7 contacts = .true. /
&decomposition margin = 1e-4 imbalance = 1 /
&neighbours finder = '{finder}' /
"""

#: Scenes with a series
RECORDED = ("walls", "border", "carried")
#: Frames in the duration of a scene, without the first
N_FRAMES = 20


def write_scene(path, scene, finder="quadtree", longer=1):
    """Write the namelist of a scene, of so many times its duration, with as many frames in each."""
    head, tail = SCENES[scene].rsplit("duration = ", 1)
    duration, rest = tail.split(" ", 1)
    series = "series_interval = 1e-4 csv = .true. " if scene in RECORDED else ""
    groups = OTHER_GROUPS.format(interval=float(duration) / N_FRAMES, finder=finder, series=series)
    path.write_text(f"{head}duration = {longer * float(duration)} {rest}{groups}", encoding="utf-8")
