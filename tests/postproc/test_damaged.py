"""Damaged files end every verb with an exit code and one sentence, never with a traceback.

Every verb that reads files gets every kind of damage in every file that it reads; beyond that files with some flipped
bytes. Of the damages of single cells and data sets one in forty is tried, and of those of whole files one in three, for
the time it takes: POLYDEM_SEED=1 to 39 chooses others, POLYDEM_FUZZ=50 tries all of them, and 50 files of flipped bytes
for each file.
"""

import csv
import json
import os
import shutil
import subprocess
import sys
import warnings
from pathlib import Path

import h5py
import numpy as np
import pytest
from polydem_lab.costs.models import MODELS
from polydem_lab.costs.models import Sample as CostSample
from polydem_lab.precision.samples import Sample as WorkSample
from polydem_lab.rivals.samples import Sample as RivalsSample
from polydem_lab.scaling.exchange_model import Count
from polydem_lab.scaling.exchange_runs import RunCount
from polydem_post.base.emit import Table, printable
from polydem_post.command_line import data_verbs
from polydem_post.command_line import main as command_line
from synthetic_bench import truths, write_sample
from test_manifest import rows_of, write_manifest

FLIPPED = int(os.environ.get("POLYDEM_FUZZ", "1"))

#: Of the damages of cells and data sets, and of whole files, every so many is tried, other ones for each file; all if
#: more bits are flipped
EVERY, EVERY_WHOLE = (40, 3) if FLIPPED <= 3 else (1, 1)
SEED = int(os.environ.get("POLYDEM_SEED", "0"))


def chosen(damages, salt, seed, every=EVERY):
    """Some of the damages, or all."""
    return [each for k, each in enumerate(damages) if (k + len(salt) + seed) % every == 0]


def write_csv(path, heading, rows):
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([heading, *rows])


def columns_of(record):
    return list(record.__dataclass_fields__)


def some(record, **texts):
    """A row of a record: 3 in every number."""
    kinds = {"str": "x", "int": "3", "float": "3.0"}
    return [texts.get(name, kinds[str(each.type)]) for name, each in record.__dataclass_fields__.items()]


@pytest.fixture(scope="module")
def whole(tmp_path_factory, finished):
    """Whole files of every kind."""
    folder = tmp_path_factory.mktemp("whole")
    shutil.copytree(finished, folder / "result")
    with h5py.File(folder / "result" / "profile.h5", "r+") as file:
        del file["counters"]
        file["counters/name"] = np.array([b"steps", b"pairs", b"ranks"])
        file["counters/value"] = [7, 5, 1]
    shutil.copytree(finished, folder / "checked")
    write_manifest(folder / "checked", rows_of(finished))
    for finder in ("quadtree", "sort_and_sweep"):
        for repeat in range(2):
            write_sample(folder / "bench", "drum_100", finder, truths()[finder], 100, repeat=repeat)
    heading = ["scene", "boxes", "finder", "few", "more", "instructions", "accesses", "first_level", "last_level",
               "mispredictions", "model", "hardware"]
    write_csv(folder / "bench" / "cache.csv", heading, [["drum_100", 100, "quadtree", 2, 12, *[1.0] * 5, "m", "h"]])
    with h5py.File(folder / "trace.h5", "w") as file:
        file["aabb"] = np.zeros((20, 5, 4))
    (folder / "bench" / "traces" / "drum_100").mkdir(parents=True)
    shutil.move(folder / "trace.h5", folder / "bench" / "traces" / "drum_100" / "trace.h5")
    rows = [some(CostSample, model=model.name, kind=kind) for model in MODELS for kind in ("time", "count", "memory")]
    write_csv(folder / "costs" / "samples.csv", columns_of(CostSample), rows)
    rows = [some(WorkSample, scene="stack", model="area/rate/cundall_strack", numerics="gear", precision=precision,
                 steps=steps, repeat="0", status="finished", result="1 1 1 0.5")
            for steps in ("10", "20", "40") for precision in ("double", "quadruple")]
    write_csv(folder / "study" / "samples.csv", columns_of(WorkSample), rows)
    rows = [some(RivalsSample, problem="stack", column=column, series=column, level=level, repeat="0",
                 status="finished", error="1e-2") for column in ("polydem", "Chipmunk") for level in ("7", "8", "9")]
    write_csv(folder / "rivals" / "points.csv", columns_of(RivalsSample), rows)
    write_csv(folder / "counts.csv", columns_of(Count), [some(Count, shape="drum", ranks="16", margin="0.2")])
    write_csv(folder / "runs.csv", columns_of(RunCount), [some(RunCount)])
    ring = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
    (folder / "parts.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": [
        {"type": "Feature", "properties": {"velocity": [1, 2], "density": 3}, "geometry": {
            "type": "MultiPolygon", "coordinates": [[ring], [[[x + 2, y] for x, y in ring]]]}}]}))
    write_csv(folder / "sweep" / "table.csv", ["name", "scene.seed"], [["a", 1], ["b", 2]])
    for name in "ab":
        run = folder / "sweep" / "runs" / name
        run.mkdir(parents=True)
        write_csv(run / "attempts.csv", ["started", "seconds", "exit_code", "threads"], [["x", 1.0, 0, 1]])
        (run / "overrides.txt").write_text("scene.seed=1\n")
        (run / "input.nml").write_text("&scene\n/\n")
        shutil.copytree(finished, run / "result")
        with h5py.File(run / "result" / "profile.h5", "r+") as file:
            if "revision" not in file["provenance"]:
                file["provenance/revision"] = "x"
    return folder




#: Name -> words behind the program's name, and the files that they read
VERBS = {
    "plot": (["plot", "result", "--contacts", "--output", "p.png"], ["result/trajectory_0003.h5"]),
    "plot a segment": (["plot", "result/trajectory_0001.h5", "--output", "p.png"], ["result/trajectory_0001.h5"]),
    "plot checked": (["plot", "checked", "--frames", "0,3,6", "--output", "p.png"],
                     ["checked/trajectory_0002.h5", "checked/manifest.txt"]),
    "export": (["export", "result", "--to", "vtkhdf", "-o", "e.vtkhdf", "--force"], ["result/trajectory_0002.h5"]),
    "export a segment": (["export", "result/trajectory_0001.h5", "--to", "csv", "-o", "e.csv", "--force"],
                         ["result/trajectory_0001.h5"]),
    "import": (["import", "parts.geojson", "-o", "b.h5", "--force"], ["parts.geojson"]),
    "table": (["table", "result"], ["result/profile.h5", "result/trajectory_0001.h5"]),
    "table checked": (["table", "checked"], ["checked/profile.h5"]),
    "tables": (["tables", "bench", "--no-figures", "--output", "report"],
               ["bench/samples/drum_100-quadtree-1-1.h5", "bench/samples/drum_100-quadtree-1-0.h5", "bench/cache.csv"]),
    "cache": (["cache", "bench", "--program", "/bin/true", "--finders", "quadtree"],
              ["bench/cache.csv", "bench/traces/drum_100/trace.h5"]),
    "costs": (["costs", "--program", "/bin/false", "--output", "costs"], ["costs/samples.csv"]),
    "workprecision": (["workprecision", "--report-only", "--output", "study"], ["study/samples.csv"]),
    "rivals": (["rivals", "--report-only", "--output", "rivals"], ["rivals/points.csv"]),
    "scale runs": (["scale", "runs.csv"], ["runs.csv"]),
    "scale counts": (["scale", "counts.csv", "--body", "1e-6"], ["counts.csv"]),
    "scale a run": (["scale", "result", "--save", "saved.csv"], ["result/profile.h5", "result/trajectory_0001.h5"]),
    "sweep collect": (["sweep", "collect", "sweep"],
                      ["sweep/table.csv", "sweep/runs/a/attempts.csv", "sweep/runs/a/result/profile.h5",
                       "sweep/runs/b/result/trajectory_0003.h5"]),
    "sweep run": (["sweep", "--program", "/bin/false", "run", "sweep"],
                  ["sweep/table.csv", "sweep/runs/a/attempts.csv"]),
}


def every_dataset(file):
    names = []
    file.visititems(lambda name, entry: names.append(name) if isinstance(entry, h5py.Dataset) else None)
    return names


def replaced(file, name, make):
    attributes = dict(file[name].attrs)
    value = make(file[name])
    del file[name]
    if value is not None:
        file[name] = value
        file[name].attrs.update(attributes)


def as_nan(dataset):
    return np.full(dataset.shape, np.nan)


def beside(dataset, kind):
    """The same data in another file."""
    file = dataset.file
    other = Path(file.filename).with_name("other.h5")
    with h5py.File(other, "w") as target:
        target["x"] = dataset[()]
    return {"link": h5py.ExternalLink("other.h5", "/x"), "soft": h5py.SoftLink("/provenance")}[kind]


#: Damages of all data sets of an HDF5 file, one after the other
EVERY_DATASET = {
    "lost": lambda dataset: None,
    "text": lambda dataset: np.bytes_("\x1b[31mtext"),
    "no number": as_nan,
    "flat": lambda dataset: np.zeros(1) if dataset.shape != (1,) else np.zeros((1, 1)),
    "empty": lambda dataset: np.zeros((0,) * max(1, dataset.ndim)),
    "deep": lambda dataset: np.zeros((2, 2, 2, 2)),
    "huge": lambda dataset: np.full(dataset.shape, 1e300),
    "negative": lambda dataset: np.full(dataset.shape, -7),
    "an external link": lambda dataset: beside(dataset, "link"),
    "a soft link": lambda dataset: beside(dataset, "soft"),
}

#: Columns of CSV files that hold texts
TEXTS = ("scene", "finder", "model", "hardware", "program", "machine", "shape", "state", "started", "name",
         "numerics", "precision", "result", "revision")

#: Damages of the bytes of any file
OF_BYTES = {
    "missing": lambda path: path.unlink(),
    "empty": lambda path: path.write_bytes(b""),
    "text": lambda path: path.write_text("\x1b]0;title\x07 no, such, thing\n1,2\n"),
    "bytes": lambda path: path.write_bytes(np.random.default_rng(1).bytes(3000)),
    "zeros": lambda path: path.write_bytes(bytes(5000)),
    "half": lambda path: os.truncate(path, path.stat().st_size // 2),
    "one byte less": lambda path: os.truncate(path, path.stat().st_size - 1),
    "a folder": lambda path: (path.unlink(), path.mkdir()),
    "unreadable link": lambda path: (path.unlink(), path.symlink_to("nowhere")),
    "other HDF5": lambda path: make_other_hdf5(path),
}


def make_other_hdf5(path):
    path.unlink()
    with h5py.File(path, "w") as file:
        file["x"] = 1


def of_cells(path):
    """Damages of the cells of a CSV file: (name, bytes)."""
    text = path.read_text(encoding="utf-8")
    rows = list(csv.reader(text.splitlines()))
    for column in range(len(rows[0])):
        for bad in ("", "x", "nan", "inf", "-1", "0", "1e400", "99999999999999999999999", "\x1b[2J", '"'):
            changed = [list(row) for row in rows]
            changed[-1][column] = bad
            yield f"{rows[0][column]} is {bad!r}", "\n".join(",".join(row) for row in changed).encode() + b"\n"
    yield "a column less", "\n".join(",".join(row[:-1]) for row in rows).encode() + b"\n"
    yield "a cell less", (text.rstrip("\n").rpartition(",")[0] + "\n").encode()
    yield "a cell more", (text.rstrip("\n") + ",7\n").encode()
    yield "a zero byte", text.encode()[:-3] + b"\0" + text.encode()[-3:]
    yield "no text", text.encode()[:-3] + b"\xff\xfe" + text.encode()[-3:]
    yield "heading alone", (text.splitlines()[0] + "\n").encode()


def run(words, capfd):
    """Exit code and what was told, after checks that hold for any damage."""
    warnings.simplefilter("ignore")
    os.environ["POLYDEM_TRACEBACK"] = ""
    code = command_line.main(words)
    out, err = capfd.readouterr()
    assert "Traceback" not in err and "Traceback" not in out
    assert code in (0, 1, 2, 75), err
    assert "A file may be damaged" not in err, err  # no reader may leave it to the last resort
    if code == 2:
        errors = [line for line in err.splitlines() if not line.startswith("warning: ")]
        assert errors and errors[0].startswith("error: ") and len(errors) <= 2, err
    told = out + err
    assert printable(told) == told, told
    return code


@pytest.fixture
def place(whole, tmp_path, monkeypatch):
    """A copy of the whole files, in which the verbs run."""
    shutil.copytree(whole, tmp_path / "files")
    monkeypatch.chdir(tmp_path / "files")
    monkeypatch.setattr("polydem_lab.costs.cache.simulate", lambda *_: {})
    monkeypatch.setattr("polydem_lab.costs.cache.count_hardware", lambda *_: {})
    return tmp_path / "files"


CASES = [(verb, path) for verb, (_, paths) in VERBS.items() for path in paths]


@pytest.mark.parametrize("verb", list(VERBS))
def test_whole_files_are_read(place, capfd, verb):
    assert run(VERBS[verb][0], capfd) in ((0, 2) if verb == "costs" else (0,))


@pytest.mark.parametrize("verb, name", CASES)
def test_damaged_bytes_end_with_a_sentence(place, capfd, verb, name):
    path, words = place / name, VERBS[verb][0]
    whole = path.read_bytes()
    for damage, harm in chosen(OF_BYTES.items(), verb + name, SEED, EVERY_WHOLE):
        harm(path)
        code = run(words, capfd)
        if damage in ("text", "bytes", "zeros", "a folder", "other HDF5") and not (verb == "table" and "traj" in name):
            assert code != 0 or verb.startswith("sweep"), (damage, code)
        shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink(missing_ok=True)
        path.write_bytes(whole)
    chance = np.random.default_rng([len(whole), *verb.encode()])
    for _ in range(FLIPPED):
        changed = bytearray(whole)
        for at in chance.integers(0, min(len(whole), chance.choice([200, 3000, len(whole)])), chance.integers(1, 6)):
            changed[at] = chance.integers(0, 256)
        path.write_bytes(changed)
        run(words, capfd)


@pytest.mark.parametrize("seed", [SEED], ids="POLYDEM_SEED={}".format)
@pytest.mark.parametrize("verb, name", [case for case in CASES if case[1].endswith(".h5")])
def test_data_sets_that_are_not_what_they_should_be_end_with_a_sentence(place, capfd, verb, name, seed):
    path, words = place / name, VERBS[verb][0]
    whole = path.read_bytes()
    with h5py.File(path, "r") as file:
        names = [name for name in every_dataset(file) if not name.startswith("provenance") or "input" in name]
    damages = [(dataset, damage) for dataset in names for damage in EVERY_DATASET]
    for dataset, damage in chosen(damages, verb + name, seed):
        with h5py.File(path, "r+") as file:
            replaced(file, dataset, EVERY_DATASET[damage])
        code = run(words, capfd)
        if "link" in damage:
            assert code == 2 or verb.startswith(("sweep", "table")), (dataset, damage)
        path.write_bytes(whole)


@pytest.mark.parametrize("seed", [SEED], ids="POLYDEM_SEED={}".format)
@pytest.mark.parametrize("verb, name", [case for case in CASES if case[1].endswith(".csv")])
def test_cells_that_are_no_numbers_end_with_a_sentence(place, capfd, verb, name, seed):
    path, words = place / name, VERBS[verb][0]
    for damage, data in chosen(list(of_cells(path)), verb, seed):
        path.write_bytes(data)
        code = run(words, capfd)
        if " is 'x'" in damage and not damage.startswith(TEXTS):
            assert code != 0, damage


@pytest.mark.parametrize("kind", ["external", "virtual"])
@pytest.mark.parametrize("verb, name", [("plot", "result/trajectory_0003.h5"), ("table", "result/profile.h5"),
                                        ("tables", "bench/samples/drum_100-quadtree-1-1.h5"),
                                        ("cache", "bench/traces/drum_100/trace.h5")])
def test_data_that_lie_in_other_files_are_refused(place, capfd, verb, name, kind):
    with h5py.File(place / name, "r+") as file:
        if kind == "external":
            (place / "secret").write_bytes(bytes(64))
            file.create_dataset("own", (8,), dtype="f8", external=[(str(place / "secret"), 0, 64)])
        else:
            layout = h5py.VirtualLayout((3,), dtype="f8")
            layout[:] = h5py.VirtualSource("other.h5", "x", (3,))
            file.create_virtual_dataset("own", layout)
    command_line.main(VERBS[verb][0])
    assert "lie in other files" in capfd.readouterr().err


@pytest.mark.parametrize("verb", ["plot", "table", "tables", "cache", "scale a run", "sweep collect", "workprecision",
                                  "rivals"])
def test_an_empty_folder_ends_with_a_sentence(tmp_path, capfd, verb):
    verb_itself, *words = VERBS[verb][0]
    folders = ("result", "bench", "sweep", "study", "rivals")
    words = [verb_itself, *(str(tmp_path) if word in folders else word for word in words)]
    assert run(words, capfd) == 2


def test_a_closed_pipe_ends_quietly(whole):
    for words in (["scale", "runs.csv"], ["sweep", "collect", "sweep"], ["table", "checked"]):
        reader, writer = os.pipe()
        os.close(reader)
        command = [sys.executable, "-m", "polydem_post", *words]
        done = subprocess.run(command, cwd=whole, stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
        os.close(writer)
        errors = [line for line in done.stderr.splitlines() if not line.startswith("warning: ")]
        assert (done.returncode, errors) == (command_line.CLOSED_PIPE, []), words


def test_what_no_reader_foresaw_is_a_sentence_and_a_traceback_for_those_who_ask(monkeypatch, capsys):
    monkeypatch.setattr(data_verbs, "timing_table", lambda *_: 1 / 0)
    monkeypatch.setattr(data_verbs, "Trajectory", lambda *_: None)
    assert command_line.main(["table", "x"]) == command_line.UNFORESEEN
    assert capsys.readouterr().err.startswith("error: table cannot go on: ZeroDivisionError: division by zero. ")
    monkeypatch.setenv("POLYDEM_TRACEBACK", "1")
    with pytest.raises(ZeroDivisionError):
        command_line.main(["table", "x"])


def test_tables_hold_nothing_that_steers_a_terminal():
    table = Table("a", "b", ("c",))
    table.add("x\x1b[31m\x07\x9b1m\u202e\ud800y")
    for form in ("text", "markdown", "csv"):
        assert r"x\x1b[31m\x07\x9b1m\u202e\ud800y" in table.written(form)


@pytest.mark.parametrize("verb, name", [("plot", "result/trajectory_0003.h5"), ("table", "result/profile.h5"),
                                        ("tables", "bench/samples/drum_100-quadtree-1-1.h5"),
                                        ("cache", "bench/traces/drum_100/trace.h5")])
def test_a_data_set_that_claims_more_than_the_file_can_hold_is_not_read(place, capfd, verb, name):
    with h5py.File(place / name, "r+") as file:
        file.create_dataset("frames/own" if "frames" in file else "own", (2**40,), dtype="f8", chunks=(1024,))
    assert run(VERBS[verb][0], capfd) == 2
