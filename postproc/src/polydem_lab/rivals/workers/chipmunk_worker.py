"""Worker for Chipmunk by its Python package pymunk."""

import math

import pymunk
from worker import area_and_inertia, serve


def build(scene, dt, knobs):
    """The space of a scene."""
    space = pymunk.Space()
    space.gravity = tuple(scene["gravity"])
    space.iterations = knobs["iterations"]
    space.collision_slop = knobs["slop"]
    bodies = [_add(space, body, scene) for body in scene["bodies"]]

    def step(count):
        for _ in range(count):
            space.step(dt)

    def states():
        return [(*body.position, body.angle, *body.velocity, body.angular_velocity) for body in bodies]

    return step, states


def _add(space, body, scene):
    area, inertia = area_and_inertia(body["vertices"])
    if body["fixed"]:
        added = pymunk.Body(body_type=pymunk.Body.STATIC)
    else:
        added = pymunk.Body(area * scene["density"], inertia * scene["density"])
    added.position, added.angle = (body["x"], body["y"]), body["angle"]
    if not body["fixed"]:
        added.velocity, added.angular_velocity = (body["vx"], body["vy"]), body["spin"]
    shape = pymunk.Poly(added, [tuple(corner) for corner in body["vertices"]])
    # The coefficients of two shapes are multiplied.
    shape.friction, shape.elasticity = math.sqrt(scene["friction"]), math.sqrt(scene["restitution"])
    space.add(added, shape)
    return added


if __name__ == "__main__":
    serve(build)
