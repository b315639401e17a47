"""Runs in parts: the end of one is the start of the next."""

import numpy as np
from case import Case
from runs import Play


def split_checkpoint(scene, dice):
    return split(scene, dice, "checkpoint")


def split_frame(scene, dice):
    return split(scene, dice, "frame")


def split(scene, dice, how):
    """The run ends at a step, and another one goes on from its result."""
    if scene.start or "until" in scene.tags:
        return None
    step = scene.every*dice.randint(3, scene.steps//scene.every - 3)
    periods = [scene.get(name, "interval") for name in scene.groups if name.startswith(("source.", "sink."))]
    if any(step % period for period in periods):
        fitting = [k for k in range(scene.every, scene.steps, scene.every) if not any(k % p for p in periods)]
        if not fitting:
            return None
        step = dice.choice(fitting)
    first, second = scene.copy(), scene.copy()
    shorten(first, 0, step)
    shorten(second, step, scene.steps)
    if has_idle_wall(first):
        return None
    forget(second, step)
    # Motions, the turn of gravity and the shift of copies are functions of another time.
    moved = bool({"turning", "sheared"} & scene.tags or scene.named("motion"))
    return Case([Play(first), Play(second, how)], before=step, exact=how == "checkpoint" and not moved,
                loose=0.03 if how == "frame" else 0.0, energies=False)


def shorten(scene, begin, end):
    """Keep the steps from `begin` to `end` of the stages, or of the duration."""
    scene.steps = end - begin
    names = scene.named("stage")
    if not names:
        scene.put("integrate", duration=(end - begin)*scene.dt)
        return
    at = 0
    for name in names:
        stage = scene.groups[f"stage.{name}"]
        steps = round(stage["duration"]/scene.dt)
        here = min(at + steps, end) - max(at, begin)
        at += steps
        if here > 0:
            stage["duration"] = here*scene.dt
            continue
        del scene.groups[f"stage.{name}"]
        for other in [other for other, group in scene.groups.items() if group.get("stage") == name]:
            del scene.groups[other]


def has_idle_wall(scene):
    """Whether a wall has a name that nothing uses any more: the program refuses it."""
    used = set()
    for group in scene.groups.values():
        used |= {group.get("wall"), group.get("opposite"), *group.get("sides", ()), *group.get("ends", ())}
    return any(name not in used and "vanish_at" not in scene.groups[f"wall.{name}"] for name in scene.named("wall"))


def forget(scene, step):
    """What has happened at a step is not said again; gravity has turned so far."""
    time = step*scene.dt
    for name in scene.named("wall"):
        wall = scene.groups[f"wall.{name}"]
        if "vanish_at" not in wall:
            continue
        wall["vanish_at"] -= time
        if wall["vanish_at"] <= 0:
            del scene.groups[f"wall.{name}"]
    angle = 2*np.pi*scene.get("forces", "turn_rate", 0.0)*time
    if angle:
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        for group in scene.groups.values():
            if "gravity" in group:
                group["gravity"] = list(turn @ np.array(group["gravity"]))


def split_continue(scene, dice):
    """The run ends early, and goes on by --continue."""
    if scene.start:
        return None
    first = scene.copy()
    names = scene.named("stage")
    if any("stage" in group for group in scene.groups.values()):
        return None
    if names:
        for name in names[1:]:
            del first.groups[f"stage.{name}"]
    else:
        shorten(first, 0, scene.every*dice.randint(3, scene.steps//scene.every - 3))
    return Case([Play(first), Play(scene.copy(), "continue")], exact=True)


def stage_boundary(scene, dice):
    """A stage becomes two that are alike."""
    other = scene.copy()
    names = scene.named("stage")
    used = {group.get("stage") for group in scene.groups.values()}
    free = [name for name in names if name not in used and "duration" in scene.groups[f"stage.{name}"]]
    if names and not free:
        return None
    chosen = dice.choice(free) if names else None
    stage = scene.groups[f"stage.{chosen}"] if names else {"duration": scene.steps*scene.dt}
    steps = round(stage["duration"]/scene.dt)
    first = dice.randint(1, steps - 1)
    halves = {"stage.half": {**stage, "duration": first*scene.dt},
              "stage.other_half": {**stage, "duration": (steps - first)*scene.dt}}
    groups = {}
    for name, group in other.groups.items():
        if name == f"stage.{chosen}":
            groups.update(halves)
        else:
            groups[name] = group
    if not names:
        groups.update(halves)
        groups["integrate"].pop("duration")
    other.groups = groups
    return Case([Play(other)], exact=True)
