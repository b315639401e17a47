"""Seeded scenes over all capabilities: a few bodies that touch early, and some hundred steps.

Each draw takes a container, a model of contacts and one to four further capabilities. `tags` names all that a scene uses;
what acts on single bodies only stands in `acts`.
"""

import math
import random

import numpy as np
from scene import Body, Scene

#: Length of walls that span a cell, also one of three copies of the largest one
LONG = 0.5
CONTAINERS = ("plane", "periodic_x", "periodic_y", "periodic_xy", "sheared", "stress_controlled")
WITHOUT_WALLS = {"periodic_xy", "sheared", "stress_controlled"}
LAWS = ("conservative", "area")
DAMPINGS = ("restitution", "rate", "hunt_crossley", "matuttis_chen", "none")
FRICTIONS = ("cundall_strack", "cundall_strack", "exact", "none")
SCHEMES = ("velocity_verlet", "velocity_verlet", "compensated", "gear", "gear_3_20")
#: What a scene may have beside container and model of contacts
EXTRAS = ("materials", "pieces", "motion_constant", "motion_table", "motion_oscillation", "motion_rotation",
          "motion_conveyor", "load", "load_hinged", "gate", "stages", "source", "sink", "cohesion", "rolling", "drag",
          "local_damping", "shaken", "turning", "start_checkpoint", "start_frame", "until", "sample")
DRIVEN = {"motion_constant", "motion_table", "motion_oscillation", "motion_rotation", "motion_conveyor", "load",
          "load_hinged"}
STARTS = {"start_checkpoint", "start_frame"}
#: Of what one scene has one or two
ALTERNATIVES = [(STARTS, 1), (DRIVEN, 2)]
#: All capabilities, of which each pair that is possible acts on touching bodies
CAPABILITIES = (*CONTAINERS, *EXTRAS, "walls", *(f"law_{name}" for name in LAWS),
                *(f"damping_{name}" for name in DAMPINGS), *(f"friction_{name}" for name in dict.fromkeys(FRICTIONS)),
                *(f"scheme_{name}" for name in dict.fromkeys(SCHEMES)))
#: Of these a scene has one each
EXCLUSIVE = (set(CONTAINERS), STARTS, *({name for name in CAPABILITIES if name.startswith(kind)}
                                        for kind in ("law_", "damping_", "friction_", "scheme_")))
#: Every so many seeds, the scene is an impact that is compared by its restitution
IMPACTS = 8


def draw(seed, impossible):
    """The scene of a seed; `impossible` has the pairs of capabilities that no scene has."""
    dice = random.Random(seed)
    if seed % IMPACTS == IMPACTS - 1:
        return draw_impact(dice)
    return Drawing(dice, impossible).scene


def alternatives(pair):
    """Whether two capabilities are alternatives of one choice."""
    return any(set(pair) <= group for group in EXCLUSIVE)


class Drawing:
    """A scene that is being drawn."""

    def __init__(self, dice, impossible):
        self.dice = dice
        self.impossible = impossible
        self.choose()
        self.radius = dice.uniform(4e-3, 7e-3)
        self.stiffness = dice.uniform(1e5, 5e5)
        self.density = dice.uniform(1000, 3000)
        mass = self.density*2*self.radius**2
        dt = 0.02*math.sqrt(mass/self.stiffness)
        self.scene = Scene(dt, steps=dice.randint(12, 20)*20, every=20)
        self.scene.tags = {self.container, *self.chosen}
        self.next_id = 1
        self.floors = []
        self.draw_container()
        self.draw_grains()
        self.draw_forces()
        for name in sorted(self.chosen, key=lambda name: (name not in DRIVEN, name in ("stages", "until"), name)):
            getattr(self, f"add_{name}", lambda: None)()
        self.finish()

    def uniform(self, low, high):
        return self.dice.uniform(low, high)

    def goes(self, name, others):
        """Whether a capability goes with others."""
        return not any(frozenset((name, other)) in self.impossible for other in others) and all(
            name not in group or len(group & set(others)) < most for group, most in ALTERNATIVES)

    def choose(self):
        """A pair of capabilities, all pairs alike; what goes with both; a container and a model that do."""
        dice, every = self.dice, [*CONTAINERS, *EXTRAS]
        while True:
            chosen = dice.sample(every, 2)
            if chosen[0] in CONTAINERS and chosen[1] in CONTAINERS or not self.goes(chosen[1], chosen[:1]):
                continue
            containers = [name for name in CONTAINERS if name in chosen] or [
                name for name in CONTAINERS if all(self.goes(other, [name]) for other in chosen)]
            if containers:
                break
        self.container = dice.choice(containers)
        extras = [name for name in chosen if name not in CONTAINERS]
        for name in dice.sample(EXTRAS, dice.randint(1, 4)):
            if name not in extras and self.goes(name, [*extras, self.container]):
                extras.append(name)
        self.chosen = set(extras)
        self.model = []
        for kind, names in (("scheme", SCHEMES), ("friction", FRICTIONS), ("damping", DAMPINGS), ("law", LAWS)):
            possible = [name for name in names
                        if self.goes(f"{kind}_{name}", [self.container, *extras, *self.model])]
            self.model.append(f"{kind}_{dice.choice(possible)}")

    def new(self, pieces, fixed=False, **how):
        body = Body(self.next_id, [np.asarray(piece, dtype=float) for piece in pieces], fixed, **how)
        self.next_id += 1
        self.scene.bodies.append(body)
        return body

    def name_wall(self, name, bodies, *tags):
        self.scene.put(f"wall.{name}", outline="bodies", bodies=[body.id for body in bodies])
        for body in bodies:
            self.scene.acts.setdefault(body.id, set()).update({"walls", *tags})
        self.scene.tags |= {"walls", *tags}

    def act(self, name, wall):
        for identifier in self.scene.groups[f"wall.{wall}"]["bodies"]:
            self.scene.acts.setdefault(identifier, set()).add(name)

    # The container: all grains start in a box from `low` to `high`, and touch `floor` first
    def draw_container(self):
        cells = [self.dice.randint(2, 4), self.dice.randint(1, 3)]
        if "source" in self.chosen:
            # One place is left free.
            cells[0] = max(cells[0], 3)
        pitch = 2.0*self.radius*self.uniform(0.93, 1.05)
        self.pitch, self.grid = pitch, cells
        self.low = np.array([self.uniform(-0.05, 0.05), self.uniform(-0.05, 0.05)])
        size = np.array(cells)*pitch
        if self.container in WITHOUT_WALLS:
            size = np.maximum(size, 4.8*self.radius)
        self.size = size
        self.down = np.array([0.0, -1.0])
        scene = self.scene
        if self.container == "plane":
            self.new_floor("floor", 0)
            self.new_floor("left", 1)
        elif self.container in ("periodic_x", "periodic_y"):
            axis = "xy".index(self.container[-1])
            self.size[axis] = max(self.size[axis], 4.8*self.radius)
            if axis == 1:
                self.down = np.array([-1.0, 0.0])
            scene.put("cell", periodic="xy"[axis], low=list(self.low), size=list(self.size))
            rows = bool({"load", "motion_constant", "motion_table", "motion_oscillation"} & self.chosen) and (
                self.dice.random() < 0.7)
            if rows:
                self.new_row("floor", axis)
            else:
                self.new_floor("floor", axis)
            if self.dice.random() < 0.4 or len(DRIVEN & self.chosen) > 1:
                self.new_floor("lid", axis, above=True)
        else:
            if self.container == "periodic_xy" and DRIVEN & self.chosen:
                self.size[1] += 1.2*self.radius
                self.new_row("floor", 0)
            scene.put("cell", periodic="xy", low=list(self.low), size=list(self.size))
            if self.container == "sheared":
                speed = self.uniform(0.5, 3)*self.dice.choice((1, -1))
                scene.put("cell", shear_rate=speed/self.size[1])
                if self.dice.random() < 0.6:
                    scene.put("cell", profile=True)
                # A start from a result would let the border stop at once.
                if self.dice.random() < 0.3 and not {"start_checkpoint", "start_frame"} & self.chosen:
                    scene.put("cell", shear_ramp=100*scene.dt)
                    scene.tags.add("shear_ramp")
            if self.container == "stress_controlled":
                scene.put("cell", obeys=self.dice.choice(("x", "y", "xy")), stress=[0.0, 0.0], mass=self.uniform(0.3, 2), damping_ratio=self.uniform(0.1, 0.5))
                if self.dice.random() < 0.3:
                    scene.put("cell", obeys="y", shear_rate=self.uniform(0.5, 3)/self.size[1])
                    scene.tags.add("sheared")
                scene.put("cell", stress=[self.uniform(1e3, 1e4)*(axis in scene.get("cell", "obeys")) for axis in "xy"])
                if self.dice.random() < 0.3:
                    scene.put("cell", stress_ramp=80*scene.dt)
                    scene.tags.add("stress_ramp")

    def new_floor(self, name, axis, above=False):
        """A long wall along an axis below (or above) the grains."""
        across = 1 - axis
        low, high = np.empty(2), np.empty(2)
        low[axis], high[axis] = self.low[axis] - 3*self.radius, self.low[axis] + LONG
        thick = self.uniform(1.5, 4)*self.radius
        face = self.low[across]
        if above:
            face += self.size[across] + 2.6*self.radius*("source" in self.chosen)
        low[across], high[across] = (face, face + thick) if above else (face - thick, face)
        body = self.new([box(low, high)], fixed=True)
        tags = ("long_wall",) if self.scene.groups.get("cell") else ()
        self.name_wall(name, [body], *tags)
        self.floors.append(name)

    def new_row(self, name, axis):
        """Glued grains along a periodic axis."""
        across = 1 - axis
        n = max(4, round(self.size[axis]/(0.8*self.radius)))
        bodies = []
        for k in range(n):
            place = np.empty(2)
            place[axis] = self.low[axis] + (k + 0.5)*self.size[axis]/n
            place[across] = self.low[across]
            bodies.append(self.new([regular(place, 0.62*self.size[axis]/n, 6, self.uniform(0, 1))], fixed=True))
        self.name_wall(name, bodies, "rows")
        self.floors.append(name)

    def draw_grains(self):
        tilt = self.uniform(0, 1)
        for i in range(self.grid[0]):
            for j in range(self.grid[1]):
                if "source" in self.chosen and self.container in WITHOUT_WALLS and (i, j) == (1, 0):
                    continue
                place = self.low + (np.array([i, j]) + 0.5)*self.pitch + self.radius*np.array(
                    [self.uniform(-0.05, 0.05), self.uniform(-0.05, 0.05)])
                pieces = self.shape(place, tilt)
                body = self.new(pieces, velocity=np.array([self.uniform(-1.5, 1.5), self.uniform(-1.5, 1.5)]),
                                spin=self.uniform(-60, 60))
                if len(pieces) > 1:
                    self.scene.acts.setdefault(body.id, set()).add("pieces")
                # No part below the floors
                if self.container == "plane":
                    body.move(np.maximum(0, self.low - corners(body).min(axis=0) - 0.02*self.radius))
                elif self.floors:
                    across = 0 if self.container == "periodic_y" else 1
                    by = np.zeros(2)
                    floor = self.low[across] + ("rows" in self.scene.tags)*0.4*self.radius
                    by[across] = max(0, floor - corners(body).min(axis=0)[across] - 0.02*self.radius)
                    body.move(by)

    def shape(self, place, tilt):
        dice, radius = self.dice, self.radius
        if "pieces" in self.chosen and dice.random() < 0.7:
            angle = tilt + self.uniform(0, 3)
            return [turned(piece, angle, place) for piece in dice.choice((cross, angle_iron, cut_square))(radius)]
        return [random_convex(dice, place, radius*self.uniform(0.85, 1.0))]

    def draw_forces(self):
        dice, scene = self.dice, self.scene
        scheme, friction, damping, law = (name.split("_", 1)[1] for name in self.model)
        entries = {"law": law, "stiffness": self.stiffness, "friction": friction}
        if damping == "restitution":
            entries.update(damping="rate", restitution=self.uniform(0.1, 0.9))
        elif damping == "none":
            entries.update(damping="none")
        else:
            entries.update(damping=damping, damping_coefficient=self.uniform(0.02, 0.2)
                           if damping != "hunt_crossley" else self.uniform(1, 10))
        if damping != "none" and dice.random() < 0.3:
            entries["tilt_damping"] = self.uniform(0, 1)
        if friction != "none":
            entries["friction_coefficient"] = self.uniform(0.1, 0.8)
        strong = self.uniform(50, 400)
        lean = self.uniform(-0.4, 0.4)
        direction = np.array([[math.cos(lean), -math.sin(lean)], [math.sin(lean), math.cos(lean)]]) @ self.down
        gravity = strong*direction if self.container not in WITHOUT_WALLS else np.zeros(2)
        if self.container in ("periodic_xy", "sheared") and dice.random() < 0.2:
            gravity = np.array([self.uniform(-50, 50), self.uniform(-50, 50)])
        if "turning" in self.chosen and not any(gravity):
            gravity = 20*self.down
        entries["gravity"] = list(gravity)
        scene.put("forces", **entries)
        scene.put("scene", density=self.density)
        scene.put("integrate", dt=scene.dt, scheme="velocity_verlet" if scheme == "compensated" else scheme)
        if scheme == "compensated":
            scene.put("integrate", accumulation="compensated")
        scene.tags |= set(self.model)

    # One method for each capability that needs more than its tag
    def add_materials(self):
        scene, dice = self.scene, self.dice
        scene.put("material.hard", stiffness=self.stiffness*1.5, friction_coefficient=self.uniform(0.1, 0.5),
                  density=self.density)
        scene.put("material.soft", stiffness=self.stiffness*0.5, friction_coefficient=self.uniform(0.3, 0.9),
                  density=self.density*0.8)
        if scene.get("forces", "restitution"):
            scene.put("material.hard", restitution=self.uniform(0.5, 0.9))
            scene.put("material.soft", restitution=self.uniform(0.1, 0.5))
        if scene.get("forces", "friction") == "none":
            for name in ("hard", "soft"):
                del scene.groups[f"material.{name}"]["friction_coefficient"]
        scene.put("contact_pair.both", materials=["hard", "soft"], stiffness=self.stiffness*self.uniform(0.5, 1.5))
        for body in scene.bodies:
            body.material = dice.choice((0, 1, 2))
            if body.material:
                scene.acts.setdefault(body.id, set()).add("materials")

    def a_wall(self, *without):
        """A wall that may get a motion or a load, the floor before others."""
        taken = {group.get("wall") for group in self.scene.groups.values()}
        names = [name for name in self.floors if name not in taken and name not in without]
        return names[0] if names else None

    def direction(self, wall):
        """Unit vectors along which a wall may move: not along a periodic axis, if it spans the cell."""
        bodies = self.scene.groups[f"wall.{wall}"]["bodies"]
        axes = [axis for axis in (0, 1) if axis not in self.scene.periodic or len(bodies) > 1]
        return [np.eye(2)[axis] for axis in axes]

    def motion(self, tag, **entries):
        wall = self.a_wall()
        if wall is None:
            self.drop(tag)
            return
        choices = self.direction(wall)
        along = sum((self.uniform(-1, 1)*choice for choice in choices), np.zeros(2))
        made = {key: list(value*along) if key in ("velocity", "amplitude") else value for key, value in entries.items()}
        self.scene.put(f"motion.{tag}", wall=wall, **made)
        self.act(tag, wall)
        return along

    def drop(self, tag):
        self.scene.tags.discard(tag)
        self.chosen.discard(tag)

    def add_motion_constant(self):
        ramp = {"ramp": 60*self.scene.dt} if self.dice.random() < 0.3 else {}
        if ramp:
            self.scene.tags.add("motion_ramp")
        self.motion("motion_constant", kind="translation", velocity=self.uniform(0.5, 3), **ramp)

    def add_motion_oscillation(self):
        period = self.scene.dt*self.uniform(100, 300)
        self.motion("motion_oscillation", kind="oscillation", amplitude=self.uniform(0.05, 0.2)*self.radius,
                    frequency=1/period)

    def add_motion_rotation(self):
        self.motion("motion_rotation", kind="rotation", rate=self.uniform(-5, 5),
                    pivot=list(self.low + self.uniform(0, 1)*self.size))

    def add_motion_conveyor(self):
        wall = self.a_wall()
        if wall is None:
            self.drop("motion_conveyor")
            return
        across = 1 if wall in ("floor", "lid") and self.container != "periodic_y" else 0
        velocity = [0.0, 0.0]
        velocity[1 - across] = self.uniform(-3, 3)
        self.scene.put("motion.motion_conveyor", wall=wall, kind="conveyor", velocity=velocity)
        self.act("motion_conveyor", wall)

    def add_motion_table(self):
        along = self.motion("motion_table", kind="table", file="table.csv")
        if along is None:
            return
        end = self.scene.dt*self.scene.steps
        turn = self.uniform(-5, 5) if self.container == "plane" else 0.0
        rows = [[0, 0, 0, 0], [0.4*end, *(0.3*self.radius*along), turn], [0.8*end, *(-0.2*self.radius*along), 0],
                [1.5*end, 0, 0, 0.3*turn]]
        self.scene.put("motion.motion_table", pivot=list(self.low))
        self.scene.tables["table.csv"] = np.array(rows, dtype=float)

    def add_load(self):
        wall = self.a_wall()
        if wall is None:
            self.drop("load")
            return
        along = self.dice.choice(self.direction(wall))
        axis = int(along[1] > 0.5)
        stiffness = self.stiffness if "materials" not in self.chosen else self.stiffness
        mass, far = self.uniform(0.05, 0.5), axis in self.scene.periodic
        # At the speed F/c it passes the cell more than once, or some grains
        steps = self.scene.steps*self.scene.dt
        speed = self.uniform(1.2, 3)*self.size[axis]/steps if far else self.uniform(0.3, 2)
        ratio = self.uniform(0.02, 0.2)
        sign = self.dice.choice((1, -1)) if far else (-1 if wall == "lid" else 1)
        force = sign*speed*2*ratio*math.sqrt(stiffness*mass)
        entries = {"wall": wall, "direction": "xy"[axis], "mass": mass, "damping_ratio": ratio}
        if self.dice.random() < 0.3:
            entries.update(stress=force/0.1, width=0.1)
        else:
            entries.update(force=force)
        self.scene.put("load.load", **entries)
        self.act("load", wall)

    def add_load_hinged(self):
        wall = self.a_wall()
        if wall is None:
            self.drop("load_hinged")
            return
        mass = self.uniform(0.5, 2)
        self.scene.put("load.load_hinged", wall=wall, direction="angle", torque=self.uniform(-1, 1)*20*mass,
                       pivot=list(self.low + self.uniform(0, 1)*self.size), mass=mass, damping_ratio=self.uniform(0, 0.1))
        self.act("load_hinged", wall)

    def add_gate(self):
        """A small wall that some grain touches, until it vanishes."""
        body = self.dice.choice(self.scene.free)
        place = body.centre + (0.8*body.reach + 0.15*self.radius)*unit(self.uniform(0, 6.28))
        gate = self.new([regular(place, 0.3*self.radius, 5, self.uniform(0, 1))], fixed=True)
        self.name_wall("gate", [gate], "gate")
        self.scene.put("wall.gate", vanish_at=(self.dice.randint(5, 20)*10 + 0.5)*self.scene.dt)

    def add_stages(self):
        scene, first = self.scene, self.dice.randint(4, 8)*20
        scene.put("stage.first", duration=first*scene.dt)
        scene.put("stage.second", duration=(scene.steps - first)*scene.dt)
        if self.dice.random() < 0.5:
            scene.put("stage.first", friction_scale=self.uniform(0, 0.5))
        if self.container != "stress_controlled" and self.dice.random() < 0.5:
            gravity = np.array(scene.get("forces", "gravity"))
            scene.put("stage.second", gravity=list(0.5*gravity + 20*unit(self.uniform(0, 6.28))))
        if self.dice.random() < 0.3:
            scene.put("stage.second", drag=self.uniform(5, 30))
            scene.tags.add("drag")
        for name in list(scene.groups):
            if name.startswith(("motion.", "load.", "source.", "sink.")) and self.dice.random() < 0.4:
                scene.put(name, stage=self.dice.choice(("first", "second")))
                scene.tags.add("stage_of_motion" if name[0] in "ml" else "stage_of_traffic")

    def rectangle(self):
        """A rectangle smaller than the cell, often across its border."""
        scene, wide = self.scene, self.uniform(0.3, 0.8)*self.size
        low = self.low + self.size*np.array([self.uniform(0, 1), self.uniform(0, 1)]) - 0.5*wide
        for axis in scene.periodic:
            if self.dice.random() < 0.6:
                low[axis] = self.low[axis] + self.dice.choice((0, 1))*self.size[axis] - wide[axis]*self.uniform(0.2, 0.8)
        return {"low": list(low), "high": list(low + wide)}

    def add_until(self):
        """The first stage ends when a condition holds."""
        scene, dice = self.scene, self.dice
        if not scene.named("stage"):
            scene.tags.add("stages")
            self.add_stages()
        steps = scene.groups["stage.first"].pop("duration")
        kinds = ["kinetic", "unbalanced"] + ["count", "solid_fraction"]*(self.container != "stress_controlled") + [
            "departed"]*("sink" in self.chosen)
        until = dice.choice(kinds)
        stage = {"until": until, "longest": 2*steps, "at_limit": "next", "check": 20}
        side = dice.choice(("below", "above")) if until != "departed" else "above"
        if until in ("count", "solid_fraction"):
            stage.update(self.rectangle())
            limits = {"count": dice.randint(1, 3) + 0.5, "solid_fraction": self.uniform(0.1, 0.7)}
        else:
            mass = self.density*2*self.radius**2
            limits = {"kinetic": mass*self.uniform(0.3, 3), "unbalanced": self.uniform(0.3, 3), "departed": 0.5}
        stage[side] = limits[until]
        scene.put("stage.first", **stage)
        scene.tags.add(f"until_{until}")

    def add_sample(self):
        self.scene.put("sample", area="rectangle", **self.rectangle())

    def add_source(self):
        """A square enters where there is room for one at a place that leaves nothing to chance."""
        scene, half = self.scene, 0.5*self.radius
        place = self.low + np.array([1.5, 0.5])*self.pitch
        if self.container not in WITHOUT_WALLS:
            away = -self.down
            place = self.low + 0.5*self.size + away*(0.5*self.size[int(abs(away[1]) > 0.5)] + 1.2*self.radius)
            if scene.periodic:
                place[scene.periodic[0]] = self.low[scene.periodic[0]] + self.uniform(0, 1)*self.size[scene.periodic[0]]
        # The program wants room for its circle in the rectangle.
        wide, interval = math.sqrt(2)*half*(1 + 1e-12), self.dice.choice((20, 40))
        for axis in scene.periodic:
            place[axis] = min(max(place[axis], self.low[axis] + 1.001*wide), self.low[axis] + self.size[axis] - 1.001*wide)
        outline = [-half, -half, half, -half, half, half, -half, half]
        velocity = 2*self.down if self.container not in WITHOUT_WALLS else unit(self.uniform(0, 6.28))
        scene.put("source.feed", low=list(place - wide), high=list(place + wide), shape="outline",
                  outline=outline, angle=[0.0, 0.0], velocity=list(velocity), interval=interval,
                  rate=self.uniform(0.2, 0.9)/(interval*scene.dt))

    def add_sink(self):
        scene = self.scene
        body = self.dice.choice(scene.free)
        wide = self.uniform(0.6, 1.2)*self.radius
        ahead = self.uniform(0, 0.7)*scene.steps*scene.dt*body.velocity
        low = body.centre + ahead + self.radius*np.array([self.uniform(-1, 1), self.uniform(-1, 1)]) - wide
        if scene.periodic and self.dice.random() < 0.6:
            axis = self.dice.choice(scene.periodic)
            low[axis] = self.low[axis] + self.dice.choice((0, 1))*self.size[axis] - wide*self.uniform(0.5, 1.5)
        scene.put("sink.bin", low=list(low), high=list(low + 2*wide), interval=self.dice.choice((20, 40, 60)))

    def add_cohesion(self):
        self.scene.put("forces", cohesion=self.uniform(0.002, 0.02)*self.stiffness)

    def add_rolling(self):
        self.scene.put("forces", rolling_friction=self.uniform(0.05, 0.5))

    def add_drag(self):
        self.scene.put("forces", drag=self.uniform(5, 60))

    def add_local_damping(self):
        self.scene.put("forces", local_damping=self.uniform(0.1, 0.6))

    def add_shaken(self):
        self.scene.put("forces", shake=list(self.uniform(50, 300)*unit(self.uniform(0, 6.28))),
                       shake_frequency=1/(self.scene.dt*self.uniform(80, 300)))

    def add_turning(self):
        self.scene.put("forces", turn_rate=self.uniform(-1, 1)*0.5/(self.scene.dt*self.scene.steps))

    def finish(self):
        scene = self.scene
        if {"start_checkpoint", "start_frame"} & self.chosen:
            scene.start = "checkpoint" if "start_checkpoint" in self.chosen else "frame"
            scene.prelude = self.dice.randint(3, 6)*20
        used = {group.get("wall") for group in scene.groups.values()}
        for name in scene.named("wall"):
            if name not in used and "vanish_at" not in scene.groups[f"wall.{name}"]:
                del scene.groups[f"wall.{name}"]
        scene.size = max(2*body.reach for body in scene.free)
        if not scene.named("stage"):
            scene.put("integrate", duration=scene.steps*scene.dt)
        scene.put("output", contacts=True, frame_interval=scene.every*scene.dt, frames_per_segment=1000,
                  series_interval=scene.dt)
        scene.put("checkpoint", wall_interval=0)


def draw_impact(dice):
    """A body or a table on feet falls centrally on a floor or a free body, in flight or to rest under gravity."""
    width, height = dice.uniform(0.01, 0.02), dice.uniform(0.01, 0.02)
    stiffness, speed, law = dice.uniform(1e5, 1e6), dice.uniform(0.05, 0.3), dice.choice(LAWS)
    density, restitution = dice.uniform(1000, 3000), dice.uniform(0.2, 0.8)
    on_body, feet, rests = dice.random() < 0.35, dice.choice((0, 0, 0, 2, 3)), dice.random() < 0.3
    scene = Scene(dt=0.01*math.sqrt(density*width*height/stiffness), steps=4000, every=20, kind="impact")
    gravity = 0.0
    if rests and not on_body:
        # A bar on a floor may rock for ever with the other law.
        scene.kind, scene.steps, law, restitution = "rest", 8000, "conservative", dice.uniform(0.2, 0.4)
        gravity = -speed/(300*scene.dt)
    scene.tags = {"impact", f"law_{law}", "damping_restitution", "friction_none"}
    place = np.array([dice.uniform(-0.1, 0.1), dice.uniform(-0.1, 0.1)])
    top = place + np.array([width, height])
    pieces = table(feet, place, top) if feet else [box(place, top)]
    if feet:
        scene.tags.add("pieces")
    middle, gap = place[0] + 0.5*width, 20*speed*scene.dt
    half, deep = (width*dice.uniform(0.5, 1.0), height) if on_body else (0.2, 0.05)
    below = Body(2, [box(np.array([middle - half, place[1] - gap - deep]), np.array([middle + half, place[1] - gap]))],
                 fixed=not on_body)
    scene.tags.add("body_on_body" if on_body else "walls")
    scene.bodies = [Body(1, pieces, velocity=np.array([0.0, -speed])), below]
    scene.size = math.hypot(width, height)
    scene.put("forces", law=law, stiffness=stiffness, damping="rate", restitution=restitution, friction="none",
              gravity=[0.0, gravity])
    scene.put("scene", density=density)
    scene.put("integrate", dt=scene.dt, duration=scene.steps*scene.dt)
    scene.put("output", contacts=True, frame_interval=scene.every*scene.dt, frames_per_segment=1000)
    scene.put("checkpoint", wall_interval=0)
    return scene


# Shapes
def unit(angle):
    return np.array([math.cos(angle), math.sin(angle)])


def box(low, high):
    return np.array([low, [high[0], low[1]], high, [low[0], high[1]]])


def corners(body):
    return np.concatenate(body.pieces)


def turned(piece, angle, place):
    c, s = math.cos(angle), math.sin(angle)
    return piece @ np.array([[c, s], [-s, c]]) + place


def regular(place, radius, n, phase):
    angles = phase + 2*math.pi*np.arange(n)/n
    return place + radius*np.stack([np.cos(angles), np.sin(angles)], axis=1)


def random_convex(dice, place, radius):
    """Corners on a circle, at uneven angles."""
    n = dice.randint(3, 7)
    gaps = np.array([dice.uniform(1, 2.5) for _ in range(n)])
    angles = dice.uniform(0, 6.28) + np.cumsum(gaps)*2*math.pi/gaps.sum()
    return place + radius*np.stack([np.cos(angles), np.sin(angles)], axis=1)


def cross(radius):
    long, arm = 0.95*radius, 0.35*radius
    return [box(np.array([-long, -arm]), np.array([long, arm])), box(np.array([-arm, arm]), np.array([arm, long])),
            box(np.array([-arm, -long]), np.array([arm, -arm]))]


def angle_iron(radius):
    long, arm = 0.65*radius, 0.1*radius
    return [box(np.array([-long, -long]), np.array([long, -arm])), box(np.array([-long, -arm]), np.array([-arm, long]))]


def cut_square(radius):
    half = 0.68*radius
    return [box(np.array([-half, -half]), np.array([0.2*half, half])), box(np.array([0.2*half, -half]), np.array([half, half]))]


def table(feet, low, high):
    """A slab on feet."""
    width, leg = (high[0] - low[0])/(2*feet - 1), low[1] + 0.4*(high[1] - low[1])
    lefts = [low[0] + 2*k*width for k in range(feet)]
    return [box(np.array([left, low[1]]), np.array([left + width, leg])) for left in lefts] + [
        box(np.array([low[0], leg]), high)]
