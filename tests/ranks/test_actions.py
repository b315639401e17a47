"""Actions on several processes: the bits of one process, also after an interruption."""

import random
import signal
import time
from pathlib import Path

import pytest
from runs import complaints, contents, differences, frames, interrupt, newest, run, start, state_hash

INPUTS = Path(__file__).parents[2] / "inputs"
#: Scene: first and last of some grains, walls that may move, load, material, first and last step
SCENES = {
    "first": (1, 250, ("floor", "left", "right"), None, "-", 20, 1200),
    "biaxial": (1, 400, ("left", "bottom"), "press", "smooth", 20, 800),
    "steady_hopper": (5, 40, (), None, "-", 1020, 2000),
}


def actions(name):
    """Lines of actions of all kinds, every 40 steps."""
    low, high, walls, load, material, begin, end = SCENES[name]
    draw = random.Random(name)
    there = list(range(low, high + 1))
    lines = []

    def number(scale):
        return repr(draw.uniform(-scale, scale))

    for k, step in enumerate(range(begin, end, 40)):
        ids = sorted(draw.sample(there, 6))
        if k % 3 == 0:
            forces = " ".join(f"{number(0.5)} {number(0.5)} {number(1e-4)}" for _ in ids)
            lines.append(f"{step} force 6 {' '.join(map(str, ids))} {forces}")
        if k % 5 == 1:
            lines.append(f"{step} gravity {number(2)} {draw.uniform(-12, -8)!r}")
        if k % 5 == 2:
            lines.append(f"{step} drag {draw.uniform(0, 3)!r}")
        if k % 5 == 3:
            lines.append(f"{step} friction {draw.uniform(0, 2)!r}")
        if k % 4 == 1 and walls:
            lines.append(f"{step} wall_velocity {draw.choice(walls)} {number(0.02)} {number(0.02)} {number(0.05)} 0 0")
        if k % 6 == 4 and load:
            lines.append(f"{step} load {load} {draw.uniform(-900, -700)!r}")
        if k % 4 == 2:
            gone = there.pop(draw.randrange(len(there)))
            lines.append(f"{step} remove 1 {gone}")
        if k % 4 == 3:
            x = 0.6 + 0.01 * k
            lines.append(f"{step} add {material} 2 3 4 0 -1 0 5 {x} 0.5 {x + 0.004} 0.5 {x} 0.504 "
                         f"0 1 1 {x} 0.52 {x + 0.004} 0.52 {x + 0.004} 0.524 {x} 0.524")
    return [*lines, f"{end} end_run"]


@pytest.fixture(params=SCENES)
def scene(request, tmp_path):
    """A scene with its file of actions, and what one process makes of it."""
    name = request.param
    path = tmp_path / "actions.txt"
    path.write_text("\n".join(actions(name)) + "\n", encoding="utf-8")
    options = ("--set", "output.contacts=T", "--set", "checkpoint.steps=100", "--set", "checkpoint.wall_interval=0")
    output, _ = run(INPUTS / f"{name}.nml", tmp_path / "serial", options=(*options, "--actions", str(path)))
    return name, path, options, output


def test_actions_have_the_bits_of_one_process(scene, tmp_path):
    name, path, options, expected = scene
    for ranks, threads in ((2, 2), (3, 1), (4, 1)):
        folder = tmp_path / str(ranks)
        output, message = run(INPUTS / f"{name}.nml", folder, ranks, threads, (*options, "--actions", str(path)))
        assert complaints(message) == []
        assert state_hash(output) == state_hash(expected)
        assert differences(contents(tmp_path / "serial"), contents(folder)) == []


def begin(folder, namelist, ranks, options):
    """Begin a run, and end it by a signal after its first checkpoint."""
    process = start(namelist, folder, ranks, options=options)
    while newest(folder) == 0 and process.poll() is None:
        time.sleep(0.002)
    process.send_signal(signal.SIGUSR1)
    _, message = process.communicate(timeout=600)
    assert process.returncode == 75, message


def test_actions_go_on_with_other_ranks(scene, tmp_path):
    name, path, options, expected = scene
    folder, namelist = tmp_path / "interrupted", INPUTS / f"{name}.nml"
    begin(folder, namelist, 2, (*options, "--actions", str(path)))
    interrupt(folder, namelist, 3, options=options)
    output, _ = run(namelist, folder, None, 2, (*options, "--continue"))
    assert state_hash(output) == state_hash(expected)
    assert differences(frames(tmp_path / "serial"), frames(folder)) == []
