"""Programs that share a simulation: shared_cases.py CASE OUT [WORD...]; on ranks if mpirun starts them.

Each process writes what it has seen to OUT.RANK as JSON; one process alone is the program with which they are compared.
"""

import hashlib
import json
import os
import random
import sys
from pathlib import Path

import numpy as np
import polydem
from polydem.parts import BODY_COLUMNS, CONTACT_COLUMNS

INPUTS = Path(__file__).parents[2] / "inputs"
#: All processes of mpirun; None: there is one, without MPI
COMM = None
if os.environ.get("OMPI_COMM_WORLD_SIZE"):
    from mpi4py import MPI

    COMM = MPI.COMM_WORLD
RANK = 0 if COMM is None else COMM.rank
HEAP = INPUTS / "first.nml"


def digest(values):
    """Shape and hash of an array."""
    bits = np.ascontiguousarray(values).tobytes()
    return f"{np.shape(values)} {hashlib.sha256(bits).hexdigest()[:16]}"


def look(sim):
    """All that can be asked of a simulation."""
    seen = {"step": sim.step, "time": sim.time, "stage": sim.stage, "hash": sim.state_hash, "bodies": len(sim.bodies),
            "contacts": len(sim.contacts), "actions": sim.actions}
    for columns, names in ((sim.bodies, BODY_COLUMNS), (sim.contacts, CONTACT_COLUMNS)):
        for name in names:
            seen[f"{columns._group}.{name}"] = digest(getattr(columns, name, ()))
    seen |= {f"energy.{name}": value.hex() for name, value in sim.energy.items()}
    seen |= {f"series.{name}": digest(values) for name, values in sim.series.items()}
    for name, wall in sim.walls.items():
        seen[f"wall.{name}"] = [digest(each) for each in (wall.force, wall.position, wall.velocity)]
    for name, load in sim.loads.items():
        seen[f"load.{name}"] = [value.hex() for value in (load.force, load.displacement, load.velocity, load.contacts)]
    frame = sim.frame()
    seen["frame"] = [digest(each) for each in (frame.position, frame.shape, frame.contacts.force, frame.walls.force)]
    return seen


def watch(namelist):
    """Values within and between runs, and states."""
    with polydem.Simulation(namelist, comm=COMM) as sim:
        every, observed, seen = max(1, sim.n_steps // 7), [], []
        sim.every(steps=every)(lambda sim: observed.append(look(sim)))
        seen.append(look(sim))
        sim.run(3 * every)
        seen.append(look(sim))
        state = sim.snapshot()
        sim.run(every)
        expected = sim.state_hash
        sim.restore(state)
        with sim.copy() as other:
            other.run(every)
            sim.run(every)
            assert sim.state_hash == other.state_hash == expected
        sim.run()
        seen.append(look(sim))
        return [seen, observed]


def act(namelist, folder):
    """Actions of all kinds, drawn by an observer; some are refused."""
    draw, refused = random.Random(7), []

    def change(sim):
        ids = sim.bodies.id[~sim.bodies.fixed]
        some = sorted(draw.sample(ids.tolist(), 5))
        kind = draw.randrange(7)
        if kind == 0:
            sim.bodies.apply_force(some, [(draw.uniform(-1, 1), draw.uniform(-1, 1)) for _ in some])
        elif kind == 1 and sim.walls:
            wall = draw.choice(list(sim.walls.values()))
            wall.move((draw.uniform(-0.02, 0.02), 1e-5 * wall.force[1]), draw.uniform(-0.05, 0.05))
        elif kind == 2:
            sim.gravity = draw.uniform(-2, 2), draw.uniform(-12, -8)
        elif kind == 3:
            sim.drag = draw.uniform(0, 3)
        elif kind == 4:
            sim.friction_scale = draw.uniform(0, 2)
        elif kind == 5:
            sim.remove(some[:2])
        else:
            x, y = sim.bodies.position[draw.randrange(len(ids))]
            y += draw.uniform(0.0, 0.3)
            assert sim.add([[(x, y), (x + 0.004, y), (x, y + 0.004)]], velocity=(0, -1)).size == 1

    with polydem.Simulation(namelist, {"output.contacts": True}, folder=folder or None, exchange=True,
                            comm=COMM) as sim:
        @sim.every(steps=20)
        def try_to_change(sim):
            try:
                change(sim)
            except polydem.InputError as error:
                refused.append(str(error))

        sim.run(600)
        sim.gravity = (0, -9.81)
        sim.run(1)
        sim.end()
        sim.run()
        assert sim.is_over
        return [look(sim), refused] if RANK == 0 else [look(sim)]


def write(namelist, folder, steps):
    """A result, in two runs of the program if it has so many steps."""
    with polydem.Simulation(namelist, folder=folder, resume=Path(folder).exists(), comm=COMM) as sim:
        sim.run(int(steps) or None)
        return [sim.step]


def react(folder, steps):
    """A run that acts, in parts; what takes effect must be known on all processes after each start."""
    with polydem.Simulation(HEAP, {"integrate.duration": 0.01}, folder=folder, resume=Path(folder).exists(),
                            comm=COMM) as sim:
        @sim.every(steps=50)
        def push(sim):
            sim.gravity = 1e-2 * sim.step, -9.81
            sim.drag = 1e-3 * sim.step
            sim.bodies.apply_force([100, 150], (1e-3 * sim.step, 0), 1e-6 * sim.step)

        begin = list(sim.gravity), sim.drag, len(sim.actions)
        sim.run(int(steps) or None)
        return [*begin, sim.step, sim.state_hash]


class Own(Exception):
    """An exception with two arguments, of which pickle would know one."""

    def __init__(self, one, other):
        super().__init__(f"{one} {other}")


class Silent(Exception):
    """An exception that can be neither sent nor shown."""

    def __str__(self):
        raise ValueError("no words")


def disturb(sim):
    """An observer that does something else at each call, mostly what is wrong."""
    number = sim.step // 50
    if number == 1:
        raise ZeroDivisionError("in an observer")
    if number == 2:
        raise Own(1, 2)
    if number == 3:
        sys.exit(5)
    if number == 4:
        sim.gravity = (float("nan"), 0)
    if number == 5:
        print(sim.bodies.position[0, 100000])
    if number == 6 and COMM is not None:
        sim.snapshot()
    if number == 7:
        raise Silent(lambda: 0)
    if number == 8:
        sim.stop("enough")


def fail():
    """What goes wrong on the root, or on all, is an exception on all; one may go on."""
    errors = []

    def expect(kind, function):
        try:
            function()
        except kind as error:
            errors.append(f"{type(error).__name__}: {error}")
        else:
            raise AssertionError("nothing went wrong")

    with polydem.Simulation(HEAP, comm=COMM) as sim, polydem.Simulation(HEAP, comm=COMM) as other:
        sim.every(steps=50)(disturb)
        for kind in (ZeroDivisionError, Exception, SystemExit, polydem.InputError, IndexError):
            expect(kind, lambda: sim.run(1000))
        if COMM is not None:
            expect(polydem.InputError, lambda: sim.run(1000))
        try:
            sim.run(1000)
        except (Silent, polydem.PolydemError) as error:
            errors.append(type(error) is Silent or "Silent" in str(error))
        sim.run(1000)
        assert (sim.step, sim.stopped) == (400, "enough")
        expect(polydem.InputError, lambda: setattr(sim, "drag", -1))
        expect(polydem.InputError, lambda: sim.bodies.apply_force([100000], (0, 0)))
        expect(polydem.InputError, lambda: sim.add([[(0, 0), (1, 0), (0, 1)]]))
        expect(polydem.InputError, lambda: sim.run(1.5))
        expect(polydem.InputError, lambda: polydem.Simulation("&scene nam = 1 /", comm=COMM))
        expect(polydem.InputError, lambda: polydem.Simulation("nowhere.nml", comm=COMM))
        with polydem.Simulation(HEAP, {"forces.gravity": (0, -1e6)}, comm=COMM) as falling:
            expect(polydem.RunError, falling.run)
            assert np.isfinite(falling.frame().position).all()
            expect(polydem.RunError, falling.run)
        other.run(np.int64(400) if RANK else 400.0)
        assert sim.state_hash == other.state_hash
        expect(AttributeError, lambda: sim.bodies.colour)
    return errors


def part(way):
    """Processes that do not make the same calls."""
    with polydem.Simulation(HEAP, comm=COMM) as sim:
        sim.run(10)
        if way == "steps":
            sim.run(10 + RANK)
        elif way == "alone" and RANK == 0:
            len(sim.contacts)
        elif way == "action":
            sim.drag = RANK
        elif way == "error" and RANK == 1:
            raise ZeroDivisionError("of one process")
        elif way == "exit" and RANK == 1:
            sys.exit(0)
        elif way == "observer" and RANK == 0:
            sim.every(steps=5)(lambda sim: polydem.Simulation(HEAP, comm=COMM))
        sim.run(20)
        # A number may be asked by one process alone.
        if RANK == 0:
            print(sim, sim.time, len(sim.bodies), sim.actions, sim.settings.scene.name)
        sim.run(20)
        if way == "late" and RANK == 1:
            raise ZeroDivisionError("of one process")
    return [sim.stopped]


def forget(way):
    """Simulations that nobody closes, or that a process leaves open and ends."""
    kept = [polydem.Simulation(HEAP, comm=COMM) for _ in range(3)]
    kept[0].run(10)
    if way == "early" and RANK == 1:
        raise ZeroDivisionError("of one process")
    kept = [kept[0]]
    kept[0].run(10)
    return [kept[0].state_hash]


def divide(folder):
    """Two groups of processes, each with a simulation."""
    group = COMM.Split(RANK % 2, -RANK)
    refused = []

    def look_at_other(sim):
        try:
            print(whole.state_hash)
        except polydem.InputError as error:
            refused.append(str(error))

    with polydem.Simulation(HEAP, comm=COMM) as whole, \
            polydem.Simulation(HEAP, {"scene.seed": RANK % 2 + 1}, comm=group) as sim:
        sim.every(steps=100)(look_at_other)
        sim.run(200)
        seen = [RANK % 2, sim.state_hash]
        assert len(refused) == (0 if group.rank else 2)
    try:
        polydem.Simulation(HEAP, comm=group, folder=folder)
    except polydem.InputError as error:
        seen.append(str(error))
    return seen


if __name__ == "__main__":
    result = globals()[sys.argv[1]](*sys.argv[3:])
    Path(f"{sys.argv[2]}.{RANK}").write_text(json.dumps(result), encoding="utf-8")
