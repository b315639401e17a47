"""What `check` and `run` say about danger: nothing about scenes of inputs, and all about scenes that are dangerous.

usage: check_initial_warnings.py PROGRAM INPUTS

Each dangerous scene is one of inputs with a mistake in it. `check` ends with code 0 unless a run would stop at once,
and a run that goes on ends with the number of its warnings.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

#: Scenes whose warnings are true: bars that lie across each other, without forces, and grains as soft as a liquid, both
#: for finders alone
TRUE_WARNINGS = {
    "rods.nml": ["deep contacts at the start: ", "the area law is not conservative", "overlap by", "is inside body"],
    "soft.nml": ["deep contacts at the start: ", "is so fast", "overlap by", "is inside body"],
}
#: Scene, mistake, part of the warning, exit code of `check`
DANGERS = (
    ("stack", ("integrate.safety_factor=258", "integrate.duration=10"), "is 2.58E+02 times the stable time step", 1),
    ("bed", ("integrate.safety_factor=258", "integrate.duration=10"), "is 2.58E+02 times the stable time step", 0),
    ("bed", ("scene.short_axis=8", "scene.long_axis=8, 11"), "lengths are in metres", 0),
    ("gas", ("scene.overlap=.true.", "scene.solid_fraction=0.9"), "deep contacts at the start: ", 0),
    ("gas", ("scene.speed=500",), "it may pass through other bodies undetected", 1),
    ("incline", ("scene.slope=1.047",), "'slope' in &scene is 1.047 degree; usual is >= 1.6: in radian?", 0),
    ("bed", ("forces.friction_coefficient=30",), "an angle of friction in degree?", 0),
    ("bed", ("forces.gravity=0,9.81",), "that of the Earth is 0, -9.81", 0),
    ("drum", ("motion.turn.rate=30",), "in revolutions per minute, or in rad/s?", 0),
    ("shaken_bed", ("motion.shake.amplitude=0,5",), "is 5.0 m; usual is >= -0.3, <= 0.3: in mm?", 0),
    ("biaxial", ("stage.shear.above=20",), "'above' in &stage shear is 20.0; usual is <= 3: in %?", 0),
    ("biaxial", ("load.press.stress=-2",), "is -2.0 N/m2; usual is <= -50 or >= 50: in kPa?", 0),
    ("gas", ("forces.law=area", "forces.damping=none"), "the area law is not conservative", 0),
)

#: Scenes that run, or that stop at their first step, with the exit code and the message of `check` and `run`
WALLS = """\
&wall name = 'floor' outline = 'rectangle' low = -0.1, -0.02 high = 0.1, 0 /
&wall name = 'lid' outline = 'rectangle' low = -0.1, 0.04 high = 0.1, 0.05 /
&grains name = 'g' region = 'box' low = -0.05, 0.001 high = 0.05, 0.03 number = 3 /
"""
FIRST_STEPS = {
    "fine": (WALLS + "&load name = 'press' wall = 'lid' direction = 'y' force = -50 mass = 1 /\n", 0, ""),
    "load": (WALLS + "&load name = 'press' wall = 'lid' direction = 'y' force = -1e8 mass = 0.01 /\n", 1,
             "check the motion of the wall, or sign and unit of the load on it"),
    "gravity": (WALLS + "&forces gravity = 0, -1e8 /\n", 1, "no point of it may move more than"),
    "empty": ("&source name = 's' low = 0, 0 high = 0.1, 0.1 rate = 1e4 interval = 10 /\n", 0, ""),
}


def checked(program, path, *settings):
    """Exit code of `check`, its warnings and its message."""
    command = [program, "check", str(path)] + [word for each in settings for word in ("--set", each)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    for line in ("extent     x ", "sizes      ", "thinnest   body ", "masses     ", "speeds     ", "frames     "):
        assert done.returncode == 2 or f"\n{line}" in done.stdout, (path.name, line, done.stdout)
    told = re.findall(r"^warning: (.*)$", done.stdout, re.MULTILINE)
    # The last line is the answer; there is none where a run would stop at once.
    answer = re.match(r"answer     this scene can run: (at most )?\d+ steps? of \d+ free bod(y|ies), (.*)$",
                      (done.stdout.splitlines() or [""])[-1])
    counted = f"{len(told)} warning{'s' * (len(told) != 1)} above" if told else "no warnings"
    assert (answer[3] == counted) if done.returncode == 0 else not answer, (path.name, done.stdout)
    return done.returncode, told, done.stderr


def main():
    program, inputs = sys.argv[1], Path(sys.argv[2])
    scenes = [path for path in sorted(inputs.rglob("*.nml")) if "&scene" in path.read_text(encoding="utf-8")]
    assert len(scenes) >= 20, scenes
    n_checked = 0
    for path in scenes:
        code, told, message = checked(program, path)
        if code == 2:
            # A scene of bodies that another run or a program makes.
            assert re.search("(packing|bodies_file).*there is no such file", message), (path.name, message)
            continue
        expected = TRUE_WARNINGS.get(path.name, [])
        assert code == 0 and len(told) == len(expected), (path.name, code, told, message)
        assert all(part in line for part, line in zip(expected, told)), (path.name, told)
        n_checked += 1
    assert n_checked >= 16, n_checked
    for scene, settings, part, expected in DANGERS:
        code, told, message = checked(program, inputs / f"{scene}.nml", *settings)
        assert code == expected and any(part in line for line in told), (scene, settings, code, told, message)
    with tempfile.TemporaryDirectory() as work:
        for name, (text, code, part) in FIRST_STEPS.items():
            path = Path(work) / f"{name}.nml"
            path.write_text(text + "&integrate dt = 1e-5 duration = 1e-3 /\n", encoding="utf-8")
            done = [subprocess.run([program, verb, str(path), *more], capture_output=True, text=True, timeout=600,
                                   check=False) for verb, more in (("check", ()), ("run", (
                                       "--set", f"output.folder={work}/{name}")))]
            assert all(each.returncode == code and part in each.stderr for each in done), (name, done)
            assert not any("NaN" in each.stdout for each in done), (name, done)
        scene, settings, part, _ = DANGERS[-1]
        words = [*settings, "integrate.duration=1e-3", f"output.folder={work}/result"]
        command = [program, "run", str(inputs / f"{scene}.nml")] + [word for each in words for word in ("--set", each)]
        subprocess.run(command, capture_output=True, timeout=600, check=True)
        log = (Path(work) / "result" / "log.txt").read_text(encoding="utf-8")
        assert part in log and "\nwarnings: 1 about the initial state\nstate hash: " in log, log


if __name__ == "__main__":
    main()
