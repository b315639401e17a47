"""The page of the viewer as a file: its data are those of the run, rounded as stated."""

import base64
import html
import json
import os
import re
import shutil
import tempfile
import zlib
from pathlib import Path

import numpy as np
import polydem_post
import pytest
from polydem_post import Frame, Trajectory
from polydem_post.command_line.main import main
from polydem_post.pictures import view_data
from polydem_post.pictures.view import SCRIPTS, SOURCES


@pytest.fixture(scope="module")
def run(small_drum):
    return Trajectory(small_drum)


def test_the_page_is_one_file_that_needs_no_network(view):
    text = view.read_text(encoding="utf-8")
    assert not re.search(r"(src|href)\s*=\s*[\"'](?!data:)|https?://|import\s*\(|fetch\s*\(|XMLHttp|@import", text)
    assert all((SOURCES / name).read_text(encoding="utf-8") in text for name in SCRIPTS)
    assert [path for path in view.parent.iterdir() if path != view] == []


def test_all_scripts_of_the_folder_are_in_the_page_and_in_the_package():
    assert {path.name for path in SOURCES.glob("*.js")} == set(SCRIPTS)
    project = Path(polydem_post.__file__).parents[2] / "pyproject.toml"
    assert '"pictures/viewer/*"' in project.read_text(encoding="utf-8")


def block(text, name, kind):
    data = re.search(rf'id="block-{name}">([^<]*)<', text)[1]
    return np.frombuffer(zlib.decompress(base64.b64decode(data)), dtype=kind)


def test_positions_and_angles_are_rounded_as_stated(view, run):
    text = view.read_text(encoding="utf-8")
    facts = json.loads(re.search(r'id="facts">(.*?)</script>', text)[1])
    for name, true in (("x", [run[k].position[:, 0] for k in range(len(run))]),
                       ("angle", [run[k].angle for k in range(len(run))]),
                       ("spin", [run[k].angular_velocity for k in range(len(run))])):
        fact = facts["series"][name]
        planes = block(text, name, np.uint8).astype(np.int64).reshape(fact["planes"], len(run), -1)
        folded = sum(planes[k] << (8 * k) for k in range(fact["planes"]))
        change = np.where(folded % 2 == 0, folded // 2, -(folded + 1) // 2)
        error = np.abs(np.cumsum(change, axis=0) * fact["quantum"] - true).max()
        assert error <= 0.5001 * fact["quantum"]
    free = ~run[0].fixed
    assert facts["series"]["x"]["quantum"] == pytest.approx(1e-3 * np.median(run[0].equivalent_diameter[free]))


def test_contacts_of_several_pieces_of_two_bodies_are_packed_one_by_one():
    """Finds counts that the bits of the pairs do not have, so that forces go to other contacts."""
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    frame = Frame.from_polygons([square, square + np.array([1, 0]), square + np.array([0, -1])])
    table = view_data._Contacts()
    table.add(frame.with_contacts([1, 1, 1], [2, 3, 2], [(0, 4), (0, 1), (0, 9)], np.zeros((3, 2))))
    table.add(frame.with_contacts([1], [2], [(0, 1)], np.zeros((1, 2))))
    packed = view_data.Packed()
    table.pack(packed, 1.0)
    read = {name: np.frombuffer(zlib.decompress(base64.b64decode(data)), np.uint8)
            for name, data in packed.blocks.items()}
    assert packed.facts["contacts"]["count"] == [3, 1] and packed.facts["contacts"]["pairs"] == 3
    assert read["pair_first"].view("<u4").tolist() == [0, 0, 0]
    assert read["pair_second"].view("<u4").tolist() == [1, 1, 2]
    assert np.bitwise_xor.accumulate(read["present"]).tolist() == [0b111, 0b001]
    assert read["force"].tolist() == [170, 255, 85, 85]


@pytest.mark.parametrize("arguments, message", [
    (["-o", "v.pdf"], "v.pdf: cannot be written: the name must end with .html"),
    (["--colour", "sped"], "there is no colour sped"),
    (["--colour", "load", "--no-contacts"], "there is no colour load in this page"),
    (["--every", "0"], "--every takes an integer of at least 1"),
    (["-o", "no/such/folder/v.html"], "no/such/folder/v.html: cannot be written (there is no folder no/such/folder)"),
])
def test_wrong_options_are_explained(small_drum, capsys, arguments, message):
    assert main(["view", str(small_drum), *arguments]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("path, why, code", [("/dev/full", "No space left on device", 3),
                                             ("/no/folder", "No such file", 2)])
def test_without_room_for_temporary_files_the_error_is_explained(small_drum, tmp_path, capsys, monkeypatch, path, why,
                                                                 code):
    monkeypatch.setattr(tempfile, "TemporaryFile", lambda **_: open(path, "r+b"))  # noqa: SIM115  the real one is, too
    monkeypatch.setattr(view_data, "MOST_KEPT", 1000)
    assert main(["view", str(small_drum), "-o", str(tmp_path / "v.html")]) == code
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and f"temporary files, in TMPDIR or /tmp: cannot be written ({why}" in said
    assert not list(tmp_path.iterdir())


def test_without_contacts_the_page_is_smaller(small_drum, view, tmp_path):
    path = tmp_path / "bare.html"
    assert main(["view", str(small_drum), "-o", str(path), "--no-contacts", "--every", "2"]) == 0
    assert path.stat().st_size < view.stat().st_size


@pytest.mark.parametrize("name", ["{style}{name}", "<b>&", "a\nb", os.fsdecode(b"\xff")])
def test_any_name_of_a_result_is_shown_as_it_is(small_drum, tmp_path, name):
    shutil.copytree(small_drum, tmp_path / name)
    path = tmp_path / "v.html"
    assert main(["view", str(tmp_path / name), "-o", str(path), "--every", "5"]) == 0
    title = re.search("<title>(.*?): polydem</title>", path.read_text(encoding="utf-8"), re.DOTALL)[1]
    assert html.unescape(title) == name.encode("utf-8", "replace").decode()
