"""Seeded scenes over all capabilities: a few bodies that touch early, and some hundred steps.

`design.py` chooses a container, a model of contacts and further capabilities. `tags` names all that a scene uses; what
acts on single bodies only stands in `acts`. One grain, the first, is where all of them are likely to meet: in the
corner of the walls or at the border of the cell, beside the gate, in the sink, below the source.
"""

import math
import random

import numpy as np
from additions import Additions
from capabilities import CONTAINERS, DRIVEN, EXTRAS, IMPACTS, KINDS, LONG, STARTS, WITHOUT_WALLS
from design import chosen_of
from impacts import draw_impact
from shapes import angle_iron, box, corners, cross, cut_square, random_convex, regular, turned

from scene import Body, Scene


def draw(seed, impossible):
    """The scene of a seed; `impossible` has the pairs of capabilities that no scene has."""
    dice = random.Random(seed)
    if seed % IMPACTS == IMPACTS - 1:
        return draw_impact(dice)
    return Drawing(dice, chosen_of(seed, impossible)).scene


class Drawing(Additions):
    """A scene that is being drawn."""

    def __init__(self, dice, chosen):
        self.dice = dice
        self.container = next(name for name in CONTAINERS if name in chosen)
        self.chosen = {name for name in chosen if name in EXTRAS}
        self.model = [name for name in chosen if name not in (*CONTAINERS, *EXTRAS)]
        self.radius = dice.uniform(4e-3, 7e-3)
        self.stiffness = dice.uniform(1e5, 5e5)
        self.density = dice.uniform(1000, 3000)
        mass = self.density*2*self.radius**2
        #: Whether a load passes its cell more than once: a longer run
        self.passes = "load" in chosen and self.container.startswith("periodic") and dice.random() < 0.5
        dt = (0.025 if self.passes else 0.018)*math.sqrt(mass/self.stiffness)
        self.scene = Scene(dt, steps=dice.randint(12, 20)*20*(2 if self.passes else 1), every=20)
        self.scene.tags = {self.container, *self.chosen}
        self.next_id = 1
        #: Whether bodies leave in the second stage only
        self.late = False
        self.floors = []
        self.draw_container()
        self.draw_grains()
        self.draw_forces()
        for name in sorted(self.chosen, key=lambda name: (name not in DRIVEN, name in ("stages", "until"), name)):
            getattr(self, f"add_{name}", lambda: None)()
        self.finish()

    def uniform(self, low, high):
        return self.dice.uniform(low, high)

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

    def draw_container(self):
        """All grains start in a grid from `low` to `low` + `size`, and fall `down`."""
        dice, axis = self.dice, "xy".find(self.container[-1]) if self.container[:-1] == "periodic_" else -1
        cells = [dice.randint(2, 3), dice.randint(1, 2)]
        if self.container in WITHOUT_WALLS:
            # One place is left free for a source.
            cells = [3 if "source" in self.chosen else dice.randint(2, 3), dice.randint(2, 3)]
        elif len(DRIVEN & self.chosen) > 1 or "source" in self.chosen:
            # The first grain is below the source, and between two walls.
            cells[1] = 1
        if axis == 1:
            cells = cells[::-1]
        self.pitch, self.grid = 2.0*self.radius*self.uniform(0.93, 1.05), cells
        self.low = np.array([self.uniform(-0.05, 0.05), self.uniform(-0.05, 0.05)])
        self.size = np.array(cells)*self.pitch
        self.border = self.low.copy()
        self.down = np.array([-1.0, 0.0]) if axis == 1 else np.array([0.0, -1.0])
        if self.container == "plane":
            self.new_floor("floor", 0)
            self.new_floor("left", 1)
            return
        for k in (0, 1) if axis < 0 else (axis,):
            # A stress-controlled cell shrinks.
            self.size[k] = max(self.size[k], (5.6 if self.container == "stress_controlled" else 4.8)*self.radius)
        if self.container == "periodic_xy" and DRIVEN & self.chosen:
            self.size[1] += 1.2*self.radius
            self.new_row("floor", 0)
        self.draw_cell(axis)
        if axis < 0 and self.floors:
            # Above the row, there is room for what enters.
            self.low[1] += 0.5*self.radius
        if axis >= 0:
            self.draw_channel(axis)
        elif self.container != "periodic_xy":
            getattr(self, f"draw_{self.container}")()

    def draw_cell(self, axis):
        """Its border often lies between the first two grains of an axis."""
        for k in (0, 1) if axis < 0 else (axis,):
            if self.grid[k] == 2 or self.dice.random() < 0.7:
                self.border[k] -= self.size[k] - self.pitch
        periodic = "xy" if axis < 0 else "xy"[axis]
        self.scene.put("cell", periodic=periodic, low=list(self.border), size=list(self.size))

    def draw_channel(self, axis):
        """A cell that repeats along one axis, between one or two walls."""
        # The faces of a row have seams, across which a belt would run.
        rows = {"load", "motion_constant", "motion_table", "motion_oscillation"} & self.chosen
        if self.passes or (rows and "motion_conveyor" not in self.chosen and self.dice.random() < 0.7):
            self.new_row("floor", axis)
        else:
            self.new_floor("floor", axis)
        if self.dice.random() < 0.4 or len(DRIVEN & self.chosen) > 1:
            self.new_floor("lid", axis, above=True)

    def draw_sheared(self):
        scene = self.scene
        speed = self.uniform(0.5, 3)*self.dice.choice((1, -1))
        scene.put("cell", shear_rate=speed/self.size[1])
        if self.dice.random() < 0.6:
            scene.put("cell", profile=True)
        # A start from a result would let the border stop at once.
        if self.dice.random() < 0.3 and not STARTS & self.chosen:
            scene.put("cell", shear_ramp=100*scene.dt)
            scene.tags.add("shear_ramp")

    def draw_stress_controlled(self):
        scene, controlled = self.scene, self.dice.choice(("x", "y", "xy"))
        if self.dice.random() < 0.3:
            controlled = "y"
            scene.put("cell", shear_rate=self.uniform(0.5, 3)/self.size[1])
            scene.tags.add("sheared")
        scene.put("cell", stress_controlled=controlled,
                  stress=[self.uniform(5e2, 5e3)*(axis in controlled) for axis in "xy"],
                  mass=self.uniform(0.3, 2), damping_ratio=self.uniform(0.1, 0.5))
        if self.dice.random() < 0.3:
            scene.put("cell", stress_ramp=80*scene.dt)
            scene.tags.add("stress_ramp")

    def new_floor(self, name, axis, above=False):
        """A long wall along an axis below (or above) the grains."""
        across = 1 - axis
        low, high = np.empty(2), np.empty(2)
        low[axis], high[axis] = self.border[axis] - 3*self.radius, self.border[axis] + LONG
        thick = self.uniform(1.5, 4)*self.radius
        face = self.low[across]
        if above:
            face += self.size[across] + 2.0*self.radius*("source" in self.chosen)
        low[across], high[across] = (face, face + thick) if above else (face - thick, face)
        body = self.new([box(low, high)], fixed=True)
        tags = ("long_wall",) if self.scene.groups.get("cell") else ()
        self.name_wall(name, [body], *tags)
        self.floors.append(name)

    def new_row(self, name, axis):
        """Glued grains along a periodic axis, or a flat belt of boxes if it runs or passes the cell."""
        across = 1 - axis
        n, self.top = max(4, round(self.size[axis]/(0.8*self.radius))), self.low[across] + 0.4*self.radius
        bodies = []
        for k in range(n):
            place = np.empty(2)
            place[axis] = self.low[axis] + (k + 0.5)*self.size[axis]/n
            place[across] = self.low[across]
            half = np.full(2, 0.51*self.size[axis]/n)
            half[across] = 0.4*self.radius
            flat = self.passes or "motion_conveyor" in self.chosen
            outline = box(place - half, place + half) if flat else regular(
                place, 0.62*self.size[axis]/n, 6, self.uniform(0, 1))
            bodies.append(self.new([outline], fixed=True))
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
                if (i, j) == (0, 0):
                    self.first = body
                self.approach(body, (i, j))
                if len(pieces) > 1:
                    self.scene.acts.setdefault(body.id, set()).add("pieces")
                body.move(self.off_walls(body))
        if "lid" in self.floors and 1 in self.grid and "source" not in self.chosen:
            # It touches the tallest grain.
            lid, across = self.scene.body(self.scene.groups["wall.lid"]["bodies"][0]), 1 - self.scene.periodic[0]
            top = max(corners(body)[:, across].max() for body in self.scene.free)
            lid.move((top - 0.02*self.radius - corners(lid)[:, across].min())*np.eye(2)[across])

    def approach(self, body, place):
        """Let the first grain move to the walls and to its neighbours across the border, and those to it."""
        for axis in (0, 1):
            periodic, moved = axis in self.scene.periodic, self.border[axis] < self.low[axis]
            ahead, speed = (1 if moved else -1), abs(body.velocity[axis]) + 0.5
            neighbour = np.eye(2, dtype=int)[axis]*(1 if moved else self.grid[axis] - 1)
            if place == (0, 0):
                body.velocity[axis] = ahead*speed
            elif periodic and place == tuple(neighbour):
                body.velocity[axis] = -ahead*speed

    def off_walls(self, body):
        """By how much a grain is moved, so that no part is below a floor; the first and a single row touch floors."""
        walled = {"plane": (0, 1), "periodic_x": (1,), "periodic_y": (0,)}.get(
            self.container, (1,) if self.floors else ())
        by = np.zeros(2)
        for axis in walled:
            floor = self.top if "rows" in self.scene.tags else self.low[axis]
            by[axis] = floor - 0.02*self.radius - corners(body)[:, axis].min()
            touches = body is self.first or (self.grid[axis] == 1 and self.container != "plane")
            by[axis] = by[axis] if touches else max(by[axis], 0)
        return by

    def shape(self, place, tilt):
        dice, radius = self.dice, self.radius
        if "pieces" in self.chosen and (not self.scene.free or dice.random() < 0.5):
            angle = tilt + self.uniform(0, 3)
            return [turned(piece, angle, place) for piece in dice.choice((cross, angle_iron, cut_square))(radius)]
        return [random_convex(dice, place, radius*self.uniform(0.85, 1.0))]

    def draw_forces(self):
        dice, scene = self.dice, self.scene
        scheme, friction, damping, law = (next(name for name in self.model if name in kind).split("_", 1)[1]
                                          for kind in KINDS)
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

    def finish(self):
        scene = self.scene
        if self.late:
            if not scene.named("stage"):
                scene.tags.add("stages")
                self.add_stages()
            scene.put("sink.bin", stage="second")
            scene.tags.add("stage_of_source_or_sink")
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
