"""Results of a writer that ran out of room."""

import errno
import os
import resource
import shutil
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from conftest import WRITE_SAMPLE
from numpy.testing import assert_array_equal
from polydem_post import NoManifest, Trajectory

#: Library that makes calls of the system fail; not in builds with sanitizers
FAILING = next(Path(WRITE_SAMPLE).parents[1].glob("run/*failing_calls*.so"), None)


def write_without_room(folder, name, *words):
    """Call WRITE_SAMPLE where there is no room from the first call on that writes to a file of this name."""
    if FAILING is None:
        pytest.skip("this build has no library that makes calls fail")
    log = folder.parent / "calls"
    call = [WRITE_SAMPLE, str(folder), *words]
    environment = os.environ | {"LD_PRELOAD": str(FAILING), "POLYDEM_FAIL_FOLDER": str(folder)}
    subprocess.run(call, env=environment | {"POLYDEM_FAIL_LOG": str(log)}, check=True)
    first = next(line.split()[0] for line in log.read_text(encoding="utf-8").splitlines() if line.endswith("/" + name))
    shutil.rmtree(folder)
    folder.mkdir()
    environment |= {"POLYDEM_FAIL_CALL": first, "POLYDEM_FAIL_HOW": "on", "POLYDEM_FAIL_ERROR": str(errno.ENOSPC)}
    return subprocess.run(call, env=environment, capture_output=True, text=True, check=False)


def test_a_failed_write_ends_with_one_message_and_keeps_closed_segments(tmp_path):
    folder = tmp_path / "result"
    folder.mkdir()
    end = write_without_room(folder, "trajectory_0003.h5.open", "20", "4", "end")
    assert end.returncode == 3
    lines = end.stderr.splitlines()
    assert len(lines) == 1
    assert "trajectory_0003.h5.open: cannot be created: No space left on device" in lines[0]
    run = Trajectory(folder)
    assert_array_equal(run.steps, [1, 2, 3, 4, 5, 6, 7, 8])
    assert_array_equal(run.frame(7).position, [[0, 0], [-8, 3], [8, 0.5]])


def test_a_failed_profile_leaves_no_part_of_it(tmp_path):
    folder = tmp_path / "result"
    folder.mkdir()
    end = write_without_room(folder, "profile.h5.unfinished", "5", "4", "end")
    assert end.returncode == 3
    assert "profile.h5.unfinished: cannot be " in end.stderr
    assert sorted(path.name for path in folder.iterdir()) == ["trajectory_0001.h5", "trajectory_0002.h5"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", NoManifest)
        assert len(Trajectory(folder)) == 5


@pytest.mark.parametrize("verb, name", [
    (["plot", "--dpi", "600"], "a.png"), (["movie", "--size", "640,480"], "a.mp4"),
    (["movie", "--size", "640,480"], "a.gif"), (["view"], "a.html"), (["export", "--to", "csv"], "a.csv"),
    (["export", "--to", "vtkhdf"], "a.vtkhdf"), (["export", "--to", "vtp"], "a.pvd"),
    (["export", "--to", "xdmf"], "a.xdmf"), (["export", "--to", "gsd"], "a.gsd")])
def test_a_verb_without_room_leaves_nothing_but_a_sentence(small_drum, tmp_path, verb, name):
    def small_files():
        resource.setrlimit(resource.RLIMIT_FSIZE, (8000, 8000))

    call = [sys.executable, "-m", "polydem_post", verb[0], str(small_drum), *verb[1:], "-o", str(tmp_path / name)]
    done = subprocess.run(call, preexec_fn=small_files, capture_output=True, text=True, check=False)
    assert done.returncode == 3, done.stderr
    assert done.stderr.startswith(f"error: {tmp_path / name}: cannot be written (")
    assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_an_output_that_takes_no_more_is_named(finished):
    with open("/dev/full", "w", encoding="utf-8") as full:
        end = subprocess.run([sys.executable, "-m", "polydem_post", "table", str(finished)], stdout=full, check=False,
                             stderr=subprocess.PIPE, text=True)
    assert end.returncode == 3
    assert end.stderr.endswith("\nerror: standard output: cannot be written (No space left on device)\n")
