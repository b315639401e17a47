"""What two answers have in common, and what every answer must have.

Poses and velocities are compared frame by frame, until rounding has grown: the bound follows from runs of the same
scene whose places and velocities differ in the last bits.
"""

from dataclasses import dataclass, field

import numpy as np

#: Changes of the last bits grow by this factor at most beside those of the disturbed runs
MARGIN = 300.0
#: Differences that are always allowed, relative to size and speed
FLOOR = 1e-10
#: Comparison ends when the bound exceeds this share of size or speed
LOST = 1e-4
#: Energies differ by this share of the greatest one at most, beside the bound
ENERGY_FLOOR = 1e-8
#: Columns of the series that no isometry changes, and those that a turn changes
SCALARS = ("coordination", "solid_fraction", "unbalanced_force", "kinetic_energy")
TENSORS = ("stress_xx", "stress_xy", "stress_yx", "stress_yy")
ENERGIES = ("kinetic", "elastic_work", "damping_work", "friction_work", "wall_work")


@dataclass
class Bound:
    """How far places [m], angles, velocities [m/s] and spins of a scene are certain, by step."""

    size: float
    speed: float
    place: dict = field(default_factory=dict)
    velocity: dict = field(default_factory=dict)
    energy: dict = field(default_factory=dict)
    #: Sum of the forces on all walls [N/m]
    force: dict = field(default_factory=dict)
    #: Means of the series, by column and step
    mean: dict = field(default_factory=dict)

    def is_lost(self, step):
        return self.place[step] > LOST*self.size or self.velocity[step] > LOST*self.speed


def jump_of(scene, frame):
    """Velocity of the copy above, in a sheared cell."""
    rate, ramp = scene.get("cell", "shear_rate", 0.0), scene.get("cell", "shear_ramp", 0.0)
    if not rate:
        return 0.0
    u = min(1.0, frame.time/ramp) if ramp > 0 else 1.0
    return rate*u*u*(3 - 2*u)*frame.size[1]


def minimum_image(scene, frame, place, velocity):
    """Differences of places and velocities up to copies of the cell."""
    place, velocity = place.copy(), velocity.copy()
    if frame.size is None:
        return place, velocity
    if 1 in scene.periodic:
        rows = np.round(place[:, 1]/frame.size[1])
        place[:, 1] -= rows*frame.size[1]
        place[:, 0] -= rows*frame.shift
        velocity[:, 0] -= rows*jump_of(scene, frame)
    if 0 in scene.periodic:
        place[:, 0] -= np.round(place[:, 0]/frame.size[0])*frame.size[0]
    return place, velocity


def speed_of(scene, answer):
    """Greatest speed of a run, or what its forces give in that time."""
    free = [frame.velocity[[int(k) not in answer.fixed for k in frame.id]] for frame in answer.frames]
    seen = max((np.hypot(*v.T).max() for v in free if len(v)), default=0.0)
    return max(seen, scene.size/(scene.steps*scene.dt))


def bound_of(scene, answer, disturbed):
    """Bound from runs with other last bits; None if one of them ended otherwise."""
    bound = Bound(scene.size, speed_of(scene, answer))
    scale = max(*(abs(answer.balance[key]).max() for key in ENERGIES), 1e-300)
    worst = np.zeros(4)
    strongest = max(abs(frame.wall_force).max() for frame in answer.frames)
    others = [{frame.step: (k, frame) for k, frame in enumerate(other.frames)} for other in disturbed]
    for k, frame in enumerate(answer.frames):
        for other, frames in zip(disturbed, others):
            if frame.step not in frames or not np.array_equal(frames[frame.step][1].id, frame.id):
                worst[:] = np.inf
                continue
            row, twin = frames[frame.step]
            place, velocity = minimum_image(scene, frame, twin.position - frame.position,
                                            twin.velocity - frame.velocity)
            turn, spin = (scene.size*abs(a - b).max(initial=0.0)
                          for a, b in ((twin.angle, frame.angle), (twin.spin, frame.spin)))
            energy = max(abs(other.balance[key][row] - answer.balance[key][k]) for key in ENERGIES)/scale
            force = abs(twin.wall_force - frame.wall_force).max()
            worst = np.maximum(worst, [max(abs(place).max(initial=0.0), turn),
                                       max(abs(velocity).max(initial=0.0), spin), energy, force])
        bound.place[frame.step] = MARGIN*worst[0] + FLOOR*bound.size
        bound.velocity[frame.step] = MARGIN*worst[1] + FLOOR*bound.speed
        bound.energy[frame.step] = (MARGIN*worst[2] + ENERGY_FLOOR)*scale
        bound.force[frame.step] = MARGIN*worst[3] + ENERGY_FLOOR*strongest
    for key in (*SCALARS, *TENSORS):
        bound.mean[key] = mean_bound(answer, disturbed, key)
    return bound


def rows_of(answer, key):
    """A column of the series by step."""
    if key not in answer.series:
        return {}
    return dict(zip(answer.series["step"].tolist(), answer.series[key].tolist()))


def mean_bound(answer, disturbed, key):
    """Bound of a column of the series, by step."""
    own, others = rows_of(answer, key), [rows_of(other, key) for other in disturbed]
    like = TENSORS if key in TENSORS else (key,)
    scale = np.nanmax(np.abs([0.0, *(value for name in like for value in rows_of(answer, name).values())]))
    worst, bound = 0.0, {}
    for step, value in own.items():
        for other in others:
            if step in other and np.isfinite(value):
                worst = max(worst, abs(other[step] - value)) if np.isfinite(other[step]) else np.inf
        bound[step] = MARGIN*worst + ENERGY_FLOOR*scale
    return bound


def differences(scene, answer, case, other, bound):
    """The first difference between an answer and that of a transformed scene, as text; '' if there is none.

    None if nothing can be compared, because rounding has grown before.
    """
    if case.exact:
        return exact_difference(scene, answer, case, other)
    frames = {frame.step + case.before: (k, frame) for k, frame in enumerate(other.frames)}
    compared = 0
    for k, frame in enumerate(answer.frames):
        if frame.step < case.before or bound.is_lost(frame.step):
            continue
        if frame.step not in frames:
            return f"step {frame.step}: has no frame"
        row, twin = frames[frame.step]
        found = frame_difference(scene, answer, case, frame, twin, bound)
        if not found and case.energies:
            found = energy_difference(answer, case, other, k, row, bound.energy[frame.step])
        if not found and not case.loose and frame.step > case.before:
            found = force_difference(case, frame, twin, bound.force[frame.step])
        if found:
            return f"step {frame.step}: {found}"
        compared += 1
    found = mean_difference(answer, case, other, bound) if case.energies and not case.extra else ""
    return found or ("" if compared else None)


def frame_difference(scene, answer, case, frame, twin, bound):
    """What differs in one frame."""
    change = case.change
    rows = {int(identifier): k for k, identifier in enumerate(twin.id)}
    pairs, guests = [], []
    known = set(case.ids) or {body.id for body in scene.bodies}
    for k, identifier in enumerate(frame.id):
        identifier = int(identifier)
        if identifier not in known:
            guests.append(k)
            continue
        for name in case.ids.get(identifier, [identifier]):
            if name not in rows:
                return f"body {name} is missing"
            pairs.append((k, rows.pop(name)))
    for name in case.extra:
        rows.pop(name, None)
    if len(rows) != len(guests)*case.copies:
        return f"{len(rows)} other bodies instead of {len(guests)*case.copies}: {sorted(rows)[:4]}"
    pairs += match(scene, case, frame, twin, guests, list(rows.values()))
    one, two = np.array(pairs, dtype=int).reshape(-1, 2).T
    place, velocity = deviations(scene, case, frame, twin, one, two)
    turn = twin.angle[two] - change.sense*frame.angle[one]
    if case.loose:
        # A run that starts from a frame counts angles from there.
        if case.turned is None:
            case.turned = dict(zip(frame.id[one], turn))
        turn = turn - np.array([case.turned.get(identifier, 0.0) for identifier in frame.id[one]])
    spin = twin.spin[two] - change.sense/change.time*frame.spin[one]
    if case.before and frame.step == case.before:
        # The velocity of a motion that begins shows from the first step on.
        walls = np.isin(frame.id[one], list(answer.fixed))
        velocity[walls], spin[walls] = 0.0, 0.0
    tolerances = (bound.place[frame.step] + case.loose*bound.size, bound.velocity[frame.step] + case.loose*bound.speed)
    # Walls that span a periodic axis and fixed bodies with motions are compared, too: by where they are.
    checks = (("position", np.hypot(*place.T), tolerances[0]), ("angle", abs(turn)*bound.size, tolerances[0]),
              ("velocity", np.hypot(*velocity.T), tolerances[1]), ("spin", abs(spin)*bound.size, tolerances[1]))
    for what, amount, tolerance in checks:
        if len(amount) and not amount.max() <= tolerance:
            worst = int(np.argmax(amount))
            scale = bound.size if what in ("position", "angle") else bound.speed
            return (f"body {int(frame.id[one[worst]])} ({int(twin.id[two[worst]])}): {what} differs by "
                    f"{amount[worst]/scale:.1e} of the {'size' if scale == bound.size else 'speed'} "
                    f"(bound {tolerance/scale:.0e})")
    return ""


def deviations(scene, case, frame, twin, one, two):
    """Differences of places and velocities of rows, in the axes of the scene up to copies."""
    change = case.change
    time = twin.time + (case.before + scene.prelude)*scene.dt*change.time
    back = np.linalg.inv(change.matrix)/change.length
    place = (twin.position[two] - case.drift*time - change.shift) @ back.T - frame.position[one]
    velocity = ((twin.velocity[two] - case.drift) @ back.T)*change.time - frame.velocity[one]
    place, velocity = minimum_image(scene, frame, place, velocity)
    if case.relative and len(one):
        place, velocity = minimum_image(scene, frame, place - place[0], velocity - velocity[0])
    return place*change.length, velocity*change.length/change.time


def match(scene, case, frame, twin, guests, rows):
    """Pairs of bodies that have entered, by where they are."""
    pairs, left = [], list(rows)
    for k in guests:
        for _ in range(case.copies):
            one, two = np.full(len(left), k), np.array(left, dtype=int)
            place, _ = deviations(scene, case, frame, twin, one, two)
            best = int(np.argmin(np.hypot(*place.T)))
            pairs.append((k, left.pop(best)))
    return pairs


def mean_difference(answer, case, other, bound):
    """Which mean over bodies or over the sample differs."""
    change = case.change
    if change.length != 1 or change.mass != 1 or change.time != 1:
        return ""
    same = np.array_equal(change.matrix, np.eye(2))
    for key in (*SCALARS, *(TENSORS if same else ())):
        own, others = rows_of(answer, key), rows_of(other, key)
        for step in sorted(set(own) & set(others)):
            if bound.is_lost(min(bound.place, key=lambda k: abs(k - step))):
                break
            one, two = own[step], others[step]
            if not abs(two - one) <= bound.mean[key][step] and not (np.isnan(one) and np.isnan(two)):
                return f"step {step}: {key} {two:.6e} instead of {one:.6e}"
    return ""


def energy_difference(answer, case, other, k, row, tolerance):
    """Which column of the balance differs."""
    unit = case.copies*case.change.unit((2, 1, -2))
    for key in ENERGIES:
        one, two = unit*answer.balance[key][k], other.balance[key][row]
        start = other.balance[key][0] - unit*answer.balance[key][0] if key != "kinetic" else 0.0
        if not abs(two - start - one) <= tolerance*unit:
            return f"{key} {two:.6e} instead of {one:.6e} J/m (bound {tolerance*unit:.0e})"
    return ""


def force_difference(case, frame, twin, tolerance):
    """Whether walls bear another force."""
    force = case.copies*case.change.vector(frame.wall_force, (1, 1, -2))
    tolerance *= case.copies*case.change.unit((1, 1, -2))
    if not abs(twin.wall_force - force).max() <= tolerance:
        return f"walls bear {twin.wall_force} instead of {force} N/m (bound {tolerance:.0e})"
    return ""


def exact_difference(scene, answer, case, other):
    """What differs in bits."""
    change = case.change
    frames = {frame.step + case.before: frame for frame in other.frames}
    for frame in answer.frames:
        if frame.step < case.before:
            continue
        twin = frames.get(frame.step)
        if twin is None:
            return f"step {frame.step}: has no frame"
        if not np.array_equal(twin.id, frame.id):
            return f"step {frame.step}: other bodies"
        for what, one, two in (
                ("position", frame.position*change.length, twin.position), ("angle", frame.angle, twin.angle),
                ("velocity", frame.velocity*(change.length/change.time), twin.velocity),
                ("spin", frame.spin/change.time, twin.spin)):
            differ = one != two
            if case.before and what in ("velocity", "spin") and frame.step == case.before:
                # The velocity of a motion that begins shows from the first step on.
                differ[np.isin(frame.id, list(answer.fixed))] = False
            if differ.any():
                row = int(np.argwhere(differ)[0][0])
                return (f"step {frame.step}: body {int(frame.id[row])}: {what} differs by "
                        f"{abs(two - one)[row].max():.1e} in its bits")
    return ""
