"""Translate a test file for pFUnit (.pf) to Fortran, in the forms that this project uses.

usage: translate.py IN.pf OUT.f90

Lines stay where they are, so that messages of the compiler name the right line of the .pf file; a module with the
list of the tests is appended. Whatever is not understood is an error with file and line, never passed over.
"""

import os
import re
import sys

ASSERTS = {"equal": "Equal", "notequal": "NotEqual", "relativelyequal": "RelativelyEqual", "true": "True",
           "false": "False", "lessthan": "LessThan", "lessthanorequal": "LessThanOrEqual",
           "greaterthan": "GreaterThan", "greaterthanorequal": "GreaterThanOrEqual", "isnan": "IsNaN",
           "isfinite": "IsFinite", "fail": "Fail"}
MARKS = ("test", "before", "after")
LONGEST = 124  # columns of an assert that pFUnit can still extend
LONGEST_NAME = 63  # of a procedure in Fortran
TAKEN = ("run",)  # names that pFUnit's module exports too

MODULE = re.compile(r"\s*module\s+(\w+)\s*$", re.IGNORECASE)
END_MODULE = re.compile(r"\s*end\s*module\b", re.IGNORECASE)
SUBROUTINE = re.compile(r"\s*subroutine\s+(\w+)\s*(\(\s*\))?\s*$", re.IGNORECASE)
ANY_SUBROUTINE = re.compile(r"\s*([\w() ]+\s)?subroutine\s", re.IGNORECASE)
PROCEDURE = re.compile(r"\s*(?!end\b)(?:[\w() ]+\s)?(?:subroutine|function)\s+(\w+)", re.IGNORECASE)
DIRECTIVE = re.compile(r"\s*@(\w+)\s*(\(.*)?$")

SUITE = """
# 1 "{output}"
!> The tests of {module}, written by translate.py.
module {module}_suite
   use funit_runner, only: runner_t
   use {module}, only: {renames}
   implicit none
   private
   public :: add_tests
contains
   subroutine add_tests(runner)
      type(runner_t), intent(inout) :: runner

{calls}
   end subroutine add_tests
end module {module}_suite
"""


class Wrong(Exception):
    """Something in the file that is not understood: line number and reason."""

    def __init__(self, line, reason):
        super().__init__(reason)
        self.line = line


def code_of(text):
    """A line without its strings and its comment; strings become blanks of the same length."""
    quote = ""
    out = []
    for character in text:
        if quote:
            quote = "" if character == quote else quote
            out.append(" ")
        elif character in "'\"":
            quote = character
            out.append(" ")
        elif character == "!":
            break
        else:
            out.append(character)
    return "".join(out)


def closes_at_end(arguments):
    """Whether a text is one pair of parentheses with whatever between them."""
    depth = 0
    code = code_of(arguments)
    if len(code) != len(arguments):
        return False
    for place, character in enumerate(code):
        depth += (character == "(") - (character == ")")
        if depth == 0:
            return code[place + 1:].strip() == ""
    return False


def assert_call(text, word, arguments, number, file_name):
    """The Fortran of an assert, on one line."""
    name = ASSERTS.get(word[len("assert"):].lower())
    if name is None:
        raise Wrong(number, f"unknown assert @{word}")
    if len(text.strip()) > LONGEST:
        raise Wrong(number, f"an assert must not be longer than {LONGEST} columns")
    if not arguments or not closes_at_end(arguments):
        raise Wrong(number, "an assert must stand on one line, with its closing parenthesis at the end")
    inside = arguments.rstrip()[1:-1].strip()
    if not inside:
        raise Wrong(number, f"@{word} needs an argument")
    return (f"call assert{name}({inside}, location=SourceLocation('{file_name}', {number})); "
            "if (anyExceptions()) return")


class Translator:
    """State of the translation of one file."""

    def __init__(self, path):
        self.path = path
        self.name = os.path.basename(path)
        self.module = None
        self.mark = None  # (word, line) of an annotation that waits for its subroutine
        self.found = {"test": [], "before": [], "after": []}

    def directive(self, text, number):
        """Translate a line that begins with @."""
        if self.mark:
            raise Wrong(number, f"@{self.mark[0]} of line {self.mark[1]} has no subroutine")
        match = DIRECTIVE.match(text)
        if not match:
            raise Wrong(number, "an annotation must stand alone on its line")
        word, arguments = match.groups()
        if word.lower() in MARKS:
            if arguments:
                raise Wrong(number, f"@{word} takes no arguments here")
            self.mark = (word.lower(), number)
            return ""
        if word.lower().startswith("assert"):
            return assert_call(text, word, arguments, number, self.name)
        raise Wrong(number, f"unknown annotation @{word}")

    def plain(self, text, number):
        """Look at a line of Fortran."""
        code = code_of(text)
        if "@" in code:
            raise Wrong(number, "an annotation must stand alone on its line")
        opening = MODULE.match(code)
        if opening and opening.group(1).lower() != "procedure":
            if self.module:
                raise Wrong(number, "one module per file")
            self.module = opening.group(1)
            stem = os.path.splitext(self.name)[0]
            if self.module.lower() != stem.lower():
                raise Wrong(number, f"module {self.module} must be named {stem} as its file")
            if code != text.rstrip():
                raise Wrong(number, "pFUnit wants nothing behind the name of a module")
        defined = PROCEDURE.match(code)
        if defined and defined.group(1).lower() in TAKEN:
            raise Wrong(number, f"pFUnit has a procedure {defined.group(1)} of its own: choose another name")
        if self.mark and code.strip():
            self.subroutine(code, number)

    def subroutine(self, code, number):
        """Take the subroutine that an annotation stands above."""
        match = SUBROUTINE.match(code)
        if not match:
            reason = "a plain subroutine without arguments must follow" if ANY_SUBROUTINE.match(code) \
                else "a subroutine must follow"
            raise Wrong(number, f"@{self.mark[0]} of line {self.mark[1]}: {reason}")
        names = self.found[self.mark[0]]
        if self.mark[0] != "test" and names:
            raise Wrong(number, f"a second @{self.mark[0]}")
        if len(match.group(1)) > LONGEST_NAME:
            raise Wrong(number, f"a name must not be longer than {LONGEST_NAME} characters")
        names.append(match.group(1))
        self.mark = None

    def translate(self, output):
        """The Fortran of the whole file."""
        with open(self.path, encoding="utf-8") as file:
            lines = file.read().splitlines()
        out = [f'# 1 "{self.path}"']
        for number, text in enumerate(lines, 1):
            if text.lstrip().startswith("@"):
                out.append(self.directive(text, number))
            else:
                self.plain(text, number)
                out.append(text)
        if self.mark:
            raise Wrong(self.mark[1], f"@{self.mark[0]} has no subroutine")
        if not self.module or not any(END_MODULE.match(text) for text in lines):
            raise Wrong(1, "the tests must stand in a module")
        if not self.found["test"]:
            raise Wrong(1, "no @test in this file")
        out.append(self.suite(output))
        return "\n".join(out)

    def suite(self, output):
        """The module with the list of the tests."""
        renames, calls = [], []
        extra = ""
        for mark in ("before", "after"):
            for name in self.found[mark]:
                renames.append(f"run_{mark} => {name}")
                extra += f", {mark}=run_{mark}"
        for place, name in enumerate(self.found["test"], 1):
            renames.append(f"test_{place} => {name}")
            calls.append(f"      call runner%add('{self.module}_suite', '{name}', test_{place}{extra})")
        return SUITE.format(output=output, module=self.module, renames=", &\n      ".join(renames),
                            calls="\n".join(calls))


def main():
    source, output = sys.argv[1:]
    try:
        text = Translator(source).translate(output)
    except Wrong as wrong:
        sys.exit(f"{source}:{wrong.line}: error: {wrong}")
    with open(output, "w", encoding="utf-8") as file:
        file.write(text)


if __name__ == "__main__":
    main()
