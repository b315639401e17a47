"""Impacts: a body falls centrally and flat, and is compared by its restitution, or by what it rests on."""

import math

import numpy as np
from capabilities import LAWS
from shapes import box, table

from scene import Body, Scene


def draw_impact(dice):
    """A body or a table on feet falls centrally on a floor or a free body, in flight or to rest under gravity."""
    width, height = dice.uniform(0.01, 0.02), dice.uniform(0.01, 0.02)
    stiffness, speed, law = dice.uniform(1e5, 1e6), dice.uniform(0.05, 0.3), dice.choice(LAWS)
    density, restitution = dice.uniform(1000, 3000), dice.uniform(0.2, 0.8)
    on_body, feet, rests = dice.random() < 0.35, dice.choice((0, 0, 0, 2, 3)), dice.random() < 0.3
    scene = Scene(dt=0.01*math.sqrt(density*width*height/stiffness), steps=4000, every=20, kind="impact")
    gravity = 0.0
    if rests and not on_body:
        # A bar on a floor may rock for ever with the area law.
        scene.kind, scene.steps, law, restitution = "rest", 8000, dice.choice(LAWS[:2]), dice.uniform(0.2, 0.4)
        gravity = -speed/(300*scene.dt)
    scene.tags = {"impact", f"law_{law}", "damping_restitution", "friction_none"}
    place = np.array([dice.uniform(-0.1, 0.1), dice.uniform(-0.1, 0.1)])
    top = place + np.array([width, height])
    pieces = table(feet, place, top) if feet else [box(place, top)]
    if feet:
        scene.tags.add("pieces")
    middle, gap = place[0] + 0.5*width, 19.4*speed*scene.dt
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
