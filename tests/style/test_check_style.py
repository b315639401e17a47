"""Test of the rules of this project: a good file passes, and each bad change of it is found on its line."""

import subprocess
import tempfile
import unittest
from pathlib import Path

from check_style import TOP_LEVEL, check_lines, check_source, check_tree

GOOD = """\
!> A good module.
module polydem_good
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: good_t, halve, double

   !> Greatest number
   integer(ip), parameter :: greatest = 10_ip

   !> A good type
   type :: good_t
      !> Length [m]
      real(wp) :: length = 1.0_wp
   contains
      procedure :: grow
      procedure :: stop => grow
   end type good_t

   !> Twice something
   interface double
      module procedure double_real, double_whole
   end interface double

contains

   !> Make it longer.
   subroutine grow(self, by)
      class(good_t), intent(inout) :: self
      !> How much [m]
      real(wp), intent(in) :: by

      self%length = self%length + by
   end subroutine grow

   !> Half of numbers
   pure function halve(x) result(half)
      !> Numbers
      real(wp), intent(in) :: x(:)
      real(wp) :: half(size(x))
      integer :: k

      half = x
      !$omp parallel do default(none) shared(half) private(k) &
      !$omp    schedule(static)
      do k = 1, size(x)
         half(k) = half(k)/2.0_wp  ! stop 'here' = never
      end do
      !$omp end parallel do
   end function halve

   !> Twice a number
   pure real(wp) function double_real(x)
      !> Number
      real(wp), intent(in) :: x

      double_real = 2.0_wp*x
   end function double_real

   pure integer(ip) function double_whole(x)
      integer(ip), intent(in) :: x

      double_whole = 2_ip*x
   end function double_whole

end module polydem_good
"""
LONGER = "      self%length = self%length + by\n"
BY = "      !> How much [m]\n      real(wp)"
# What replaces what in GOOD, the line that must be named, and words of the message.
BAD = [
    ("!> A good module.\n", "\n", 2, "no comment !> above polydem_good"),
    ("module polydem_good\n   use", "module polydem_better\n   use", 2, "is not named as its file"),
    ("only: ip, wp", "only: dp, ip, wp", 3, "dp is not used"),
    ("only: ip, wp", "only: ip, wp, half_of => ip", 3, "half_of is not used"),
    ("integer(ip), parameter ::", "integer(ip) ::", 9, "a variable of a module"),
    ("      integer :: k\n", "      integer, save :: k\n", 41, "no save"),
    ("      integer :: k\n", "      save\n", 41, "no save"),
    ("   !> A good type\n", "\n", 12, "no comment !> above good_t"),
    ("      !> Length [m]\n", "      ! Length [m]\n", 14, "no comment !> above length"),
    ("real(wp) :: length = 1.0_wp", "real(wp), pointer :: length(:)", 14, "no pointers"),
    ("   !> Make it longer.\n", "\n", 28, "no comment !> above grow"),
    ("      !> How much [m]\n", "\n", 31, "no comment !> above by"),
    (BY, "      type(length_t)", 30, "no comment !> above by"),
    (BY, "      type(baby_t)", 30, "no comment !> above by"),
    (LONGER, "      stop 1\n", 33, "only the program"),
    (LONGER, "      self%settings%forces%gravity(1) = 0.0_wp\n", 33, "settings do not change"),
    (LONGER, "      if (by > 0) error stop 'no'\n", 33, "only the program"),
    (LONGER, "      if (by > 0) call abort()\n", 33, "only the program"),
    (LONGER, "      call omp_set_num_threads(2)\n", 33, "set the threads"),
    (LONGER, "      go to 10\n", 33, "go to"),
    (LONGER, 61*"\n", 28, "grow has 67 lines, more than 60"),
    ("half = x\n", "if (s%law == 'area') half = x\n", 43, "only `choose_parts`"),
    ("   !> Half of numbers\n", "\n", 37, "no comment !> above halve"),
    ("half(k)/2.0_wp", "exp(-half(k))", 47, "the bits of this intrinsic"),
    ("half(k)/2.0_wp", "half(k)**(1.0_wp/3.0_wp)", 47, "a power with a real exponent"),
    ("default(none) ", "", 44, "without default(none)"),
    ("schedule(static)", "reduction(+:total)", 44, "a sum by reduction"),
    ("schedule(static)", "num_threads(2) schedule(static)", 44, "a smaller team"),
    ("half(k)/2.0_wp", "half(k)\n      !$omp atomic", 48, "write disjointly"),
    ("   !> Twice a number\n", "\n", 53, "no comment !> above double_real"),
    ("end module polydem_good\n", 340*"\n" + "end module polydem_good\n", 406, "406 lines, more than 400"),
]
# Changes of GOOD after which it is still good
STILL_GOOD = [
    (BY, "      type(by_t)"),
    (BY, "      class( stand_by_t )"),
    (BY + ", intent(in)", "      type(by_t), allocatable, intent(inout)"),
    ("type :: good_t\n      !> Length [m]\n", "type :: good_t\n      private\n"),
    ("\ncontains\n\n", "\ninterface\n!> The time [s]\ninteger(c_int) function clock(kind) bind(C)\nimport :: c_int\n"
     "integer(c_int), value :: kind\nend function clock\nend interface\n\ncontains\n\n"),
]


class Rules(unittest.TestCase):
    def found(self, old="", new="", path="src/bodies/good.f90"):
        self.assertTrue(not old or GOOD.count(old) == 1, old)
        lines = GOOD.replace(old, new).split("\n") if old else GOOD.split("\n")
        return [*check_source(path, lines), *check_lines(path, lines)]

    def test_good_files_pass(self):
        self.assertEqual(self.found(), [])
        for old, new in STILL_GOOD:
            self.assertEqual(self.found(old, new), [], new)
        inherited = GOOD.replace("      !> How much [m]\n", "").replace("type ::", "type, extends(better_t) ::")
        self.assertEqual(list(check_source("src/bodies/good.f90", inherited.split("\n"))), [])
        self.assertEqual(self.found(LONGER, "      if (by < 0.0_wp) stop\n", "src/app/good.f90"), [])
        self.assertEqual(self.found(path="src/bodies/good_single.f90"), [])

    def test_bad_files_are_found_on_their_line(self):
        for old, new, line, words in BAD:
            with self.subTest(new=new):
                found = self.found(old, new)
                self.assertEqual([place for place, _ in found], [line], found)
                self.assertIn(words, found[0][1])

    def test_bad_lines_of_any_file(self):
        for text, words in (("a \n", "blanks"), ("\ta\n", "tabulator"), ("a\r\n", "blanks"), ("a", "newline"),
                            ("a\n\n", "newline"), ("! TO" "DO: a\n", "issue"), (125*"a" + "\n", "125 columns")):
            found = list(check_lines("a.pf", text.split("\n")))
            self.assertEqual(len(found), 1, text)
            self.assertIn(words, found[0][1])

    def test_stray_files_are_found(self):
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            self.assertEqual(list(check_tree(root)), [("src", 1, "no sources found")])
            subprocess.run(["git", "init", "--quiet", root], check=True)
            (root / "src/bodies").mkdir(parents=True)
            for name, text in (("src/bodies/good.f90", GOOD), ("LICENSE", "")):
                (root / name).write_text(text, encoding="utf-8")
            subprocess.run(["git", "-C", root, "add", "."], check=True)
            (root / "draft.f90").write_text("x", encoding="utf-8")
            self.assertEqual(list(check_tree(root)), [])
            (root / "src/bodies/good.F90").write_text(GOOD, encoding="utf-8")
            subprocess.run(["git", "-C", root, "add", "."], check=True)
            found = [name for name, *_ in check_tree(root)]
            self.assertEqual(found, ["draft.f90", "draft.f90", "src/bodies/good.F90"])
        self.assertTrue({"src", "LICENSE", "polydem"} <= TOP_LEVEL)


if __name__ == "__main__":
    unittest.main()
