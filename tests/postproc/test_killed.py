"""Reading results of writers that were killed, or that are still writing."""

import random
import time
import warnings

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from polydem_post import NoManifest, Trajectory


def wait_for(writer, frame):
    """Wait until the writer has flushed a frame."""
    while int(writer.stdout.readline()) < frame:
        pass


def assert_good(run):
    """The frames are the first ones, whole and right."""
    assert_array_equal(run.steps, np.arange(1, len(run) + 1))
    for number in range(max(0, len(run) - 6), len(run)):
        step = number + 1
        assert_array_equal(run.frame(number).position, [[0, 0], [-step, 3], [step, 0.5]])
        assert_array_equal(run.contacts(number).area, step + np.arange(1, step % 3 + 1))
        assert_array_equal(run.walls(number).torque, [-step])
    assert_array_equal(run.energy_balance["kinetic"], 0.5 * np.arange(1, len(run) + 1))


@pytest.mark.parametrize("frames", [1, 2, 3, 4, 8, 9, 20])
def test_finds_all_flushed_frames_of_a_killed_run(start_writer, frames):
    folder, writer = start_writer(frames, 4)
    wait_for(writer, frames)
    writer.kill()
    writer.wait()
    n_closed = len(list(folder.glob("*.h5")))
    n_open = len(list(folder.glob("*.h5.open")))
    assert (n_closed, n_open) == (frames // 4, 1 if frames % 4 else 0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", NoManifest)
        run = Trajectory(folder)
    assert len(run) == frames
    assert_good(run)


def test_reads_while_the_run_goes_on(start_writer):
    folder, writer = start_writer(6, 4)
    wait_for(writer, 6)
    assert writer.poll() is None
    run = Trajectory(folder)
    assert len(run) == 6
    assert_good(run)


@pytest.mark.parametrize("seed", range(8))
def test_keeps_closed_segments_whenever_a_run_is_killed(start_writer, seed):
    moment = random.Random(seed)
    folder, writer = start_writer(1000000, 5)
    wait_for(writer, moment.randint(1, 40))
    time.sleep(moment.uniform(0.0, 0.02))
    writer.kill()
    flushed = [int(line) for line in writer.communicate()[0].split()]
    n_closed = len(list(folder.glob("*.h5")))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warnings.simplefilter("ignore", NoManifest)
        run = Trajectory(folder)
    assert len(run) >= 5 * n_closed
    if flushed and not caught:
        assert len(run) >= flushed[-1]
    assert_good(run)


def test_leaves_out_an_unreadable_open_segment_with_a_warning(start_writer):
    folder, writer = start_writer(6, 4)
    wait_for(writer, 6)
    writer.kill()
    writer.wait()
    spoilt = folder / "trajectory_0002.h5.open"
    spoilt.write_bytes(spoilt.read_bytes()[:3000])
    with pytest.warns(UserWarning, match="left out: .*trajectory_0002.h5.open: cannot be read .*; a run may be "
                      "writing this file: try again"):
        run = Trajectory(folder)
    assert len(run) == 4
    assert_good(run)
