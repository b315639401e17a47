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
    # A turning ring and a funnel of parts; three groups of grains, each placed around walls and earlier ones; drag.
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
&forces gravity = 0, -40 stiffness = 1e6 drag = 2 /
&integrate duration = 0.01 /
""",
    # Walls that yield to a stress, a force and a torque, a belt, a gate, and the record of all of them.
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
&load name = 'twist' wall = 'flap' direction = 'angle' torque = 20 mass = 2 /
&motion name = 'run' wall = 'belt' kind = 'conveyor' velocity = 1, 0 ramp = 3e-3 end = 9e-3 /
&motion name = 'shake' wall = 'right' kind = 'oscillation' amplitude = 0, 1e-3 frequency = 100 /
&forces gravity = 0, -40 stiffness = 1e6 /
&integrate duration = 0.012 /
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

#: Frames in the duration of a scene, without the first
N_FRAMES = 20


def write_scene(path, scene, finder="quadtree", longer=1):
    """Write the namelist of a scene, of so many times its duration, with as many frames in each."""
    head, tail = SCENES[scene].rsplit("duration = ", 1)
    duration, rest = tail.split(" ", 1)
    series = "series_interval = 1e-4 csv = .true. " if scene == "walls" else ""
    groups = OTHER_GROUPS.format(interval=float(duration) / N_FRAMES, finder=finder, series=series)
    path.write_text(f"{head}duration = {longer * float(duration)} {rest}{groups}", encoding="utf-8")
