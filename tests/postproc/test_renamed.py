"""Segments that a run closes and renames while they are being read."""

import warnings
from pathlib import Path

import pytest
from numpy.testing import assert_array_equal
from polydem_post import NoManifest, Trajectory


@pytest.fixture
def growing(start_writer):
    """A result of a closed segment of 4 frames and an open one of 2."""
    folder, writer = start_writer(6, 4)
    while int(writer.stdout.readline()) < 6:
        pass
    warnings.simplefilter("error")
    warnings.simplefilter("ignore", NoManifest)
    return folder


def close_last(folder):
    """What a run does when its segment is full."""
    (folder / "trajectory_0002.h5.open").rename(folder / "trajectory_0002.h5")


def test_finds_a_segment_renamed_between_listing_and_opening(growing, monkeypatch):
    list_folder = Path.iterdir

    def list_and_rename(folder):
        paths = list(list_folder(folder))
        close_last(folder)
        return iter(paths)

    monkeypatch.setattr(Path, "iterdir", list_and_rename)
    run = Trajectory(growing)
    assert_array_equal(run.steps, [1, 2, 3, 4, 5, 6])
    assert run.frame(5).step == 6


def test_counts_a_segment_listed_under_both_names_once(growing, monkeypatch):
    list_folder = Path.iterdir
    both = [*list_folder(growing), growing / "trajectory_0002.h5"]
    close_last(growing)
    monkeypatch.setattr(Path, "iterdir", lambda folder: iter(both))
    assert_array_equal(Trajectory(growing).steps, [1, 2, 3, 4, 5, 6])


def test_reads_frames_of_a_segment_renamed_after_it_was_found(growing):
    run = Trajectory(growing)
    close_last(growing)
    assert_array_equal(run.frame(5).position, [[0, 0], [-6, 3], [6, 0.5]])
    assert_array_equal(run.walls(5).torque, [-6])
    assert_array_equal(run.energy_balance["momentum_x"], [-1, -2, -3, -4, -5, -6])
