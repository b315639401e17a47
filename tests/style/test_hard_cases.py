"""Test of tests/hard_cases.md: all cases are there, and every row names tests that exist, and all tests of its case."""

import pathlib
import re
import unittest

TESTS = pathlib.Path(__file__).resolve().parent.parent
CASES = [f"{letter}{number}" for letter, last in (("G", 30), ("D", 21), ("N", 15)) for number in range(1, last + 1)]

ROW = re.compile(r"^\|\s*([GDN]\d+)\s*\|([^|]+)\|([^|]+)\|([^|]*)\|$", re.MULTILINE)
UNIT_TEST = re.compile(r"^\s*@test\s*\n\s*subroutine\s+(\w+)", re.MULTILINE)
CTEST = re.compile(r"\badd_test\(\s*NAME\s+(\w+)")


def rows_of(text):
    """Case, expected outcome and tests of every row."""
    return [(case, expected.strip(), re.findall(r"`(\w+)`", tests))
            for case, expected, tests, _ in ROW.findall(text)]


def tests_of(folder):
    """Names of all tests below a folder."""
    names = []
    for path in sorted(folder.rglob("*.pf")):
        names += UNIT_TEST.findall(path.read_text(encoding="utf-8"))
    for path in sorted(folder.rglob("CMakeLists.txt")):
        names += CTEST.findall(path.read_text(encoding="utf-8"))
    return names


def wrong_in(text, names):
    """What is wrong with a table, given the names of all tests."""
    rows = rows_of(text)
    wrong = []
    if [case for case, _, _ in rows] != CASES:
        wrong.append("the cases are not all there, once each and in order")
    for case, expected, tests in rows:
        start = case.lower() + "_"
        if not expected:
            wrong.append(f"{case} expects nothing")
        if not (tests and tests[0].startswith(start)):
            wrong.append(f"{case} has no test of its own first")
        wrong += [f"{case}: there is no test {test}" for test in tests if test not in names]
        wrong += [f"{case} lacks {name}" for name in names if name.startswith(start) and name not in tests]
    return wrong


class HardCases(unittest.TestCase):
    def test_the_table_is_complete_and_true_and_faults_are_found(self):
        text, names = (TESTS / "hard_cases.md").read_text(encoding="utf-8"), tests_of(TESTS)
        self.assertEqual(wrong_in(text, names), [])
        for pattern, by, words in ((r"\n\| N3 .*", "", "the cases are not all there"),
                                   ("`n1_no_box", "`n1_no_fox", "N1: there is no test n1_no_fox"),
                                   (r"`g1_\w+`", "–", "G1 has no test of its own first")):
            self.assertIn(words, wrong_in(re.sub(pattern, by, text), names)[0])
        self.assertEqual(wrong_in(text, [*names, "d4_another"]), ["D4 lacks d4_another"])


if __name__ == "__main__":
    unittest.main()
