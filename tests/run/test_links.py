"""Files that lead into other files, for every verb that reads any: bodies, traces, results, checkpoints, segments.

A stranger's file must not make the program read another file of its user. Links within a file are harmless.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "ranks"))
import seals

PROGRAM = os.path.abspath(os.environ["POLYDEM_PROGRAM"])
ROOT = os.environ["POLYDEM_SOURCE_DIR"]

BAD_INPUT, NO_FILE = 2, 3

#: Ways out of a file, and those that stay in it
OUTSIDE = ("link", "link to a group", "soft link to a link", "soft links to a link", "relative soft link to a link",
           "raw", "virtual")
INSIDE = ("soft link", "soft links", "relative soft link", "hard link")

SCENE = """\
&scene name = 'gas' bodies = 20 solid_fraction = 0.3 speed = 1 /
&integrate dt = 1e-5 duration = 2e-4 /
&output frame_interval = 2e-5 frames_per_segment = 4 /
&checkpoint steps = 8 /
"""

FROM_FILE = """\
&scene name = 'file' bodies_file = 'bodies.h5' /
&integrate dt = 1e-5 duration = 1e-4 /
"""


def command(words):
    """The words of a call; the program of the laboratory lies beside the other one."""
    return [PROGRAM + "_lab" * (words[0] in ("replay", "bench")), *words]


def call(*words):
    """Exit code, output and message of a call."""
    done = subprocess.run(command(words), capture_output=True, text=True, timeout=600, check=False,
                          env={**os.environ, "OMP_NUM_THREADS": "1"})
    return done.returncode, done.stdout, done.stderr


def lead(path, name, way):  # noqa: C901
    """Put a data set of a file elsewhere, whose place a link or a description takes."""
    group, leaf = os.path.split(name)
    other = path + ".other"
    shutil.copy(path, other)
    with h5py.File(path, "r+") as file:
        data = file[name][()]
        kind = file[name].dtype
        parent = file[group]
        if way in ("hard link", "soft link", "soft links", "relative soft link"):
            file.move(name, "/elsewhere/values")
        else:
            del file[name]
        if way == "link":
            parent[leaf] = h5py.ExternalLink(other, name)
        elif way == "link to a group":
            # The whole group is in the other file.
            if group == "/":
                parent[leaf] = h5py.ExternalLink(other, name)
            else:
                del file[group]
                file[group] = h5py.ExternalLink(other, group)
        elif way in ("soft link to a link", "soft links to a link", "relative soft link to a link"):
            file["/elsewhere/values"] = h5py.ExternalLink(other, name)
        elif way == "raw":
            if kind.kind == "O":
                return False
            with open(path + ".raw", "wb") as raw:
                raw.write(np.ascontiguousarray(data).tobytes())
            parent.create_dataset(leaf, shape=data.shape, dtype=kind, external=[(path + ".raw", 0, data.nbytes)])
        elif way == "virtual":
            if kind.kind == "O" or data.shape == ():
                return False
            layout = h5py.VirtualLayout(shape=data.shape, dtype=kind)
            layout[...] = h5py.VirtualSource(other, name, shape=data.shape)
            parent.create_virtual_dataset(leaf, layout)
        if "soft link" in way:
            target = "/elsewhere/values"
            if "links" in way:
                file["/elsewhere/step"] = h5py.SoftLink("values")
                file["/elsewhere_too"] = h5py.SoftLink("/elsewhere")
                target = "/elsewhere_too/step"
            if "relative" in way:
                target = "values"
                file[os.path.join(group, "values")] = h5py.SoftLink("/elsewhere/values")
            parent[leaf] = h5py.SoftLink(target)
        if way == "hard link":
            parent[leaf] = file["/elsewhere/values"]
    return True


def write_bodies():
    with h5py.File("bodies.h5", "w") as file:
        file["vertex"] = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0], [3, 0], [4, 0], [4, 1]])
        file["vertex_start"] = np.array([0, 4, 7], dtype="i4")
        file["fixed"] = np.array([1, 0], dtype="i4")
        file["density"] = np.array([1000.0, 2000.0])


@pytest.fixture(autouse=True)
def in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in (("scene.nml", SCENE), ("file.nml", FROM_FILE)):
        (tmp_path / name).write_text(text, encoding="utf-8")


def assert_refused(answer, path, name):
    code, _, message = answer
    assert code in (BAD_INPUT, NO_FILE), answer
    assert message.startswith("polydem: ") and message.count("\n") == 1, message
    assert f"{path}: {name} lies in another file" in message, message


def test_bodies_must_be_in_their_file():
    for name in "vertex", "vertex_start", "fixed", "density":
        for way in OUTSIDE:
            write_bodies()
            assert lead("bodies.h5", "/" + name, way)
            if "soft" in way:
                # The other names of these at the top would be unknown data sets.
                with h5py.File("bodies.h5", "r+") as file:
                    if "values" in file:
                        continue
                    if "elsewhere_too" in file:
                        del file["elsewhere_too"]
                        del file[name]
                        file[name] = h5py.SoftLink("/elsewhere/step")
            for verb in "check", "run":
                assert_refused(call(verb, "file.nml", *(["--force"] if verb == "run" else [])), "bodies.h5", name)
    assert not os.path.exists("results")
    for way in INSIDE:
        if way == "relative soft link":
            continue
        write_bodies()
        assert lead("bodies.h5", "/density", way)
        assert call("check", "file.nml")[0] == 0, way


def test_boxes_must_be_in_their_trace():
    original = os.path.join(ROOT, "tests", "laboratory", "traces", "drum_cut.h5")
    names = []
    with h5py.File(original, "r") as file:
        file.visititems(lambda name, entry: names.append("/" + name) if isinstance(entry, h5py.Dataset) else None)
    expected = call("replay", original)[1].splitlines()
    read = 0
    for name in names:
        for way in (*OUTSIDE, *INSIDE):
            shutil.copy(original, "trace.h5")
            if not lead("trace.h5", name, way):
                continue
            code, output, message = call("replay", "trace.h5")
            if way in INSIDE:
                assert code == 0, (name, way, message)
                assert [line for line in output.splitlines() if line.startswith("pair")] == \
                    [line for line in expected if line.startswith("pair")]
            elif code != 0:
                read += 1
                assert (f"trace.h5: {name} lies in" in message or f"trace.h5: {os.path.dirname(name)}" in message
                        or (way == "link to a group" and "lies in another file" in message)), (name, way, message)
            else:
                # Nobody asked for it.
                assert name.startswith("/provenance"), (name, way)
    assert read >= 3 * len(OUTSIDE)


def test_what_info_tells_must_be_in_the_file():
    assert call("run", "scene.nml")[0] == 0
    told = 0
    for file_name, names in (("profile.h5", ("/state_hash", "/status", "/provenance/host", "/provenance/version")),
                             ("trajectory_0001.h5", ("/frames/time", "/frames/start", "/provenance/version"))):
        for name in names:
            for way in (*OUTSIDE, *INSIDE):
                shutil.rmtree("copy", ignore_errors=True)
                shutil.copytree("results/scene", "copy")
                if not lead(f"copy/{file_name}", name, way):
                    continue
                for place in "copy", f"copy/{file_name}":
                    answer = call("info", place)
                    if way in INSIDE:
                        assert answer[0] == 0, (name, way, answer)
                    else:
                        told += 1
                        assert answer[0] == BAD_INPUT, (name, way, answer)
                        assert f"copy/{file_name}: /" in answer[2] and "lies in another file" in answer[2], answer
    assert told > 50


def test_a_run_goes_on_from_its_own_files_only():
    assert call("run", "scene.nml", "--set", "output.folder=whole")[0] == 0
    # As if it had ended early: the profile is not there, and not in the manifest either
    os.remove("whole/profile.h5")
    seals.seal_list(Path("whole/manifest.txt"), lambda lines: re.sub("(profile.h5 +)closed", r"\1  open", lines))
    segment = max(name for name in os.listdir("whole") if name.startswith("trajectory_"))
    with h5py.File("whole/checkpoint_1.h5", "r") as file:
        names = []
        file.visititems(lambda name, entry: names.append("/" + name) if isinstance(entry, h5py.Dataset) else None)
    names = ["/run/step", *[name for name in names if "provenance" not in name][::5]]
    cases = [(segment, "/frames/step"), *(("checkpoint", name) for name in names)]
    told = 0
    for path, name in cases:
        for way in OUTSIDE if name in ("/frames/step", "/run/step") else ("soft link to a link", "virtual"):
            shutil.rmtree("copy", ignore_errors=True)
            shutil.copytree("whole", "copy")
            if path == segment:
                led = lead(f"copy/{path}", name, way)
            else:
                led = [lead(f"copy/checkpoint_{k}.h5", name, way) for k in (1, 2)][0]
                seals.seal("copy/checkpoint_1.h5")
                seals.seal("copy/checkpoint_2.h5")
            if not led:
                continue
            code, _, message = call("run", "scene.nml", "--set", "output.folder=copy", "--continue")
            assert code in (BAD_INPUT, NO_FILE) and f"copy/{path}" in message, (path, name, way, code, message)
            # A manifest may find earlier that the segment was changed.
            told += "lies in another file" in message
            assert path == segment or "lies in another file" in message, (path, name, way, message)
    assert told > 20, told


def test_control_characters_of_a_file_do_not_reach_the_screen():
    assert call("run", "scene.nml")[0] == 0
    evil = "".join(chr(code) for code in range(1, 32)) + "\x7f\x1b]0;owned\x07\x9b1m\u202eäß→"
    with h5py.File("results/scene/profile.h5", "r+") as file:
        for name in "/status", "/state_hash", *(f"/provenance/{key}" for key in file["provenance"]):
            if file[name].dtype.kind == "O":
                del file[name]
                file[name] = evil
    done = subprocess.run([PROGRAM, "info", "results/scene"], capture_output=True, check=True)
    shown = done.stdout
    assert not set(shown) & (set(range(32)) - {10}) and 127 not in shown
    text = shown.decode("utf-8")
    assert "\\x1b]0;owned\\x07\\xc2\\x9b1m\\xe2\\x80\\xaeäß→" in text and "\x9b" not in text and "\u202e" not in text
    assert text.count("owned") >= 10


def test_control_characters_of_words_and_namelists_do_not_reach_the_screen():
    evil = "\x1b]0;owned\x07\x9b\u202eä"
    with open("evil.nml", "w", encoding="utf-8") as file:
        file.write(SCENE.replace("'gas'", "'owned\x9b\u202e'"))
    with open("control.nml", "w", encoding="utf-8") as file:
        file.write(SCENE.replace("'gas'", f"'{evil}'"))
    assert "the character with code 27 is not allowed here" in call("run", "control.nml")[2]
    os.mkdir(evil)
    shutil.copy("scene.nml", f"{evil}/{evil}.nml")
    calls = (("run", "evil.nml"), ("check", f"{evil}.nml"), ("info", evil), (evil,),
             (f"--{evil}",), ("run", "scene.nml", "--set", f"{evil}=1"),
             ("run", "scene.nml", "--set", f"scene.name={evil}"),
             ("replay", evil), ("replay", "scene.nml", "--finder", evil), ("bench", evil),
             ("run", f"{evil}/{evil}.nml"), ("run", f"{evil}/{evil}.nml"), ("run", "x", evil),
             ("run", "scene.nml", "--threads", evil), ("run", "scene.nml", "--walltime", evil))
    for words in calls:
        done = subprocess.run(command(words), capture_output=True, check=False)
        for shown in done.stdout, done.stderr:
            assert not set(shown) & (set(range(32)) - {10}), (words, shown)
            assert "\u202e" not in shown.decode("utf-8") and "\x9b" not in shown.decode("utf-8"), (words, shown)
        assert b"owned" in done.stdout + done.stderr, (words, done)
    with open(f"results/{evil}/log.txt", "rb") as file:
        log = file.read()
    assert b"owned" in log and not set(log) & (set(range(32)) - {10})
