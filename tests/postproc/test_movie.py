"""Films: read back, they have their frames, their size and their motion."""

import re

import numpy as np
import pytest
from PIL import Image
from polydem_post import ResultError, Trajectory
from polydem_post.command_line.main import main
from polydem_post.pictures.drawing import Look, settle
from polydem_post.pictures.movie import Film, Painter, make_movie

ffmpeg = pytest.importorskip("imageio_ffmpeg", reason="films in MP4 need imageio-ffmpeg")


def frames_of(path):
    """What ffmpeg says of a film, and its frames as arrays."""
    reader = ffmpeg.read_frames(str(path))
    facts = next(reader)
    width, height = facts["size"]
    return facts, [np.frombuffer(frame, dtype=np.uint8).reshape(height, width, 3) for frame in reader]


def test_a_film_has_all_frames_its_size_and_the_colours_of_players(small_drum, tmp_path, capsys):
    path = tmp_path / "film.mp4"
    command = ["movie", str(small_drum), "-o", str(path), "--fps", "10", "--size", "401,321", "--show", "forces",
               "--colour", "speed"]
    assert main(command) == 0
    assert capsys.readouterr().out.strip() == str(path)
    facts, frames = frames_of(path)
    assert (facts["size"], facts["fps"], facts["codec"], facts["pix_fmt"][:7]) == ((400, 320), 10.0, "h264", "yuv420p")
    assert len(frames) == len(Trajectory(small_drum))
    assert list(tmp_path.iterdir()) == [path]
    changes = [np.abs(after.astype(int) - before).mean() for before, after in zip(frames, frames[1:])]
    assert min(changes[:4]) > 0.5  # bodies fall
    still = np.ptp(np.array(frames, dtype=int), axis=0).max(axis=2)
    assert np.median(still[:, -12:]) < 12  # the scale of colours stays as it is


def test_frames_of_a_film_show_what_a_picture_shows(small_drum):
    """The frame that several others were drawn before is the frame drawn at once."""
    run = Trajectory(small_drum)
    look = settle(run, list(range(len(run))), Look(colour="speed", show=("forces", "boxes", "cells")))
    film = Film(look, (480, 400), 2, "max")
    worn = Painter(run, film, 0)
    for number in (3, 8, 5):
        last = worn.paint(number)
    assert last == Painter(run, film, 0).paint(5)
    assert last != worn.paint(6)


@pytest.mark.parametrize("processes", [1, 2])
def test_the_number_of_processes_does_not_matter(small_drum, tmp_path, processes):
    run = Trajectory(small_drum)
    numbers = [*range(len(run)), *range(len(run))]
    make_movie(run, numbers, tmp_path / "one.gif", Look(colour="id"), size=(200, 200), processes=1)
    make_movie(run, numbers, tmp_path / "more.gif", Look(colour="id"), size=(200, 200), processes=processes)
    assert (tmp_path / "one.gif").read_bytes() == (tmp_path / "more.gif").read_bytes()


def test_a_gif_has_the_chosen_frames_and_their_time(small_drum, tmp_path):
    path = tmp_path / "film.gif"
    assert main(["movie", str(small_drum), "-o", str(path), "--frames", "2:10", "--every", "3", "--fps", "5",
                 "--size", "300,260"]) == 0
    with Image.open(path) as film:
        assert (film.n_frames, film.size, film.info["duration"], film.info["loop"]) == (3, (300, 260), 200, 0)
        pictures = []
        for number in range(film.n_frames):
            film.seek(number)
            pictures.append(np.asarray(film.convert("RGB"), dtype=int))
    assert np.abs(pictures[1] - pictures[0]).mean() > 0.5


@pytest.mark.parametrize("arguments, message", [
    (["-o", "m.avi"], "m.avi: cannot be written: the name must end with .mp4 or .gif"),
    (["-o", "m.png"], "./polydem plot draws pictures"),
    (["--fps", "0"], "--fps takes a number from 0.1"),
    (["--every", "0"], "--every and --processes take integers of at least 1"),
    (["--size", "100,2"], "--size takes a width and a height from 160"),
    (["--frames", "50:"], "50: contains none of the 1"),
    (["-o", "no/such/folder/m.gif"], "no/such/folder/m.gif: cannot be written (there is no folder no/such/folder)"),
    (["-o", "no/such/folder/m.mp4"], "no/such/folder/m.mp4: cannot be written (there is no folder no/such/folder)"),
])
def test_wrong_options_are_explained(small_drum, capsys, arguments, message):
    assert main(["movie", str(small_drum), *arguments]) == 2
    assert message in capsys.readouterr().err


def test_progress_is_shown_on_a_terminal_only(small_drum, tmp_path, capsys, monkeypatch):
    run = Trajectory(small_drum)
    make_movie(run, [0, 1], tmp_path / "a.gif", Look(), size=(200, 200))
    assert capsys.readouterr().err == ""
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    make_movie(run, [0, 1], tmp_path / "a.gif", Look(), size=(200, 200))
    assert re.search(r"\rframe 2 of 2, [\d.]+ per second, 0 s left", capsys.readouterr().err)


def test_without_the_package_mp4_says_what_to_do(small_drum, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    with pytest.raises(ResultError, match="pip install imageio-ffmpeg"):
        make_movie(Trajectory(small_drum), [0], tmp_path / "a.mp4", Look())
