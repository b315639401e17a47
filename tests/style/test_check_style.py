"""Test of the rules of this project: a good file passes, and each bad change of it is found on its line."""

import os
import tempfile
import unittest

from check_style import check_lines, check_source, check_tree

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

CLOCK = """\
!> The time [s]
integer(c_int) function clock(kind) bind(C, name='clock')
import :: c_int
integer(c_int), value :: kind
end function clock
"""

# What replaces what in GOOD, the line that must be named, and words of the message.
BAD = [
    ("!> A good module.\n", "\n", 2, "no comment !> above module"),
    ("only: ip, wp", "only: dp, ip, wp", 3, "dp is not used"),
    ("only: ip, wp", "only: ip, wp, half_of => ip", 3, "half_of is not used"),
    ("polydem_kinds, only", "hdf5, only", 3, "the library HDF5 is used in the layer hdf5 only"),
    ("polydem_kinds, only", "h5lt, only", 3, "the library HDF5 is used in the layer hdf5 only"),
    ("polydem_kinds, only", "mpi_f08, only", 3, "MPI is used in the layers communicator and hdf5 only"),
    ("integer(ip), parameter ::", "integer(ip) ::", 9, "a variable of a module"),
    ("integer(ip), parameter ::", "integer(ip), save ::", 9, "no save"),
    ("   !> A good type\n", "\n", 12, "no comment !> above type good_t"),
    ("      !> Length [m]\n", "\n", 14, "no comment !> above length"),
    ("      !> Length [m]\n", "      ! Length [m]\n", 14, "no comment !> above length"),
    ("real(wp) :: length = 1.0_wp", "real(wp), pointer :: length(:)", 14, "no pointers"),
    ("1.0_wp", "1.0", 14, "the real number 1.0 has no kind"),
    ("half = x\n", "if (s%law == 'area') half = x\n", 43, "only `choose_parts` of the factory"),
    ("1.0_wp", "1e3", 14, "the real number 1e3 has no kind"),
    ("1.0_wp", "1.0d0", 14, "the real number 1.0d0 has no kind"),
    ("   !> Make it longer.\n", "\n", 28, "no comment !> above grow"),
    ("      !> How much [m]\n", "\n", 31, "no comment !> above by"),
    ("      !> How much [m]\n      real(wp)", "      type(length_t)", 30, "no comment !> above by"),
    ("      !> How much [m]\n      real(wp)", "      class(communicator_t)", 30, "no comment !> above by"),
    ("      !> How much [m]\n      real(wp)", "      type(baby_t)", 30, "no comment !> above by"),
    ("      self%length = self%length + by\n", "      stop 1\n", 33, "only the program"),
    ("      self%length = self%length + by\n", "      if (by > 0) error stop 'no'\n", 33, "only the program"),
    ("      self%length = self%length + by\n", "      if (by > 0) call abort()\n", 33, "only the program"),
    ("      self%length = self%length + by\n", "      call omp_set_num_threads(2)\n", 33, "the number of threads is"),
    ("      self%length = self%length + by\n", "      go to 10\n", 33, "go to"),
    ("      self%length = self%length + by\n", "#endif\n", 33, "no preprocessor"),
    ("      self%length = self%length + by\n", 61*"\n", 28, "grow has 67 lines, more than 60"),
    ("   !> Half of numbers\n", "\n", 37, "no comment !> above halve"),
    ("      !> Numbers\n", "\n", 39, "no comment !> above x"),
    ("      integer :: k\n", "      save\n", 41, "save is not used"),
    ("half(k)/2.0_wp", "exp(-half(k))", 47, "exp: the bits of this intrinsic"),
    ("half(k)/2.0_wp", "hypot (half(k), x(k))", 47, "hypot: the bits of this intrinsic"),
    ("half(k)/2.0_wp", "half(k)**0.5_wp", 47, "a power with a real exponent"),
    ("half(k)/2.0_wp", "half(k)**(1.0_wp/3.0_wp)", 47, "a power with a real exponent"),
    ("default(none) ", "", 44, "without default(none)"),
    ("schedule(static)", "reduction(+:total)", 44, "a sum by reduction"),
    ("schedule(static)", "num_threads(2) schedule(static)", 44, "num_threads: a smaller team"),
    ("half(k)/2.0_wp", "half(k)\n      !$omp atomic", 48, "atomic: write disjointly"),
    ("half(k)/2.0_wp", "half(k)\n      !$omp critical", 48, "critical: write disjointly"),
    ("   !> Twice a number\n", "\n", 53, "no comment !> above double_real"),
    ("end module polydem_good\n", 340*"\n" + "end module polydem_good\n", 406, "406 lines, more than 400"),
]


def found_in(text, layer="state"):
    return [*check_source("polydem_good.f90", layer, text), *check_lines("good.f90", text.split("\n"))]


class Rules(unittest.TestCase):
    def test_an_argument_named_as_its_type_needs_no_comment(self):
        for declaration in ("type(by_t), intent(in) :: by", "class( stand_by_t ), intent(in) :: by",
                            "type(by_t), allocatable, intent(inout) :: by", "type(by_t), intent(in) :: by(:)"):
            text = GOOD.replace("      !> How much [m]\n      real(wp), intent(in) :: by\n", f"      {declaration}\n")
            self.assertNotEqual(text, GOOD)
            self.assertEqual(found_in(text), [])
        text = GOOD.replace("      !> How much [m]\n      real(wp)", "      class(communicator_t)")
        text = text.replace("by", "comm")
        self.assertEqual(found_in(text), [])

    def test_a_good_file_passes(self):
        self.assertEqual(found_in(GOOD), [])

    def test_bad_files_are_found_on_their_line(self):
        for old, new, line, words in BAD:
            with self.subTest(new=new):
                self.assertEqual(GOOD.count(old), 1)
                found = found_in(GOOD.replace(old, new))
                self.assertEqual([place for place, _ in found], [line], found)
                self.assertIn(words, found[0][1])

    def test_bad_lines_of_any_file(self):
        for text, words in (("a \n", "blanks"), ("\ta\n", "tabulator"), ("a\r\n", "blanks"), ("a", "newline"),
                            ("a\n\n", "newline"), ("! TO" "DO: a\n", "issue"), (125*"a" + "\n", "125 columns")):
            with self.subTest(text=text):
                found = list(check_lines("a.pf", text.split("\n")))
                self.assertEqual(len(found), 1)
                self.assertIn(words, found[0][1])

    def test_scripts_and_pages_of_the_viewer_are_not_wider_than_sources(self):
        for path in ("polydem", "a.js", "a.html", "a.css", "a.sh"):
            self.assertEqual(list(check_lines(path, [120*"a", ""])), [])
            self.assertEqual([line for line, _ in check_lines(path, ["a", 121*"a", ""])], [2])

    def test_what_a_layer_alone_may_do(self):
        self.assertEqual(found_in(GOOD.replace("polydem_kinds, only", "hdf5, only"), "hdf5"), [])
        self.assertEqual(found_in(GOOD.replace("self%length + by", "by\n      if (by < 0.0_wp) stop"), "app"), [])

    def test_arguments_of_foreign_and_inherited_procedures_are_explained_elsewhere(self):
        foreign = GOOD.replace("\ncontains\n", "\ninterface\n" + CLOCK + "end interface\n\ncontains\n")
        self.assertEqual(found_in(foreign), [])
        self.assertEqual(len(found_in(foreign.replace(" bind(C, name='clock')", ""))), 1)
        inherited = GOOD.replace("      !> How much [m]\n", "")
        self.assertEqual(len(found_in(inherited)), 1)
        self.assertEqual(found_in(inherited.replace("type :: good_t", "type, extends(better_t) :: good_t")), [])


class Tree(unittest.TestCase):
    """Rules of a whole tree, in a made-up one."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = folder.name
        self.write("bodies/good.f90", GOOD)

    def write(self, path, text):
        path = os.path.join(self.root, "src", path)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)

    def messages(self):
        return [f"{path}:{line}: {message}" for path, line, message in check_tree(self.root)]

    def test_a_good_tree_passes(self):
        self.assertEqual(self.messages(), [])

    def test_modules_are_named_as_their_files(self):
        self.write("bodies/better.f90", GOOD)
        self.assertEqual(self.messages(),
                         ["src/bodies/better.f90:2: module polydem_good should be polydem_better, as its file"])

    def test_files_that_cmake_chooses_between_share_a_module(self):
        self.write("bodies/good_double.f90", GOOD)
        self.write("bodies/good_single.f90", GOOD)
        self.assertEqual(self.messages(), [])

    def test_files_for_the_preprocessor_are_refused(self):
        self.write("bodies/good.F90", GOOD)
        self.assertEqual(self.messages(), ["src/bodies/good.F90:1: free-form .f90 without preprocessor only"])

    def test_stages_are_folders_and_groups(self):
        type_comment = "   !> A good type\n"
        names = "   integer, parameter :: stage_names(n_stages) = &\n      [character(len=6) :: 'bodies', 'flow']\n"
        timers = GOOD.replace("_good\n", "_timers\n").replace(type_comment, names + type_comment)
        self.write("base/timers.f90", timers)
        self.write("config/entries.txt", "# Comment\n\ngroup bodies: bodies\n")
        self.assertEqual(self.messages(), ["src/base/timers.f90:1: stage flow is not a folder of src",
                                           "src/base/timers.f90:1: stage flow is not a group of the namelist"])

    def test_an_empty_tree_is_not_praised(self):
        with tempfile.TemporaryDirectory() as empty:
            self.assertEqual(list(check_tree(empty)), [("src", 1, "no sources found")])


if __name__ == "__main__":
    unittest.main()
