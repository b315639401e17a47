"""The JSON Schema of the settings and the functions of `polydem.settings`, on all namelists and all entries."""

import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import polydem
import pytest
from polydem_post.read.settings import Settings

jsonschema = pytest.importorskip("jsonschema", reason="jsonschema is not installed: pip install 'postproc[test]'")

ROOT = Path(os.environ["POLYDEM_SOURCE_DIR"])
SCHEMA = polydem.schema()
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)
#: A number beside a bound, by the sign
BESIDE = {">=": -1e-3, "<=": 1e-3, ">": 0.0, "<": 0.0}
#: An end of a line with a comment, which has no quote
COMMENT = re.compile(r"(?m)^((?:[^!'\n]|'[^'\n]*')*)!.*$")


def rows():
    """The rows of the table, by group and key, and the groups."""
    sys.path.insert(0, str(ROOT / "src/config"))
    from generator.table import read_table
    path = ROOT / "src/config/entries.txt"
    groups, found = read_table(path.read_text(encoding="utf-8"), path.parent)
    entries = {}
    for row in found:
        if row.key != "name" or not groups[row.group].is_repeatable:
            entries.setdefault((row.group, row.key), []).append(row)
    return groups, entries


GROUPS, ENTRIES = rows()


def dictionary_of(path):
    """The dictionary of a namelist: a line for each entry, and values in lists."""
    text = COMMENT.sub(r"\1", path.read_text(encoding="utf-8"))
    text = re.sub(r"\s+(\w+\s*=)", r"\n\1", text)
    text = re.sub(r"\s*(&\w+)", r"\n\1\n", re.sub(r"\s+/\s*$", "\n/", text, flags=re.MULTILINE))
    text = re.sub(r"\n(?!\s*(?:&|/|\w+\s*=))", " ", text)
    groups = {}
    for kind, group in Settings(text).items():
        if kind in GROUPS and GROUPS[kind].is_repeatable:
            groups[kind] = {name: {key: value for key, value in each.items() if key != "name"}
                            for name, each in group.items()}
        else:
            groups[kind] = dict(group)
    return groups


def scenes():
    """All namelists of runs."""
    names = subprocess.run(["git", "ls-files", "inputs/*.nml"], cwd=ROOT, capture_output=True, text=True, check=True)
    return [name for name in names.stdout.split() if "bench" not in name]


def test_the_schema_is_one():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert list(SCHEMA["properties"]) == list(GROUPS)


@pytest.mark.parametrize("name", scenes())
def test_the_schema_accepts_all_namelists(name):
    groups = dictionary_of(ROOT / name)
    assert groups
    assert not [f"{list(error.path)}: {error.message}" for error in VALIDATOR.iter_errors(groups)]
    # The functions of the groups, too
    for kind, group in groups.items():
        for each in group.values() if GROUPS[kind].is_repeatable else [group]:
            given = {"from_" if key == "from" else key: value for key, value in each.items()}
            assert getattr(polydem.settings, kind)(**given) == each


def good_of(row):
    """A value that is right; of a number, within its bounds."""
    if row.type == "word":
        return row.allowed.split()[0]
    if row.type in ("path", "name", "logical"):
        return {"path": "a/b", "name": "a_1", "logical": True}[row.type]
    bounds = dict(re.findall(r"(>=|>|<=|<) ([^\s,]+)", row.allowed))
    low, high = (float(next((bounds[sign] for sign in signs if sign in bounds), other))
                 for signs, other in (((">=", ">"), "0"), (("<=", "<"), "10")))
    value = low if ">=" in bounds else (low + high)/2
    return int(value) if row.type == "integer" else value


def bad_of(same):
    """Values that no row of an entry allows."""
    row = same[0]
    if row.type == "word":
        return ["nonsense", 1]
    if row.type in ("path", "logical"):
        return [1, ["a"]]
    if row.type == "name":
        return ["a b", "a.b", "x"*65, 1]
    found = ["text", True]
    for sign in BESIDE:
        bounds = [float(each) for row in same for each in re.findall(rf"(?<!\S){sign} ([^\s,]+)", row.allowed)]
        if len(bounds) == len(same):
            bound = min(bounds) if ">" in sign else max(bounds)
            step = BESIDE[sign]*max(abs(bound), 1e-12)
            found.append(int(bound + np.sign(step)) if row.type == "integer" else bound + step)
    return [*found, 1.5, 2**31] if row.type == "integer" else found


def several(row, value):
    """As many values as the entry has."""
    return value if row.count == 1 else [value]*max(row.count, 1)


@pytest.mark.parametrize("group, key", ENTRIES)
def test_a_bad_value_of_any_entry_is_rejected(group, key):
    same = ENTRIES[group, key]
    row = same[0]

    def verdicts(value):
        """Those of the schema and of the function of the group."""
        entries = {key: value}
        valid = VALIDATOR.is_valid({group: {"it": entries} if GROUPS[group].is_repeatable else entries})
        try:
            polydem.settings.__dict__[group](**{"from_" if key == "from" else key: value})
        except polydem.InputError as error:
            assert str(error).startswith(f"{key} of &{group} must ")
            return valid, False
        return valid, True

    for each in same:
        assert verdicts(several(each, good_of(each))) == (True, True)
    for bad in bad_of(same):
        assert verdicts(several(row, bad)) == (False, False), bad
        if row.count != 1:
            assert verdicts([good_of(row)]*max(row.count - 1, 0) + [bad]) == (False, False), bad
    if row.count != 1:
        assert verdicts([]) == (False, False)
    if row.count == 2:
        assert verdicts([good_of(row)]*3) == verdicts(good_of(row)) == (False, False)
    ranges = {row.allowed for row in same if row.type in ("real", "integer")} - {""}
    assert len(bad_of(same)) > 2 or not ranges


def test_unknown_names_are_rejected_at_once():
    with pytest.raises(TypeError, match="frictio_coefficient"):
        polydem.settings.forces(frictio_coefficient=0.4)
    assert not VALIDATOR.is_valid({"forces": {"frictio_coefficient": 0.4}})
    assert not VALIDATOR.is_valid({"force": {}})
    assert not VALIDATOR.is_valid({"wall": {"outline": "line"}})
    assert not VALIDATOR.is_valid({"wall": {"a wall": {"outline": "line"}}})


def test_each_function_has_the_entries_of_its_group():
    for group in GROUPS:
        function = polydem.settings.__dict__[group]
        assert [name.rstrip("_") for name in inspect.signature(function).parameters] == [
            key for kind, key in ENTRIES if kind == group]
        for key in (key for kind, key in ENTRIES if kind == group):
            assert f"    {key}" in inspect.getdoc(function).replace("\n", "\n    ")


def test_a_simulation_takes_the_groups_of_the_functions():
    from polydem.settings import forces, grains, integrate, wall
    box = {"wall": {"floor": wall(outline="line", from_=(-1, 0), to=np.array([1.0, 0.0]), thickness=0.1)},
           "grains": {"few": grains(region="box", low=(-0.05, 0.001), high=(0.05, 0.05), number=np.int64(5))},
           "forces": forces(friction_coefficient=0.4, gravity=(0, -9.81)), "integrate": integrate(duration=0.01)}
    with polydem.Simulation(box) as sim:
        assert len(sim.bodies) == 6 and sim.settings.forces.friction_coefficient == 0.4
    assert forces(gravity=None) == {}
    with pytest.raises(polydem.InputError, match=r"stiffness of &forces must be finite, not nan"):
        forces(stiffness=float("nan"))
    with pytest.raises(polydem.InputError, match=r"bodies of &scene must be >= 0 or must be > 0, not -1"):
        polydem.settings.scene(bodies=-1)
