"""Tab completion and man page name what the help texts name, and the shells accept them.

usage: test_completion.py LAUNCHER

Shells that are not here are left out; bash is always there.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

LAUNCHER = Path()


def call(*words, text=None):
    """Output of a command that must succeed."""
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, input=text, check=False)
    assert (done.returncode, done.stderr) == (0, ""), (words, done)
    return done.stdout


def help_texts():
    """Help text of each verb that the launcher lists."""
    names = re.findall(r"^  ([a-z]+) ", call(LAUNCHER, "--help"), re.MULTILINE)
    return {name: call(LAUNCHER, name, "--help") for name in names if name != "help"}


def options_of(text):
    """Options that a help text names at the start of its lines."""
    found = set()
    for line in text.splitlines():
        while match := re.match(r"(?:  |, )(-[-\w]+)", line):
            found.add(match[1])
            line = line[match.end():]
    return found


class Completion(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.help = help_texts()

    def completed(self, *words):
        """What bash suggests for the last word."""
        script = call(LAUNCHER, "completion", "bash") + (
            f"COMP_WORDS=({' '.join(map(repr, words))})\nCOMP_CWORD={len(words) - 1}\n_polydem\n"
            'printf "%s\\n" "${COMPREPLY[@]}"\n')
        return set(call("bash", "-s", text=script).split())

    def test_bash_completes_every_verb_and_every_option_of_the_help(self):
        self.assertEqual(self.completed("polydem", ""), {*self.help, "help", "--help", "--version"})
        self.assertEqual(self.completed("./polydem", "ru"), {"run"})
        self.assertEqual(self.completed("polydem", "help", ""), set(self.help))
        for verb, text in self.help.items():
            with self.subTest(verb=verb):
                options = options_of(text)
                self.assertIn("--help", options)
                self.assertEqual(self.completed("polydem", verb, "x", "-"), options)

    def test_bash_leaves_files_and_values_to_the_shell(self):
        self.assertEqual(self.completed("polydem", "run", ""), set())
        self.assertEqual(self.completed("polydem", "run", "a.nml", "--threads", "-"), set())
        self.assertEqual(self.completed("polydem", "sweep", ""), {"make", "run", "collect"})

    def test_bash_completes_entries_after_set_and_quantities_after_colour(self):
        page, of = (LAUNCHER.parent / "inputs/entries.md").read_text(encoding="utf-8"), {}
        for group, key in re.findall(r"^\| &(\w+) \| `(\w+)` \|", page, re.MULTILINE):
            of.setdefault(group, set()).add(key)
        self.assertIn("stiffness", of["material"])
        self.assertEqual(self.completed("polydem", "run", "a.nml", "--set", "integrate."),
                         {f"integrate.{key}=" for key in of["integrate"]})
        self.assertIn("scene.seed=", self.completed("polydem", "check", "a.nml", "--set", ""))
        self.assertIn("bench.repeats=", self.completed("polydem", "bench", "a.nml", "--set", "bench."))
        self.assertEqual(self.completed("polydem", "run", "a.nml", "--set", "wall.floor."),
                         {f"wall.floor.{key}=" for key in of["wall"]})
        self.assertEqual(self.completed("polydem", "run", "a.nml", "--set", "wall."), set())
        source = LAUNCHER.parent / "postproc/src/polydem_post/pictures/quantities.py"
        quantities = set(re.findall(r'^    "(\w+)": Quantity\(', source.read_text(encoding="utf-8"), re.MULTILINE))
        for verb in ("plot", "movie", "view"):
            self.assertEqual(self.completed("polydem", verb, "x", "--colour", ""), {*quantities, "none"})
            self.assertEqual(self.completed("polydem", verb, "x", "--color", "angl"), {"angle"})
        for kind in ("zsh", "fish"):
            text = call(LAUNCHER, "completion", kind)
            self.assertIn("scene.seed=", text)
            self.assertIn("angular_velocity angle rotation", text)

    def test_every_text_names_every_option(self):
        for kind in ("zsh", "fish", "man"):
            text = call(LAUNCHER, "completion", kind).replace("\\-", "-")
            for verb, help_text in self.help.items():
                with self.subTest(kind=kind, verb=verb):
                    begin = {"zsh": rf"    {verb}\) .*\n", "man": rf'\.SS "{verb}\b.*\n(?:(?!\.S[SH]).*\n)*',
                             "fish": rf"(?:complete .*from {verb}'.*\n)+"}[kind]
                    part = re.search(begin, text)[0]
                    for option in options_of(help_text):
                        name = f"-l {option[2:]} " if kind == "fish" and option[:2] == "--" else option.lstrip("-")
                        self.assertIn(name, part)

    def test_the_man_page_names_the_variables_that_the_program_reads(self):
        sources = [path.read_text(encoding="utf-8") for path in (LAUNCHER.parent / "src").rglob("*.f90")]
        read = {name for text in sources for name in re.findall(r"'(POLYDEM_[A-Z]+)'", text)} - {"POLYDEM_CALL"}
        self.assertTrue(read)
        part = call(LAUNCHER, "completion", "man").partition(".SH ENVIRONMENT")[2]
        for name in (*read, "GLIBC_TUNABLES", "GOMP_SPINCOUNT"):
            self.assertIn(f".B {name}\n", part)

    def test_shells_accept_the_texts(self):
        with tempfile.TemporaryDirectory() as folder:
            for kind, command in (("bash", ["bash", "-n"]), ("zsh", ["zsh", "-n"]), ("fish", ["fish", "-n"]),
                                  ("man", ["groff", "-man", "-ww", "-Tascii"])):
                if shutil.which(command[0]):
                    path = os.path.join(folder, kind)
                    Path(path).write_text(call(LAUNCHER, "completion", kind), encoding="utf-8")
                    call(*command, path)

    def test_an_output_that_takes_no_more_is_named(self):
        with open("/dev/full", "w", encoding="utf-8") as full:
            done = subprocess.run([LAUNCHER, "completion", "bash"], stdout=full, stderr=subprocess.PIPE, text=True,
                                  check=False)
        self.assertEqual((done.returncode, done.stderr),
                         (3, "polydem: standard output: cannot be written (No space left on device)\n"))

    def test_an_unknown_shell_is_named(self):
        for words in ([], ["csh"], ["bash", "zsh"]):
            done = subprocess.run([LAUNCHER, "completion", *words], capture_output=True, text=True, check=False)
            self.assertEqual((done.returncode, done.stdout), (2, ""))
            self.assertIn("bash, zsh, fish and man", done.stderr)


if __name__ == "__main__":
    LAUNCHER = Path(sys.argv.pop(1)).resolve()
    unittest.main()
