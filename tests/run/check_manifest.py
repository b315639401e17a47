"""The manifest: damage is found, files of other origin stay, and `--force` always leaves one complete result.

usage: check_manifest.py PROGRAM FAILING_CALLS [all]

FAILING_CALLS is the library of failing_calls.c. With `all`, a run with `--force` is disturbed at every single call that
writes, otherwise at all calls that set the old result aside, and at the first and the last of each kind of the later
ones; and every file stands in the way of every run, or is a link, and 200 bits are flipped, otherwise a sample.
"""

import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

#: Few bodies, so a run takes some milliseconds; they overlap, so a run writes overlaps.csv
SCENE = """\
&scene name = 'gas' bodies = 6 solid_fraction = 0.8 overlap = .true. speed = 0.5 spin = 20 /
&forces stiffness = 1e6 /
&integrate dt = 1e-5 duration = 1.2e-4 /
&output frame_interval = 2e-5 frames_per_segment = 3 /
&guards listed_depth = 1e-9 /
&checkpoint steps = 5 /
"""
#: Enough bodies for the packing of another scene
BED = "&scene name = 'bed' bodies = 700 / &integrate duration = 5e-4 /\n"
#: Options that record boxes and steps
RECORDED = ("--set", "output.trace_steps=3", "--set", "output.step_profile=.true.")
#: Options of another run, whose files differ
OTHER = ("--set", "forces.gravity=0,-9")
#: Names that files of a result have
NAMES = ("trace.h5", "steps.h5", "overlaps.csv", "profile.h5", "trajectory_0001.h5", "trajectory_0007.h5", "log.txt",
         "checkpoint_1.h5", "checkpoint_2.h5", "manifest.txt")
ENDINGS = ("", ".unfinished", ".open")
#: Exit codes of a run, as inputs/getting_started.md lists them
BAD_INPUT, NO_FILE = 2, 3
WAYS = ((), ("--continue",), ("--force",))


class Program:
    """The program, and an undisturbed result."""

    def __init__(self, path, library):
        self.path = path
        self.library = library
        write("scene.nml", SCENE.encode())
        write("bed.nml", BED.encode())
        code, output, message = self.run("whole", *RECORDED)
        assert code == 0, message
        self.hash = output.splitlines()[-1]
        assert self.check("whole")[0] == 0, self.check("whole")

    def call(self, *words, cwd=None, **hostile):
        environment = {**os.environ, "OMP_NUM_THREADS": "1", **hostile}
        done = subprocess.run([self.path, *words], capture_output=True, text=True, env=environment, check=False,
                              cwd=cwd)
        return done.returncode, done.stdout, done.stderr

    def run(self, folder, *options, scene="scene.nml", **hostile):
        return self.call("run", scene, "--threads", "1", "--set", f"output.folder={folder}", *options, **hostile)

    def check(self, folder):
        code, output, message = self.call("info", "--check", folder)
        assert (code == 0) == ("WRONG" not in output), (code, output, message)
        return code, output, message


def contents(folder):
    """Bytes of all files below a folder, by path."""
    found = {}
    for place, _, names in os.walk(folder):
        for name in names:
            path = os.path.join(place, name)
            with open(path, "rb") as file:
                found[os.path.relpath(path, folder)] = file.read()
    return found


def write(path, data):
    with open(path, "wb") as file:
        file.write(data)


def segments(folder):
    return sorted(name for name in os.listdir(folder) if re.fullmatch(r"trajectory_\d{4}\.h5", name))


def copy(name, source="whole"):
    shutil.rmtree(name, ignore_errors=True)
    shutil.copytree(source, name)
    return name


def every_file_is_listed_with_its_checksum(program):
    code, output, _ = program.check("whole")
    files = sorted(os.listdir("whole"))
    assert code == 0 and sorted(re.findall(r"^ok +(\S+)", output, re.MULTILINE)) == files, (output, files)
    assert {"trace.h5", "steps.h5", "overlaps.csv", "profile.h5", "trajectory_0002.h5", "checkpoint_2.h5"} <= {*files}


def flipped_bits_are_found(program, thoroughly):
    chance = random.Random(4)
    folder = copy("flipped")
    n_tried = 0
    for name, n_flips in (("trajectory_0001.h5", 40), ("trajectory_0003.h5", 20), ("profile.h5", 40),
                          ("manifest.txt", 60), ("trace.h5", 10), ("steps.h5", 10), ("overlaps.csv", 10),
                          ("checkpoint_1.h5", 10)):
        with open(f"whole/{name}", "rb") as file:
            good = file.read()
        n_flips = n_flips if thoroughly else n_flips * 2 // 5
        for k in range(n_flips):
            # Spread over the whole file, the first and the last byte among them
            place = k * (len(good) - 1) // (n_flips - 1)
            bad = bytearray(good)
            bad[place] ^= 1 << chance.randrange(8)
            write(f"{folder}/{name}", bad)
            code, output, _ = program.check(folder)
            assert code == NO_FILE and f"WRONG  {name}" in output, (name, place, output)
            if k % 4 == 0 and name == "overlaps.csv":
                code, _, message = program.run(folder, "--continue", *RECORDED)
                assert code == 0 and program.check(folder)[0] == 0, (place, message)
                assert contents(folder) == contents("whole"), place
            elif k % 4 == 0 and not name.startswith("checkpoint"):
                code, _, message = program.run(folder, "--continue", *RECORDED)
                assert code != 0 and f"{folder}/{name}" in message, (name, place, code, message)
            n_tried += 1
        write(f"{folder}/{name}", good)
    assert program.check(folder)[0] == 0
    print(f"  {n_tried} bits")


def missing_cut_and_exchanged_files_are_found(program):
    code, _, message = program.run("other", *RECORDED, *OTHER)
    assert code == 0, message
    names = [*segments("whole"), "profile.h5", "trace.h5", "overlaps.csv"]
    assert len(names) == 6, names

    def expect(name, folder):
        code, output, _ = program.check(folder)
        assert code == NO_FILE and f"WRONG  {name}" in output, (name, output)
        before = contents(folder)
        code, _, message = program.run(folder, "--continue", *RECORDED)
        if name == "overlaps.csv":
            # A run makes this table again.
            assert code == 0 and contents(folder) == contents("whole"), message
            return
        assert code == NO_FILE and f"{folder}/{name}" in message and "--force" in message, (name, code, message)
        assert contents(folder) == before

    for name in names:
        folder = copy("missing")
        os.remove(f"{folder}/{name}")
        expect(name, folder)
        for length in (0, 100, os.path.getsize(f"whole/{name}") - 1):
            folder = copy("cut")
            os.truncate(f"{folder}/{name}", length)
            expect(name, folder)
        if name == "overlaps.csv":
            continue  # the same in both results
        folder = copy("exchanged")
        shutil.copy(f"other/{name}", folder)
        expect(name, folder)
    folder = copy("swapped")
    os.rename(f"{folder}/{names[0]}", "aside")
    os.rename(f"{folder}/{names[1]}", f"{folder}/{names[0]}")
    os.rename("aside", f"{folder}/{names[1]}")
    expect(names[0], folder)
    # A truncated manifest of any length is detected.
    with open("whole/manifest.txt", "rb") as file:
        good = file.read()
    folder = copy("cut")
    for length in range(0, len(good), 23):
        write(f"{folder}/manifest.txt", good[:length])
        code, output, _ = program.check(folder)
        assert code == NO_FILE, (length, output)


def open_files_of_another_run_are_found(program):
    """Files without a checksum in the manifest: a segment whose closing a kill prevented, and checkpoints."""
    for folder in "first", "equal":
        code, _, message = program.run(folder)
        assert code == 0, message
    last = segments("first")[-1]
    assert os.path.getsize(f"equal/{last}") == os.path.getsize(f"first/{last}")
    cases = {f"equal/{last}": (f"{last} was written by another run", [last]),
             f"first/{segments('first')[0]}": (f"{last} was written as {segments('first')[0]}", [last]),
             "equal/checkpoint_1.h5": ("was written by another run", ["checkpoint_1.h5", "checkpoint_2.h5"])}
    for source, (words, names) in cases.items():
        folder = copy("begun", "first")
        os.remove(f"{folder}/profile.h5")
        seal_list(Path(folder, "manifest.txt"),
                  lambda lines: re.sub(f"^(profile.h5|{last})( +)closed", r"\1\2  open", lines, flags=re.MULTILINE))
        for name in names:
            shutil.copy(source if name == last else f"equal/{name}", f"{folder}/{name}")
        before = contents(folder)
        code, _, message = program.run(folder, "--continue")
        assert code == NO_FILE and words in message, (source, code, message)
        assert contents(folder) == before
        code, output, _ = program.check(folder)
        assert code == NO_FILE and f"WRONG  {names[0]}" in output, (source, output)
    shutil.copy("first/checkpoint_1.h5", f"{folder}/checkpoint_1.h5")
    code, output, message = program.run(folder, "--continue")
    assert code == 0 and "checkpoint_2.h5 was written by another run" in output, (output, message)
    assert output.splitlines()[-1] == program.hash


def ways_of(k, thoroughly):
    """All ways to start a run, or one of them in turn"""
    return WAYS if thoroughly else WAYS[k % 3:k % 3 + 1]


def files_of_somebody_else_stay(program, thoroughly):
    for n, name in enumerate(NAMES):
        for k, ending in enumerate(ENDINGS):
            for way in ways_of(n + k, thoroughly):
                shutil.rmtree("foreign", ignore_errors=True)
                os.makedirs("foreign")
                write(f"foreign/{name}{ending}", b"foreign")
                code, _, message = program.run("foreign", *way, *RECORDED)
                if (name, ending) == ("manifest.txt", ".open"):
                    assert code == 0, message  # nothing ever has this name
                else:
                    assert code == BAD_INPUT and f"foreign/{name}{ending}" in message, (name, ending, way, message)
                    assert "Move the file away" in message and os.listdir("foreign") == [name + ending], message
                assert contents("foreign")[name + ending] == b"foreign", (name, ending, way)
    # Beside a result that has no such file
    code, _, message = program.run("plain", "--set", "guards.listed_depth=1")
    assert code == 0, message
    for n, name in enumerate(("trace.h5", "steps.h5", "overlaps.csv", "mine.txt")):
        for k, ending in enumerate(ENDINGS):
            for way in ways_of(n + k, thoroughly):
                folder = copy("beside", "plain")
                write(f"{folder}/{name}{ending}", b"foreign")
                shutil.rmtree(f"{folder}.1", ignore_errors=True)
                code, _, message = program.run(folder, *way, "--set", "guards.listed_depth=1")
                assert code == (0 if way else BAD_INPUT), (name, way, message)
                place = f"{folder}.1" if way == ("--force",) else folder
                assert contents(place)[name + ending] == b"foreign", (name, ending, way)
                assert program.check(folder)[0] == 0, (name, ending, way)


def nothing_is_written_through_links(program, thoroughly):
    """Files of a result that are links, or have a second name as in a copy made with `cp -al`."""
    code, _, message = program.run("linkable")
    assert code == 0, message
    names = sorted(name for name in os.listdir("linkable"))
    for way in "hard", "soft", "nowhere":
        some = names if thoroughly else random.Random(way).sample(names, 3)
        for chosen in [*([name] for name in some), names]:
            if way == "nowhere" and chosen == names:
                continue
            shutil.rmtree("snapshot", ignore_errors=True)
            folder = copy("linked", "linkable")
            os.makedirs("snapshot")
            before = contents(folder)
            for name in chosen:
                if way == "hard":
                    os.link(f"{folder}/{name}", f"snapshot/{name}")
                else:
                    os.rename(f"{folder}/{name}", f"snapshot/{name}")
                    os.symlink(f"../snapshot/{name}" if way == "soft" else f"../absent/{name}", f"{folder}/{name}")
            code, _, message = program.run(folder, "--continue", "--changed", "--set", "integrate.duration=2.4e-4")
            assert way == "nowhere" or code == 0, (way, chosen, message)
            assert contents("snapshot") == {name: before[name] for name in chosen}, (way, chosen)
            assert not os.path.exists("absent"), (way, chosen)
    # Names of files that a run has not made yet
    for name in ("log.txt", "profile.h5", "checkpoint_1.h5", "trajectory_0001.h5", "overlaps.csv"):
        for ending in ENDINGS:
            shutil.rmtree("linked")
            os.makedirs("linked")
            os.symlink("../absent", f"linked/{name}{ending}")
            code, _, message = program.run("linked", "--force")
            assert code == BAD_INPUT and f"linked/{name}{ending} blocks" in message, (name, ending, code, message)
            assert not os.path.exists("absent")


def a_result_without_a_manifest_is_left_alone(program):
    folder = copy("older")
    os.remove(f"{folder}/manifest.txt")
    before = contents(folder)
    for way in WAYS:
        code, _, message = program.run(folder, *way, *RECORDED)
        assert code == BAD_INPUT and f"{folder}/" in message and "blocks a file" in message, (way, message)
        assert contents(folder) == before
    code, _, message = program.call("info", "--check", folder)
    assert code == NO_FILE and "has no manifest.txt" in message, message


def force_does_not_replace_its_own_input(program):
    code, _, message = program.run("packed", scene="bed.nml")
    assert code == 0, message
    os.symlink("packed", "link")
    os.symlink("packed/trajectory_0001.h5", "segment")
    shutil.copy("scene.nml", "packed/log.txt")
    os.symlink("packed/log.txt", "log.nml")
    before = contents("packed")
    packings = ("packed", "./packed/../packed", "link", "packed/trajectory_0001.h5", "segment")
    calls = [("bed.nml", ("--set", f"scene.packing={path}", "--set", "scene.bodies=20")) for path in packings]
    calls += [("packed/log.txt", ()), ("log.nml", ())]
    for scene, options in calls:
        for folder in ("packed", "link"):
            code, _, message = program.run(folder, "--force", *options, scene=scene)
            assert code == BAD_INPUT and f"--force would rename {folder}" in message, (scene, options, code, message)
            assert contents("packed") == before
    code, _, message = program.run("unpacked", "--force", *calls[0][1], scene="bed.nml")
    assert code == 0, message
    code, _, message = program.run(".", "--force", scene="../bed.nml", cwd="packed")
    assert code == BAD_INPUT and "holds the working directory" in message, (code, message)
    assert contents("packed") == before


def force_renames_the_folder_with_all_files(program):
    folder = copy("forced")
    write(f"{folder}/mine.txt", b"mine")
    os.mkdir(f"{folder}.1")
    before = contents(folder)
    for k in (2, 3):
        code, output, message = program.run(folder, "--force", *OTHER)
        assert code == 0 and f"is in {os.path.abspath(folder)}.{k}" in output, (code, output, message)
        assert contents(f"{folder}.{k}") == before and not os.listdir(f"{folder}.1")
        before = contents(folder)
        assert program.check(folder)[0] == 0 and program.check(f"{folder}.{k}")[0] == 0
    # A link to the folder stays a link.
    os.symlink(folder, "to_forced")
    code, _, message = program.run("to_forced/", "--force", *OTHER)
    assert code == 0 and os.readlink("to_forced") == folder and contents(f"{folder}.4") == before, message


def other_bodies_are_not_taken_for_the_finished_run(program):
    bed = ("--set", "scene.packing=grains", "--set", "scene.bodies=20")
    for seed in (1, 2):
        code, _, message = program.run(f"grains_{seed}", "--set", f"scene.seed={seed}", scene="bed.nml")
        assert code == 0, message
    shutil.copytree("grains_1", "grains")
    for checkpoints in (("--set", "checkpoint.steps=4"), ("--set", "checkpoint.steps=0")):
        shutil.rmtree("poured", ignore_errors=True)
        copy("grains", "grains_1")
        code, _, message = program.run("poured", *bed, *checkpoints, scene="bed.nml")
        assert code == 0, message
        code, output, message = program.run("poured", *bed, *checkpoints, "--continue", scene="bed.nml")
        assert code == 0 and "nothing to do" in output, message
        before = contents("poured")
        copy("grains", "grains_2")
        for changed in ((), ("--changed",)):
            code, _, message = program.run("poured", *bed, *checkpoints, "--continue", *changed, scene="bed.nml")
            assert code == BAD_INPUT and "the contents of packing = 'grains' changed" in message, (code, message)
            assert contents("poured") == before


def a_disturbed_force_leaves_a_whole_result(program, thoroughly):
    old = {**contents("whole"), "mine.txt": b"mine"}
    code, output, message = program.run("new", *OTHER)
    assert code == 0, message
    new_hash = output.splitlines()[-1]
    assert new_hash != program.hash
    log, places = os.path.abspath("calls"), {"LD_PRELOAD": program.library, "POLYDEM_FAIL_FOLDER": os.getcwd()}

    def disturbed(folder, **more):
        """A run over a copy of the old result, and its calls."""
        shutil.rmtree("disturbed.1", ignore_errors=True)
        copy(folder)
        write(f"{folder}/mine.txt", b"mine")
        write(log, b"")
        told = program.run(folder, "--force", *OTHER, **places, **more, POLYDEM_FAIL_LOG=log)
        with open(log, encoding="utf-8") as file:
            return told, [Call(0, *line.split(" ", 2)) for line in file.read().splitlines()]

    (code, _, message), calls = disturbed("disturbed")
    assert code == 0, message
    aside = next(k for k, call in enumerate(calls) if (call.name, call.path) == ("rename", "disturbed.1"))
    chosen = calls if thoroughly else calls[:aside + 1] + sample(calls[aside + 1:])
    for kind in ("once", "kill"):
        ends = {"old": 0, "new": 0}
        for at in chosen:
            folder = "disturbed"
            (code, output, message), _ = disturbed(folder, POLYDEM_FAIL_HOW=kind, POLYDEM_FAIL_CALL=str(at.number))
            assert code == -9 if kind == "kill" else code != -9, (str(at), code, message)
            tried = (kind, str(at), code, output, message)
            former = "disturbed.1" if os.path.exists("disturbed.1") else folder
            after = contents(former)
            after.pop("running.lock", None)
            assert after == old, (tried, after.keys())
            assert program.check(former)[0] == 0, (tried, program.check(former))
            if former == folder:
                ends["old"] += 1
                code, output, message = program.run(folder, "--continue", *RECORDED)
                assert code == 0 and "nothing to do" in output, (tried, message)
            else:
                ends["new"] += 1
                code, output, message = program.run(folder, "--continue", *OTHER)
                assert code == 0, (tried, message)
                assert output.splitlines()[-1] == new_hash, (tried, output)
                assert program.check(folder)[0] == 0, (tried, program.check(folder))
        print(f"  {kind}: {len(chosen)} of {len(calls)} calls, the old result was whole after {ends['old']}, the "
              f"new one after {ends['new']}")
        assert ends["old"] >= 3 and ends["new"] > 15, ends


def main():
    program_path, library = (os.path.abspath(word) for word in sys.argv[1:3])
    thoroughly = sys.argv[3:] == ["all"]
    with tempfile.TemporaryDirectory() as work:
        os.chdir(os.path.realpath(work))
        program = Program(program_path, library)
        tests = (every_file_is_listed_with_its_checksum, flipped_bits_are_found,
                 missing_cut_and_exchanged_files_are_found, open_files_of_another_run_are_found,
                 files_of_somebody_else_stay,
                 nothing_is_written_through_links, a_result_without_a_manifest_is_left_alone,
                 force_does_not_replace_its_own_input, other_bodies_are_not_taken_for_the_finished_run,
                 force_renames_the_folder_with_all_files, a_disturbed_force_leaves_a_whole_result)
        for test in tests:
            began = time.monotonic()
            test(program, *([thoroughly] if "thoroughly" in test.__code__.co_varnames else []))
            print(f"{test.__name__.replace('_', ' ')}: {time.monotonic() - began:.1f} s", flush=True)


if __name__ == "__main__":
    sys.dont_write_bytecode = True
    sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "ranks"))
    from check_writes import Call, sample
    from seals import seal_list

    main()
