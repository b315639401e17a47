"""Reading a large result takes little memory: frames one at a time, checksums in pieces."""

import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
from polydem_post.base.result_file import SCHEMA_VERSION
from test_manifest import closed_row, write_manifest

#: Bodies, contacts and frames of a segment, and segments; POLYDEM_SEGMENTS=220 makes the 1 GB of the manual
BODIES, CONTACTS, FRAMES = 20000, 40000, 1
SEGMENTS = int(os.environ.get("POLYDEM_SEGMENTS", "32"))

#: Memory that reading may take beyond what the imports take [MiB]
MOST = 150

READER = """
import sys
from pathlib import Path
from polydem_post import Trajectory
peak = lambda: int(Path("/proc/self/status").read_text().split("VmHWM:")[1].split()[0]) / 1024
before = peak()
run = Trajectory(sys.argv[1])
total = 0.0
for frame in run:
    total += frame.position.sum() + len(frame.contacts) + frame.vertex.sum()
print(len(run), peak() - before, peak())
"""


def write_segment(path, number):
    random = np.random.default_rng(number)
    corners = 4
    with h5py.File(path, "w") as file:
        file.attrs["schema_version"] = SCHEMA_VERSION
        file["bodies/id"] = np.arange(1, BODIES + 1)
        file["bodies/fixed"] = np.zeros(BODIES, dtype=np.int8)
        file["bodies/mass"] = file["bodies/inertia"] = np.ones(BODIES)
        file["bodies/vertex_start"] = corners * np.arange(BODIES + 1)
        file["bodies/vertex"] = np.tile([(-1.0, -1), (1, -1), (1, 1), (-1, 1)], (BODIES, 1))
        file["frames/step"] = number * FRAMES + np.arange(FRAMES)
        file["frames/time"] = (number * FRAMES + np.arange(FRAMES)) * 0.1
        file["frames/start"] = BODIES * np.arange(FRAMES + 1)
        for name, shape in (("position", (2,)), ("angle", ()), ("velocity", (2,)), ("angular_velocity", ())):
            file[f"frames/{name}"] = random.random((FRAMES * BODIES, *shape))
        rows = FRAMES * CONTACTS
        file["contacts/start"] = CONTACTS * np.arange(FRAMES + 1)
        file["contacts/first"] = np.ones(rows, dtype=np.int32)
        file["contacts/second"] = random.integers(2, BODIES, rows).astype(np.int32)
        for name in ("area", "length", "couple"):
            file[f"contacts/{name}"] = random.random(rows)
        for name in ("point", "normal", "force"):
            file[f"contacts/{name}"] = random.random((rows, 2))


def write_result(folder):
    """A result with a manifest; return its size [MB]."""
    folder.mkdir()
    rows, total = [], 0
    for number in range(SEGMENTS):
        path = folder / f"trajectory_{number + 1:04d}.h5"
        write_segment(path, number)
        first = number * FRAMES
        rows.append(closed_row(path, FRAMES, first, first + FRAMES - 1))
        total += path.stat().st_size
    write_manifest(folder, rows)
    return total / 1e6


def test_memory_does_not_grow_with_the_result(tmp_path):
    size = write_result(tmp_path / "result")
    assert size > 4.5 * SEGMENTS
    environment = {**os.environ, "PYTHONPATH": str(Path(os.environ["POLYDEM_SOURCE_DIR"]) / "postproc" / "src")}
    done = subprocess.run([sys.executable, "-W", "error", "-c", READER, str(tmp_path / "result")], env=environment,
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    frames, grown, peak = map(float, done.stdout.split())
    print(f"{size:.0f} MB in {frames:.0f} frames: {grown:.0f} MiB more, {peak:.0f} MiB at most")
    assert frames == SEGMENTS * FRAMES
    assert grown < MOST
