"""Other cells: a border elsewhere, and cells of several copies."""

import numpy as np
from case import Case
from runs import Play

#: What has a rectangle that stays where it is
RECTANGLES = {"source", "sink", "sample", "until_count", "until_solid_fraction"}


def border(scene, dice):
    """The border of the cell lies elsewhere. A sheared cell is at rest in its middle, which moves, too."""
    if not scene.periodic:
        return None
    other = scene.copy()
    by = np.zeros(2)
    size = np.array(scene.get("cell", "size"))
    for axis in scene.periodic:
        by[axis] = dice.uniform(0, 1)*size[axis]
        while crosses_source(scene, axis, by[axis]):
            by[axis] = dice.uniform(0, 1)*size[axis]
    low = np.array(scene.get("cell", "low")) + by
    other.put("cell", low=list(low))
    rate = scene.get("cell", "shear_rate", 0.0)
    drift = np.array([-rate*by[1], 0.0])
    profile = scene.get("cell", "profile", False)
    if rate and RECTANGLES & scene.tags and not enters_at_once(scene):
        # Rectangles would move relative to the bodies; a body that enters at once does not see it.
        by[1], drift, low[1] = 0.0, np.zeros(2), scene.get("cell", "low")[1]
        other.put("cell", low=list(low))
    if rate and "shear_ramp" in scene.tags:
        drift = np.zeros(2)
    inside = dice.random() < 0.5
    for body in other.bodies:
        if not profile and not body.fixed:
            body.velocity = body.velocity + drift
        if inside and not (body.fixed and body.reach > 0.4*size[scene.periodic[0]]):
            jump = 0.0 if profile or "shear_ramp" in scene.tags else rate*size[1]
            put_into_cell(body, low, size, scene.periodic, jump)
    for name in scene.named("source"):
        ends = [np.array(scene.get(f"source.{name}", key)) for key in ("low", "high")]
        for axis in scene.periodic:
            cells = -np.floor((ends[0][axis] - low[axis])/size[axis])*size[axis]
            ends[0][axis] += cells
            ends[1][axis] += cells
        other.put(f"source.{name}", low=list(ends[0]), high=list(ends[1]))
    return Case([Play(other)], drift=drift, relative=is_relative(scene),
                energies="sheared" not in scene.tags)


def enters_at_once(scene):
    """Whether the only rectangle is that of a source, whose body enters before the first step."""
    late = scene.start or any("stage" in scene.groups[f"source.{name}"] for name in scene.named("source"))
    return not late and RECTANGLES & scene.tags == {"source"}


def is_relative(scene):
    """Whether the middle of the cell is no frame at constant velocity: its height or its shear changes."""
    return bool({"stress_controlled", "shear_ramp"} & scene.tags)


def crosses_source(scene, axis, by):
    """Whether a border elsewhere crosses the rectangle of a source, which must be within the cell."""
    low, size = scene.get("cell", "low")[axis] + by, scene.get("cell", "size")[axis]
    ends = [[scene.get(f"source.{name}", key)[axis] for key in ("low", "high")] for name in scene.named("source")]
    return any((first - low) % size + (last - first) > size*(1 - 1e-9) for first, last in ends)


def put_into_cell(body, low, size, axes, jump):
    """Put a body into the cell, with the velocity of the border."""
    for axis in axes:
        cells = -np.floor((body.centre[axis] - low[axis])/size[axis])
        by = np.zeros(2)
        by[axis] = cells*size[axis]
        body.move(by)
        if axis == 1:
            body.velocity = body.velocity + np.array([cells*jump, 0.0])


def copies_2x2(scene, dice):
    return copies(scene, (2, 2))


def copies_3x1(scene, dice):
    return copies(scene, (1, 3) if scene.periodic == [1] else (3, 1))


def copies(scene, numbers):
    """A cell of several copies; along axes that are not periodic there is one."""
    numbers = [n if axis in scene.periodic else 1 for axis, n in enumerate(numbers)]
    rate = scene.get("cell", "shear_rate", 0.0)
    sheared = rate != 0.0 and numbers[1] > 1
    if not scene.periodic or not has_copies(scene, sheared):
        return None
    other = scene.copy()
    size = np.array(scene.get("cell", "size"))
    other.put("cell", size=list(size*numbers))
    if not scale_cell(other, numbers):
        return None
    jump = 0.0 if "shear_ramp" in scene.tags else rate*size[1]
    drift = np.array([-0.5*(numbers[1] - 1)*jump, 0.0])
    offsets = [np.array([i, j]) for j in range(numbers[1]) for i in range(numbers[0])]
    ids = copy_bodies(scene, other, offsets, jump, drift)
    copy_groups(scene, other, [offset*size for offset in offsets], ids)
    return Case([Play(other)], ids=ids, drift=drift, copies=len(offsets), relative=is_relative(scene),
                energies=not sheared)


def has_copies(scene, sheared):
    """Whether copies of a scene are another scene that can be stated."""
    if any("count" in scene.groups[f"source.{name}"] for name in scene.named("source")):
        return False
    if not sheared:
        return True
    return not RECTANGLES & scene.tags


def copy_bodies(scene, other, offsets, jump, drift):
    """Copy all bodies, but those that span the cell; give the identifiers of the copies of each."""
    size, first = np.array(scene.get("cell", "size")), max(body.id for body in scene.bodies)
    ids, other.bodies = {body.id: [] for body in scene.bodies}, []
    for m, offset in enumerate(offsets):
        for body in scene.bodies:
            if m > 0 and is_long(scene, body):
                continue
            new = body.copied(body.id + m*first)
            new.move(offset*size)
            if not body.fixed and not scene.get("cell", "profile", False):
                new.velocity = new.velocity + np.array([offset[1]*jump, 0.0]) + drift
            other.bodies.append(new)
            ids[body.id].append(new.id)
    return ids


def copy_groups(scene, other, offsets, ids):
    """Walls of all copies, loads times their number, and the sources and sinks of each copy."""
    n = len(offsets)
    for name in scene.named("wall"):
        other.put(f"wall.{name}", bodies=[k for body in scene.groups[f"wall.{name}"]["bodies"] for k in ids[body]])
    for name in scene.named("load"):
        load = other.groups[f"load.{name}"]
        for key in {"force", "stress", "mass"} & set(load):
            load[key] *= n
        load["damping_ratio"] *= np.sqrt(n)
    for group in other.groups.values():
        if group.get("until") == "departed":
            group["above"] *= n
    for full in [full for full in scene.groups if full.startswith(("source.", "sink."))]:
        group = other.groups.pop(full)
        for m, by in enumerate(offsets):
            other.put(f"{full}_{m}", **{**group, "low": list(np.array(group["low"]) + by),
                                        "high": list(np.array(group["high"]) + by)})


def is_long(scene, body):
    """Whether a fixed body spans the cell."""
    return "long_wall" in scene.acts.get(body.id, ())


def scale_cell(scene, numbers):
    """Mass and damping of a stress-controlled cell; false if one mass does not do for both axes."""
    controlled = scene.get("cell", "stress_controlled", "none")
    if controlled == "none":
        return True
    factors = {"x": numbers[1]/numbers[0], "y": numbers[0]/numbers[1]}
    if controlled == "xy" and numbers[0] != numbers[1]:
        return False
    factor = factors[controlled[0]]
    scene.put("cell", mass=scene.get("cell", "mass")*factor,
              damping_ratio=scene.get("cell", "damping_ratio")*np.sqrt(factor))
    return True
