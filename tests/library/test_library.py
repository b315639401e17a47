"""The shared library and the package `polydem`: the bits of the program, whoever looks; states; what is refused."""

import os
import re
import subprocess
import sys
import threading
import time
from pathlib import Path

import h5py
import numpy as np
import polydem
import pytest
from polydem import library
from polydem_post import Trajectory

ROOT = Path(os.environ["POLYDEM_SOURCE_DIR"])
PROGRAM = os.environ["POLYDEM_PROGRAM"]
EXAMPLES = os.environ["POLYDEM_EXAMPLES"].split(",")
#: Scenes that have between them all that a state may contain, with their overrides; each has contacts at the end
SCENES = {
    "heap": ("first", {}),
    "conservative": ("first", {"forces.law": "conservative", "forces.rolling_friction": 0.1, "forces.cohesion": 2e4}),
    "exact": ("first", {"forces.law": "area", "forces.friction": "exact", "output.energy_balance": False}),
    "gear": ("first", {"forces.law": "area", "integrate.scheme": "gear"}),
    "compensated": ("first", {"integrate.accumulation": "compensated"}),
    "gate": ("gate", {}),
    "loads": ("biaxial", {}),
    "cell": ("cell", {}),
    "sheared": ("plane_shear", {}),
    "sources": ("steady_hopper", {}),
    "pieces": ("concave_grains", {}),
    "shaken": ("shaken_bed", {}),
    "materials": ("two_materials", {}),
    "stages": ("shear_cell", {}),
}
STEPS = 400


def simulation(name, **options):
    """A simulation of a scene."""
    scene, overrides = SCENES[name]
    return polydem.Simulation(ROOT / "inputs" / f"{scene}.nml", overrides, **options)


def words(overrides):
    """Overrides of the command line."""
    return [word for entry, value in overrides.items() for word in ("--set", polydem.namelist.override(entry, value))]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The end of a short heap that the program has run: folder and overrides."""
    folder = tmp_path_factory.mktemp("whole") / "result"
    overrides = {"integrate.duration": 0.05, "output.contacts": True, "output.frame_interval": 0.01,
                 "output.series_interval": 0.002}
    subprocess.run([PROGRAM, "run", str(ROOT / "inputs/first.nml"), "--threads", "1", *words(overrides), "--set",
                    f"output.folder={folder}"], check=True, capture_output=True)
    return folder, overrides


def columns_of(folder):
    """All data sets of the frames of a result but those of its origin."""
    found = {}
    for path in sorted(Path(folder).glob("trajectory_*.h5")):
        with h5py.File(path, "r") as file:
            file.visititems(lambda name, entry, path=path: found.update({f"{path.name}/{name}": entry[()]})
                            if isinstance(entry, h5py.Dataset) and not name.startswith("provenance") else None)
    return found


@pytest.mark.parametrize("observers", (0, 1, 7))
@pytest.mark.parametrize("threads", (1, 3))
def test_observing_changes_nothing(whole, observers, threads):
    folder, overrides = whole
    with polydem.Simulation(ROOT / "inputs/first.nml", overrides, threads=threads) as sim:
        seen = []
        for k in range(observers):
            @sim.every(steps=37 + k)
            def look(sim):
                frame = sim.frame()
                seen.append((sim.energy["kinetic"], len(frame.contacts), frame.walls.force.sum(), sim.series))
        sim.run()
        assert sim.is_over
        assert sim.state_hash == Trajectory(folder).state_hash
        assert len(seen) == sum(sim.n_steps // (37 + k) for k in range(observers))


def test_a_folder_has_the_result_of_the_program(whole, tmp_path):
    folder, overrides = whole
    with polydem.Simulation(ROOT / "inputs/first.nml", overrides, folder=tmp_path / "result") as sim:
        sim.run(100)
        sim.run()
    expected, found = columns_of(folder), columns_of(tmp_path / "result")
    assert expected.keys() == found.keys()
    for name in expected:
        assert expected[name].tobytes() == found[name].tobytes(), name
    assert Trajectory(tmp_path / "result").status == "finished"


def test_a_frame_is_that_of_the_result(whole):
    folder, overrides = whole
    with polydem.Simulation(ROOT / "inputs/first.nml", overrides) as sim:
        for stored in Trajectory(folder):
            sim.run(until=stored.time)
            live = sim.frame()
            assert live.step == stored.step
            for name in ("id", "fixed", "position", "angle", "velocity", "angular_velocity", "shape", "vertex_start",
                         "mass", "inertia"):
                assert np.array_equal(getattr(live, name), getattr(stored, name)), name
            for name in ("first", "second", "area", "point", "normal", "length", "force", "couple"):
                assert np.array_equal(getattr(live.contacts, name), getattr(stored.contacts, name)), name
            assert np.array_equal(live.walls.force, stored.walls.force)
        series = Trajectory(folder).time_series
        assert all(np.array_equal(sim.series[name], series[name], equal_nan=True) for name in series)


def test_a_simulation_that_is_closed_early_is_interrupted_and_resumed(whole, tmp_path):
    _, overrides = whole
    path = tmp_path / "result"
    with polydem.Simulation(ROOT / "inputs/first.nml", overrides, folder=path) as sim:
        sim.run(777)
    assert "interrupted by the host at step 777" in Trajectory(path).status
    with polydem.Simulation(ROOT / "inputs/first.nml", overrides, folder=path, resume=True) as sim:
        assert sim.step == 777
        sim.run()
        assert sim.state_hash == Trajectory(whole[0]).state_hash
    assert Trajectory(path).status == "finished"


@pytest.mark.parametrize("name", SCENES)
def test_a_state_goes_on_to_the_same_bits(name):
    threads = 1 + list(SCENES).index(name) % 4
    with simulation(name, threads=threads) as sim, simulation(name) as other:
        sim.run(STEPS)
        state = sim.snapshot()
        copy = sim.copy()
        sim.run(STEPS)
        expected = sim.state_hash
        energy = sim.energy
        sim.restore(state)
        assert sim.step == STEPS
        sim.run(STEPS)
        assert sim.state_hash == expected
        assert sim.energy == energy
        sim.restore(state)
        sim.restore(state)
        sim.run(STEPS)
        assert sim.state_hash == expected
        copy.run(STEPS)
        assert copy.state_hash == expected
        copy.close()
        other.run(2 * STEPS)
        assert other.state_hash == expected


def test_a_state_can_be_left_behind_without_growth():
    def memory():
        return int(re.search(r"VmRSS:\s+(\d+)", Path("/proc/self/status").read_text(encoding="utf-8"))[1])

    with simulation("heap") as sim:
        sim.run(100)
        for _ in range(50):
            sim.restore(sim.snapshot())
        before = memory()
        for _ in range(400):
            sim.restore(sim.snapshot())
            sim.copy().close()
        assert memory() - before < 3000


def test_several_simulations_in_turn_and_in_threads():
    with simulation("heap") as alone:
        alone.run(600)
        expected = alone.state_hash
    with simulation("heap") as one, simulation("cell") as two, simulation("heap") as three:
        for _ in range(6):
            one.run(100)
            two.run(50)
        worker = threading.Thread(target=three.run, args=(600,))
        worker.start()
        two.run(50)
        worker.join()
        assert one.state_hash == three.state_hash == expected


def test_time_and_steps(capfd):
    with simulation("heap") as sim:
        assert sim.run(10) == 10
        sim.run(duration=20 * sim.dt)
        assert sim.step == 30
        sim.run(until=50 * sim.dt)
        assert (sim.step, sim.time) == (50, 50 * sim.dt)
        assert sim.run(until=0.0) == 0

        @sim.every(steps=8)
        def watch(sim):
            if sim.step >= 64:
                sim.stop("enough")

        sim.run(1000)
        assert (sim.step, sim.stopped) == (64, "enough")
        sim.run(3)
        assert (sim.step, sim.stopped) == (67, None)
    assert capfd.readouterr() == ("", "")


def test_an_exception_and_ctrl_c_leave_a_good_state():
    with simulation("heap") as sim, simulation("heap") as other:
        @sim.every(steps=50)
        def fail(sim):
            if sim.step == 100:
                raise ZeroDivisionError
            if sim.step == 150:
                raise KeyboardInterrupt

        with pytest.raises(ZeroDivisionError):
            sim.run(1000)
        with pytest.raises(KeyboardInterrupt):
            sim.run(1000)
        assert sim.step == 150
        sim.run(50)
        other.run(200)
        assert sim.state_hash == other.state_hash


def test_a_guard_is_an_exception_after_which_one_may_look():
    with polydem.Simulation(ROOT / "inputs/first.nml", {"forces.gravity": (0.0, -1e6)}) as sim:
        with pytest.raises(polydem.RunError, match=r"step \d+"):
            sim.run()
        assert len(sim.bodies) == 253
        assert np.isfinite(sim.frame().position).all()
        with pytest.raises(polydem.RunError, match="has stopped"):
            sim.run()


def test_a_namelist_as_text_or_dictionary_is_that_of_a_file():
    text = (ROOT / "inputs/first.nml").read_text(encoding="utf-8")
    groups = {"wall": {"floor": {"outline": "rectangle", "low": (-0.1, -0.02), "high": (0.1, 0.0)}},
              "grains": {"few": {"region": "box", "low": (-0.05, 0.001), "high": (0.05, 0.05), "number": 5}},
              "integrate": {"duration": 0.01}}
    with polydem.Simulation(text) as sim, simulation("heap") as other:
        sim.run(50)
        other.run(50)
        assert sim.state_hash == other.state_hash
    with polydem.Simulation(groups) as sim:
        assert len(sim.bodies) == 6
        assert list(sim.walls) == ["floor"]
        assert sim.settings.wall.floor.outline == "rectangle"
    with pytest.raises(polydem.InputError, match=r"dictionary:\d+: .*must be"):
        polydem.Simulation({"scene": {"name": "heap", "bodies": -3}})


def test_misuse_is_an_exception(tmp_path):
    with pytest.raises(polydem.InputError, match="nowhere.nml"):
        polydem.Simulation("nowhere.nml")
    with pytest.raises(polydem.FileError, match="nowhere"):
        polydem.Simulation(ROOT / "inputs/first.nml", folder="/proc/nowhere")
    for bad in ({"steps": 1, "until": 2.0}, {"steps": -1}, {"steps": 1.5}, {"until": float("nan")}):
        with simulation("heap") as sim, pytest.raises(polydem.InputError):
            sim.run(**bad)
    with simulation("heap") as sim, simulation("cell") as other:
        for name in ("bodies/colour", "contacts/", "planets/mass", "", "x"):
            with pytest.raises(polydem.InputError, match="there is no"):
                sim._handle.array(name)
        with pytest.raises(AttributeError):
            sim.bodies.colour  # noqa: B018
        with pytest.raises(polydem.InputError, match="other settings"):
            sim.restore(other.snapshot())
        with pytest.raises(polydem.InputError, match="interval"):
            sim.every(steps=0)
        frame = sim.frame()
        sim.run(1)
        with pytest.raises(Exception, match="gone on"):
            frame.contacts  # noqa: B018
    for use in (lambda: sim.time, lambda: sim.run(1), lambda: sim.snapshot(), lambda: sim.bodies.id):
        with pytest.raises(polydem.InputError, match="closed"):
            use()
    sim.close()
    with polydem.Simulation(ROOT / "inputs/first.nml", folder=tmp_path / "r") as sim:
        with pytest.raises(polydem.InputError, match="without a folder"):
            sim.restore(sim.snapshot())
        with pytest.raises(polydem.InputError, match="already holds a result|is in use|locked|running"):
            polydem.Simulation(ROOT / "inputs/first.nml", folder=tmp_path / "r")


def test_two_threads_cannot_use_one_simulation():
    refused = []

    def insist(use):
        while True:
            try:
                return use()
            except polydem.InputError as error:
                refused.append(str(error))
                time.sleep(1e-3)

    with simulation("sheared") as sim:
        worker = threading.Thread(target=insist, args=(lambda: library.call("advance", sim._handle.open, 3000, 0.0),))
        worker.start()
        while worker.is_alive():
            insist(lambda: sim._handle.integer("step"))
        worker.join()
        assert refused
        assert all("another thread uses" in text for text in refused)
        assert sim.step == 3000


def test_a_fork_is_refused():
    with simulation("heap") as sim:
        sim.run(1)
        child = os.fork()
        if child == 0:
            try:
                sim.run(1)
            except polydem.InputError as error:
                os._exit(0 if "forked" in str(error) else 1)
            os._exit(2)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
        sim.run(1)


def test_examples_in_c_and_fortran():
    with simulation("heap") as sim:
        sim.run(500)
        expected, highest = sim.state_hash, sim.bodies.position[:, 1].max()
    said = [subprocess.run([path, str(ROOT / "inputs/first.nml"), "500"], check=True, capture_output=True,
                           text=True).stdout.split() for path in EXAMPLES]
    assert said[0][1:] == ["500", f"{highest:.17g}", expected]
    assert said[1] == ["500", expected]
    failed = subprocess.run([EXAMPLES[0], "nowhere.nml", "1"], check=False, capture_output=True, text=True)
    assert failed.returncode == 2
    assert "nowhere.nml" in failed.stderr


def test_symbols_header_and_python_name_the_same_functions():
    header = (ROOT / "src/library/polydem.h").read_text(encoding="utf-8")
    declared = set(re.findall(r"\bpolydem_(\w+)\(", header))
    shown = subprocess.run(["nm", "-D", "--defined-only", os.environ["POLYDEM_LIBRARY"]], check=True,
                           capture_output=True, text=True).stdout
    assert {line.split()[-1] for line in shown.splitlines()} == {f"polydem_{name}" for name in declared}
    assert declared == {*library.WITH_ERROR, *library.WITHOUT_ERROR}
    assert len(declared) <= 40


def test_a_notebook_draws_a_simulation():
    with simulation("heap") as sim:
        sim.run(100)
        assert sim._repr_png_() == sim.frame()._repr_png_() != b""


def test_a_finished_run_goes_on_only_if_it_shall_be_longer(tmp_path):
    script = """if True:
        import sys, polydem
        for steps, resume in (100, False), (100, True), (150, True):
            settings = {"integrate.dt": 1e-5, "integrate.duration": steps * 1e-5}
            try:
                with polydem.Simulation(sys.argv[1], settings, folder=sys.argv[2], resume=resume) as sim:
                    sim.run()
                    print(sim.step)
            except polydem.InputError as error:
                print(error)
    """
    done = subprocess.run([sys.executable, "-c", script, str(ROOT / "inputs/first.nml"), str(tmp_path / "result")],
                          check=True, capture_output=True, text=True)
    assert done.stdout.splitlines() == ["100", f"{tmp_path / 'result'}: the run is finished; resume it with a longer "
                                        "integrate.duration, or read its result", "150"]


def test_another_library_is_refused():
    path = next(line.split()[-1] for line in Path("/proc/self/maps").read_text(encoding="utf-8").splitlines()
                if "/libc.so" in line)
    done = subprocess.run([sys.executable, "-c", "import polydem; polydem.version()"], check=False, capture_output=True,
                          text=True, env={**os.environ, "POLYDEM_LIBRARY": path})
    assert f"PolydemError: {path} has no function polydem_" in done.stderr
