"""Test of the guard: the smallest change of a result is found, names are translated, no entry is forgotten."""

import sys
import tempfile
import unittest
from pathlib import Path

import guard_python  # first: it finds a Python that has the next two
import h5py
import numpy as np
from guard_cases import UNTRIED, generated_cases, read_entries
from guard_names import PRESENT, Names
from guard_results import differences, read_result
from guard_runs import Side, UnknownError

MANUAL = guard_python.ROOT / "inputs" / "entries.md"


def write_result(folder, start=0, change=None, counters=("steps", "contacts"), ledger="ledger", listed=True):
    """A result of two segments with two frames each; `change` gets the file of the second one.

    Not `listed`: in the older form, with one row per frame.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for number in (1, 2):
        with h5py.File(folder / f"trajectory_{number:04d}.h5", "w") as file:
            chance = np.random.default_rng(number + start)
            file["bodies/id"] = np.arange(3, dtype=np.int32)
            file["frames/position"] = chance.random((6, 2) if listed else (2, 3, 2))
            file["frames/angle"] = chance.random(6 if listed else (2, 3))
            file["frames/cell_size"] = chance.random((2, 3))
            if listed:
                file["frames/start"] = np.array([0, 3, 6])
            file["contacts/start"] = np.array([0, 2, 3])
            file["contacts/force"] = chance.random((3, 2))
            file["walls/force"] = chance.random((2, 1, 2))
            file[f"{ledger}/kinetic"] = chance.random(2)
            file["provenance/host"] = f"anywhere {start}"
            if number == 2 and change is not None:
                change(file)
    with h5py.File(folder / "profile.h5", "w") as file:
        file["state_hash"] = "0123456789abcdef"
        file["counters/name"] = list(counters)
        file["counters/value"] = np.array([4, 12])
        file["profile/total"] = np.random.default_rng().random(3)


def flip(name, place):
    """A change of the last bit of one number of a data set."""
    def change(file):
        values = file[name][()]
        bits = values.view(np.uint64)
        bits[place] ^= 1
        file[name][...] = values
    return change


class TestGuard(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)
        write_result(self.path / "base")
        self.expected = read_result(self.path / "base", PRESENT)

    def against(self, names=PRESENT, whole=True, **changes):
        """What is said of a changed result."""
        write_result(self.path / "other", **changes)
        expected = read_result(self.path / "base", names, whole)
        return differences(expected, read_result(self.path / "other", PRESENT, whole), names)

    def test_the_same_result_is_equal(self):
        self.assertEqual(self.against(), ([], []))
        self.assertEqual(self.expected["trajectory/frames/position"].shape, (12, 2))
        self.assertEqual(self.against(listed=False), ([], []))

    def test_one_bit_of_any_kind_of_number_is_found(self):
        for name, place, where in (("frames/position", (5, 0), "[11, 0]"), ("frames/angle", (1,), "[7]"),
                                   ("contacts/force", (2, 1), "[5, 1]"), ("walls/force", (1, 0, 1), "[3, 0, 1]"),
                                   ("ledger/kinetic", (0,), "[2]")):
            for whole in (True, False):
                wrong, _ = self.against(change=flip(name, place), whole=whole)
                self.assertEqual(len(wrong), 1, wrong)
                self.assertIn(f"trajectory/{name}: ", wrong[0])
                self.assertIn(f" at {where}, 1 of ", wrong[0])

    def test_minus_zero_and_the_kind_of_a_nan_are_differences(self):
        for before, after in ((0.0, -0.0), (np.nan, -np.nan)):
            wrong, _ = differences({"trajectory/x": np.array([before])}, {"trajectory/x": np.array([after])}, PRESENT)
            self.assertEqual(len(wrong), 1)
        same = np.array([np.nan])
        self.assertEqual(differences({"trajectory/x": same}, {"trajectory/x": same.copy()}, PRESENT)[0], [])

    def test_other_state_hash_counter_and_missing_data_are_found(self):
        def lose(file):
            del file["frames/angle"]

        wrong, notes = self.against(counters=("steps", "touches"))
        self.assertIn("counter profile contacts is missing", wrong[0])
        self.assertEqual(notes, ["counter profile touches is new"])
        with self.assertRaises(KeyError):
            self.against(change=lose)
        changed = {**self.expected, "profile/state_hash": np.asarray("0123456789abcdee", dtype=object)}
        self.assertIn("profile/state_hash", differences(self.expected, changed, PRESENT)[0][0])

    def test_renamed_data_are_compared_and_removed_ones_are_not(self):
        names = Names(data={"trajectory/balance/": "ledger/"}, counters={"touches": "contacts"})
        self.assertEqual(self.against(names, ledger="balance", counters=("steps", "touches")), ([], []))
        wrong, _ = self.against(names, ledger="balance", counters=("steps", "touches"), start=1)
        self.assertIn("trajectory/balance/kinetic", " ".join(wrong))
        names = Names(removed=frozenset({"trajectory/ledger/", "counter profile contacts"}))
        reduced = {name: value for name, value in self.expected.items() if "ledger" not in name}
        del reduced["counter profile contacts"]
        wrong, notes = differences(self.expected, reduced, names)
        self.assertEqual((wrong, len(notes)), ([], 2))

    def test_renamed_and_divided_entries(self):
        names = Names(entries={"output.balance": "output.ledger", "scene.corners": ("scene.low", "scene.high")},
                      words={"forces.damping=matuttis_chen": "book"})
        self.assertEqual([names.pairs(*pair) for pair in (
            ("output.balance", ".true."), ("scene.corners", "3, 20"), ("forces.damping", "'matuttis_chen'"),
            ("forces.damping", "rate"))],
            [[("output.ledger", ".true.")], [("scene.low", "3"), ("scene.high", "20")],
             [("forces.damping", "'book'")], [("forces.damping", "rate")]])

    def test_what_the_base_does_not_have_is_said(self):
        names = Names(entries={"scene.recipe": "scene.name", "forces.stiffness": "forces.hardness"})
        side = Side(names, guard_python.ROOT, self.path, False)
        for entry, value in (("wall.one.softness", "1"), ("forces.law", "quadratic"), ("scene.recipe", "box")):
            with self.assertRaisesRegex(UnknownError, "no (wall.one.softness|forces.law = quadratic|scene.name = box)"):
                side.overrides({entry: value})
        self.assertEqual(side.overrides({"wall.one.angle": "3", "scene.recipe": "'drum'", "forces.stiffness": "1e7"}),
                         ["--set", "wall.one.angle=3", "--set", "scene.name='drum'", "--set", "forces.stiffness=1e7"])

    def test_no_entry_and_no_choice_is_forgotten(self):
        manual = MANUAL.read_text(encoding="utf-8")
        cases = generated_cases(manual)
        self.assertEqual(len(cases), len({case.name for case in cases}))
        settings = [case.settings for case in cases]
        for entry in read_entries(manual):
            for choice in entry.choices if not entry.name.startswith("bench.") else ():
                tried = any(each.get(entry.name, entry.default) == choice for each in settings)
                self.assertTrue(tried or (entry.name, choice) in UNTRIED, f"{entry.name}={choice}")
        more = manual.replace("| &forces | `stiffness` | real", "| &forces | `softness` | real")
        with self.assertRaisesRegex(ValueError, "forces.softness"):
            generated_cases(more)


if __name__ == "__main__":
    sys.exit(unittest.main())
