"""Every namelist entry with every bad value: check_bad_entries.py PROGRAM ENTRIES.txt... [--full].

The entries are those of the tables, that of runs first. Each gets values of a wrong type, negative, zero, huge and tiny
ones, NaN, no value, lists in place of numbers and misspelt words, in a file and by --set, with each scene that uses it.
Either the value is refused: code 2 and a message that names the entry, and its line or --set. Or it is legal: `check`
ends with code 0, or with code 1 and the message of a guard that stops the run at its start, and prints no NaN and no
infinity. A legal value of an entry that acts during a run is also run for some steps.

Without --full a sample of all cases is tried, which has each row of the table.
"""

import concurrent.futures
import itertools
import os
import random
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(sys.argv[2]).parent))
from make_entries import read_table  # noqa: E402

#: Longest time of a call [s]; most take some hundredths, but the machine may be busy
PATIENCE = 60
#: Number of cases of a sample beside one of each kind of value for each row
SAMPLE = 250
#: Seed of the sample
SEED = 32

#: Required entries of each scene
SCENES = {
    "drum": {"bodies": "20"}, "hopper": {"bodies": "20", "opening": "0.03", "slope": "45"},
    "gas": {"bodies": "20", "speed": "1"}, "bed": {"bodies": "20"}, "heap": {"bodies": "20"},
    "channel": {"bodies": "20", "speed": "1"}, "incline": {"width": "0.02", "height": "0.01", "slope": "30"},
    "stack": {"bodies": "3", "width": "0.01", "height": "0.01"},
}
#: Name of the instance of a repeatable group
NAME = "only_1"
#: Required entries of each motion
MOTIONS = {"rotation": {"rate": "1"}, "translation": {"velocity": "0.1, 0"},
           "oscillation": {"amplitude": "1e-3, 0", "frequency": "10"},
           "conveyor": {"velocity": "0.1, 0"}, "table": {"file": "'none.csv'"}}
#: Required entries of each kind of wall, region, arrangement and shape of grains, by the entry and its word
PARTS = {
    "outline": {"line": {"from": "-1, -1", "to": "2, -1", "thickness": "0.1"},
                "polyline": {"vertices": "-1, -1, 1, -1, 2, 0", "thickness": "0.1"},
                "rectangle": {"low": "-1, -2", "high": "2, -1"}, "bodies": {"bodies": "1"},
                "ring": {"centre": "0.5, 0.5", "radius": "1", "segments": "20", "thickness": "0.1"},
                "polygon": {"vertices": "-1, -2, 1, -2, 0, -1"}, "result": {},
                "row": {"from": "-1, -1", "to": "2, -1", "radius": "0.1", "segments": "10"}},
    "region": {"box": {"low": "0, 0", "high": "0.2, 0.2"}, "disc": {"radius": "0.1"}, "at": {"at": "0.1, 0.1"},
               "polygon": {"vertices": "0, 0, 0.2, 0, 0.2, 0.2, 0, 0.2"}, "inside": {"wall": f"'{NAME}'"}},
    "arrangement": {"loose": {}, "spread": {}, "row": {}, "random": {}, "single": {"region": "at"},
                    "column": {"region": "at", "shape": "rectangle"}, "packing": {"packing": "'none'"},
                    "voronoi": {"gap": "1e-4"}},
    "shape": {"ellipse": {}, "regular": {"diameter": "8e-3, 9e-3"}, "random": {"diameter": "8e-3, 9e-3"},
              "rectangle": {"width": "9e-3", "height": "4e-3"}, "cross": {"width": "9e-3", "arm": "3e-3"},
              "outline": {"outline": "-4e-3, -4e-3, 4e-3, -4e-3, 0, 5e-3"}},
    "sizes": {"uniform": {}, "octaves": {"size_ratio": "2"}, "log_normal": {"size_spread": "1.2"},
              "grading": {"grading": "1, 0, 2, 1"}}, "momentum": {"random": {}, "zero": {}},
}
#: Required entries of groups that need a scene of parts
REQUIRED = {"cell": {"periodic": "xy", "size": "1, 1"}, "load": {"wall": f"'{NAME}'", "direction": "x", "force": "1"},
            "stage": {},
            "source": {"low": "0.3, 0.3", "high": "0.5, 0.5", "count": "9"},
            "sink": {"low": "-1, -3", "high": "2, -2.5"},
            "sample": {},
            "contact_pair": {"materials": f"'{NAME}', '{NAME}'", "friction_coefficient": "0.1"}}
#: What is not a number, or not one number
NO_NUMBERS = ("'text'", "word", ".true.", "nan", "NaN", "inf", "-inf", "Infinity", "", "1 2 3", "1, 2, 3", ",", "1,,2",
              "0x10", "1_4", "2**1", "2*", "*1", "(1,2)", "1.e", "--1", "1e+", "+", "1d400", "1e400", "1e999999",
              "1e-400", "1" + 400*"0")
#: Numbers of any size
NUMBERS = ("-1", "0", "9e99", "-9e99", "1e-300", "-1e-300", "1.7e308", "1e30", "1e12", "1e9", "1e-20", "1.", "1, 2",
           "0." + 400*"3")
#: Values of each type of entry
VALUES = {
    "real": NO_NUMBERS + NUMBERS,
    "integer": (*NO_NUMBERS, *NUMBERS, "1.5", "1e3", "2147483647", "2147483648", "-2147483648", "99999999999999999999",
                "300000000"),
    "logical": ("'text'", "maybe", "1", "0", "-1", "", "nan", ".true. .false.", "'.true.'", "9e99"),
    "word": ("'nonsense'", "nonsense", "1", "''", "", "'none', 'none'", "nan", ".true.", "'NONE'", "' '",
             f"'{5000*'x'}'"),
    "name": ("nonsense", "1", "''", "", "'a', 'b'", "nan", ".true.", "' '", "'a b'", "'a.b'", "'a-b'", "'\u00e9'",
             "'/'", "'legal_1'", f"'{5000*'x'}'"),
    "path": ("1", "''", "", "'a', 'b'", "nan", ".true.", "'/nonexistent/x'", "'/dev/null'", "' '", "'a\tb'",
             f"'{5000*'x'}'"),
}
#: Steps of a run; stiff bodies need many
MOST_STEPS = 10000
#: Groups whose entries also act after the start
RUNNING = ("neighbours", "overlap", "guards", "decomposition", "output", "checkpoint", "forces")


class Case(NamedTuple):
    """An entry with a value."""

    #: Row of the table
    row: tuple
    #: All other entries, group.key -> value
    settings: dict
    value: str
    #: Whether the value is given by --set
    is_override: bool

    @property
    def name(self):
        return entry_of(self.row.group, self.row.key)


def entry_of(group, key):
    """The entry as overrides name it."""
    return f"{group}.{NAME}.{key}" if group in REPEATABLE else f"{group}.{key}"


def contexts(row):
    """Settings with which a row is in use."""
    if row.group in ("grains", "wall"):
        for parts in parts_with(row):
            yield {**parts, "integrate.duration": "1e-3"}
        return
    if row.group in REQUIRED:
        yield from with_required(row)
        return
    key, _, words = row.needs.rpartition(":")
    scenes, others = ["bed"], [{}]
    if row.group == "scene" and key == "name":
        scenes = [word for word in words.split() if word in SCENES]
    elif row.group == "scene" and not key:
        scenes = list(SCENES)
    elif row.group == "motion":
        others = [{entry_of("motion", key): value for key, value in {"kind": word, **MOTIONS[word]}.items()}
                  for word in words.split() or MOTIONS]
    elif key:
        others = [{entry_of(row.group, key): word} for word in words.split()]
    if row.group in REPEATABLE:
        others = [{entry_of(row.group, "name"): f"'{NAME}'", **other} for other in others]
    for scene, other in itertools.product(scenes, others):
        yield {"scene.name": scene, **{f"scene.{key}": value for key, value in SCENES[scene].items()}, **other,
               "integrate.duration": "1e-3"}


def with_required(row):
    """A scene of parts with a group and its required entries, with which a row of the group is in use."""
    key, _, words = row.needs.rpartition(":")
    parts = {"wall": {"outline": "rectangle", **PARTS["outline"]["rectangle"]},
             "grains": {"region": "box", "number": "9", **PARTS["region"]["box"]}, "material": {}}
    for word in words.split() or [None]:
        entries = {**REQUIRED[row.group], **({key: word} if word else {})}
        if row.group == "stage":
            until = entries.setdefault("until", "duration")
            entries.update({"duration": "1"} if until == "duration" else {"longest": "1", "below": "1"})
            entries.update({"wall": f"'{NAME}'", "opposite": f"'{NAME}'"} if until == "strain" else {})
            entries.update({"low": "0, 0", "high": "1, 1"} if until in ("count", "solid_fraction") else {})
            entries.update({"component": "xx"} if until == "stress" else {})
            if until == "departed":
                entries["above"] = entries.pop("below")
        if row.group == "source":
            entries.update(PARTS["shape"][entries.setdefault("shape", "ellipse")])
            entries.update(PARTS["sizes"][entries.setdefault("sizes", "octaves")])
        if entries.get("area") == "rectangle":
            entries.update({"low": "0, 0", "high": "1, 1"})
        if row.group == "sample" and word == "walls":
            entries.update({"sides": f"'{NAME}', '{NAME}'"})
        if entries.get("direction") == "angle":
            entries["torque"] = entries.pop("force")
        groups = {**({"grains": parts["grains"]} if row.group == "cell" else parts), row.group: entries}
        if row.group == "cell":
            groups["forces"] = {"gravity": "0, 0"}
        if entries.get("until") == "departed":
            groups["sink"] = REQUIRED["sink"]
        if entries.get("until") == "stress":
            groups["sample"] = {"area": "rectangle", "low": "0, 0", "high": "1, 1"}
        yield {**{entry_of(group, name): value for group, given in groups.items()
                  for name, value in {**({"name": f"'{NAME}'"} if group in REPEATABLE else {}), **given}.items()},
               **({} if row.group == "stage" else {"integrate.duration": "1e-3"})}


def parts_with(row):
    """Walls and grains with which a row of one of their groups is in use."""
    key, _, words = row.needs.rpartition(":")
    for word in words.split() or [None]:
        wall, grains = {"outline": "rectangle"}, {"region": "box", "number": "9"}
        (wall if row.group == "wall" else grains).update({key: word} if word else {})
        wall.update(PARTS["outline"][wall["outline"]])
        for name in 2 * ["arrangement", "shape", "sizes", "momentum", "region"]:
            grains.update(PARTS[name].get(grains.get(name), {}))
        if grains["region"] == "inside":
            wall = {"outline": "ring", **PARTS["outline"]["ring"]}
        if grains["region"] == "at" and grains.get("arrangement") != "column":
            grains["number"] = "1"
        yield {entry_of(group, name): value for group, entries in (("wall", wall), ("grains", grains))
               for name, value in {"name": f"'{NAME}'", **entries}.items()}


def all_cases(rows):
    """Cases of each row, (row: list of cases)."""
    for row in rows:
        if row.key in ("bodies_file", "start_from"):
            usual = [{"scene.name": row.needs.split()[-1], "integrate.duration": "1e-3"}]
        elif row.group == "bench":
            # The scene does not exist, so a bench whose entries are legal ends at once.
            usual = [{"bench.scenes": "'no.nml'", "bench.names": "'no'", "bench.finders": "'two_level'"}]
        else:
            usual = list(contexts(row))
        yield [Case(row, settings, value, way) for settings in usual for value in VALUES[row.type]
               for way in (True, False)]


def namelist(settings):
    """Text of a namelist, one entry per line."""
    text = ""
    for group in dict.fromkeys(name.partition(".")[0] for name in settings):
        text += f"&{group}\n"
        for name, value in settings.items():
            if name.startswith(f"{group}."):
                quoted = f"'{value}'" if re.fullmatch("[a-z_]+", value) and name in WORDS else value
                text += f"  {name.rpartition('.')[2]} = {quoted}\n"
        text += "/\n"
    return text


def call(program, folder, case, verb, *more):
    """Code, output, messages and time of a call."""
    settings = dict(case.settings)
    if not case.is_override:
        settings[case.name] = case.value
    path = Path(folder) / "case.nml"
    path.write_text(namelist(settings), encoding="utf-8")
    command = [program + "_lab" * (verb == "bench"), verb, str(path), *more]
    if case.is_override:
        command += ["--set", f"{case.name}={case.value}"]
    began = time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=PATIENCE, check=False,
                          cwd=folder, env={**os.environ, "OMP_NUM_THREADS": "1"})
    return done.returncode, done.stdout, done.stderr, time.monotonic() - began


def fault_of(program, case):
    """What is wrong with the answer to a case; empty if nothing is."""
    with tempfile.TemporaryDirectory() as folder:
        verb = "bench" if case.row.group == "bench" else "check"
        try:
            code, output, message, _ = call(program, folder, case, verb)
            fault = fault_of_answer(case, code, output, message)
            steps = re.search(r"^duration .* s, (\d+) steps$", output, re.MULTILINE)
            if not fault and code == 0 and case.row.group in RUNNING and case.row.key != "folder" and steps and int(
                    steps[1]) < MOST_STEPS:
                code, output, message, _ = call(program, folder, case, "run", "--set", "output.folder=result", "--set",
                                                "integrate.duration=1e-4")
                fault = fault_of_answer(case, code, output, message)
        except subprocess.TimeoutExpired:
            return f"takes more than {PATIENCE} s"
        return fault


def fault_of_answer(case, code, output, message):
    """What is wrong with an answer; empty if nothing is."""
    stopped = code == 1 and re.match(r"polydem: step \d+: ", message)
    if code == 0 or stopped or (case.row.group == "bench" and "there is no file 'no.nml'" in message):
        # A name may be nan.
        lines = [line for line in output.splitlines() if not re.search(r"= '|\.nml", line)]
        wrong = [line for line in lines if re.search(r"(?i)(?<![\w'])(nan|[+-]?inf(inity)?)\b|\*\*\*", line)]
        return f"prints {wrong[0]!r}" if wrong else ""
    # A bench that is legal looks for its scenes.
    if case.name == "bench.scenes" and message.startswith("polydem: scene no: "):
        return ""
    # A file that cannot be read has code 3.
    if code != 2 and not (code == 3 and case.row.type == "path"):
        return f"code {code}: {message[-300:]!r} {output[-100:]!r}"
    # A very long or thick wall needs too many boxes.
    if case.row.group == "wall" and "largest_ratio in &boxes" in message:
        return ""
    # Large bodies do not fit into the rectangle of their source, and a long stage may need too many steps.
    if case.row.group == "source" and "leaves no room" in message:
        return ""
    if case.name.endswith(".longest") and "duration" in message:
        return ""
    # The scene has one wall only; a sample between walls and a strain need two. Zero is no limit of a condition.
    if case.row.group == "sample" and "names the same wall twice" in message:
        return ""
    if case.row.group == "stage" and re.search("must be another wall|needs a limit: give 'below' or", message):
        return ""
    # A light wall needs small steps, and a table of a motion is not there.
    if case.row.group == "load" and case.row.key == "mass" and "requires" in message:
        return ""
    if case.row.group == "motion" and "none.csv: no such file" in message:
        return ""
    # What two parts do to each other is said of one of them.
    named = [case.row.key, *[f"{part} {NAME}" for part in ("grains", "wall") if case.row.group in ("grains", "wall")],
             *[f"{part} {NAME}" for part in ("source", "stage") if case.row.group == part],
             "bodies of &grains and &wall", "bodies of &source"]
    if not any(name in message for name in named):
        return f"the message does not name the entry: {message[:300]!r}"
    place = "--set " if case.is_override else r"case\.nml:\d+: "
    return "" if re.search(place, message) else f"the message does not say where the entry is given: {message[:300]!r}"


def sample(cases):
    """Some cases of each row, and some of all."""
    draw = random.Random(SEED)
    chosen = [case for each in cases for case in draw.sample(each, 2)]
    return chosen + draw.sample([case for each in cases for case in each], SAMPLE)


def main():
    program, rows = str(Path(sys.argv[1]).resolve()), []
    for table in (Path(word) for word in sys.argv[2:] if word != "--full"):
        groups, found = read_table(table.read_text(encoding="utf-8"), table.parent)
        REPEATABLE.update(name for name, group in groups.items() if group.is_repeatable)
        rows += found
    WORDS.update(entry_of(row.group, row.key) for row in rows if row.type == "word")
    cases = list(all_cases(rows))
    tried = [case for each in cases for case in each] if "--full" in sys.argv else sample(cases)
    faults = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for case, fault in zip(tried, pool.map(lambda case: fault_of(program, case), tried)):
            if fault:
                faults += 1
                way = "--set " if case.is_override else ""
                print(f"{way}{case.name} = {case.value[:60]} with {case.settings}: {fault}", flush=True)
    print(f"{len(tried)} values of {len(rows)} rows of the table tried, {faults} faults")
    sys.exit(faults > 0)


#: Entries that are words, and groups that have names
WORDS, REPEATABLE = set(), set()

if __name__ == "__main__":
    main()
