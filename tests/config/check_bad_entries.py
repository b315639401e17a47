"""Every namelist entry with every bad value: check_bad_entries.py PROGRAM ENTRIES.txt... [--full].

The entries are those of the tables, that of runs first. Each gets values of a wrong type, negative, zero, huge and tiny
ones, NaN, no value, lists in place of numbers and misspelt words, in a file and by --set, with each scene that uses it.
Either the value is refused: code 2 and a message that names the entry, and its line or --set. Or it is legal: `check`
ends with code 0, or with code 1 and the message of a guard that stops the run at its start, and prints no NaN and no
infinity. A legal value of an entry that acts during a run is also run for some steps.

Without --full a sample of all cases is tried, which has each row of the table.
"""

import concurrent.futures
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
from generator.table import read_table  # noqa: E402

#: Longest time of a call [s]; most take some hundredths, but the machine may be busy
PATIENCE = 60
#: Number of cases of a sample beside one of each kind of value for each row
SAMPLE = 250
#: Seed of the sample
SEED = 32

#: Name of the instance of a repeatable group
NAME = "only_1"
#: Scenes that need a file, and the one of parts
NO_RECIPES = ("file", "result", "parts")
#: Values of required entries: by group.key@word with the word that they are used with, by group.key, or by key
GIVEN = {
    "bodies": "20", "opening": "0.03", "slope": "45", "scene.width": "0.02", "scene.height": "0.01", "speed": "1",
    "kind": "rotation", "rate": "1", "velocity": "0.1, 0", "amplitude": "1e-3, 0", "frequency": "10",
    "motion.file": "'none.csv'", "duration": "1e-3", "stage.duration": "1", "longest": "1", "component": "xx",
    "from": "-1, -1", "to": "2, -1", "wall.low": "-1, -2", "wall.high": "2, -1", "thickness": "0.1", "segments": "10",
    "wall.radius@ring": "1", "wall.radius@row": "0.1", "wall.vertices@polyline": "-1, -1, 1, -1, 2, 0",
    "wall.vertices@polygon": "-1, -2, 1, -2, 0, -1",
    "grains.low": "0, 0", "grains.high": "0.2, 0.2", "grains.radius": "0.1", "at": "0.1, 0.1",
    "grains.vertices": "0, 0, 0.2, 0, 0.2, 0.2, 0, 0.2", "packing": "'none'",
    "wall": f"'{NAME}'", "opposite": f"'{NAME}'", "materials": f"'{NAME}', '{NAME}'",
    "diameter": "8e-3, 9e-3", "width": "9e-3", "height": "4e-3", "arm": "3e-3", "size_ratio": "2",
    "size_spread": "1.2", "grading": "1, 0, 2, 1",
    "cell.size": "1, 1", "direction": "x", "sample.low": "0, 0", "sample.high": "1, 1",
    "source.low": "0.3, 0.3", "source.high": "0.5, 0.5", "sink.low": "-1, -3", "sink.high": "2, -2.5",
}
#: What a group needs beside its required entries: by group, group.key=word or key=word
BESIDE = {
    "name=drum": {"bodies": GIVEN["bodies"]},
    "grains": {"region": "box", "number": "9"}, "region=at": {"number": "1"},
    "arrangement=single": {"region": "at"}, "arrangement=column": {"number": "9", "region": "at", "shape": "rectangle"},
    "arrangement=voronoi": {"gap": "1e-4"}, "shape=outline": {"outline": "-4e-3, -4e-3, 4e-3, -4e-3, 0, 5e-3"},
    "wall": {"outline": "rectangle"}, "outline=bodies": {"bodies": "1"}, "outline=ring": {"centre": "0.5, 0.5"},
    "cell": {"periodic": "xy"}, "source": {"count": "9"}, "contact_pair": {"friction_coefficient": "0.1"},
    "direction=x": {"force": "1"}, "direction=y": {"force": "1"}, "direction=angle": {"torque": "1"},
    "area=walls": {"sides": f"'{NAME}', '{NAME}'"}, "until=departed": {"above": "1"},
    "until=count": {"below": "1", "low": "0, 0", "high": "1, 1"},
    "until=solid_fraction": {"below": "1", "low": "0, 0", "high": "1, 1"},
}
#: Groups that need a scene of parts
IN_PARTS = ("cell", "load", "stage", "source", "sink", "sample", "contact_pair")
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


def choose(group, chosen, key, value):
    """Give an entry of a group a value unless it has one, and with it what it needs."""
    if key in chosen:
        return
    chosen[key] = value
    for other, given in BESIDE.get(f"{group}.{key}={value}", BESIDE.get(f"{key}={value}", {})).items():
        choose(group, chosen, other, given)


def decider_of(row, chosen):
    """The value of the entry with which a row is used; empty if it is always used."""
    key = row.needs.partition(":")[0]
    rows = (each for each in ROWS if (each.group, each.key) == (row.group, key) and is_used(each, chosen))
    return chosen.get(key, next((each.default for each in rows), "")) if key else ""


def is_used(row, chosen):
    """Whether a row is in use beside chosen entries of its group."""
    return not row.needs or decider_of(row, chosen) in row.needs.partition(":")[2].split()


def entries_of(group, key="", word=""):
    """A group with all that it needs, and with a word of one of its entries."""
    chosen = {}
    for name, value in [*([(key, word)] if key else []), *BESIDE.get(group, {}).items()]:
        choose(group, chosen, name, value)
    for row in ROWS:
        if row.group != group or row.key in ("name", *chosen) or row.default != "required" or not is_used(row, chosen):
            continue
        names = (f"{group}.{row.key}@{decider_of(row, chosen)}", f"{group}.{row.key}", row.key)
        value = next((GIVEN[name] for name in names if name in GIVEN), None)
        if value is None:
            sys.exit(f"{group}.{row.key} is required and has no value in GIVEN of check_bad_entries.py: add one")
        choose(group, chosen, row.key, value)
    if chosen.get("until", "duration") != "duration" and "above" not in chosen:
        chosen.setdefault("below", "1")
    return chosen


def named(groups):
    """Groups with their entries as settings, each repeatable one with its name."""
    return {entry_of(group, name): value for group, given in groups.items()
            for name, value in {**({"name": f"'{NAME}'"} if group in REPEATABLE else {}), **given}.items()}


def contexts(row):
    """Settings with which a row is in use."""
    key, _, words = row.needs.rpartition(":")
    duration = {"integrate.duration": GIVEN["duration"]}
    for word in words.split() or [""]:
        if row.group in ("grains", "wall"):
            yield {**named(parts_with(entries_of(row.group, word and key, word), row.group)), **duration}
        elif row.group in IN_PARTS:
            groups = scene_of_parts(row.group, entries_of(row.group, word and key, word))
            yield {**named(groups), **({} if row.group == "stage" else duration)}
        elif row.group == "scene":
            yield from ({**named({"scene": entries_of("scene", "name", scene)}), **duration}
                        for scene in ([word] if word else words_of("scene", "name")) if scene not in NO_RECIPES)
        else:
            kinds = [word] if word or row.group != "motion" else words_of("motion", "kind")
            key = key or "kind" * (row.group == "motion")
            yield from ({**named({"scene": entries_of("scene", "name", "bed"),
                                  row.group: entries_of(row.group, key, kind)}), **duration} for kind in kinds)


def words_of(group, key):
    """All words of an entry."""
    return next(row.allowed.split() for row in ROWS if (row.group, row.key) == (group, key))


def parts_with(entries, group):
    """Walls and grains, of which one group has given entries."""
    grains = entries if group == "grains" else entries_of("grains")
    shape = "ring" if grains.get("region") == "inside" else "rectangle"
    return {"wall": entries if group == "wall" else entries_of("wall", "outline", shape), "grains": grains}


def scene_of_parts(group, entries):
    """A scene of parts with a group."""
    parts = {"wall": entries_of("wall"), "grains": entries_of("grains"), "material": {}}
    if group == "cell":
        parts = {"grains": parts["grains"], "forces": {"gravity": "0, 0"}}
    if entries.get("until") == "departed":
        parts["sink"] = entries_of("sink")
    if entries.get("until") == "stress":
        parts["sample"] = entries_of("sample", "area", "rectangle")
    return {**parts, group: entries}


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
    program = str(Path(sys.argv[1]).resolve())
    for table in (Path(word) for word in sys.argv[2:] if word != "--full"):
        groups, found = read_table(table.read_text(encoding="utf-8"), table.parent)
        REPEATABLE.update(name for name, group in groups.items() if group.is_repeatable)
        ROWS.extend(found)
    rows = ROWS
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


#: Rows of the table, entries that are words, and groups that have names
ROWS, WORDS, REPEATABLE = [], set(), set()

if __name__ == "__main__":
    main()
