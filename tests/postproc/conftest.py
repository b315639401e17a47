"""Results that the Fortran program write_sample writes."""

import os
import subprocess

import pytest

WRITE_SAMPLE = os.environ["POLYDEM_WRITE_SAMPLE"]


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
                                     "&neighbours\n finder = 'quadtree'\n/\n"
                                     "&integrate\n duration = 0.2\n/\n"
                                     "&output\n frame_interval = 0.02\n contacts = .true.\n/\n", encoding="utf-8")
    subprocess.run([os.environ["POLYDEM_PROGRAM"], "run", "drum.nml"], cwd=folder, check=True,
                   stdout=subprocess.DEVNULL)
    return folder / "results" / "drum"


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
