"""Test of the stand-in for pFUnit: bad test files are refused with file and line, failures reach the exit code.

usage: check_stand_in.py FAILING REFUSED      the programs built from failing/test_failing.pf and test_refused.pf
"""

import os
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

HERE = os.path.dirname(os.path.abspath(__file__))
sys.dont_write_bytecode = True
sys.path.insert(0, HERE)
import translate as translator  # noqa: E402

PROGRAM = REFUSED = ""

GOOD = """\
module test_x
   use funit
   implicit none
contains
   @test
   subroutine works()
      @assertTrue(.true.)
   end subroutine works
end module test_x
"""

# What replaces what in GOOD, and the line and words of the message that must follow.
BAD = [
    ("   @test\n", "   @tset\n", 5, "unknown annotation @tset"),
    ("   @test\n", "   @test\n   @test\n", 6, "has no subroutine"),
    ("   @test\n", "   @test ! first\n", 5, "alone on its line"),
    ("   @test\n", "   @test(npes=[1])\n", 5, "takes no arguments"),
    ("   @test\n", "", 1, "no @test"),
    ("   subroutine works()", "   recursive subroutine works()", 6, "a plain subroutine"),
    ("subroutine works()", "subroutine works(x)", 6, "a plain subroutine"),
    ("subroutine works()", "integer function works()", 6, "a subroutine must follow"),
    ("   subroutine works()", "   subroutine " + 64*"a" + "()", 6, "longer than 63"),
    ("   @test\n", "\t@test\n", 5, "a tab"),
    ("      @assertTrue", "\t@assertTrue", 7, "a tab"),
    ("   implicit none\n", "   implicit none\n   integer k\n", 4, "needs ::"),
    ("@assertTrue(.true.)", "@assertTruth(.true.)", 7, "unknown assert @assertTruth"),
    ("@assertTrue(.true.)", "if (.true.) @assertTrue(.true.)", 7, "alone on its line"),
    ("@assertTrue(.true.)", "@assertTrue(.true.) ! yes", 7, "on one line"),
    ("@assertTrue(.true.)", "@assertTrue(.true.); continue", 7, "on one line"),
    ("@assertTrue(.true.)", "@assertTrue(.true., &\n         message='x')", 7, "on one line"),
    ("@assertTrue(.true.)", "@assertTrue()", 7, "needs an argument"),
    ("@assertTrue(.true.)", "@assertTrue", 7, "on one line"),
    ("@assertTrue(.true.)", "@assertTrue(" + 13*".not. .not. " + ".true.)", 7, "longer than"),
    ("module test_x\n   use", "module test_y\n   use", 1, "must be named test_x"),
    ("module test_x\n   use", "module test_x ! tests\n   use", 1, "nothing behind"),
    ("   @test\n", "   @before\n   subroutine a()\n   end subroutine a\n   @before\n"
     "   subroutine b()\n   end subroutine b\n   @test\n", 9, "a second @before"),
    ("end module test_x\n", "   @test\nend module test_x\n", 10, "a subroutine must follow"),
]

# Where a name of a test may meet one that pFUnit exports: what replaces what in GOOD, and the line.
NAMED = [
    ("   @test\n", "   subroutine {name}()\n   end subroutine {name}\n   @test\n", 5),
    ("   @test\n", "   pure character(len=2) function {name}()\n   end function {name}\n   @test\n", 5),
    ("      @assertTrue(.true.)\n", "      @assertTrue(.true.)\n   contains\n      SUBROUTINE {name}()\n"
     "      end subroutine {name}\n", 9),
    ("subroutine works()", "subroutine {name}()", 6),
    ("   implicit none\n", "   implicit none\n   integer :: one(2, 2), {name}, three\n", 4),
    ("   implicit none\n", "   implicit none\n   character, parameter :: a = &\n      '&', &\n      {name} = 'a'\n", 4),
    ("   implicit none\n", "   implicit none\n   type, abstract :: {name}\n   end type {name}\n", 4),
    ("   implicit none\n", "   implicit none\n   type {name}\n      integer :: k\n   end type\n", 4),
    ("   implicit none\n", "   implicit none\n   interface {name}\n      procedure works\n   end interface\n", 4),
    ("   implicit none\n", "   implicit none\n   enum, bind(c)\n      enumerator :: one = 1, {name}\n   end enum\n", 5),
    ("   implicit none\n", "   use helpers, only: one, {name}\n   implicit none\n", 3),
    ("   implicit none\n", "   use helpers, only: one, &\n      {name} => two\n   implicit none\n", 3),
    ("   subroutine works()\n", "   subroutine works()\n      use, intrinsic :: helpers, only: {name}\n", 7),
]

# Names that are no names of the module, so that pFUnit does not mind.
HARMLESS = """\
module test_x
   use, intrinsic :: iso_fortran_env, only: output => error_unit
   use funit, only: throw, catch
   use helpers, only: mine => run
   implicit none
   ! integer :: run
   character(len=*), parameter :: text = &
      'integer :: run'
   type :: one_t
      integer :: run
   end type one_t
   type(one_t) :: several
   interface
      subroutine other(run)
         integer, intent(in) :: run
      end subroutine other
   end interface
contains
   @test
   subroutine works()
      integer :: near, t

      near = several%run; t = near
   end subroutine works
end module test_x
"""


def translate(text):
    """Exit code and messages of the translator for a file test_x.pf."""
    with tempfile.TemporaryDirectory() as folder:
        source = os.path.join(folder, "test_x.pf")
        with open(source, "w", encoding="utf-8") as file:
            file.write(text)
        result = subprocess.run([sys.executable, os.path.join(HERE, "translate.py"), source, source + ".f90"],
                                capture_output=True, text=True, check=False)
    return result.returncode, result.stderr


def run(*options, program=None):
    """Exit code and output of the program with a failing test."""
    result = subprocess.run([program or PROGRAM, *options], capture_output=True, text=True, check=False)
    return result.returncode, result.stdout


class Translation(unittest.TestCase):
    def test_accepts_a_good_file(self):
        self.assertEqual(translate(GOOD), (0, ""))

    def test_accepts_names_that_pfunit_does_not_see(self):
        self.assertEqual(translate(HARMLESS), (0, ""))

    def test_refuses_every_name_of_pfunit_wherever_it_stands(self):
        with open(os.path.join(HERE, "funit_names.txt"), encoding="utf-8") as file:
            names = file.read().split()
        self.assertGreater(len(names), 100)
        with tempfile.TemporaryDirectory() as folder:
            source = os.path.join(folder, "test_x.pf")
            for old, new, line in NAMED:
                self.assertEqual(GOOD.count(old), 1)
                for name in ["mine", *names, *translator.OF_SUITE]:
                    with self.subTest(new=new, name=name):
                        with open(source, "w", encoding="utf-8") as file:
                            file.write(GOOD.replace(old, new.format(name=name.capitalize())))
                        refused = ""
                        try:
                            translator.Translator(source).translate("out.f90")
                        except translator.Wrong as wrong:
                            refused = f"{wrong.line} {wrong}"
                        of_module = "implicit none" in old and "use helpers" not in new
                        expected = name in names or (name != "mine" and of_module)
                        words = f"{line} pFUnit has a name {name.capitalize()} of its own: choose another"
                        self.assertEqual(refused, words if expected else "")

    def test_refuses_bad_files_with_file_and_line(self):
        for old, new, line, words in BAD:
            with self.subTest(new=new):
                self.assertEqual(GOOD.count(old), 1)
                code, message = translate(GOOD.replace(old, new))
                self.assertEqual(code, 1)
                self.assertIn(f"test_x.pf:{line}: error: ", message)
                self.assertIn(words, message)


class Verdict(unittest.TestCase):
    def test_failures_reach_the_exit_code_in_the_words_of_pfunit(self):
        code, output = run()
        self.assertEqual(code, 2)
        for words in ("[test_failing.pf:18]", "one & <two>", "expected: <2> but found: <1>",
                      "Tests run: 2, Failures: 1", "Encountered 1 or more failures/errors during testing"):
            self.assertIn(words, output)

    def test_what_compares_nothing_is_refused(self):
        code, output = run("-v", program=REFUSED)
        started = re.findall(r"Start: <(.*)>", output)
        self.assertEqual((code, len(started)), (2, 7))
        self.assertEqual(re.findall(r"^ in: (.*)$", output, re.MULTILINE), started)
        self.assertEqual(output.count("a tolerance must be a finite number that is not negative"), 6)
        self.assertEqual(output.count("nothing is relatively equal to zero or to what is not finite"), 1)

    def test_the_filter_chooses(self):
        code, output = run("-f", "suite.passes")
        self.assertEqual(code, 0)
        self.assertIn(" OK\n (1 test)", output)

    def test_verbose_names_the_tests(self):
        self.assertIn("Start: <test_failing_suite.passes>", run("-v")[1])

    def test_no_match_and_unknown_options_are_errors(self):
        self.assertEqual(run("-f", "nothing")[0], 3)
        self.assertEqual(run("--quick")[0], 3)
        self.assertEqual(run("-f")[0], 3)

    def test_writes_well_formed_xml(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "report.xml")
            self.assertEqual(run("-x", "-o", path)[0], 2)
            suite = xml.etree.ElementTree.parse(path).getroot()
        self.assertEqual((suite.get("tests"), suite.get("failures")), ("2", "1"))
        self.assertIn("one & <two>", suite.find("testcase/failure").get("message"))


if __name__ == "__main__":
    PROGRAM, REFUSED = sys.argv.pop(1), sys.argv.pop(1)
    unittest.main()
