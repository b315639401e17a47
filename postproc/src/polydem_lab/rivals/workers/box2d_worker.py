"""Worker for Box2D v3 by its Python package pyb2d3."""

import numpy as np
import pyb2d3
from worker import Turns, serve


def build(scene, dt, knobs):
    """The world of a scene."""
    world = pyb2d3.World(gravity=tuple(scene["gravity"]), restitution_threshold=0.0)
    world.sleeping_enabled = False
    if "frequency" in knobs:  # contact springs: frequency [1/s], damping ratio, greatest speed of separation [m/s]
        world.set_contact_tuning(knobs["frequency"], 10.0, 3.0)
    bodies = [_add(world, body, scene) for body in scene["bodies"]]
    turns = Turns([body["angle"] for body in scene["bodies"]])

    def step(count):
        for _ in range(count):
            world.step(dt, knobs["substeps"])

    def states():
        angles = turns.follow([body.angle for body in bodies])
        return [(*body.position, angle, *body.linear_velocity, body.angular_velocity)
                for body, angle in zip(bodies, angles)]

    return step, states


def _add(world, body, scene):
    place = {"position": (body["x"], body["y"]), "rotation": pyb2d3.make_rot(body["angle"])}
    if body["fixed"]:
        added = world.create_static_body(**place)
    else:
        added = world.create_dynamic_body(linear_velocity=(body["vx"], body["vy"]), angular_velocity=body["spin"],
                                          **place)
    surface = pyb2d3.surface_material(friction=scene["friction"], restitution=scene["restitution"])
    added.create_polygon_shape(pyb2d3.shape_def(density=scene["density"], material=surface),
                               pyb2d3.polygon(points=np.array(body["vertices"], dtype=np.float32)))
    return added


if __name__ == "__main__":
    serve(build)
