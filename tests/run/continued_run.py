"""A small run for the tests of checkpoints, which interrupt it in many ways."""

import os
import re
import subprocess

#: Bodies that overlap initially, between oscillating walls; frequent frames
SCENE = """\
&scene
   name = 'gas'
   bodies = 60
   solid_fraction = 0.8
   overlap = .true.
   speed = 0.5
   spin = 20
/
&motion name = 'shake' kind = 'oscillation' amplitude = 1e-3, 2e-3 frequency = 300 /
&forces stiffness = 1e6 /
&integrate dt = 1e-5 duration = 1.2e-2 /
&output frame_interval = 1.2e-4 frames_per_segment = 10 log_interval = 1e-3 contacts = .true. /
&checkpoint steps = 120 /
"""
#: Time between frames [s], of 12 steps; frames of the whole run of 1200 steps, with the first
INTERVAL, N_FRAMES = 1.2e-4, 101


def write_scene(path="scene.nml"):
    """Write the namelist of the scene into the working directory."""
    with open(path, "w", encoding="utf-8") as file:
        file.write(SCENE)


def start(program, folder, *options, before=None):
    """Start a run of the scene; its process first executes `before`."""
    command = [program, "run", "scene.nml", "--threads", "2", "--set", f"output.folder={folder}", *options]
    environment = {**os.environ, "OMP_WAIT_POLICY": "passive"}
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
                            preexec_fn=before)  # noqa: PLW1509


def run(program, folder, *options):
    """Run the scene to its end; return exit code, standard output and standard error."""
    process = start(program, folder, *options)
    output, message = process.communicate()
    return process.returncode, output, message


def totals_of(output):
    """Lines that must agree between equal runs: state hash, work, residuals, counts of pairs, contacts and warnings."""
    totals = re.findall(r"^(?:state hash|work |residuals|warnings: ).*$|^(?:steps|pairs|contacts)\b.* \d+  [a-z ]+$",
                        output, re.MULTILINE)
    assert len(totals) == 12, output
    return totals


def closed_segments(folder):
    """Contents of the closed segments, by name."""
    segments = {}
    for name in os.listdir(folder) if os.path.isdir(folder) else []:
        if re.fullmatch(r"trajectory_\d{4,}\.h5", name):
            with open(os.path.join(folder, name), "rb") as file:
                segments[name] = file.read()
    return segments


def frames_of(program, folder):
    """Numbers of frames, first and last times of the segments of a finished result."""
    told = subprocess.run([program, "info", folder], capture_output=True, text=True, check=True).stdout
    found = re.findall(r"frames +(\d+) of 64 bodies, from (\S+) s to (\S+) s", told)
    return [(int(n), float(first), float(last)) for n, first, last in found]


def summary_of(program, folder):
    """Summary of a result by `info`: the lines below its folder, by their first words."""
    told = subprocess.run([program, "info", folder], capture_output=True, text=True, check=True).stdout
    lines = re.match(rf"{re.escape(folder)}\n((?:   .*\n)+)", told)[1].splitlines()
    return {line[3:19].strip(): line[19:] for line in lines}


def assert_whole(program, folder):
    """Check that no frame is missing or doubled."""
    frames = frames_of(program, folder)
    assert sum(n for n, _, _ in frames) == N_FRAMES, frames
    for n, first, last in frames:
        assert abs(last - first - INTERVAL * (n - 1)) < 1e-9, (n, first, last)
    for (_, _, last), (_, first, _) in zip(frames, frames[1:]):
        assert abs(first - last - INTERVAL) < 1e-9, (last, first)
