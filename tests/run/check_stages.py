"""Runs in stages: they equal runs that start from each other, and any restart, number of threads and ranks.

usage: check_stages.py PROGRAM

The Python of .venv runs it if that of the command lacks h5py.
"""

import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from check_continue import BAD_INPUT, FAILED

try:
    import h5py
except ImportError:
    PYTHON = Path(__file__).resolve().parents[2]/".venv"/"bin"/"python"
    if Path(sys.executable) == PYTHON or not PYTHON.exists():
        sys.exit(f"{sys.executable} lacks h5py; ./polydem test makes an environment that has it")
    os.execv(PYTHON, [str(PYTHON), *sys.argv])

#: An mpirun that ends with its ranks
MPIRUN = (os.path.join(os.path.dirname(__file__), "..", "..", "src", "packaging", "watch_ranks"), "mpirun",
          "--oversubscribe", "--allow-run-as-root")

#: A box with grains and a lid; the step is a power of two, so that times of a stage are exact differences
SCENE = """\
&wall name = 'floor' outline = 'rectangle' low = -0.1, -0.02 high = 0.1, 0 /
&wall name = 'left' outline = 'rectangle' low = -0.07, 0 high = -0.05, 0.3 /
&wall name = 'right' outline = 'rectangle' low = 0.05, 0 high = 0.07, 0.3 /
&wall name = 'lid' outline = 'rectangle' low = -0.049, 0.1 high = 0.049, 0.11 /
&grains name = 'sand' region = 'box' low = -0.05, 0 high = 0.05, 0.1 number = 60 arrangement = 'spread' speed = 0.5
   seed = {seed} /
&forces stiffness = 2e5 friction_coefficient = 0.5 /
"""
#: The same walls in a scene that starts from a result
FOUND = "".join(f"&wall name = '{name}' outline = 'result' /\n" for name in ("floor", "left", "right", "lid"))
#: Grains in a cell
GAS = ("&grains name = 'gas' region = 'box' low = 0, 0 high = 0.1, 0.1 number = 60 arrangement = 'spread' "
       "speed = 0.5 /\n")
OUTPUT = """\
&integrate dt = 3.0517578125e-5 {duration} {scheme} /
&output frame_interval = 1e-3 frames_per_segment = 5 contacts = .true. /
"""
#: Groups of each stage of 256 steps
STAGES = (
    "&stage name = 'fall' duration = 7.8125e-3 gravity = 0, -60 friction_scale = 0 /\n",
    "&stage name = 'press' duration = 7.8125e-3 gravity = 20, -60 /\n"
    "&motion name = 'down' wall = 'lid' kind = 'translation' velocity = 0, -2 ramp = 2e-3 stage = 'press' /\n",
    "&stage name = 'shake' duration = 7.8125e-3 gravity = 0, 0 friction_scale = 2 /\n"
    "&motion name = 'shift' wall = 'lid' kind = 'oscillation' amplitude = 2e-3, 1e-3 frequency = 200\n"
    "   stage = 'shake' /\n"
    "&motion name = 'tilt' wall = 'floor' kind = 'rotation' rate = 0.5 stage = 'shake' /\n",
)
#: Stages that conditions end
CONDITIONS = """\
&stage name = 'fall' until = 'kinetic' below = 6e-3 hold = 2e-3 longest = 1 check = 7 gravity = 0, -60
   friction_scale = 0 /
&stage name = 'press' until = 'strain' wall = 'lid' opposite = 'floor' above = 0.1 longest = 1 check = 10 /
&motion name = 'down' wall = 'lid' kind = 'translation' velocity = 0, -2 ramp = 2e-3 stage = 'press' /
&stage name = 'count' until = 'count' low = -0.05, 0 high = 0.05, 0.02 above = 9 longest = 1 check = 3
   gravity = 0, -99 /
&stage name = 'fill' until = 'solid_fraction' low = -0.05, 0 high = 0.05, 0.05 above = 0.5 longest = 1 /
&stage name = 'rest' until = 'unbalanced' below = 0.3 longest = 1 drag = 20 check = 25 /
"""
SEVERAL = ("--set", "checkpoint.steps=50")


class Case:
    """The programs, and how to start them."""

    def __init__(self, program):
        self.program = program
        self.parallel = os.environ.get("POLYDEM_MPI_PROGRAM")
        #: Lets ranks sleep while they wait
        self.patience = os.path.join(os.path.dirname(program), "..", "..", "tests", "ranks", "libpatient_ranks.so")

    def run(self, text, folder, *options, ranks=None, threads=1, code=0):
        """Run a namelist; return the output, or the message if the run is to fail."""
        process = self.start(text, folder, *options, ranks=ranks, threads=threads)
        output, message = process.communicate()
        assert process.returncode == code, (process.returncode, message, output[-2000:])
        return message if code else output

    def start(self, text, folder, *options, ranks=None, threads=1):
        with open(f"{folder}.nml", "w", encoding="utf-8") as file:
            file.write(text)
        command = [*MPIRUN, "-n", str(ranks), self.parallel] if ranks else [self.program]
        command += ["run", f"{folder}.nml", "--threads", str(threads), "--set", f"output.folder={folder}", *options]
        environment = {**os.environ, "OMP_WAIT_POLICY": "passive"}
        if ranks and os.path.exists(self.patience):
            environment["LD_PRELOAD"] = self.patience
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL,
                                text=True, env=environment)


def hash_of(output):
    return re.search(r"^state hash: (\S+)", output, re.MULTILINE).group(1)


def starts_of(output):
    """Names of the stages, and the steps at which they began."""
    return re.findall(r"^stage      (\w+), \d of \d, from step (\d+)", output, re.MULTILINE)


def whole(stages, scheme="", seed=1):
    return SCENE.format(seed=seed) + "".join(stages) + OUTPUT.format(duration="", scheme=scheme)


def stages_are_runs_that_start_from_each_other(case):
    """Finds contact history, accelerations or poses that a start from a result loses, and stages that shift motions."""
    for k, scheme in enumerate(("", "scheme = 'gear'", "accumulation = 'compensated'")):
        one = case.run(whole(STAGES, scheme), f"one_{k}")
        assert starts_of(one) == [("fall", "0"), ("press", "256"), ("shake", "512")], one
        case.run(whole(STAGES[:1], scheme), f"chain_{k}_0")
        for number in (1, 2):
            scene = f"&scene name = 'result' start_from = 'chain_{k}_{number - 1}' /\n" + FOUND
            output = case.run(scene + "&forces stiffness = 2e5 friction_coefficient = 0.5 /\n" + STAGES[number]
                              + OUTPUT.format(duration="", scheme=scheme), f"chain_{k}_{number}")
            assert "step 256, with contact history" in output, output
        assert hash_of(output) == hash_of(one), scheme
        if case.parallel:
            output = case.run(scene + "&forces stiffness = 2e5 friction_coefficient = 0.5 /\n" + STAGES[2]
                              + OUTPUT.format(duration="", scheme=scheme), f"ranks_{k}", ranks=3)
            assert hash_of(output) == hash_of(one), scheme
        # Its energy closes although gravity changes.
        residual = float(re.search(r"energy (\S+) of the largest", one).group(1))
        momentum = float(re.search(r"momentum (\S+),", one).group(1))
        assert residual < 0.03 and (momentum < 1e-12 or "gear" in scheme), one


def a_frame_is_a_start_without_history(case):
    case.run(whole(STAGES), "film")
    scene = "&scene name = 'result' start_from = 'film:{frame}' /\n" + FOUND
    rest = "&forces stiffness = 2e5 /\n" + OUTPUT.format(duration="duration = 1e-3", scheme="")
    output = case.run(scene.format(frame=12) + rest, "from_frame")
    assert "from frame 12 of film" in output and "contact history and accelerations begin anew" in output, output
    output = case.run(scene.format(frame=-1) + rest, "from_last_frame")
    assert "from the last frame of film, at " in output, output
    message = case.run(scene.format(frame=999) + rest, "no_frame", code=BAD_INPUT)
    assert "no_frame.nml:1: 'start_from' in &scene: film has no frame 999" in message, message


def a_stress_controlled_cell_keeps_its_size(case):
    """Finds a start with bodies that a cell of another size brings back over each other."""
    cell = "&cell periodic = 'xy' size = {size} {entries} /\n"
    rest = "&forces gravity = 0, 0 stiffness = 2e5 /\n" + OUTPUT.format(duration="duration = 0.015625", scheme="")
    entries = "stress_controlled = 'xy' stress = 2e4, 1e4 mass = 0.02"
    case.run(cell.format(size="0.1, 0.1", entries=entries) + GAS + rest, "pressed")
    for folder, origin in (("smaller", "pressed"), ("as_frame", "pressed:9")):
        scene = f"&scene name = 'result' start_from = '{origin}' /\n"
        message = case.run(cell.format(size="0.1, 0.1", entries="") + scene + rest, "as_before", code=BAD_INPUT)
        assert "as_before.nml:1: 'size' in &cell: the cell of" in message, message
        size = re.search(r"size = (\S+, \S+)", message).group(1)
        assert all(0.02 < float(side) < 0.099 for side in size.split(", ")), message
        output = case.run(cell.format(size=size, entries="") + scene + rest, folder)
        deepest = re.search(r"the deepest (\S+) of", output)
        assert deepest is None or float(deepest.group(1)) < 0.05, output


def walls_do_not_jump_when_motions_change(case):
    """Finds a scene that counts as another one since a wall has another speed, and walls that go on from elsewhere."""
    for kind in ("conveyor", "translation"):
        motion = f"&motion name = 'run' wall = 'floor' kind = '{kind}' velocity = 0, -0.1 {{}} /\n"
        rest = motion + OUTPUT.format(duration="duration = {}", scheme="")
        scene = SCENE.format(seed=1)
        case.run(scene + rest.format("", "7.8125e-3"), kind)
        shutil.copytree(kind, f"{kind}_on")
        faster = rest.format("", "0.015625").replace("-0.1", "-0.3")
        if kind == "conveyor":
            case.run(scene + faster, kind, "--continue", "--changed")
            continue
        message = case.run(scene + faster, kind, "--continue", "--changed", code=BAD_INPUT)
        assert "would move body 61, of a wall, at once by 1.56E-03 m" in message, message
        more = "&motion name = 'on' wall = 'floor' kind = 'translation' velocity = 0, -0.3 start = 7.8125e-3 /\n"
        case.run(scene + more + rest.format("end = 7.8125e-3", "0.015625"), f"{kind}_on", "--continue", "--changed")


def walls_that_have_vanished_stay_away(case):
    """Finds a start that brings the bodies of such a wall back, or gives a body the state or the springs of another.

    Grains enter after the floor, which vanishes, so that they have other places among all bodies then.
    """
    text = SCENE.format(seed=1).replace("high = 0.1, 0 /", "high = 0.1, 0 vanish_at = {} /")
    text += "&source name = 'rain' low = -0.049, 0.12 high = 0.049, 0.2 count = 80 interval = 20 velocity = 0, -2 /\n"
    rest = OUTPUT.format(duration="duration = {}", scheme="{}")
    start = FOUND.replace("&wall name = 'floor' outline = 'result' /\n", "")
    start += "&forces stiffness = 2e5 friction_coefficient = 0.5 /\n&scene name = 'result' start_from = '{}' /\n"
    half, whole = 15.625e-3, 31.25e-3
    for scheme in ("scheme = 'gear'", "accumulation = 'compensated'", ""):
        case.run(text.format(half / 2) + rest.format(half, scheme), "gone", "--force")
        case.run(text.format(half / 2) + rest.format(whole, scheme), "through", "--force")
        with h5py.File("gone/checkpoint_1.h5") as file:
            assert any(file["pairs/tangential"][()])
        expected = last_poses("through")
        for ranks in (None, 2)[:2 if case.parallel else 1]:
            output = case.run(start.format("gone") + rest.format(half, scheme), "away", "--force",
                              **({"ranks": ranks} if ranks else {}))
            assert re.search(r"^bodies +83 ", output, re.MULTILINE), output
            assert last_poses("away") == expected
    output = case.run(start.format("gone:-1") + rest.format(half, scheme), "away_from_frame")
    assert re.search(r"^bodies +83 ", output, re.MULTILINE), output
    case.run(text.format(1.0) + rest.format(half, scheme), "closed")
    output = case.run(start.format("closed") + rest.format(half, scheme), "open")
    assert re.search(r"^bodies +84 ", output, re.MULTILINE), output


def last_poses(folder):
    """Identifier -> pose and velocity of each free body of the last frame."""
    with h5py.File(max(Path(folder).glob("trajectory_*.h5"))) as file:
        frames, fixed = file["frames"], set(file["bodies/id"][()][file["bodies/fixed"][()] == 1])
        rows = slice(*frames["start"][-2:])
        # Only a run with sources says which bodies a frame has.
        names = frames["id"][rows] if "id" in frames else file["bodies/id"][()]
        columns = [frames[name][rows] for name in ("position", "angle", "velocity", "angular_velocity")]
        return {int(name): [column[k].tobytes() for column in columns]
                for k, name in enumerate(names) if name not in fixed}


def a_stage_that_ends_at_once_is_told(case):
    text = whole(["&stage name = 'early' until = 'kinetic' below = 1e9 longest = 1 {} /\n", STAGES[1]])
    for more, steps in (("", 101), ("hold = 3.0517578125e-3", 201), ("check = 7", 8)):
        output = case.run(text.format(more), "early", "--force")
        assert starts_of(output)[1] == ("press", str(steps)), output
        assert "warning: stage early ended at its first check" in output, output
    assert "stage fall ended at its first check" not in case.run(whole([CONDITIONS]), "late")


def a_sheared_cell_goes_on_where_it_was(case):
    """Finds a start whose copies above are not where those of the result were. All times and shifts are exact."""
    cell = "&cell periodic = 'xy' size = 0.125, 0.125 {shear} /\n"
    rest = "&forces gravity = 0, 0 stiffness = 2e5 /\n" + OUTPUT
    short, sheared = rest.format(duration="duration = 7.8125e-3", scheme=""), cell.format(shear="shear_rate = 96")
    begin = sheared + GAS.replace("high = 0.1, 0.1 number = 60", "high = 0.125, 0.125 number = 110")
    start = "&scene name = 'result' start_from = '{}' /\n"
    whole = case.run(begin + rest.format(duration="duration = 0.015625", scheme=""), "sheared")
    case.run(begin + short, "half")
    for how in ({}, {"ranks": 3})[:2 if case.parallel else 1]:
        assert hash_of(case.run(sheared + start.format("half") + short, "again", "--force", **how)) == hash_of(whole)
    killed = case.start(sheared + start.format("half") + short, "stopped", "--set", "checkpoint.steps=64")
    time.sleep(0.1)
    killed.kill()
    killed.communicate()
    assert hash_of(case.run(sheared + start.format("half") + short, "stopped", "--continue", "--set",
                            "checkpoint.steps=64")) == hash_of(whole)
    # Copies stay displaced when the shear ends, and a cell without shear can be sheared.
    depths = []
    for k, (origin, shear) in enumerate((("half", ""), ("half:7", ""), ("rests_0", "shear_rate = 96"))):
        output = case.run(cell.format(shear=shear) + start.format(origin) + short, f"rests_{k}")
        found = re.search(r"the deepest (\S+) m between", output)
        depths.append(float(found.group(1)) if found else 0.0)
    assert max(depths) < 2e-3, depths


def bodies_beyond_the_border_start_where_their_copies_are(case):
    """Finds bodies that lose shift and velocity of the border, a shear that is added twice, and lost crossings."""
    cell = "&cell periodic = 'xy' low = {low} size = 0.125, 0.125 {shear} /\n"
    shear = "shear_rate = 96 profile = .true."
    rest = "&forces gravity = 0, 0 stiffness = 2e5 /\n" + OUTPUT
    short = rest.format(duration="duration = 7.8125e-3", scheme="") + "&output series_interval = 1e-3 /\n"
    short = short.replace("/\n&output series", "series")
    gas = GAS.replace("high = 0.1, 0.1 number = 60", "high = 0.125, 0.125 number = 110").replace("0.5", "3")
    case.run(cell.format(low="0, 0", shear=shear) + gas + short, "first")
    start = "&scene name = 'result' start_from = '{}' /\n"
    # A border elsewhere puts many bodies into other copies, with the velocities that they have there.
    outputs = [case.run(cell.format(low=low, shear=shear) + start.format("first" + frame) + short, f"on_{k}")
               for k, (low, frame) in enumerate((("0, 0", ""), ("0.03125, 0.0625", ""), ("0, 0", ":-1"),
                                                 ("0.03125, 0.0625", ":-1")))]
    assert "bodies outside were moved into it" in outputs[1], outputs[1]
    for k in (0, 2):
        for frame in (0, -1):
            here, there = (last_bodies(f"on_{n}", frame) for n in (k, k + 1))
            # Relative to the shear all copies have the same velocity.
            one = here["velocity"][:, 0] - 96.0 * (here["position"][:, 1] - 0.0625)
            other = there["velocity"][:, 0] - 96.0 * (there["position"][:, 1] - 0.0625)
            assert abs(one - other).max() < 1e-5, (k, frame, abs(one - other).max())
            assert abs(here["velocity"][:, 1] - there["velocity"][:, 1]).max() < 1e-5, (k, frame)
            assert abs(here["path"] - there["path"]).max() < 1e-7 or frame != 0, (k, frame)
    before, after = last_bodies("first", -1), last_bodies("on_0", 0)
    assert abs(before["path"] - after["path"]).max() < 1e-12
    # The profile is added once, also to a sample that does not have it yet; after that it is there.
    case.run(cell.format(low="0, 0", shear="") + gas + short, "still")
    for k, origin in enumerate(("still", "still:-1")):
        case.run(cell.format(low="0, 0", shear=shear) + start.format(origin) + short, f"sheared_{k}")
        gain = last_bodies(f"sheared_{k}", 0)
        former = last_bodies("still", -1)
        assert abs(gain["velocity"][:, 0] - former["velocity"][:, 0]
                   - 96.0 * (gain["position"][:, 1] - 0.0625)).max() < 1e-12, origin
        moved = last_bodies(f"sheared_{k}", 1)["velocity"][:, 0] - gain["velocity"][:, 0]
        assert abs(moved).mean() < 1.0, origin
    # Gravity works along the whole path, which the first frame of a start has, too.
    fall = short.replace("gravity = 0, 0", "gravity = 40, 0")
    case.run(cell.format(low="0, 0", shear="") + gas + fall, "falls")
    output = case.run(cell.format(low="0, 0", shear="") + start.format("falls") + fall, "falls_on")
    assert float(re.search(r"energy (\S+) of the largest", output).group(1)) < 0.01, output


def last_bodies(folder, frame):
    """Positions, velocities and paths in a frame of a result of one or more segments."""
    files = sorted(name for name in os.listdir(folder) if re.fullmatch(r"trajectory_\d+\.h5", name))
    with h5py.File(os.path.join(folder, files[0 if frame >= 0 else -1])) as file:
        start = file["frames/start"][()]
        frame %= len(start) - 1
        rows = slice(start[frame], start[frame + 1])
        found = {name: file["frames"][name][rows] for name in ("position", "velocity")}
        path = found["position"] + file["frames/image"][rows] * file["cell/size"][:]
        if "shear_offset" in file["frames"]:
            path[:, 0] += file["frames/shear_offset"][rows]
    return {**found, "path": path}


def pieces_keep_their_history(case):
    """Finds bodies that lose their pieces in a start from a result, and sources that lose those of others."""
    cross = "shape = 'cross' width = 0.009 arm = 3e-3 angle = 0, 360"
    source = f"&source name = 'feed' low = -0.04, 0.12 high = 0.04, 0.2 count = 80 interval = 32 {cross} {{}} /\n"
    for k, more in enumerate(("", source)):
        scene = SCENE.format(seed=1).replace("arrangement = 'spread'", f"arrangement = 'random' {cross}")
        scene = scene.replace("high = 0.05, 0.1", "high = 0.05, 0.12").replace("low = -0.049, 0.1 high = 0.049, 0.11",
                                                                               "low = -0.049, 0.3 high = 0.049, 0.31")
        rest = OUTPUT.format(duration="", scheme="")
        second = "&stage name = 'press' duration = 7.8125e-3 gravity = 20, -60 /\n"
        one = case.run(scene + STAGES[0] + second + more.format("stage = 'press'") + rest, f"pieces_{k}")
        case.run(scene + STAGES[0] + rest, f"first_{k}")
        start = (f"&scene name = 'result' start_from = 'first_{k}' /\n" + FOUND
                 + "&forces stiffness = 2e5 friction_coefficient = 0.5 /\n" + second + more.format("") + rest)
        for how in ({}, {"ranks": 3})[:2 if case.parallel else 1]:
            assert hash_of(case.run(start, f"second_{k}", "--force", **how)) == hash_of(one), (k, how)


def conditions_end_stages_alike_everywhere(case, seeds=2):
    """Finds decisions that depend on ranks, threads, finders or restarts."""
    for seed in range(1, seeds + 1):
        text = whole([CONDITIONS], seed=seed)
        output = case.run(text, f"seed_{seed}")
        starts = starts_of(output)
        assert len(starts) == 5, output
        others = [{"threads": 2}, {"threads": 3}, *({"ranks": ranks} for ranks in (1, 2, 3) if case.parallel)]
        for k, how in enumerate(others):
            finder = "neighbours.finder=" + ("quadtree", "verlet")[k % 2]
            told = case.run(text, f"seed_{seed}_{k}", "--set", finder, **how)
            assert starts_of(told) == starts and hash_of(told) == hash_of(output), how


def a_run_goes_on_in_its_stage(case, kills=12):
    """Finds state of a stage that no checkpoint holds. The unit tests try the steps of a change one by one."""
    text = whole([CONDITIONS])
    expected = hash_of(case.run(text, "straight"))
    chance = random.Random(1)
    for _ in range(kills):
        process = case.start(text, "killed", "--continue", "--set", "checkpoint.steps=20",
                             threads=chance.choice((1, 2)))
        time.sleep(chance.uniform(0.02, 0.3))
        process.send_signal(chance.choice((signal.SIGKILL, signal.SIGTERM)))
        output, message = process.communicate()
        assert process.returncode in (0, 75, -signal.SIGKILL, -signal.SIGTERM), message
    output = case.run(text, "killed", "--continue")
    assert hash_of(output) == expected, output
    told = subprocess.run([case.program, "info", "--check", "killed"], capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stdout


def more_stages_make_a_finished_run_longer(case):
    one = hash_of(case.run(whole(STAGES), "three"))
    steady = "&motion name = 'steady' wall = 'right' kind = 'translation' velocity = 1e-3, 0 /\n"
    case.run(whole(STAGES[:2]), "grown")
    message = case.run(whole([*STAGES[:2], STAGES[2]]), "grown", "--continue", code=BAD_INPUT)
    assert "motion.shift.kind was not used" in message, message
    assert hash_of(case.run(whole(STAGES), "grown", "--continue", "--changed")) == one
    # A stage alone needs no --changed.
    last = "&stage name = 'still' duration = 1e-3 /\n"
    case.run(whole([*STAGES, last, steady]), "four")
    case.run(whole([*STAGES, steady]), "alone")
    output = case.run(whole([*STAGES, last, steady]), "alone", "--continue")
    assert "extended   stage.name was" in output, output
    assert hash_of(output) == hash_of(case.run(whole([*STAGES, last, steady]), "four", "--force"))


def a_stage_that_lasts_too_long_stops_the_run(case):
    text = whole(["&stage name = 'rest' until = 'kinetic' below = 1e-9 longest = {longest} {more} /\n"])
    short = text.format(longest="2e-3", more="")
    message = case.run(short, "stuck", code=FAILED)
    assert re.search("stuck.nml:8: stage rest has lasted 2.0.*s, but kinetic is [1-9].*, not below 1.000E-09", message)
    assert case.run(short, "stuck", "--continue", code=FAILED) == message
    case.run(text.format(longest="3e-3", more="check = 10"), "stuck", "--continue", "--changed", code=FAILED)
    output = case.run(text.format(longest="4e-3", more="at_limit = 'next'"), "stuck", "--continue", "--changed")
    assert hash_of(output) == hash_of(case.run(text.format(longest="4e-3", more="at_limit = 'next'"), "free"))


def faults_are_named(case):
    stage = "&stage name = 'one' {} /\n"
    case.run(whole(STAGES[:1]), "source")
    scene = "&scene name = 'result' start_from = '{}' /\n"
    rest = "&forces stiffness = 2e5 /\n" + OUTPUT.format(duration="duration = 1e-3", scheme="")
    for text, words in (
            (whole([stage.format("until = 'kinetic' longest = 1")]), "needs a limit: give 'below' or 'above'"),
            (whole([stage.format("until = 'kinetic' longest = 1 below = 1 above = 2")]), "give only one of them"),
            (whole([stage.format("")]), "'duration' in &stage is required with until = 'duration'"),
            (whole([stage.format("duration = 1 gravity = 1")]), "needs two numbers"),
            (whole([stage.format("duration = 1")]).replace("dt =", "duration = 1 dt ="),
             "cannot be combined with groups"),
            (whole([stage.format("until = 'count' longest = 1 above = 1 low = 0, 0 high = 0, 1")]),
             "must exceed 'low'"),
            (whole([stage.format("until = 'departed' longest = 1 above = 1")]), "needs a sink; add a group &sink"),
            (whole([stage.format("until = 'departed' longest = 1 below = 1")]), "which only grows; give 'above'"),
            (whole([stage.format("until = 'strain' longest = 1 above = 1 wall = 'lid' opposite = 'lid'")]),
             "must be another wall"),
            (whole([stage.format("duration = 1"), STAGES[1].replace("stage = 'press'", "stage = 'two'")]),
             "unknown stage 'two' in &motion"),
            (whole([stage.format("until = 'strain' longest = 1 above = 1 wall = 'lid' opposite = 'bar'")])
             + "&wall name = 'bar' outline = 'rectangle' low = -0.01, 0.1 high = 0.01, 0.11 /\n",
             "the centres of the walls lid and bar coincide"),
            (whole([]), "'duration' in &integrate is required"),
            (scene.format("nowhere") + rest, "'start_from' in &scene: 'nowhere' is no folder; give the folder of"),
            (scene.format("nowhere:3") + rest, "'nowhere' is no folder"),
            (scene.format(".") + rest, ". holds neither checkpoint nor frame"),
            (scene.format("source:-2") + rest, "there is no frame -2; frames count from 0, and -1 is the last one"),
            (scene.format("source:99999999999") + rest, "source has no frame 99999999999"),
            (scene.format("source") + "&wall name = 'lit' outline = 'result' /\n" + rest,
             "has no wall 'lit'; did you mean"),
            (scene.format("source") + "&forces friction = 'none' damping = 'none' /\n"
             + OUTPUT.format(duration="duration = 1e-3", scheme="scheme = 'gear'"), "start from a frame of it"),
            (scene.format("source") + "&grains name = 'more' region = 'at' at = 0, 1 /\n" + rest,
             "cannot be combined with name = 'result'"),
    ):
        message = case.run(text, "bad", code=BAD_INPUT)
        assert words in message and "bad.nml" in message, (words, message)


TESTS = (stages_are_runs_that_start_from_each_other, a_frame_is_a_start_without_history,
         a_stress_controlled_cell_keeps_its_size, a_sheared_cell_goes_on_where_it_was,
         bodies_beyond_the_border_start_where_their_copies_are, pieces_keep_their_history,
         a_stage_that_ends_at_once_is_told, walls_do_not_jump_when_motions_change, walls_that_have_vanished_stay_away,
         conditions_end_stages_alike_everywhere, a_run_goes_on_in_its_stage, more_stages_make_a_finished_run_longer,
         a_stage_that_lasts_too_long_stops_the_run, faults_are_named)


def main():
    program = os.path.abspath(sys.argv[1])
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        case = Case(program)
        for test in TESTS:
            began = time.monotonic()
            test(case)
            print(f"{test.__name__.replace('_', ' ')}: {time.monotonic() - began:.1f} s", flush=True)
            shutil.rmtree("results", ignore_errors=True)


if __name__ == "__main__":
    main()
