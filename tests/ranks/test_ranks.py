"""Runs of several processes give what one process gives, in every bit."""

import re
import subprocess
from itertools import product
from pathlib import Path

import h5py
import numpy as np
import pytest
from conftest import Outcome
from polydem_post import Trajectory
from runs import (
    ENVIRONMENT,
    FINDERS,
    MPIRUN,
    PARALLEL,
    complaints,
    contents,
    count,
    differences,
    frames,
    interrupt,
    run,
    state_hash,
)
from scenes import SCENES, write_scene

RANKS = (1, 2, 3, 4, 7)
THREADS = (1, 2)
#: How often bodies are handed out anew at least; grains in a stack hardly move
LEAST_SETTLEMENTS = {"drum": 100, "gas": 100, "hopper": 100, "bed": 100, "parts": 100, "pieces": 100, "materials": 100,
                     "cell": 100, "shear": 100, "controlled": 100, "border": 50, "carried": 100, "chute": 100,
                     "stages": 30, "walls": 100, "flow": 50, "stack": 1}
#: Numbers of ranks that are tried unless all are
QUICK_RANKS = {"drum": (2, 4), "gas": (1, 3), "hopper": (2, 3), "bed": (4, 2), "parts": (1, 2),
               "pieces": (2, 7), "materials": (3, 4), "cell": (3, 1), "shear": (2, 3), "controlled": (3, 2),
               "border": (2, 3), "carried": (3, 2), "chute": (2, 3), "stages": (1, 2), "walls": (3, 4), "flow": (2, 3),
               "stack": (2, 7)}
#: What is tried unless all is: every scene on two numbers of ranks, every finder somewhere, few ranks with two threads
QUICK = [(scene, ranks, 1 + (ranks + k) % 2 if ranks < 4 else 1, FINDERS[(2 * k + n) % len(FINDERS)])
         for k, scene in enumerate(SCENES) for n, ranks in enumerate(QUICK_RANKS[scene])]
#: Runs that go on with other ranks, twice; some are tried unless all are
RESTARTS = (("drum", (3, 2, None)), ("gas", (None, 4, 3)), ("bed", (2, 7, 1)), ("chute", (1, 3, None)),
            ("shear", (2, None, 3)), ("controlled", (None, 2, 3)), ("walls", (2, 3, None)), ("flow", (3, None, 2)))
#: Scenes that are long enough for two interruptions
OF_MANY_STEPS = ("shear", "flow")


def pytest_generate_tests(metafunc):
    full = metafunc.config.getoption("full")
    if "restart" in metafunc.fixturenames:
        metafunc.parametrize("restart", RESTARTS if full else RESTARTS[::2], ids=lambda words: words[0])
    if "combination" in metafunc.fixturenames:
        combinations = list(product(SCENES, RANKS, THREADS, FINDERS)) if full else QUICK
        metafunc.parametrize("combination", combinations, ids=lambda words: "-".join(str(word) for word in words))


def test_the_result_has_the_same_bits(combination, expected, outcomes, tmp_path):
    scene, ranks, threads, finder = combination
    outcome = outcomes.setdefault((scene, ranks), Outcome())
    outcome.tried += 1
    write_scene(tmp_path / "scene.nml", scene, finder)
    output, message = run(tmp_path / "scene.nml", tmp_path / "result", ranks, threads)
    assert complaints(message) == []
    assert differences(expected(scene).contents, contents(tmp_path / "result")) == []
    assert state_hash(output) == expected(scene).hash
    for name in ("steps", "contacts"):
        assert count(output, name) == getattr(expected(scene), name), name
    outcome.equal += 1
    if ranks > 1:
        assert count(output, "redistributions") >= LEAST_SETTLEMENTS[scene], output
        outcome.migrations.append(count(output, "migrations"))


def test_equal_materials_have_the_bits_of_one_and_names_may_change_places(tmp_path):
    grains = ("&wall name = 'w' outline = 'ring' radius = 0.1 segments = 20 thickness = 0.01 {} /\n"
              "&grains name = 'a' region = 'inside' wall = 'w' number = 60 speed = 1 {} /\n"
              "&grains name = 'b' region = 'inside' wall = 'w' number = 60 speed = 1 {} /\n"
              "&forces stiffness = 2e5 /\n&integrate duration = 0.02 /\n")
    named = [f"material = '{name}'" for name in ("steel", "glass", "wood")]
    groups = {name: f"&material name = '{name}' {{}} /\n" for name in ("steel", "glass", "wood")}
    unlike = dict(zip(groups, ("stiffness = 1e6", "restitution = 0.9 density = 2000", "friction_coefficient = 0.7")))
    texts = {"none": grains.format("", "", ""),
             "equal": "".join(groups[name].format("") for name in groups) + grains.format(*named),
             "unlike": "".join(groups[name].format(unlike[name]) for name in groups) + grains.format(*named),
             "turned": "".join(groups[name].format(unlike[name]) for name in reversed(groups)) + grains.format(*named)}
    hashes = {}
    for name, text in texts.items():
        (tmp_path / f"{name}.nml").write_text(text, encoding="utf-8")
        hashes[name] = state_hash(run(tmp_path / f"{name}.nml", tmp_path / name)[0])
    assert hashes["equal"] == hashes["none"] != hashes["unlike"] == hashes["turned"]


#: Tables of three pieces that land on the one fixed body
TABLES = """\
&wall name = 'floor' outline = 'rectangle' low = -0.1, -0.02 high = 0.1, 0 /
&grains name = 'tables' region = 'box' low = -0.09, 1e-3 high = 0.09, 0.07 number = 10 velocity = 0.1, -0.5
   shape = 'outline' outline_corners = 4, 4, 4 outline_pieces = 3 angle = -8, 8
   outline = 0, 0, 3e-3, 0, 3e-3, 0.01, 0, 0.01, 7e-3, 0, 0.01, 0, 0.01, 0.01, 7e-3, 0.01,
             3e-3, 7e-3, 7e-3, 7e-3, 7e-3, 0.01, 3e-3, 0.01 /
&forces stiffness = 1e6 restitution = 0.3 /
&integrate dt = 1e-5 duration = 0.08 /
"""


def test_contacts_that_share_the_damping_of_one_floor_have_the_same_bits(tmp_path):
    (tmp_path / "scene.nml").write_text(TABLES, encoding="utf-8")
    one, _ = run(tmp_path / "scene.nml", tmp_path / "one")
    assert count(one, "contacts") > 1000
    for ranks in (2, 3):
        several, _ = run(tmp_path / "scene.nml", tmp_path / str(ranks), ranks)
        assert state_hash(several) == state_hash(one)


def write_comb(path, first):
    """Squares fall on a fixed comb of ten pieces whose teeth catch them; it is the first or the last body."""
    comb = [[(-0.1, -0.02), (0.1, -0.02), (0.1, 0.0), (-0.1, 0.0)]]
    comb += [[(x, 0.0), (x + 0.008, 0.0), (x + 0.004, 0.012)] for x in (0.02 * k - 0.094 for k in range(9))]
    squares = [[(x + a * i, y + a * j) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
               for k in range(45) for x, y, a in [(0.018 * (k % 9) - 0.07, 0.02 + 0.018 * (k // 9), 0.0085)]]
    bodies = [[square] for square in squares]
    bodies.insert(0 if first else len(bodies), comb)
    sizes = [sum(map(len, body)) for body in bodies]
    with h5py.File(path, "w") as file:
        file["vertex"] = [corner for body in bodies for piece in body for corner in piece]
        file["vertex_start"] = np.concatenate(([0], np.cumsum(sizes)))
        file["piece"] = [k for body in bodies for k, piece in enumerate(body) for _ in piece]
        file["fixed"] = [int(len(body) > 1) for body in bodies]


@pytest.mark.parametrize("first", [True, False], ids=("first", "last"))
def test_forces_on_a_concave_wall_are_summed_in_the_order_of_one_process(first, tmp_path):
    write_comb(tmp_path / "bodies.h5", first)
    (tmp_path / "scene.nml").write_text(
        f"&scene name = 'file' bodies_file = '{tmp_path}/bodies.h5' /\n"
        "&forces gravity = 3, -80 stiffness = 1e6 damping = 'hunt_crossley' damping_coefficient = 1 /\n"
        "&integrate duration = 0.02 /\n&output frame_interval = 1e-3 contacts = .true. /\n&checkpoint steps = 150 /\n",
        encoding="utf-8")
    run(tmp_path / "scene.nml", tmp_path / "one")
    expected = frames(tmp_path / "one")
    assert len(Trajectory(tmp_path / "one").contacts(-1)) > 50
    for ranks in (2, 3):
        run(tmp_path / "scene.nml", tmp_path / str(ranks), ranks)
        assert differences(expected, frames(tmp_path / str(ranks))) == []


#: Fast grains that fly through the areas of all ranks
FAST = """\
&scene name = 'gas' bodies = 60 solid_fraction = 0.2 speed = 1.75 spin = 175 seed = 641 /
&forces gravity = 0, 0 stiffness = 1.25e6 /
&integrate safety_factor = 0.2 duration = 0.043 /
&decomposition balance = 'off' /
&guards displacement = 'off' step = 'off' /
"""


@pytest.mark.parametrize("ranks", [3, 7])
def test_no_contact_is_missed_where_grains_fly_through_the_areas_of_all_ranks(ranks, tmp_path):
    (tmp_path / "scene.nml").write_text(FAST, encoding="utf-8")
    one, _ = run(tmp_path / "scene.nml", tmp_path / "one")
    for margin in ("1e-3", "4e-3"):
        override = ("--set", f"decomposition.margin={margin}")
        several, _ = run(tmp_path / "scene.nml", tmp_path / margin, ranks, 1, override)
        assert state_hash(several) == state_hash(one)
        assert count(several, "contacts") == count(one, "contacts")


@pytest.mark.parametrize("scene, midstep, row_bytes", [("drum", ".false.", 48), ("hopper", ".true.", 72)])
def test_what_ranks_tell_each_other_is_counted(scene, midstep, row_bytes, tmp_path):
    ranks = 3
    write_scene(tmp_path / "scene.nml", scene)
    # With such a margin every rank has all bodies, once and for all.
    overrides = ("--set", "decomposition.margin=100", "--set", f"forces.midstep_slip={midstep}")
    output, _ = run(tmp_path / "scene.nml", tmp_path / "result", ranks, 1, overrides)
    counts = {name: count(output, name) for name in (
        "steps", "redistributions", "migrations", "migrations at the start", "messages", "messages at the start",
        "bytes in messages", "bytes at the start", "rectangles")}
    steps = counts["steps"]
    ghosts = count(output, "halo bodies, summed over steps")
    bodies = ghosts // (2*steps)
    assert ghosts == 2*bodies*steps and bodies > 100
    assert counts["redistributions"] == 1 and counts["rectangles"] >= ranks
    assert 0 < counts["migrations"] == counts["migrations at the start"] < bodies
    assert count(output, "halo messages") == ranks*(ranks - 1)*steps
    assert count(output, "halo bytes") == row_bytes*2*bodies*steps
    assert counts["messages"] >= counts["messages at the start"] + count(output, "halo messages")
    assert counts["bytes in messages"] >= counts["bytes at the start"] + count(output, "halo bytes")
    names = ("bodies", "halo bodies", "messages", "bytes")
    most = {name: count(output, f"maximum per rank: {name}") for name in names}
    assert bodies <= ranks*most["bodies"] and most["bodies"] < bodies
    assert most["messages"] == (ranks - 1)*steps
    assert most["bytes"] == row_bytes*2*most["bodies"]*steps
    # The one that has fewest bodies of its own has most halo bodies.
    assert 2*bodies*steps <= ranks*most["halo bodies"] and most["halo bodies"] < bodies*steps


def test_bodies_leave_and_enter_alike_on_any_number_of_ranks():
    build = Path(PARALLEL).parents[2]
    subprocess.run(["cmake", "--build", build, "--target", "replaced_bodies"], check=True, stdout=subprocess.PIPE)
    told = {}
    for ranks in (1, 2, 3):
        done = subprocess.run([*MPIRUN, "-n", str(ranks), build / "tests/simulation/replaced_bodies"],
                              env=ENVIRONMENT, timeout=300, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              check=False)
        told[ranks] = (done.returncode, done.stderr, done.stdout)
    assert told[1][:2] == (0, "") and re.fullmatch("[0-9a-f]{16}\n", told[1][2]), told
    assert set(told.values()) == {told[1]}, told


def test_a_run_goes_on_with_another_number_of_ranks(restart, restarts, tmp_path):
    scene, ranks = restart
    write_scene(tmp_path / "scene.nml", scene, longer=1 if scene in OF_MANY_STEPS else 3)
    options = ("--set", "checkpoint.steps=100")
    whole, _ = run(tmp_path / "scene.nml", tmp_path / "whole", None, 1, options)
    folder = tmp_path / "result"
    steps = [interrupt(folder, tmp_path / "scene.nml", number, options=options)[0] for number in ranks[:2]]
    assert 0 < steps[0] < steps[1] < count(whole, "steps"), steps
    output, _ = run(tmp_path / "scene.nml", folder, ranks[2], 1, ("--continue", *options))
    assert f"step {steps[1]}\n" in output
    assert state_hash(output) == state_hash(whole)
    assert differences(frames(tmp_path / "whole"), frames(folder)) == []
    # No file keeps disk space that was reserved for the writes of several ranks.
    sizes = {path.name: (512*path.stat().st_blocks, path.stat().st_size) for path in folder.iterdir()}
    assert all(on_disk <= size + 65536 for on_disk, size in sizes.values()), sizes
    restarts.append((scene, ranks, steps))
