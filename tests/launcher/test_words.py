"""What needs no preparation: help, wrong words."""

import os
import re

from toy import HELP_PLACES, LAUNCHER, Toy


class Words(Toy):
    """What needs no preparation."""

    def verbs(self):
        """Verbs that the launcher lists."""
        code, output, messages = self.call("--help")
        self.assertEqual((code, messages), (0, ""))
        return [verb for verb in re.findall(r"^  ([a-z]+) ", output, re.MULTILINE) if verb != "help"]

    def test_every_verb_has_help_at_once_and_without_any_tool(self):
        verbs = self.verbs()
        texts = [name for place in HELP_PLACES for name in os.listdir(os.path.join(self.folder, place))]
        self.assertEqual(sorted(verbs), sorted({name[:-len(".txt")] for name in texts} - {"table"}))
        machine = self.bare_machine()
        for verb in verbs:
            for words in ((verb, "--help"), (verb, "-h"), ("help", verb), ("--help", verb), (verb, "x", "--a=b", "-h")):
                code, output, messages = self.call(*words, **machine)
                self.assertEqual((code, messages), (0, ""))
                self.assertTrue(output.startswith(f"usage: ./polydem {verb}"), output)
                self.assertIn("\n  -h, --help  ", output)
            self.assert_fast(0.3, lambda words=(verb, "--help"): self.call(*words, **machine))
        for words in (["--help"], ["-h"], ["help"], ["help", "--help"], ["help", "help"]):
            self.assertEqual(self.call(*words, **machine), (0, self.call("--help")[1], ""))
        self.assertFalse(os.path.exists(os.path.join(self.folder, "build")))
        self.assertFalse(os.path.exists(machine["APT_LOG"]))

    def test_the_help_names_every_option_of_the_launcher(self):
        output = self.call("--help")[1]
        for word in ("--help", "--version", "--no-install", "--yes"):
            self.assertIn(f" {word}", output)
        self.assertIn("\n  --ranks R ", self.call("help", "run")[1])
        self.assertLessEqual(max(map(len, output.splitlines())), 120)

    def test_the_help_of_verify_names_every_benchmark(self):
        path = os.path.join(os.path.dirname(LAUNCHER), "tests/verification/benchmarks.f90")
        with open(path, encoding="utf-8") as file:
            text = file.read()
        listed, long = (re.findall(r"'([^']+)'", re.search(rf":: {name}\(\*\) = \[[^:]*::([^\]]*)\]", text)[1])
                        for name in ("benchmark_names", "long_names"))
        said = re.search(r"\nBenchmarks, .*:\n((?:  .*\n)+)", self.call("help", "verify")[1])[1].splitlines()
        names = [word for line in said for word in line[:24].replace("*", " ").replace(",", " ").split()]
        self.assertEqual(sorted([*listed, "exact"]), sorted(names))
        self.assertEqual(sorted(long), sorted(line.split()[0] for line in said if "*" in line[:24]))
        for line in said:
            self.assertRegex(line, r"^  [B0-9., *]{24}[a-z].* \(.*\)$|^  exact {19}[a-z].*\)$")

    def test_wrong_verbs_and_options_give_2(self):
        self.assertEqual(self.call()[0], 2)
        self.assertEqual(self.call("fly"), (2, "", "polydem: there is no verb fly; see ./polydem --help\n"))
        for words in (("help", "fly"), ("fly", "--help")):
            self.assertEqual(self.call(*words), (2, "", "polydem: there is no verb fly; see ./polydem --help\n"))
        said = "polydem: the verb comes first: ./polydem VERB --threads ...; see ./polydem --help\n"
        self.assertEqual(self.call("--threads", "2", "run", "a.nml"), (2, "", said))
        self.assertEqual(self.call("test", "a", "b")[0], 2)
        self.assertEqual(self.call("test", "--quick")[0], 2)
        self.assertEqual(self.call("build", "--quick")[0], 2)
