"""Write the module funit_asserts: one overload per kind and rank, each a call of one comparison per kind.

usage: write_asserts.py OUT.f90
"""

import sys

RELATIONS = ["Equal", "NotEqual", "LessThan", "LessThanOrEqual", "GreaterThan", "GreaterThanOrEqual"]
RANKS = [(0, 0), (0, 1), (1, 1), (0, 2), (2, 2)]
REALS = ["real32", "real64", "real128"]
INTEGERS = [("int8", "int8"), ("int32", "int8"), ("int32", "int32"), ("int32", "int64"), ("int64", "int64")]
SHAPE = {0: "", 1: "(:)", 2: "(:, :)"}

HEAD = """\
!> Asserts of the stand-in for pFUnit. Written by write_asserts.py; do not edit.
module funit_asserts
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
   use, intrinsic :: iso_fortran_env, only: int8, int32, int64, real32, real64, real128
   use funit_exceptions, only: SourceLocation, throw
   implicit none
   private
"""

OVERLOAD = """
   subroutine {name}(expected, actual{tolerance_argument}, message, location)
      {type_expected}, intent(in) :: expected{shape_expected}
      {type_actual}, intent(in) :: actual{shape_actual}
{tolerance_declaration}\
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      call check_{core}('{relation}', {expected}, shape(expected), &
         {actual}, shape(actual){tolerance_argument}, message=message, location=location)
   end subroutine {name}
"""

COMMON = """
   !> Whether a relation of two numbers holds, given their order: -1, 0 or 1
   pure logical function holds(relation, order)
      character(len=*), intent(in) :: relation
      integer, intent(in) :: order

      select case (relation)
      case ('Equal', 'RelativelyEqual')
         holds = order == 0
      case ('NotEqual')
         holds = order /= 0
      case ('LessThan')
         holds = order < 0
      case ('LessThanOrEqual')
         holds = order <= 0
      case ('GreaterThan')
         holds = order > 0
      case default
         holds = order >= 0
      end select
   end function holds

   !> Whether two shapes can be compared; if not, that is the failure.
   logical function conform(expected, actual, message, location)
      integer, intent(in) :: expected(:), actual(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      character(len=80) :: text

      conform = .true.
      if (size(expected) == 0) return
      conform = all(expected == actual)
      if (conform) return
      write (text, '(*(a, 2(i0, :, 1x)))') 'shapes differ: expected ', expected
      write (text(len_trim(text) + 2:), '(a, 2(i0, :, 1x))') 'but found ', actual
      call fail(trim(text), message, location)
   end function conform

   !> Describe a pair of values that does not fulfil a relation.
   subroutine fail_pair(relation, expected, actual, place, extents, message, location)
      character(len=*), intent(in) :: relation, expected, actual
      integer, intent(in) :: place, extents(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      character(len=:), allocatable :: text
      character(len=40) :: element

      element = ''
      if (size(extents) == 1) write (element, '(a, i0, a)') ' at element (', place, ')'
      if (size(extents) == 2) write (element, '(a, i0, a, i0, a)') ' at element (', &
         modulo(place - 1, extents(1)) + 1, ', ', (place - 1)/extents(1) + 1, ')'
      if (relation == 'Equal' .or. relation == 'RelativelyEqual') then
         text = 'expected: <'//trim(adjustl(expected))//'> but found: <'//trim(adjustl(actual))//'>'
      else
         text = 'not true: <'//trim(adjustl(expected))//'> '//relation//' <'//trim(adjustl(actual))//'>'
      end if
      call fail(text//trim(element), message, location)
   end subroutine fail_pair

   !> Throw a failure, the words of the test first.
   subroutine fail(text, message, location)
      character(len=*), intent(in) :: text
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      if (present(message)) then
         call throw(trim(message)//new_line('a')//text, location)
      else
         call throw(text, location)
      end if
   end subroutine fail

   !> The one comparison of integers
   subroutine check_integer(relation, expected, shape_expected, actual, shape_actual, message, location)
      character(len=*), intent(in) :: relation
      integer(int64), intent(in) :: expected(:), actual(:)
      integer, intent(in) :: shape_expected(:), shape_actual(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      character(len=24) :: wanted, found
      integer(int64) :: e, a
      integer :: k

      if (.not. conform(shape_expected, shape_actual, message, location)) return
      do k = 1, size(actual)
         e = expected(min(k, size(expected)))
         a = actual(k)
         if (holds(relation, merge(-1, merge(1, 0, e > a), e < a))) cycle
         write (wanted, '(i0)') e
         write (found, '(i0)') a
         call fail_pair(relation, wanted, found, k, shape_actual, message, location)
         return
      end do
   end subroutine check_integer

   !> The one comparison of texts: blanks at both ends do not count
   subroutine check_text(relation, expected, shape_expected, actual, shape_actual, message, location)
      character(len=*), intent(in) :: relation, expected(:), actual(:)
      integer, intent(in) :: shape_expected(:), shape_actual(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      integer :: k, j

      if (.not. conform(shape_expected, shape_actual, message, location)) return
      do k = 1, size(actual)
         j = min(k, size(expected))
         if (trim(adjustl(expected(j))) == trim(adjustl(actual(k)))) cycle
         call fail_pair(relation, expected(j), actual(k), k, shape_actual, message, location)
         return
      end do
   end subroutine check_text

   !> Text of a logical
   elemental character(len=5) function word(condition)
      logical, intent(in) :: condition

      word = merge('true ', 'false', condition)
   end function word

   subroutine true_0(condition, message, location)
      logical, intent(in) :: condition
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      if (.not. condition) call fail('expected: <true> but found: <false>', message, location)
   end subroutine true_0

   subroutine true_1(condition, message, location)
      logical, intent(in) :: condition(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      call check_text('Equal', ['true'], [integer ::], word(condition), shape(condition), message, location)
   end subroutine true_1

   subroutine false_0(condition, message, location)
      logical, intent(in) :: condition
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      if (condition) call fail('expected: <false> but found: <true>', message, location)
   end subroutine false_0

   subroutine false_1(condition, message, location)
      logical, intent(in) :: condition(:)
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      call check_text('Equal', ['false'], [integer ::], word(condition), shape(condition), message, location)
   end subroutine false_1

   !> Fail whatever the values are.
   subroutine assertFail(message, location)
      character(len=*), intent(in) :: message
      type(SourceLocation), intent(in), optional :: location

      call throw(message, location)
   end subroutine assertFail
"""

REAL_CORE = """
   !> The one comparison of reals of kind {kind}; a NaN fulfils no relation
   subroutine check_{kind}(relation, expected, shape_expected, actual, shape_actual, tolerance, message, location)
      character(len=*), intent(in) :: relation
      real({kind}), intent(in) :: expected(:), actual(:)
      integer, intent(in) :: shape_expected(:), shape_actual(:)
      real({kind}), intent(in), optional :: tolerance
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location
      character(len=48) :: wanted, found
      real({kind}) :: e, a, allowed
      integer :: k
      logical :: good

      if (.not. conform(shape_expected, shape_actual, message, location)) return
      allowed = 0.0_{kind}
      if (present(tolerance)) allowed = tolerance
      ! A comparison with NaN would end a program that traps it.
      good = ieee_is_finite(allowed)
      if (good) good = allowed >= 0.0_{kind}
      if (.not. good) then
         call fail('a tolerance must be a finite number that is not negative', message, location)
         return
      end if
      if (relation == 'RelativelyEqual') then
         good = all(ieee_is_finite(expected))
         if (good) good = all(abs(expected) > 0.0_{kind})
         if (.not. good) then
            call fail('nothing is relatively equal to zero or to what is not finite', message, location)
            return
         end if
      end if
      do k = 1, size(actual)
         e = expected(min(k, size(expected)))
         a = actual(k)
         good = .false.
         if (.not. (ieee_is_nan(e) .or. ieee_is_nan(a))) then
            good = holds(relation, merge(-1, merge(1, 0, e > a), e < a))
            if (.not. good .and. ieee_is_finite(e) .and. ieee_is_finite(a)) then
               if (relation == 'Equal') good = abs(a - e) <= allowed
               if (relation == 'RelativelyEqual') good = abs(a - e) <= allowed*abs(e)
            end if
         end if
         if (good) cycle
         write (wanted, '(es{width}.{digits}e4)') e
         write (found, '(es{width}.{digits}e4)') a
         call fail_pair(relation, wanted, found, k, shape_actual, message, location)
         return
      end do
   end subroutine check_{kind}

   subroutine nan_{kind}(number, message, location)
      real({kind}), intent(in) :: number
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      if (.not. ieee_is_nan(number)) call fail('expected: <NaN> but found a number', message, location)
   end subroutine nan_{kind}

   subroutine finite_{kind}(number, message, location)
      real({kind}), intent(in) :: number
      character(len=*), intent(in), optional :: message
      type(SourceLocation), intent(in), optional :: location

      if (.not. ieee_is_finite(number)) call fail('expected a finite number', message, location)
   end subroutine finite_{kind}
"""


def overload(relation, type_expected, type_actual, ranks, core, convert, tolerance=None):
    """One specific procedure of a generic assert: its name and its text."""
    tag = f"{type_expected}_{type_actual}_{ranks[0]}{ranks[1]}"
    name = f"{relation}_{tag}".lower().translate(str.maketrans({"(": "_", ")": "", "=": "", "*": "s"}))
    declaration = "" if tolerance is None else f"      {type_actual}, intent(in){tolerance} :: tolerance\n"
    text = OVERLOAD.format(
        name=name, relation=relation, core=core,
        type_expected=type_expected, type_actual=type_actual,
        shape_expected=SHAPE[ranks[0]], shape_actual=SHAPE[ranks[1]],
        expected=convert.format("expected"), actual=convert.format("actual"),
        tolerance_argument="" if tolerance is None else ", tolerance",
        tolerance_declaration=declaration)
    return name, text


def overloads():
    """All of them, by generic assert."""
    found = {}

    def add(relation, *arguments, **options):
        found.setdefault(relation, []).append(overload(relation, *arguments, **options))

    for ranks in RANKS:
        for relation in RELATIONS:
            for expected, actual in INTEGERS:
                add(relation, f"integer({expected})", f"integer({actual})", ranks, "integer", "[int({}, int64)]")
            for kind in REALS:
                tolerance = ", optional" if relation == "Equal" else None
                add(relation, f"real({kind})", f"real({kind})", ranks, kind, "[{}]", tolerance=tolerance)
        for kind in REALS:
            add("RelativelyEqual", f"real({kind})", f"real({kind})", ranks, kind, "[{}]", tolerance="")
    for ranks in RANKS[:3]:
        add("Equal", "character(len=*)", "character(len=*)", ranks, "text", "[{}]")
        add("Equal", "logical", "logical", ranks, "text", "[word({})]")
    return found


def main():
    found = overloads()
    lines = [HEAD]
    generics = {f"assert{relation}": [name for name, _ in members] for relation, members in found.items()}
    generics["assertTrue"] = ["true_0", "true_1"]
    generics["assertFalse"] = ["false_0", "false_1"]
    generics["assertIsNaN"] = [f"nan_{kind}" for kind in REALS]
    generics["assertIsFinite"] = [f"finite_{kind}" for kind in REALS]
    lines.append("   public :: assertFail")
    for generic, members in generics.items():
        lines.append(f"   public :: {generic}\n   interface {generic}")
        lines.extend(f"      module procedure {name}" for name in members)
        lines.append(f"   end interface {generic}")
    lines.append("\ncontains")
    lines.append(COMMON)
    digits = {"real32": 8, "real64": 16, "real128": 33}
    lines.extend(REAL_CORE.format(kind=kind, digits=digits[kind], width=digits[kind] + 12) for kind in REALS)
    lines.extend(text for members in found.values() for _, text in members)
    lines.append("\nend module funit_asserts\n")
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        file.write("\n".join(lines))


if __name__ == "__main__":
    main()
