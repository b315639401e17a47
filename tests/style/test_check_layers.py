"""Test of check_layers.py: a layer that sees, names or uses too much or too little is found.

usage: test_check_layers.py COMPILER
"""

import os
import subprocess
import sys
import tempfile
import unittest

from check_layers import LIBRARIES, USE, Target, check_declarations, check_visibility, folders_of, judge

COMPILER = sys.argv.pop() if len(sys.argv) > 1 else "gfortran"


def layers():
    """Three layers, each of which uses the one before."""
    found = {}
    for name, below in (("low", ""), ("middle", "low"), ("high", "middle")):
        links, used = ([f"polydem::{below}"], {f"polydem_{below}_file"}) if below else ([], set())
        found[f"polydem_{name}"] = Target(f"polydem_{name}", links, {f"polydem_{name}_file"}, used)
    return found


class TestDeclarations(unittest.TestCase):
    def test_names_and_uses_agree(self):
        self.assertEqual(list(check_declarations(layers())), [])

    def test_what_is_used_and_not_named_is_found(self):
        targets = layers()
        targets["polydem_high"].used.add("polydem_low_file")
        self.assertEqual(list(check_declarations(targets)), ["polydem_high uses low and does not name it"])

    def test_what_is_named_and_not_used_is_found(self):
        targets = layers()
        targets["polydem_high"].links.append("polydem::low")
        self.assertEqual(list(check_declarations(targets)), ["polydem_high names low and does not use it"])

    def test_libraries_count_too(self):
        targets = layers()
        targets["polydem_high"].used.add("hdf5")
        targets["polydem_middle"].links.append("MPI::MPI_Fortran")
        self.assertEqual(
            sorted(check_declarations(targets)),
            ["polydem_high uses the library HDF5 and does not name it",
             "polydem_middle names the library MPI and does not use it"])

    def test_all_forms_of_use_are_read(self):
        text = "  use a, only: x\nuse :: b\n USE, intrinsic :: c, only: y\n! use d\nused = 1\n   use, non_intrinsic::e"
        self.assertEqual(USE.findall(text), ["a", "b", "c", "e"])

    def test_the_flags_of_a_command(self):
        command = "fc -I/a/b -O3 -isystem /c -Jmodules/x -std=f2008 -c x.f90 -o CMakeFiles/x.dir/x.o"
        self.assertEqual(folders_of(command), ("fc", "-I/a/b", "-isystem", "/c", "-Imodules/x"))


class TestVisibility(unittest.TestCase):
    """With the compiler: what a layer does not name must be refused, for want of the module."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.targets = layers()
        for name in ("low", "middle", "high"):
            os.mkdir(os.path.join(folder.name, name))
            path = os.path.join(folder.name, f"{name}.f90")
            with open(path, "w", encoding="utf-8") as file:
                file.write(f"module polydem_{name}_file\n   implicit none\nend module polydem_{name}_file\n")
            subprocess.run([COMPILER, f"-J{name}", "-fsyntax-only", path], cwd=folder.name, check=True)
            self.targets[f"polydem_{name}"].directory = folder.name
        for name, seen in (("low", ""), ("middle", "low"), ("high", "middle")):
            self.targets[f"polydem_{name}"].compiler = (COMPILER, f"-I{name}", *([f"-I{seen}"] if seen else []))

    def test_layers_that_see_what_they_name(self):
        wrong, refused, seen = check_visibility(self.targets, list(self.targets.values()))
        self.assertEqual((wrong, refused, seen), ([], 4 + 3 * len(LIBRARIES), 2))

    def test_a_layer_that_sees_through_another_is_found(self):
        self.targets["polydem_high"].compiler += ("-Ilow",)
        wrong, _, _ = check_visibility(self.targets, list(self.targets.values()))
        self.assertEqual(wrong, ["polydem_high sees polydem_low_file of low, which it does not name"])

    def test_a_layer_that_is_named_and_not_seen_is_found(self):
        self.targets["polydem_middle"].compiler = (COMPILER,)
        wrong, _, _ = check_visibility(self.targets, list(self.targets.values()))
        self.assertEqual(len(wrong), 1)
        self.assertIn("polydem_middle names low and does not see polydem_low_file", wrong[0])

    def test_a_refusal_for_another_reason_does_not_count(self):
        self.targets["polydem_low"].compiler += ("-fno-such-option",)
        wrong, _, _ = check_visibility(self.targets, list(self.targets.values()))
        self.assertTrue(wrong and all("for another reason" in sentence for sentence in wrong), wrong)
        other = "Fatal Error: Cannot open module file 'polydem_else.mod' for reading"
        self.assertIn("another reason", judge(self.targets["polydem_low"], "high", "polydem_high_file", 1, other))


if __name__ == "__main__":
    sys.exit(unittest.main())
