"""Exported files: what is in them, and the verb; test_export_readers.py reads them by other libraries."""

import csv
import os
import shutil
from xml.etree import ElementTree

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from polydem_post import ResultError
from polydem_post.command_line.main import main
from polydem_post.export import FORMATS, export_result


@pytest.fixture(scope="module")
def run(heap_with_contacts):
    return heap_with_contacts


def test_the_list_of_frames_names_times_and_files(run, exported):
    for name in ("heap", "heap_contacts"):
        rows = ElementTree.parse(exported / f"{name}.pvd").findall("Collection/DataSet")
        assert [float(row.get("timestep")) for row in rows] == list(run.times)
        assert all((exported / row.get("file")).exists() for row in rows)


def test_the_topology_of_bodies_is_in_a_file_once(run, exported):
    with h5py.File(exported / "heap.vtkhdf") as file:
        root = file["VTKHDF"]
        assert root.attrs["Type"] == b"PolyData" and list(root.attrs["Version"]) == [2, 0]
        assert len(root["Polygons/Offsets"]) == len(run[0]) + 1
        assert len(root["CellData/mass"]) == len(run[0])
        assert len(root["CellData/angle"]) > len(run[0])
        assert root["Steps"].attrs["NSteps"] == len(run)


def test_gsd_reads_shapes_poses_and_contacts(run, tmp_path):
    pytest.importorskip("gsd", reason="gsd is not installed: pip install 'postproc[readers]'")
    import gsd.hoomd

    export_result(run, "gsd", tmp_path / "heap.gsd")
    with gsd.hoomd.open(str(tmp_path / "heap.gsd")) as file:
        assert len(file) == len(run)
        for frame, read in zip(run, file):
            bodies = read.particles
            assert (read.configuration.step, read.configuration.dimensions) == (frame.step, 2)
            assert read.log["time"][0] == frame.time
            assert_allclose(bodies.position[:, :2], frame.position, rtol=1e-6, atol=1e-9)
            half = 2.0 * np.arctan2(bodies.orientation[:, 3], bodies.orientation[:, 0])
            assert_allclose(np.cos(half - frame.angle), 1.0, atol=1e-6)
            for k in (0, len(frame) - 1):
                shape = bodies.type_shapes[bodies.typeid[k]]
                assert shape["type"] == "Polygon"
                assert_allclose(shape["vertices"], frame.shape[frame.vertex_start[k] : frame.vertex_start[k + 1]])
            assert (np.abs(frame.vertex) <= 0.5 * read.configuration.box[:2] * (1 + 1e-6)).all()
            assert len(frame.contacts) == read.bonds.N
            if len(frame.contacts):
                assert_array_equal(read.bonds.group[:, 0], frame.contacts.first_index)
                assert_array_equal(read.log["bonds/normal_force"], frame.contacts.normal_force)


def test_tables_read_back_to_the_same_bits(run, exported):
    def read(name):
        with (exported / name).open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        return {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}

    bodies = read("heap.csv")
    assert_array_equal(bodies["position_x"], np.concatenate([frame.position[:, 0] for frame in run]))
    assert_array_equal(bodies["time"], np.repeat(run.times, len(run[0])))
    assert_array_equal(np.isinf(bodies["mass"]), bodies["fixed"] == 1)
    contacts = read("heap_contacts.csv")
    assert_array_equal(contacts["normal_force"], np.concatenate([frame.contacts.normal_force for frame in run]))
    assert_array_equal(read("heap_vertices.csv")["y"], run[0].shape[:, 1])
    assert_array_equal(read("heap_energy.csv")["kinetic"], run.energy_balance["kinetic"])


@pytest.mark.parametrize("form", [form for form in FORMATS if form != "gsd"])
def test_the_verb_writes_what_the_function_writes(run, exported, tmp_path, capsys, form):
    output = tmp_path / f"heap{FORMATS[form]}"
    command = ["export", str(run.folder), "--to", form, "-o", str(output)]
    assert main(command) == 0
    written = capsys.readouterr().out.split()
    assert written[0] == str(output)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(name.rpartition("/")[2] for name in written)
    if form != "vtkhdf":  # HDF5 files may differ in unused bytes
        assert output.read_bytes() == (exported / output.name).read_bytes()
    assert main(command) == 2
    assert "exists already; --force replaces it" in capsys.readouterr().err
    assert main([*command, "--frames", "0,-1", "--no-contacts", "--force"]) == 0


@pytest.mark.parametrize("frames, numbers", [("0,-1", [0, -1]), ("1:", slice(1, None)), ("::2", slice(None, None, 2)),
                                             ("-2:", slice(-2, None))])
def test_some_frames_are_exported(run, tmp_path, frames, numbers):
    output = tmp_path / "some.csv"
    assert main(["export", str(run.folder), "--to", "csv", "-o", str(output), f"--frames={frames}"]) == 0
    times = {float(line.split(",")[0]) for line in output.read_text().splitlines()[1:]}
    assert times == set(run.times[numbers])


@pytest.mark.parametrize("words, message", [
    (["--to", "vtkhdf", "-o", "x.h5"], "the name of a file for --to vtkhdf ends with .vtkhdf"),
    (["--to", "csv", "-o", "file/x.csv"], "file/x.csv: cannot be written"),
    (["--to", "csv", "--frames", "99"], "there is no frame 99, only 4 frames"),
])
def test_errors_are_sentences(run, capsys, words, message, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    assert main(["export", str(run.folder), *words]) == 2
    error = capsys.readouterr().err
    assert message in error and "Traceback" not in error


def test_nothing_is_left_of_an_export_that_fails(run, tmp_path, monkeypatch):
    import polydem_post.export.exporting as exporting

    def fail(frame, with_contacts):
        raise OSError("no space")

    monkeypatch.setattr(exporting, "body_mesh", fail)
    for form in ("vtkhdf", "vtp", "xdmf"):
        with pytest.raises(ResultError, match="no space"):
            export_result(run, form, tmp_path / f"x{FORMATS[form]}")
    assert list(tmp_path.iterdir()) == []


def test_a_killed_export_does_not_hinder_the_next(run, tmp_path):
    (tmp_path / ".x_vtp.unfinished").mkdir()
    (tmp_path / ".x_vtp.unfinished" / "bodies_00000.vtp").touch()
    export_result(run, "vtp", tmp_path / "x.pvd")
    assert not list(tmp_path.glob(".*"))


def test_only_files_of_exports_are_replaced(run, tmp_path):
    export_result(run, "vtp", tmp_path / "x.pvd")
    export_result(run[:1], "vtp", tmp_path / "x.pvd", overwrite=True)
    assert sorted(path.name for path in (tmp_path / "x_vtp").iterdir()) == ["bodies_00000.vtp", "contacts_00000.vtp"]
    (tmp_path / "x_vtp" / "view.pvsm").write_text("mine")
    (tmp_path / "x.csv").mkdir()
    shutil.copy(run.folder / "profile.h5", tmp_path / "profile.h5")
    before = sorted(tmp_path.rglob("*"))
    for form, name, message in (("vtp", "x.pvd", "holds view.pvsm, which no export made"),
                                ("csv", "x.csv", "is a folder, which an export does not replace"),
                                ("xdmf", "profile.xdmf", "is a file of a run")):
        with pytest.raises(ResultError, match=message):
            export_result(run, form, tmp_path / name, overwrite=True)
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("form", [form for form in FORMATS if form != "gsd"])
def test_names_may_have_any_letters_of_unicode(run, tmp_path, form):
    output = tmp_path / f"a b'\"<&>:%s{{name}}ü\n{FORMATS[form]}"
    paths = export_result(run, form, output)
    assert all(path.exists() for path in paths)
    for path in paths:
        if path.suffix in (".pvd", ".xdmf"):
            tree = ElementTree.parse(path)
            named = [each.get("file") for each in tree.iter("DataSet")]
            named += [each.text.rpartition(":/")[0] for each in tree.iter("DataItem")]
            assert named and all((tmp_path / name).exists() for name in named)
    with pytest.raises(ResultError, match="is no name in UTF-8"):
        export_result(run, form, tmp_path / os.fsdecode(b"\xff" + FORMATS[form].encode()))
