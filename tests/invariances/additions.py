"""Capabilities of a drawn scene beside container and model: one method for each that needs more than its tag."""

import math

import numpy as np
from capabilities import WITHOUT_WALLS
from shapes import regular, unit


class Additions:
    """The methods; `Drawing` has the scene, its dice and sizes."""

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
            body.material = dice.choice((1, 2) if body is self.first else (0, 1, 2))
            if body.material:
                scene.acts.setdefault(body.id, set()).add("materials")

    def a_wall(self, shifts=False):
        """A wall that may get a motion or a load: the floor before others, and one that has another motion if need be.

        One that is stress-controlled along one axis may be shifted along the other.
        """
        taken = {group.get("wall") for group in self.scene.groups.values()}
        names = [name for name in self.floors if name not in taken]
        free = not self.scene.named("load") or (
            shifts and self.floors and "load_hinged" not in self.chosen and self.direction(self.floors[0]))
        again = taken and free and (not names or self.dice.random() < 0.5)
        return self.floors[0] if again and self.floors else names[0] if names else None

    def direction(self, wall):
        """Unit vectors along which a wall may move: not along its load, nor a periodic axis that it spans."""
        bodies = self.scene.groups[f"wall.{wall}"]["bodies"]
        loads = [group for name, group in self.scene.groups.items()
                 if name.startswith("load.") and group["wall"] == wall]
        axes = [axis for axis in (0, 1) if (axis not in self.scene.periodic or len(bodies) > 1)
                and all(load["direction"] != "xy"[axis] for load in loads)]
        return [np.eye(2)[axis] for axis in axes]

    def motion(self, tag, **entries):
        wall = self.a_wall(shifts="pivot" not in entries and "file" not in entries)
        if wall is None:
            self.drop(tag)
            return None
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
        # The velocity of a belt stays along its face.
        turns = self.container == "plane" and "motion_conveyor" not in self.chosen
        turn = self.uniform(-5, 5) if turns else 0.0
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
        if self.passes:
            along = np.eye(2)[self.scene.periodic[0]]
        axis = int(along[1] > 0.5)
        mass, far = self.uniform(0.2, 1), axis in self.scene.periodic
        # The speed F/c, to which it tends
        ratio, speed = self.uniform(0.02, 0.2), self.uniform(0.3, 2)
        damping = 2*ratio*math.sqrt(self.stiffness*mass)
        if self.passes:
            # From rest it passes the cell about twice.
            time, slow = self.scene.steps*self.scene.dt, mass/damping
            speed = self.uniform(2, 2.8)*self.size[axis]/(time - slow*(1 - math.exp(-time/slow)))
        sign = self.dice.choice((1, -1)) if far else (-1 if wall == "lid" else 1)
        force = sign*speed*damping
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
                       pivot=list(self.low + self.uniform(0, 1)*self.size), mass=mass,
                       damping_ratio=self.uniform(0, 0.1))
        self.act("load_hinged", wall)

    def add_gate(self):
        """A small wall that some grain touches, until it vanishes."""
        # Ahead of the first grain, between its neighbours and off the walls
        ahead = [1 if axis not in self.scene.periodic or self.border[axis] < self.low[axis] else -1 for axis in (0, 1)]
        angle = math.atan2(ahead[1], ahead[0]) + self.uniform(-0.2, 0.2)
        place = self.first.centre + (0.75*self.first.reach + 0.15*self.radius)*unit(angle)
        gate = self.new([regular(place, 0.3*self.radius, 5, self.uniform(0, 1))], fixed=True)
        self.name_wall("gate", [gate], "gate")
        # A checkpoint of a run in which it has vanished starts no other.
        first = 13 if "start_checkpoint" in self.chosen else 5
        self.scene.put("wall.gate", vanish_at=(self.dice.randint(first, 20)*10 + 0.5)*self.scene.dt)

    def add_stages(self):
        scene, first = self.scene, self.dice.randint(4, 8)*20
        scene.put("stage.first", duration=first*scene.dt)
        scene.put("stage.second", duration=(scene.steps - first)*scene.dt)
        if self.dice.random() < 0.5:
            scene.put("stage.first", friction_scale=self.uniform(0, 0.5))
        if self.container != "stress_controlled" and self.dice.random() < 0.5:
            gravity = np.array(scene.get("forces", "gravity"))
            scene.put("stage.second", gravity=list(0.5*gravity + 20*unit(self.uniform(0, 6.28))))
            scene.tags.add("stage_gravity")
        if self.dice.random() < 0.3:
            scene.put("stage.second", drag=self.uniform(5, 30))
            scene.tags.add("drag")
        for name in list(scene.groups):
            if name.startswith(("motion.", "load.", "source.", "sink.")) and self.dice.random() < 0.4:
                scene.put(name, stage=self.dice.choice(("first", "second")))
                scene.tags.add("stage_of_motion" if name[0] in "ml" else "stage_of_source_or_sink")

    def rectangle(self):
        """A rectangle smaller than the cell, often across its border."""
        scene, wide = self.scene, self.uniform(0.3, 0.8)*self.size
        low = self.border + self.size*np.array([self.uniform(0, 1), self.uniform(0, 1)]) - 0.5*wide
        for axis in scene.periodic:
            if self.dice.random() < 0.6:
                low[axis] = (self.border[axis] + self.dice.choice((0, 1))*self.size[axis]
                             - wide[axis]*self.uniform(0.2, 0.8))
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
        """A square enters beside the first grain, where there is room for one at a place without chance."""
        scene, half = self.scene, 0.4*self.radius
        place, velocity = self.low + np.array([1.5, 0.5])*self.pitch, np.array([-5.0, self.uniform(-1, 1)])
        if self.container not in WITHOUT_WALLS:
            place = self.low + 0.5*self.pitch - self.down*(0.5*self.pitch + self.radius)
            velocity = 3*self.down
        # The program wants room for its circle in the rectangle.
        wide, interval = math.sqrt(2)*half*(1 + 1e-12), 20
        for axis in scene.periodic:
            first, last = self.border[axis] + 1.001*wide, self.border[axis] + self.size[axis] - 1.001*wide
            place[axis] -= math.floor((place[axis] - self.border[axis])/self.size[axis])*self.size[axis]
            place[axis] = min(max(place[axis], first), last)
        # A run from a result has no density of its scene.
        outline = [-half, -half, half, -half, half, half, -half, half]
        scene.put("source.feed", low=list(place - wide), high=list(place + wide), shape="outline",
                  outline=outline, angle=[0.0, 0.0], velocity=list(velocity), interval=interval, density=self.density)
        if self.container == "sheared":
            # One enters at once: later, its place would differ where the same shear is seen from another height.
            scene.put("source.feed", count=len(scene.free) + 1)
        else:
            scene.put("source.feed", rate=self.uniform(1.01, 1.2)/(interval*scene.dt))

    def add_sink(self):
        scene = self.scene
        body = self.first if self.dice.random() < 0.8 else self.dice.choice(scene.free)
        wide, interval = self.uniform(1.0, 1.5)*self.radius, self.dice.choice((20, 40))
        ahead = self.uniform(0, 100)*scene.dt*body.velocity
        low = body.centre + ahead + 0.3*self.radius*np.array([self.uniform(-1, 1), self.uniform(-1, 1)]) - wide
        if scene.periodic and self.dice.random() < 0.6:
            # Across the border that is nearer
            axis = self.dice.choice(scene.periodic)
            sides = [self.border[axis], self.border[axis] + self.size[axis]]
            low[axis] = min(sides, key=lambda side: abs(side - body.centre[axis])) - wide*self.uniform(0.8, 1.2)
        # Else what is there leaves before the first step.
        self.late = self.dice.random() < 0.7
        scene.put("sink.bin", low=list(low), high=list(low + 2*wide), interval=interval)

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
