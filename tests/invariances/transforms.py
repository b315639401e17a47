"""The invariances: each makes of a scene another one whose answer is known, or says that it does not apply.

A function gets the scene and dice, and gives a `Case`, or None. Whole capabilities that break an invariance for a
reason stand in exceptions.txt, and nowhere else.
"""

import numpy as np
from case import Case
from cells import border, copies_2x2, copies_3x1, is_relative
from runs import Play
from splits import split_checkpoint, split_continue, split_frame, stage_boundary

from scene import Body, Map


# Coordinates and units
def quarter_turn(scene, dice):
    change = Map(matrix=np.array([[0.0, -1.0], [1.0, 0.0]]))
    return Case([Play(scene.mapped(change))], change)


def mirror(scene, dice):
    change = Map(matrix=np.diag(dice.choice(([-1.0, 1.0], [1.0, -1.0]))))
    return Case([Play(scene.mapped(change))], change)


def units(scene, dice):
    length, mass, time = (2.0**dice.randint(-5, 5) for _ in range(3))
    change = Map(length=length, mass=mass, time=time)
    return Case([Play(scene.mapped(change))], change, exact=True)


def moving_frame(scene, dice):
    """Everything moves beside; walls that span a periodic axis cannot move along it, nor walls along their load.

    Where all fixed bodies vanish, a motion could find none in the frame from which a run starts.
    """
    drift = np.array([dice.uniform(-1, 1), dice.uniform(-1, 1)])
    if "long_wall" in scene.tags:
        drift[scene.periodic] = 0.0
    for name in scene.named("load"):
        drift["xy".index(scene.get(f"load.{name}", "direction"))] = 0.0
    fixed = {body.id for body in scene.bodies if body.fixed}
    gates = {k for wall in scene.groups.values() if "vanish_at" in wall for k in wall["bodies"]}
    if not drift.any() or (fixed and fixed <= gates):
        return None
    other = scene.copy()
    for body in other.free:
        body.velocity = body.velocity + drift
    if fixed:
        # It comes last: the motions before it keep their pivots.
        other.put("motion.frame", kind="translation", velocity=list(drift))
    return Case([Play(other)], drift=drift, relative=is_relative(scene), energies=False)


# Order, and what is far away
def corners(scene, dice):
    other = scene.copy()
    for body in other.bodies:
        body.pieces = [np.roll(piece, dice.randint(1, len(piece) - 1), axis=0) for piece in body.pieces]
    return Case([Play(other)])


def order(scene, dice):
    """Other identifiers, bodies and groups in another order; motions, stages and materials keep theirs."""
    other = scene.copy()
    old = [body.id for body in other.bodies]
    new = old[:]
    dice.shuffle(new)
    ids = dict(zip(old, new))
    for body in other.bodies:
        body.id = ids[body.id]
    dice.shuffle(other.bodies)
    for body in other.bodies:
        dice.shuffle(body.pieces)
    for name in other.named("wall"):
        other.put(f"wall.{name}", bodies=[ids[k] for k in other.groups[f"wall.{name}"]["bodies"]])
    kept = [name for name in other.groups if name.startswith(("motion.", "stage.", "material."))]
    names = [name for name in other.groups if name not in kept]
    dice.shuffle(names)
    other.groups = {name: other.groups[name] for name in (*kept, *names)}
    return Case([Play(other)], ids={k: [ids[k]] for k in old})


def far_body(scene, dice, fixed=False):
    if len(scene.periodic) == 2:
        return None
    other = scene.copy()
    away = np.zeros(2)
    axis = 1 - scene.periodic[0] if scene.periodic else dice.choice((0, 1))
    away[axis] = dice.choice((-1, 1))*dice.uniform(5, 20)
    model = scene.free[0]
    new = model.copied(max(body.id for body in scene.bodies) + 1)
    new.fixed, new.velocity, new.spin = fixed, np.zeros(2), 0.0
    new.move(away)
    other.bodies.append(new)
    return Case([Play(other)], extra={new.id}, energies=fixed)


def far_wall(scene, dice):
    return far_body(scene, dice, fixed=True)


# Cuts
def cut_body(scene, dice):
    """The body that falls is cut into columns or layers of one width."""
    if scene.kind == "any" or len(scene.bodies[0].pieces) > 1:
        return None
    other = scene.copy()
    columns, layers = dice.choice(((2, 1), (4, 1), (8, 1), (1, 2), (1, 3), (2, 2), (3, 2)))
    other.bodies[0].pieces = cut(other.bodies[0].pieces[0], columns, layers)
    return Case([Play(other)], impact=True)


def cut_wall(scene, dice):
    """What lies below is cut: a floor into several fixed bodies, a free body into pieces."""
    if scene.kind == "any":
        return None
    other = scene.copy()
    n = dice.choice((2, 3))
    if other.bodies[1].fixed:
        pieces = cut(other.bodies[1].pieces[0], n, 1)
        other.bodies[1:] = [Body(2 + k, [piece], fixed=True) for k, piece in enumerate(pieces)]
    else:
        other.bodies[1].pieces = cut(other.bodies[1].pieces[0], n, 1)
    return Case([Play(other)], impact=True)


def cut(rectangle, columns, layers):
    """Equal parts of a rectangle along the axes."""
    low, high = rectangle.min(axis=0), rectangle.max(axis=0)
    xs, ys = np.linspace(low[0], high[0], columns + 1), np.linspace(low[1], high[1], layers + 1)
    return [np.array([[xs[i], ys[j]], [xs[i + 1], ys[j]], [xs[i + 1], ys[j + 1]], [xs[i], ys[j + 1]]])
            for i in range(columns) for j in range(layers)]


def ranks(scene, dice):
    """The run of every fourth scene has several processes, which take longer to start than such a run."""
    if dice.random() > 0.25:
        return None
    return Case([Play(scene.copy())], exact=True, ranks=dice.choice((2, 3)))


#: All invariances, by name
INVARIANCES = {function.__name__: function for function in (
    border, copies_2x2, copies_3x1, quarter_turn, mirror, moving_frame, units, corners, order, far_body, far_wall,
    cut_body, cut_wall, split_checkpoint, split_frame, split_continue, stage_boundary,
    ranks)}
