"""Test of check_layers.py: a layer that sees too much, uses what it does not name, or uses a library is found."""

import unittest

from check_layers import MODULE, USE, breaches

#: Three layers, each of which uses the one before: modules that it defines and uses, layers that it sees
SOUND = {"polydem_low": ({"a"}, {"iso_c_binding"}, set()), "polydem_middle": ({"b"}, {"a"}, {"low"}),
         "polydem_high": ({"c"}, {"b"}, {"middle"}), "test_low": ({"d"}, {"a", "d"}, {"low"})}


class Layers(unittest.TestCase):
    def test_faults_are_found(self):
        self.assertEqual(list(breaches(SOUND)), [])
        for changed, words in ((({"c"}, {"b"}, {"middle", "low"}), "sees low and does not use it: name it no more"),
                               (({"c"}, {"a", "b"}, {"middle"}), "uses low and does not name it"),
                               (({"c"}, {"b", "mpi_f08"}, {"middle"}), "may not use the module mpi_f08")):
            self.assertEqual(list(breaches({**SOUND, "polydem_high": changed})), [f"polydem_high {words}"])

    def test_all_forms_are_read(self):
        text = "  use a, only: x\nuse :: b\n USE, intrinsic :: c, only: y\n! use d\nused = 1\n   use, non_intrinsic::e"
        self.assertEqual(USE.findall(text), ["a", "b", "c", "e"])
        self.assertEqual(MODULE.findall("module a\nmodule procedure b\nend module a\n"), ["a"])


if __name__ == "__main__":
    unittest.main()
