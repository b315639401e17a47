"""Test of the generic rules: a good file passes each tool, and each planted fault is found under its code."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from check_style import text_files
from run_tool import SKIPPED, TOOLS, find_tool, pinned_version, shell_scripts, what_to_read
from test_check_style import GOOD

ROOT = Path(__file__).resolve().parent.parent.parent
RUNNER = Path(__file__).resolve().parent / "run_tool.py"

#: What replaces what in GOOD, and the code of the rule
FORTRAN_FAULTS = [
    ("   implicit none\n", "", "C001"),
    ("   private\n", "", "C131"),
    ("   private\n", "   public\n", "C132"),
    ("polydem_kinds, only: ip, wp", "polydem_kinds", "C121"),
    ("integer(ip), parameter ::", "integer(4), parameter ::", "PORT011"),
    ("1.0_wp", "1.0_8", "PORT012"),
    ("real(wp) :: length = 1.0_wp", "real*8 :: length", "PORT021"),
    ("real(wp) :: length = 1.0_wp", "double precision :: length", "MOD001"),
    ("      integer :: k\n", "      integer :: k = 0\n", "C081"),
    ("      integer :: k\n", "      integer :: k\n      common k\n", "OB011"),
    ("      integer :: k\n", "      integer :: k, l\n      equivalence (k, l)\n", "OB012"),
    ("      real(wp), intent(in) :: by\n", "      real(wp) :: by\n", "C061"),
    ("subroutine grow(self, by)\n", "subroutine grow(self, by, b, c, d, e, f, g, h, i, j, k)\n"
     "      integer, intent(in) :: b, c, d, e, f, g, h, i, j, k\n", "S902"),
    ("end module polydem_good\n", "end module polydem_good\nmodule b\nimplicit none\nprivate\nend module b\n", "S211"),
    ("end module polydem_good\n", "end module polydem_good\nsubroutine b()\nend subroutine b\n", "C092"),
    ("!> A good module.\n", "!> " + 118*"a" + "\n", "S001"),
]

GOOD_PYTHON = '"""Good."""\n\n\ndef double(x):\n    """Twice a number."""\n    return 2*x\n'
PYTHON_FAULTS = [
    ('"""Good."""\n', '"""Good."""\nimport os\n', "F401"),
    ('    """Twice a number."""\n', "", "D103"),
    ("double(x)", "double(x, a, b, c, d, e, f, g, h, i, j)", "PLR0913"),
    ("double(x)", "double(x=[])", "B006"),
    ("2*x", "2*" + 110*"x", "E501"),
    ("2*x", "2*y", "F821"),
]


class Tools(unittest.TestCase):
    """A made-up tree with the settings of this one."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        for name in (".fortitude.toml", ".ruff.toml", "postproc/pyproject.toml"):
            self.write(name, (ROOT / name).read_text(encoding="utf-8"))
        self.write("src/bodies/good.f90", GOOD)
        self.write("postproc/good.py", GOOD_PYTHON)
        self.write("tests/good.py", GOOD_PYTHON)
        self.write("polydem", "#!/usr/bin/env bash\necho \"$1\"\n")

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        return path

    def run_tool(self, tool, path):
        """Code and output of run_tool.py on the made-up tree."""
        done = subprocess.run([sys.executable, RUNNER, self.root, tool], capture_output=True, text=True, check=False,
                              env={**os.environ, "PATH": f"{path}:{os.environ['PATH']}"})
        return done.returncode, done.stdout + done.stderr

    def run_here(self, tool):
        """Code and output of a tool of this project; skips the test if it is not installed."""
        command, problem = find_tool(ROOT, tool)
        if problem:
            self.skipTest(problem)
        return self.run_tool(tool, os.path.dirname(command))

    def expect_faults(self, tool, name, good, faults):
        self.assertEqual(self.run_here(tool)[0], 0, self.run_here(tool)[1])
        for old, new, code in faults:
            with self.subTest(code=code, new=new):
                self.assertEqual(good.count(old), 1)
                self.write(name, good.replace(old, new))
                status, output = self.run_here(tool)
                self.assertNotEqual(status, 0)
                self.assertIn(code, re.findall(rf"{name}:\d+:\d+: (?:error: )?(\w+)", output), output)
        self.write(name, good)

    def test_fortitude_finds_planted_faults(self):
        self.expect_faults("fortitude", "src/bodies/good.f90", GOOD, FORTRAN_FAULTS)

    def test_ruff_finds_planted_faults(self):
        self.expect_faults("ruff", "postproc/good.py", GOOD_PYTHON, PYTHON_FAULTS)
        self.write("tests/bad.py", "import os\n")
        self.assertIn("F401", self.run_here("ruff")[1])

    def test_shellcheck_reads_every_script(self):
        self.assertEqual(self.run_here("shellcheck")[0], 0)
        for name in ("polydem", ".ci/run", "inputs/slurm/job.sh"):
            path = self.write(name, "#!/bin/sh\nrm $1\n")
            status, output = self.run_here("shellcheck")
            self.assertNotEqual(status, 0)
            self.assertIn("SC2086", output)
            path.unlink()
        self.assertTrue({"polydem", ".ci/run", "inputs/slurm/job.sh"} <= set(shell_scripts(ROOT)))

    def test_only_tracked_files_are_read(self):
        self.assertEqual(what_to_read(self.root, "ruff"), ["postproc", "tests"])
        subprocess.run(["git", "init", "--quiet", self.root], check=True)
        subprocess.run(["git", "-C", self.root, "add", "src", "postproc/good.py", "polydem"], check=True)
        self.write("postproc/draft.py", "import os\n")
        self.write("src/bodies/draft.f90", "x\n")
        self.write("draft.sh", "#!/bin/sh\nrm $1\n")
        self.assertEqual(what_to_read(self.root, "ruff"), ["postproc/good.py"])
        self.assertEqual(what_to_read(self.root, "fortitude"), ["src/bodies/good.f90"])
        self.assertEqual(what_to_read(self.root, "shellcheck"), ["polydem"])
        read = [os.path.relpath(path, self.root) for path in text_files(str(self.root))]
        self.assertEqual(read, ["polydem", "postproc/good.py", "src/bodies/good.f90"])
        # What is deleted but still tracked cannot be read.
        (self.root / "postproc/good.py").unlink()
        self.assertEqual(what_to_read(self.root, "ruff"), [])

    def test_a_tool_of_another_version_is_not_used(self):
        for tool in TOOLS:
            script = self.write(f"bin/{tool}", f"#!/bin/sh\necho {tool} 0.0.1\n")
            script.chmod(0o755)
        for tool, (package, *_) in TOOLS.items():
            code, output = self.run_tool(tool, self.root / "bin")
            self.assertEqual(code, SKIPPED)
            self.assertIn(f"is 0.0.1, but {pinned_version(ROOT, package)} is wanted", output)
        (self.root / ".venv").mkdir()
        for tool in TOOLS:
            self.assertEqual(self.run_tool(tool, self.root / "bin")[0], 1)
        shutil.rmtree(self.root / "bin")


if __name__ == "__main__":
    unittest.main()
