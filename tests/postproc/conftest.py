"""Results that the Fortran program write_sample writes."""

import os
import subprocess
import sys

import pytest
from polydem_post import Trajectory
from polydem_post.export import FORMATS, export_result

WRITE_SAMPLE = os.environ["POLYDEM_WRITE_SAMPLE"]
PROGRAM = os.environ["POLYDEM_PROGRAM"]

#: Some grains fall on a floor; the first frame has no contacts
HEAP = """&scene
   name = 'heap'
   bodies = 40
/
&integrate
   duration = 0.3
/
&output
   frame_interval = 0.1
   contacts = .true.
/
"""


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """A finished result of 7 frames in segments of 3."""
    folder = tmp_path_factory.mktemp("finished") / "result"
    subprocess.run([WRITE_SAMPLE, str(folder), "7", "3", "end"], check=True)
    return folder


@pytest.fixture(scope="session")
def small_drum(tmp_path_factory):
    """A run of the program: 150 bodies that fall and settle in a drum, 11 frames with contacts."""
    folder = tmp_path_factory.mktemp("small_drum")
    (folder / "drum.nml").write_text("&scene\n name = 'drum'\n boxes = 150\n/\n"
                                     "&forces law = 'area' damping_coefficient = 0.0251 tilt_damping = 0 /\n"
                                     "&neighbours\n finder = 'quadtree'\n/\n"
                                     "&integrate\n duration = 0.2\n/\n"
                                     "&output\n frame_interval = 0.02\n contacts = .true.\n/\n", encoding="utf-8")
    # Threads of so few bodies wait for each other more than they work, and long on a busy machine.
    subprocess.run([os.environ["POLYDEM_PROGRAM"], "run", "--threads", "1", "drum.nml"], cwd=folder, check=True,
                   stdout=subprocess.DEVNULL)
    return folder / "results" / "drum"


@pytest.fixture(scope="session")
def heap_with_contacts(tmp_path_factory):
    """A run of the program with contacts."""
    folder = tmp_path_factory.mktemp("heap")
    (folder / "heap.nml").write_text(HEAP)
    subprocess.run([PROGRAM, "run", "heap.nml"], cwd=folder, check=True, capture_output=True)
    return Trajectory(folder / "results" / "heap")


@pytest.fixture(scope="session")
def exported(heap_with_contacts, tmp_path_factory):
    """That run in all formats but gsd, which needs a package."""
    folder = tmp_path_factory.mktemp("exported")
    for form, suffix in FORMATS.items():
        if form != "gsd":
            export_result(heap_with_contacts, form, folder / f"heap{suffix}")
    return folder


@pytest.fixture(scope="session")
def view(small_drum, tmp_path_factory):
    """The page of the viewer of this run."""
    path = tmp_path_factory.mktemp("view") / "view.html"
    command = [sys.executable, "-m", "polydem_post", "view", str(small_drum), "-o", str(path)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return path


@pytest.fixture
def start_writer(tmp_path):
    """Start a writer that prints the number of each frame it has flushed, and waits at its end."""
    writers = []

    def start(frames, per_segment):
        folder = tmp_path / f"result_{len(writers)}"
        command = [WRITE_SAMPLE, str(folder), str(frames), str(per_segment), "wait"]
        writer = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        writers.append(writer)
        return folder, writer

    yield start
    for writer in writers:
        writer.kill()
        writer.communicate()
