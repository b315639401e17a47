"""Results of a writer that ran out of room."""

import resource
import subprocess
import sys
import warnings

import pytest
from conftest import WRITE_SAMPLE
from numpy.testing import assert_array_equal
from polydem_post import NoManifest, Trajectory


def test_a_failed_write_ends_with_one_message_and_keeps_closed_segments(tmp_path):
    folder = tmp_path / "result"
    folder.mkdir()
    (folder / "trajectory_0003.h5.open").symlink_to("/dev/full")
    end = subprocess.run([WRITE_SAMPLE, str(folder), "20", "4", "end"], capture_output=True, text=True, check=False)
    assert end.returncode == 3
    lines = end.stderr.splitlines()
    assert len(lines) == 1
    assert "trajectory_0003.h5.open: cannot be created: No space left on device" in lines[0]
    with pytest.warns(UserWarning, match="left out: .*trajectory_0003.h5.open"):
        run = Trajectory(folder)
    assert_array_equal(run.steps, [1, 2, 3, 4, 5, 6, 7, 8])
    assert_array_equal(run.frame(7).position, [[0, 0], [-8, 3], [8, 0.5]])


def test_a_failed_profile_leaves_no_part_of_it(tmp_path):
    folder = tmp_path / "result"
    folder.mkdir()
    (folder / "profile.h5.unfinished").symlink_to("/dev/full")
    end = subprocess.run([WRITE_SAMPLE, str(folder), "5", "4", "end"], capture_output=True, text=True, check=False)
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
