"""Actions: their motion in closed form, their energy, their repetition by the program, and what is refused."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import polydem
import pytest
from polydem import library
from polydem_post import Trajectory

ROOT = Path(os.environ["POLYDEM_SOURCE_DIR"])
PROGRAM = os.environ["POLYDEM_PROGRAM"]
SQUARE = np.array([(0.0, 0.0), (0.01, 0.0), (0.01, 0.01), (0.0, 0.01)])


def square(x, y):
    """A square with its lower left corner at a place."""
    return SQUARE + np.array([x, y])


#: Two walls far below and above, and two grains that meet nothing
FREE = {
    "wall": {"floor": {"outline": "rectangle", "low": (-0.1, -0.62), "high": (0.1, -0.6)},
             "lid": {"outline": "rectangle", "low": (-0.1, 0.6), "high": (0.1, 0.62)}},
    "grains": {"few": {"region": "box", "low": (-0.05, 0.001), "high": (0.05, 0.05), "number": 2,
                       "shape": "rectangle", "width": 0.01, "height": 0.01}},
    "forces": {"gravity": (0, 0), "stiffness": 1e6},
    "integrate": {"duration": 0.5, "dt": 1e-4},
    "output": {"energy_balance": True},
}


def run_program(path, actions, folder, *options):
    """State hash of a run of the program with a file of actions."""
    subprocess.run([PROGRAM, "run", str(path), "--actions", str(actions), "--set", f"output.folder={folder}", *options],
                   check=True, capture_output=True)
    return Trajectory(folder).state_hash


@pytest.fixture
def free():
    with polydem.Simulation(FREE) as sim:
        yield sim


# --- motion -----------------------------------------------------------------------------------------------------------


def test_a_force_and_a_torque_act_until_they_end(free):
    body = free.bodies.id[~free.bodies.fixed]
    row = np.flatnonzero(~free.bodies.fixed)
    mass, inertia = free.bodies.mass[row], free.bodies.inertia[row]
    free.run(10)
    x, v = free.bodies.position[row], free.bodies.velocity[row]
    angle, spin = free.bodies.angle[row], free.bodies.angular_velocity[row]
    force, torque = np.array([(0.3, 0.1), (-0.2, 0.4)]), np.array([2e-4, -1e-4])
    free.bodies.apply_force(body, force, torque)
    free.run(100)
    # The first step has the half of the new acceleration at its end, all later ones the whole: n - 1/2 steps.
    t, dt = 100 * free.dt, free.dt
    a, alpha = force / mass[:, None], torque / inertia
    np.testing.assert_allclose(free.bodies.velocity[row], v + a * (t - dt / 2), rtol=1e-12)
    np.testing.assert_allclose(free.bodies.position[row], x + v * t + a * (t - dt) ** 2 / 2 + a * (t - dt) * dt / 2,
                               rtol=1e-11)
    np.testing.assert_allclose(free.bodies.angular_velocity[row], spin + alpha * (t - dt / 2), rtol=1e-12)
    np.testing.assert_allclose(free.bodies.angle[row], angle + spin * t + alpha * (t - dt) * t / 2, rtol=1e-11)
    np.testing.assert_allclose(free.bodies.force[row], force, rtol=1e-12)
    work = np.sum(force * (free.bodies.position[row] - x)) + np.sum(torque * (free.bodies.angle[row] - angle))
    # The balance has an error of second order in dt when a force begins.
    assert free.energy["wall_work"] == pytest.approx(work, rel=(dt / t) ** 2)
    assert abs(free.energy["energy_residual"]) < (dt / t) ** 2 * work
    free.bodies.apply_force(body, (0.0, 0.0))
    free.run(1)
    v = free.bodies.velocity[row]
    free.run(100)
    np.testing.assert_array_equal(free.bodies.velocity[row], v)
    assert abs(free.energy["energy_residual"]) < 2 * (dt / t) ** 2 * work


def test_gravity_and_drag(free):
    row = np.flatnonzero(~free.bodies.fixed)
    free.gravity = (1.0, -3.0)
    free.run(1000)
    t = 1000 * free.dt - free.dt / 2
    np.testing.assert_allclose(free.bodies.velocity[row], [(t, -3 * t)] * 2, rtol=1e-12)
    assert free.gravity == (1.0, -3.0)
    free.gravity = (0, 0)
    free.drag = 20.0
    free.run(1)
    v = free.bodies.velocity[row]
    free.run(1000)
    np.testing.assert_allclose(free.bodies.velocity[row], v * np.exp(-20 * 1000 * free.dt), rtol=1e-5)
    assert free.energy["damping_work"] < -0.9 * free.energy["elastic_work"] - 1e-6
    assert abs(free.energy["energy_residual"]) < 1e-6 * abs(free.energy["damping_work"])


def test_a_wall_is_continuous_and_has_the_velocity(free):
    free.run(7)
    start = free.walls["floor"].position
    floor = np.searchsorted(free.bodies.id, free.walls["floor"].id)
    free.walls["floor"].velocity = (0.02, 0.05)
    free.run(100)
    np.testing.assert_allclose(free.walls["floor"].position, start + 100 * free.dt * np.array([0.02, 0.05]), rtol=1e-13)
    np.testing.assert_array_equal(free.walls["floor"].velocity, (0.02, 0.05))
    here = free.walls["floor"].position
    pivot = here + np.array([0.1, 0.0])
    free.walls["floor"].move((0.0, 0.1), spin=3.0, pivot=pivot)
    free.run(200)
    t = 200 * free.dt
    turned = pivot + np.array([0, 0.1 * t]) - 0.1 * np.array([np.cos(3 * t), np.sin(3 * t)])
    np.testing.assert_allclose(free.walls["floor"].position, turned, rtol=1e-12)
    np.testing.assert_allclose(free.bodies.angle[floor], 3 * t, rtol=1e-12)
    np.testing.assert_allclose(free.bodies.angular_velocity[floor], 3.0)
    free.walls["floor"].velocity = (0, 0)
    free.run(50)
    np.testing.assert_allclose(free.walls["floor"].position, turned, rtol=1e-12)
    assert not free.walls["lid"].velocity.any()


def test_a_velocity_replaces_motions_where_they_are():
    groups = {**FREE, "motion": {"shake": {"wall": "floor", "kind": "oscillation", "amplitude": (0, 0.01),
                                           "frequency": 7}}}
    with polydem.Simulation(groups) as sim, polydem.Simulation(groups) as other:
        sim.run(333)
        sim.walls["floor"].velocity = (0.0, 0.0)
        other.run(333)
        sim.run(200)
        np.testing.assert_allclose(sim.walls["floor"].position, other.walls["floor"].position, rtol=1e-14)


def test_a_load_accelerates_its_wall():
    groups = {**FREE, "load": {"press": {"wall": "lid", "direction": "y", "force": 0.0, "mass": 2.0,
                                         "damping_ratio": 0.0}}}
    with polydem.Simulation(groups) as sim:
        sim.run(5)
        sim.loads["press"].force = -0.8
        sim.run(1000)
        t = 1000 * sim.dt - sim.dt / 2
        assert sim.loads["press"].velocity == pytest.approx(-0.4 * t, rel=1e-12)
        assert sim.loads["press"].force == -0.8
        assert sim.energy["load_work"] == pytest.approx(0.5 * 2.0 * (0.4 * t) ** 2, rel=1e-6)
        with pytest.raises(polydem.InputError, match="press moves the wall lid"):
            sim.walls["lid"].velocity = (0, 1)
        with pytest.raises(polydem.InputError, match="no load \"pres\"; did you mean 'press'"):
            sim._handle.act("load", "pres", values=[1.0])


def test_a_factor_of_the_friction_is_that_of_a_stage():
    groups = ROOT / "inputs/incline.nml"
    with polydem.Simulation(groups) as sim, polydem.Simulation(groups, {"forces.friction_coefficient": 0.0}) as smooth:
        sim.friction_scale = 0.0
        assert sim.friction_scale == 1.0
        sim.run(300)
        smooth.run(300)
        assert sim.friction_scale == 0.0
        row = ~sim.bodies.fixed
        # All but the first force is without friction.
        np.testing.assert_allclose(sim.bodies.velocity[row], smooth.bodies.velocity[row], rtol=1e-2)


def test_stages_and_runs_end_with_the_next_step():
    scene = ROOT / "inputs/shear_cell.nml"
    with polydem.Simulation(scene) as sim:
        sim.run(20)
        assert sim.stage == "compress"
        sim.end_stage()
        sim.run(1)
        assert (sim.stage, sim.step) == ("shear", 21)
        sim.end()
        sim.run()
        assert sim.is_over
        assert (sim.step, sim.n_steps) == (22, 22)
        with pytest.raises(polydem.InputError, match="over"):
            sim.gravity = (0, 0)


def test_bodies_enter_and_leave():
    with polydem.Simulation(FREE, exchange=True) as sim:
        sim.run(5)
        former = sim.bodies.id
        kinetic = sim.energy["kinetic"]
        ids = sim.add([square(0.2, 0), SQUARE[:3] - (0.3, 0.1)], velocity=[(0.1, 0), (0, 0.2)], angular_velocity=2.0,
                      density=1000.0)
        more = sim.add([square(0.3, 0)])
        assert np.array_equal(ids, former.max() + np.array([1, 2]))
        assert more[0] == ids[1] + 1
        sim.run(100)
        assert np.array_equal(sim.bodies.id, [*former, *ids, *more])
        t = 100 * sim.dt
        np.testing.assert_allclose(sim.bodies.position[-3], (0.205 + 0.1 * t, 0.005), rtol=1e-12)
        np.testing.assert_allclose(sim.bodies.angle[-3:-1] - sim.bodies.angle[-3:-1][0], 0, atol=1e-12)
        np.testing.assert_allclose(sim.bodies.mass[-3:], (0.1, 0.05, 0.25), rtol=1e-12)
        inertia = sim.bodies.inertia[-3:]
        brought = 0.5 * (0.1 * 0.01 + 0.05 * 0.04) + 0.5 * 4 * (inertia[0] + inertia[1])
        assert sim.energy["entered_energy"] == pytest.approx(brought, rel=1e-12)
        assert sim.energy["kinetic"] == pytest.approx(kinetic + brought, rel=1e-12)
        sim.remove(ids)
        sim.run(1)
        assert np.array_equal(sim.bodies.id, [*former, *more])
        assert sim.energy["departed_energy"] == pytest.approx(brought, rel=1e-12)
        assert abs(sim.energy["energy_residual"]) < 1e-15
        assert sim.add([square(0.2, 0)])[0] == more[0] + 1


def test_added_grains_fall_on_others_and_their_energy_closes():
    with polydem.Simulation(ROOT / "inputs/first.nml", exchange=True) as sim:
        sim.run(1500)
        sim.add([square(x, 0.35) for x in (-0.03, 0.0, 0.03)], velocity=(0, -1.0))
        sim.run(1500)
        free = sim.bodies.id[~sim.bodies.fixed]
        sim.remove(free[:50])
        sim.run(1500)
        # As large as without actions: the steps are the same.
        assert abs(sim.energy["energy_residual"]) < 1e-3 * abs(sim.energy["damping_work"])
        assert len(sim.bodies) == 253 + 3 - 50


# --- repetition -------------------------------------------------------------------------------------------------------

SCRIPT = """
import os, signal, sys
import numpy as np
import polydem

scene, folder, mode, kill = sys.argv[1], sys.argv[2] or None, sys.argv[3], int(sys.argv[4])
threads = int(sys.argv[5])
with polydem.Simulation(scene, {"checkpoint.steps": 150, "checkpoint.wall_interval": 0.0}, folder=folder,
                        resume=mode == "resume", exchange=True, threads=threads) as sim:
    @sim.every(steps=50)
    def act(sim):
        k = sim.step // 50
        rng = np.random.default_rng(k)
        free = sim.bodies.id[~sim.bodies.fixed]
        names = [name for name in sim.walls if sim.walls[name].id.size and name not in sys.argv[6].split(",")]
        if k % 3 == 0:
            sim.bodies.apply_force(rng.choice(free, 4, replace=False), rng.normal(size=(4, 2)), rng.normal() * 1e-4)
        if k % 4 == 1:
            sim.gravity = rng.normal(size=2) + (0, -9)
        if k % 5 == 2:
            sim.drag = float(rng.uniform(0, 3))
        if k % 5 == 3:
            sim.friction_scale = float(rng.uniform(0, 2))
        if k % 6 == 4 and names:
            sim.walls[names[k % len(names)]].velocity = rng.normal(size=2) * 0.01
        if k % 7 == 5:
            sim.remove(rng.choice(free, 2, replace=False))
        if k % 7 == 6:
            sim.add([np.array([(0, 0), (0.004, 0), (0, 0.004)]) + (0.5 + 0.01 * k, 0.5)], velocity=(-0.1, 0),
                    material=next(iter(sim.settings.get("material", {})), ""))
        for load in sim.loads.values():
            if k % 8 == 7:
                load.force = -float(rng.uniform(50, 100))
        if k == 20:
            sim.end()
        if k == kill:
            os.kill(os.getpid(), signal.SIGKILL)
    sim.run()
    sim.save_actions(sys.argv[7])
    print(sim.state_hash)
"""


def run_script(scene, folder, path, *, mode="new", kill=0, threads=1, held=""):
    """Run the script above; its state hash, or None if it was killed."""
    words = [str(scene), str(folder or ""), mode, str(kill), str(threads), held, str(path)]
    done = subprocess.run([sys.executable, "-c", SCRIPT, *words], check=False, capture_output=True, text=True)
    assert done.returncode == (-signal.SIGKILL if kill else 0), done.stderr
    return done.stdout.strip() or None


@pytest.mark.parametrize(("name", "held"), [
    ("first", ""), ("gate", ""), ("biaxial", "right,top"), ("steady_hopper", ""), ("shaken_bed", ""),
    ("two_materials", ""), ("concave_grains", "")])
def test_the_program_repeats_a_script(tmp_path, name, held):
    scene = ROOT / "inputs" / f"{name}.nml"
    actions = tmp_path / "actions.txt"
    expected = run_script(scene, None, actions, held=held)
    assert len(actions.read_text(encoding="utf-8").splitlines()) > 20
    for k, finder in enumerate(("sort_and_sweep", "quadtree")):
        assert run_program(scene, actions, tmp_path / finder, "--threads", str(1 + 2 * k), "--set",
                           f"neighbours.finder={finder}") == expected
    energy = [Trajectory(tmp_path / finder).energy_balance for finder in ("sort_and_sweep", "quadtree")]
    assert all(np.array_equal(energy[0][key], energy[1][key]) for key in energy[0])


def test_a_killed_script_goes_on_and_can_be_repeated_to_its_last_action(tmp_path):
    scene = ROOT / "inputs/first.nml"
    expected = run_script(scene, tmp_path / "whole", tmp_path / "expected.txt")
    record = (tmp_path / "whole/actions.txt").read_text(encoding="utf-8")
    assert record.split("\n", 1)[1] == (tmp_path / "expected.txt").read_text(encoding="utf-8")
    for k, kill in enumerate((2, 7, 9, 13)):
        run_script(scene, tmp_path / "killed", tmp_path / "none", mode="resume" if k else "new", kill=kill)
        assert record.startswith((tmp_path / "killed/actions.txt").read_text(encoding="utf-8"))
    # The program repeats what is known of it.
    with polydem.Simulation(scene, exchange=True) as sim:
        subprocess.run([PROGRAM, "run", str(scene), "--actions", str(tmp_path / "killed/actions.txt"), "--set",
                        f"output.folder={tmp_path / 'part'}", "--set", f"integrate.duration={700 * sim.dt}", "--set",
                        f"integrate.dt={sim.dt!r}"], check=True, capture_output=True)
    assert run_script(scene, tmp_path / "killed", tmp_path / "found.txt", mode="resume", threads=2) == expected
    assert (tmp_path / "killed/actions.txt").read_text(encoding="utf-8") == record
    checked = subprocess.run([PROGRAM, "info", "--check", str(tmp_path / "killed")], check=True, capture_output=True,
                             text=True)
    assert "intact" in checked.stdout


@pytest.mark.parametrize("kill", [False, True])
def test_a_run_with_a_file_of_actions_goes_on_after_a_kill(tmp_path, kill):
    scene, actions = ROOT / "inputs/first.nml", tmp_path / "actions.txt"
    expected = run_script(scene, None, actions)
    command = [PROGRAM, "run", str(scene), "--set", f"output.folder={tmp_path / 'r'}", "--set", "checkpoint.steps=100",
               "--set", "checkpoint.wall_interval=0", "--threads", "1"]
    run = subprocess.Popen([*command, "--actions", str(actions)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while run.poll() is None and not list((tmp_path / "r").glob("checkpoint_2.h5")):
        pass
    run.send_signal(signal.SIGKILL if kill else signal.SIGTERM)
    run.wait()
    subprocess.run([*command, "--continue"], check=True, capture_output=True)
    assert Trajectory(tmp_path / "r").state_hash == expected
    repeated = [*command, "--continue", "--actions", str(actions)]
    assert "nothing to do" in subprocess.run(repeated, check=True, capture_output=True, text=True).stdout
    lines = actions.read_text(encoding="utf-8").splitlines(keepends=True)
    for n, wrong in ((len(lines), lines[:-1]), (len(lines) + 1, [*lines, "1000 drag 1\n"]),
                     (1, ["0 drag 1\n", *lines])):
        actions.write_text("".join(wrong), encoding="utf-8")
        refused = subprocess.run(repeated, check=False, capture_output=True, text=True)
        assert refused.returncode == 2
        assert f"{actions}: differs in action {n} from {tmp_path / 'r'}/actions.txt" in refused.stderr
    (tmp_path / "r" / "actions.txt").unlink()
    assert "began without actions" in subprocess.run(repeated, check=False, capture_output=True, text=True).stderr


def test_a_run_that_is_killed_before_its_first_checkpoint_keeps_its_actions(tmp_path):
    scene, actions = ROOT / "inputs/first.nml", tmp_path / "actions.txt"
    expected = run_script(scene, None, actions)
    command = [PROGRAM, "run", str(scene), "--set", f"output.folder={tmp_path / 'r'}", "--threads", "1"]
    run = subprocess.Popen([*command, "--actions", str(actions)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while run.poll() is None and not list((tmp_path / "r").glob("trajectory_*")):
        pass
    run.kill()
    run.wait()
    assert not list((tmp_path / "r").glob("checkpoint_*"))
    record = tmp_path / "r" / "actions.txt"
    record.rename(f"{record}.unfinished")
    lost = subprocess.run([*command, "--continue"], check=False, capture_output=True, text=True)
    assert lost.returncode == 2 and "give them again with --actions" in lost.stderr
    Path(f"{record}.unfinished").rename(record)
    subprocess.run([*command, "--continue"], check=True, capture_output=True)
    assert Trajectory(tmp_path / "r").state_hash == expected


def test_a_state_has_its_actions():
    with polydem.Simulation(ROOT / "inputs/first.nml") as sim:
        sim.gravity = (0, -5)
        sim.run(100)
        sim.bodies.apply_force([20], (1, 1))
        state, copy = sim.snapshot(), sim.copy()
        sim.run(100)
        sim.drag = 3.0
        sim.run(100)
        sim.restore(state)
        assert len(sim.actions) == 2
        sim.run(200)
        copy.run(200)
        assert copy.state_hash == sim.state_hash
        assert copy.actions == sim.actions
        copy.close()


# --- what is refused --------------------------------------------------------------------------------------------------

BAD = [
    (lambda s: setattr(s.walls["floor"], "velocity", (1,)), "2 numbers"),
    (lambda s: setattr(s.walls["floor"], "velocity", (1, np.nan)), "not finite"),
    (lambda s: s.walls["floor"].move(spin=np.inf), "not finite"),
    (lambda s: s._handle.act("wall_velocity", "flor", values=[0] * 5), "no wall \"flor\"; did you mean 'floor'"),
    (lambda s: s._handle.act("wall_velocity", values=[0] * 5), "name of the wall is missing"),
    (lambda s: s._handle.act("load", "press", values=[1]), "has no loads"),
    (lambda s: s._handle.act("gravity", "floor", values=[1, 2]), "has no name"),
    (lambda s: s._handle.act("gravity", bodies=[1], values=[1, 2]), "not allowed"),
    (lambda s: s._handle.act("gravity", values=[1]), "1 values, not 2"),
    (lambda s: s._handle.act("gravitate", values=[1]), "no action \"gravitate\"; did you mean 'gravity'"),
    (lambda s: setattr(s, "gravity", (1, 2, 3)), "2 numbers"),
    (lambda s: setattr(s, "drag", -1.0), "must be >= 0, not -1"),
    (lambda s: setattr(s, "drag", 1e9), "more than a tenth"),
    (lambda s: setattr(s, "friction_scale", -1.0), "must be >= 0, not -1"),
    (lambda s: s.bodies.apply_force([99], (1, 0)), "no body 99"),
    (lambda s: s.bodies.apply_force([3], (1, 0)), "body 3 is fixed"),
    (lambda s: s.bodies.apply_force([1, 1], (1, 0)), "body 1 is given twice"),
    (lambda s: s.bodies.apply_force([1], (np.nan, 0)), "not finite"),
    (lambda s: s.bodies.apply_force([1, 2], [(1, 0)] * 3), "force is"),
    (lambda s: s.bodies.apply_force([-3], (1, 0)), "identifier"),
    (lambda s: s.end_stage(), "no stages"),
    (lambda s: s.add([SQUARE * 0 + (1, 1)]), "body"),
    (lambda s: s.add([SQUARE[[0, 2, 1, 3]] + (1, 1)]), "convex|itself|cross"),
    (lambda s: s.add([SQUARE[:2]]), "three corners"),
    (lambda s: s.add([[1, 2, 3]]), "are a list"),
    (lambda s: s.add([square(0, -0.61)]), "overlaps the body 3 of the wall floor"),
    (lambda s: s.add([square(1, 1), square(1.005, 1)]), "overlaps body"),
    (lambda s: s.add([square(1, 1)], material="glass"), "no material \"glass\""),
    (lambda s: s.add([square(1, 1)], density=-1), "must be >= 0, not -1"),
    (lambda s: s.add([square(np.nan, 1)]), "not finite"),
    (lambda s: s.remove([4]), "body 4 is fixed"),
    (lambda s: s.remove([77]), "no body 77"),
    (lambda s: s.walls["roof"], "no wall 'roof'; there are floor, lid"),
    (lambda s: s.loads["press"], "no load 'press'"),
    (lambda s: s.energy["kinetik"], "no term of the balance 'kinetik'; there are kinetic"),
    (lambda s: s.add([square(1, 1)], material=1), "a material is a name"),
]


@pytest.mark.parametrize("k", range(len(BAD)))
def test_a_wrong_action_is_an_exception_before_anything_changes(k):
    act, message = BAD[k]
    with polydem.Simulation(FREE, exchange=True) as sim, polydem.Simulation(FREE, exchange=True) as other:
        sim.run(3)
        with pytest.raises(polydem.InputError, match=message):
            act(sim)
        assert sim.actions == []
        sim.run(20)
        other.run(23)
        assert sim.state_hash == other.state_hash


def test_a_slip_of_the_pen_is_an_error(free):
    for thing, name in ((free, "fricton_scale"), (free.walls["floor"], "velocty"), (free.bodies, "colour")):
        with pytest.raises(AttributeError, match=f"no attribute {name}"):
            setattr(thing, name, 1)
    for thing, name in ((free, "time"), (free.bodies, "position"), (free.walls["floor"], "force")):
        with pytest.raises(AttributeError, match="read, but not set"):
            setattr(thing, name, 1)


def test_an_observer_may_act_after_the_last_step():
    with polydem.Simulation(FREE, {"integrate.duration": 0.01}) as sim:
        @sim.every(steps=20)
        def act(sim):
            sim.gravity = (0, -1)

        sim.run()
        assert sim.is_over
        assert [line.split()[0] for line in sim.actions] == ["20", "40", "60", "80"]


def test_bodies_do_not_leave_unless_the_run_expects_it(free):
    for act in (lambda: free.remove([1]), lambda: free.add([square(1, 1)])):
        with pytest.raises(polydem.InputError, match="exchange=True"):
            act()


def test_what_is_no_communicator_is_refused():
    with pytest.raises(polydem.InputError, match="intracommunicator of mpi4py"):
        polydem.Simulation(FREE, comm=4)
    with pytest.raises(polydem.InputError, match="libpolydem_mpi"):
        library.call("new_simulation_on_ranks", 0, b"none", None, 0, None, None, 0, 1)


def test_a_gate_that_opens_when_bodies_leave_closes_the_balance():
    def wall(low, high, **more):
        return {"outline": "rectangle", "low": low, "high": high, **more}

    residuals = []
    for vanish in (0.2, 0.1999):
        groups = {"wall": {"floor": wall((-0.2, -0.02), (0.2, 0.0)), "left": wall((-0.05, 0.0), (-0.03, 0.05)),
                           "gate": wall((0.03, 0.0), (0.05, 0.05), vanish_at=vanish)},
                  "grains": {"few": {"region": "box", "low": (-0.03, 0.001), "high": (0.03, 0.05), "number": 16}},
                  "sink": {"out": {"low": (-0.03, 0.0), "high": (0.03, 0.012), "interval": 10000}},
                  "integrate": {"duration": 0.3, "dt": 2e-5}}
        with polydem.Simulation(groups) as sim:
            sim.run(until=0.1998)
            before = sim.energy["energy_residual"], len(sim.bodies)
            sim.run(until=0.2002)
            residuals.append(sim.energy["energy_residual"] - before[0])
            assert len(sim.bodies) < before[1] - 5
    assert residuals[0] == pytest.approx(residuals[1], abs=1e-8)


@pytest.mark.parametrize(("lines", "message"), [
    ("gravity 0 1", ":1: the line begins with \"gravity\""),
    ("5 gravity 0", ":1: gravity: it has 1 values, not 2"),
    ("# text\n\n5 gravity 0 x", ":3: gravity: \"x\" is in no number"),
    ("5 gravity 0 1\n4 drag 1", ":2: step 4 follows step 5"),
    ("5 fly 1", "no action \"fly\""),
    ("5 force 2 20", "fewer than 2 identifiers"),
    ("5 force two 20", "no number of bodies"),
    ("5 force 1 1.5 0 0 0", "a number is wrong"),
    ("5 wall_velocity lid 0 0 0 0 0", "action 1, after step 5 (wall_velocity lid): there is no wall \"lid\""),
    ("5 force 1 9999 0 0 0", "there is no body 9999"),
    ("5 drag 1\n6 remove 1 251", "action 2, after step 6 (remove): the body 251 is fixed"),
])
def test_a_file_of_actions_with_an_error_names_it(tmp_path, lines, message):
    path = tmp_path / "actions.txt"
    path.write_text(lines + "\n", encoding="utf-8")
    done = subprocess.run([PROGRAM, "run", str(ROOT / "inputs/first.nml"), "--actions", str(path), "--set",
                           f"output.folder={tmp_path / 'r'}"], check=False, capture_output=True, text=True)
    assert done.returncode in (1, 2)
    assert message in done.stderr
    assert str(path) in done.stderr


def test_a_line_that_was_not_completed_is_no_action(tmp_path):
    path = tmp_path / "actions.txt"
    path.write_text("3 gravity 0 -1\n4 gravity 0 -", encoding="utf-8")
    run_program(ROOT / "inputs/first.nml", path, tmp_path / "r", "--set", "integrate.duration=0.001")
    assert len((tmp_path / "r/actions.txt").read_text(encoding="utf-8").splitlines()) == 2
