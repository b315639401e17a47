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
# Names that pFUnit's module exports too, and those of the function that pFUnit writes behind a module
with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "funit_names.txt"), encoding="utf-8") as names_file:
    TAKEN = frozenset(names_file.read().split())
OF_SUITE = frozenset(("suite", "t"))

MODULE = re.compile(r"\s*module\s+(\w+)\s*$", re.IGNORECASE)
END_MODULE = re.compile(r"\s*end\s*module\b", re.IGNORECASE)
SUBROUTINE = re.compile(r"\s*subroutine\s+(\w+)\s*(\(\s*\))?\s*$", re.IGNORECASE)
ANY_SUBROUTINE = re.compile(r"\s*([\w() ]+\s)?subroutine\s", re.IGNORECASE)
PROCEDURE = re.compile(r"\s*(?!end\b)(?:[\w()=*: ]+\s)?(?:subroutine|function)\s+(\w+)", re.IGNORECASE)
CONTAINS = re.compile(r"\s*contains\s*$", re.IGNORECASE)
USE = re.compile(r"\s*use\b(?:[^:]*::)?\s*(\w+)\s*(?:,\s*only\s*:(.*))?$", re.IGNORECASE)
OPEN = re.compile(r"\s*(?:abstract\s+)?interface\b\s*(\w*)|\s*type\b(?!\s*\()[^:]*?(?:::)?\s*(\w+)\s*$|\s*enum\b",
                  re.IGNORECASE)
CLOSE = re.compile(r"\s*end\s*(interface|type|enum)\b", re.IGNORECASE)
ENUMERATOR = re.compile(r"\s*enumerator\b", re.IGNORECASE)
UNMARKED = re.compile(r"\s*(?:integer|real|complex|logical|character|double|(?:type|class|procedure)\s*\()",
                      re.IGNORECASE)
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


def listed(text):
    """Leading names of the items of a list that commas separate, commas in parentheses and brackets apart"""
    depth, item, items = 0, "", []
    for character in text + ",":
        depth += (character in "([") - (character in ")]")
        if character == "," and depth == 0:
            items.append(item)
            item = ""
        else:
            item += character
    return [match[1] for match in (re.match(r"\s*(\w+)", item) for item in items) if match]


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
        self.statement = ""  # what a line continues, without its ampersand
        self.first = 0  # line where that begins
        self.open = False  # within a type, an interface or a list of enumerators of the module
        self.in_head = False  # before the procedures of the module

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
            self.in_head = True
            self.refuse([self.module], number)
        if text.strip() and not text.lstrip().startswith("!"):
            if not self.statement:
                self.first = number
            self.statement += code.strip().lstrip("&")
            if self.statement.endswith("&"):
                self.statement = self.statement[:-1] + " "
            else:
                for statement in self.statement.split(";"):
                    self.names(statement, self.first)
                self.statement = ""
        if self.mark and code.strip():
            self.subroutine(code, number)

    def names(self, statement, number):
        """Look at the names that a statement gives to procedures, and to whatever the module has before them."""
        defined = PROCEDURE.match(statement)
        if defined:
            self.refuse([defined.group(1)], number)
        used = USE.match(statement)
        if used and used.group(2) and used.group(1).lower() != "funit":
            self.refuse(listed(used.group(2)), number)
        if used or not self.in_head:
            return
        opening, marked = OPEN.match(statement), statement.split("::")
        if CONTAINS.match(statement) and not self.open:
            self.in_head = False
        elif CLOSE.match(statement):
            self.open = False
        elif self.open:
            if ENUMERATOR.match(statement):
                self.refuse(listed(marked[-1]), number, OF_SUITE)
        elif opening:
            self.refuse([name for name in opening.groups() if name], number, OF_SUITE)
            self.open = True
        elif len(marked) > 1:
            self.refuse(listed("::".join(marked[1:])), number, OF_SUITE)
        elif UNMARKED.match(statement):
            raise Wrong(number, "a declaration needs :: before its names")

    @staticmethod
    def refuse(names, number, more=frozenset()):
        """Refuse names that pFUnit has, too."""
        for name in names:
            if name.lower() in TAKEN | more:
                raise Wrong(number, f"pFUnit has a name {name} of its own: choose another")

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
            if "\t" in text:
                raise Wrong(number, "a tab: write blanks")
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
