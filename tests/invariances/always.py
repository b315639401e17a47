"""What every answer must have, whatever the scene: balances that close, works, masses, and walls that hold."""

import re

import numpy as np
from tables import excepted, read_table

#: Residual of the energy relative to the greatest kinetic energy or work, and of the momentum. The first is the error
#: of integration; the second is rounding with velocity Verlet.
ENERGY, MOMENTUM = 0.1, 1e-9
#: What the balance says and what the frames give, relative to the greatest
AGREES = 1e-9
#: Work of a wall and force times speed, summed over steps: the speed of an oscillation from its displacements
WORK = 5e-3


#: Restitution of an impact; speed and force at rest, relative to speed of the fall and weight
RESTITUTION, REST = 0.02, 1e-3


def faults(scene, answer):
    """What is wrong with an answer by itself, one text each."""
    found, table = [], read_table("exceptions")
    for check in (energies, momenta, kinetic, wall_works, masses, walls_hold, impact):
        text = "" if excepted(scene, check.__name__, table) else check(scene, answer)
        if text:
            found.append((check.__name__, text))
    return found


def energies(scene, answer):
    balance = answer.balance
    scale = max(balance["kinetic"].max(), *(abs(balance[key]).max() for key in (
        "elastic_work", "damping_work", "friction_work", "wall_work")))
    worst = abs(balance["energy_residual"]).max()
    if worst > ENERGY*scale:
        return f"energy residual {worst/scale:.1e} of the greatest energy"
    return ""


def momenta(scene, answer):
    """Impulses explain the momentum."""
    balance = answer.balance
    change = np.stack([balance[f"momentum_{axis}"] - balance[f"impulse_{axis}"] for axis in "xy"])
    scale = max(abs(balance[f"{what}_{axis}"]).max() for axis in "xy" for what in ("momentum", "impulse"))
    scale += sum(answer.mass[body.id] for body in scene.free)*scene.size/(scene.steps*scene.dt)
    worst = abs(change - change[:, :1]).max()
    if worst > MOMENTUM*scale:
        return f"momentum differs by {worst/scale:.1e} from the impulses"
    return ""


def kinetic(scene, answer):
    """The frames have the kinetic energy of the balance."""
    values = answer.balance["kinetic"]
    for k, frame in enumerate(answer.frames):
        own = sum(0.5*answer.mass[int(i)]*(v @ v) + 0.5*answer.inertia[int(i)]*w*w
                  for i, v, w in zip(frame.id, frame.velocity, frame.spin) if int(i) not in answer.fixed)
        if abs(own - values[k]) > AGREES*max(values.max(), own):
            return f"step {frame.step}: kinetic energy of the bodies {own:.9e}, of the balance {values[k]:.9e} J/m"
    return ""


def wall_works(scene, answer):
    """Work of a wall that only shifts is its force times its speed, as the balance sums them at the ends of steps."""
    series = answer.series
    for name in scene.named("wall"):
        acting = set().union(*(scene.acts.get(k, set()) for k in scene.groups[f"wall.{name}"]["bodies"]))
        if f"{name}.work" not in series or acting & {"motion_rotation", "motion_table", "load_hinged",
                                                     "motion_conveyor"}:
            continue
        loads = {scene.get(f"load.{load}", "direction", "") for load in scene.named("load")
                 if scene.groups[f"load.{load}"]["wall"] == name}
        work, total = np.zeros((2, len(series["time"])))
        for axis in "xy":
            moved = np.diff(series[f"{name}.{axis}"])
            rate = series[f"{name}.force_{axis}"]*speeds(moved, axis in loads)
            step = 0.5*(rate[1:] + rate[:-1])
            work[1:] -= np.cumsum(step)
            total[1:] += np.cumsum(abs(step))
        own = series[f"{name}.work"] - series[f"{name}.work"][0]
        kept = np.isfinite(own) & np.isfinite(work)
        scale = max(total.max(), abs(own[kept]).max(initial=0.0), 1e-300)
        wrong = abs(own - work)[kept].max(initial=0.0)
        if wrong > WORK*scale and scale > 1e-3*answer.balance["kinetic"].max():
            return f"work of wall {name}: {own[-1]:.4e}, force times speed {work[-1]:.4e} J/m"
    return ""


def speeds(moved, has_load):
    """Speeds at the ends of steps, times the step, from the displacements in the steps. A wall that starts or stops
    jumps: at the start it has no speed yet. At the end one with a load has none, one with a motion still has it."""
    before, behind = np.append(moved[:1], moved), np.append(moved, moved[-1:])
    speed = 0.5*(before + behind)
    speed[before == 0] = 0
    speed[behind == 0] = 0 if has_load else before[behind == 0]
    return speed


def masses(scene, answer):
    """Who was there, entered and has not left is there."""
    start = {int(k) for k in answer.frames[0].id}
    gone = {int(k) for k in answer.departures.get("id", ())}
    last = {int(k) for k in answer.frames[-1].id}
    for name in scene.named("wall"):
        vanish = scene.get(f"wall.{name}", "vanish_at", 0.0)
        if 0 < vanish < answer.frames[-1].time:
            start -= set(scene.groups[f"wall.{name}"]["bodies"])
            last -= set(scene.groups[f"wall.{name}"]["bodies"])
    if not start - gone <= last:
        return f"bodies {sorted(start - gone - last)} are lost"
    if gone & last:
        return f"bodies {sorted(gone & last)} have left and are there"
    series = answer.series
    for name in scene.named("sink"):
        if f"{name}.mass" in series and len(scene.named("sink")) == 1:
            mass = sum(answer.departures.get("mass", ()))
            if abs(series[f"{name}.mass"][-1] - mass) > AGREES*max(mass, 1e-300):
                return f"sink {name}: mass {series[f'{name}.mass'][-1]} in the series, {mass} in the table"
    entered = sum(int(series[f"{name}.entered"][-1]) for name in scene.named("source") if f"{name}.entered" in series)
    guests = len((last | gone) - {body.id for body in scene.bodies})
    if scene.named("source") and not scene.start and entered != guests:
        return f"{entered} bodies have entered, {guests} were there"
    return ""


def walls_hold(scene, answer):
    """No centre of a free body is inside a wall, unless the run warns that one passes through."""
    if re.search(r"warnings: .* pass", answer.log):
        return ""
    for frame in answer.frames:
        gone = {k for name in scene.named("wall") for k in scene.groups[f"wall.{name}"]["bodies"]
                if 0 < scene.get(f"wall.{name}", "vanish_at", 0.0) <= frame.time}
        fixed = [k for k, i in enumerate(frame.id) if int(i) in answer.fixed and int(i) not in gone]
        free = [k for k, i in enumerate(frame.id) if int(i) not in answer.fixed]
        for w in fixed:
            turn = frame.angle[w]
            c, s = np.cos(turn), np.sin(turn)
            place = frame.position[free] - frame.position[w]
            if frame.size is not None:
                for axis in scene.periodic:
                    if "long_wall" not in scene.acts.get(int(frame.id[w]), ()):
                        place[:, axis] -= np.round(place[:, axis]/frame.size[axis])*frame.size[axis]
            place = place @ np.array([[c, -s], [s, c]])
            for piece in answer.outline[int(frame.id[w])]:
                edge = np.roll(piece, -1, axis=0) - piece
                inside = ((edge[:, 0]*(place[:, None, 1] - piece[:, 1])
                           - edge[:, 1]*(place[:, None, 0] - piece[:, 0])) > 0).all(axis=1)
                if inside.any():
                    body = int(frame.id[free[int(np.flatnonzero(inside)[0])]])
                    return f"step {frame.step}: the centre of body {body} is inside wall {int(frame.id[w])}"
    return ""


def impact(scene, answer):
    """An impact has the restitution of the namelist; a body that shall come to rest does, and the floor bears it."""
    if scene.kind not in ("impact", "rest"):
        return ""
    first, last = answer.frames[0], answer.frames[-1]
    fall = first.velocity[first.row(2)][1] - first.velocity[first.row(1)][1]
    rise = last.velocity[last.row(1)][1] - last.velocity[last.row(2)][1]
    if scene.kind == "rest":
        weight = answer.mass[1]*np.array(scene.get("forces", "gravity"))
        if abs(rise) > REST*fall:
            return f"moves at {rise/fall:.1e} of the speed of the fall when it shall rest"
        if not np.allclose(last.wall_force, weight, rtol=REST, atol=REST*abs(weight).max()):
            return f"force on the floor {last.wall_force} N/m, weight {weight}"
        return ""
    nominal = scene.get("forces", "restitution")
    if len(last.contacts):
        return "an impact does not end"
    if abs(rise/fall - nominal) > RESTITUTION:
        return f"restitution {rise/fall:.3f} instead of {nominal:.3f}"
    return ""
