"""A Fortran file taken apart as far as the house rules need it: statements, scopes, documentation."""

import re

OPENING = re.compile(r"(?:(?:pure|impure|elemental|recursive|module|[a-z]\w*\s*\([^()]*(?:\([^()]*\)[^()]*)*\)|"
                     r"integer|real|logical|complex|character)\s+)*(subroutine|function)\s+(\w+)")
TYPE = re.compile(r"type\s*(?:,[^:]*)?(?:::\s*|\s)(\w+)$")
DECLARATION = re.compile(r"(?:integer|real|logical|complex|character|type|class|procedure|double\s+precision)\b")


class Statement:
    """One statement: first line, its code in lower case without strings, and the scopes around it."""

    def __init__(self, line, last, code):
        self.line = line
        self.last = last
        self.code = code
        self.scopes = ()

    @property
    def is_declaration(self):
        return "::" in self.code and DECLARATION.match(self.code) is not None and opening_of(self.code) is None

    @property
    def attributes(self):
        """What stands before the double colon of a declaration."""
        return self.code.split("::")[0]

    @property
    def names(self):
        """What a declaration declares, without shapes and values."""
        return [re.match(r"\w*", part.strip()).group() for part in split_commas(self.code.split("::", 1)[1])]


class Scope:
    """A module, type, interface or procedure."""

    def __init__(self, kind, name, statement):
        self.kind = kind
        self.name = name
        self.first = statement
        self.last = None
        self.contains = False


class Source:
    """A file: lines, statements, scopes."""

    def __init__(self, path, text):
        self.path = path
        self.lines = text.split("\n")
        self.statements = list(statements_of(self.lines))
        self.scopes = []
        self.find_scopes()

    def find_scopes(self):
        """Tell every statement in which scopes it stands."""
        stack = []
        for statement in self.statements:
            code = statement.code
            if code.startswith("!$"):
                statement.scopes = tuple(stack)
                continue
            ending = re.match(r"end\s*(module|submodule|program|type|interface|subroutine|function)\b", code)
            if ending and stack:
                statement.scopes = tuple(stack)
                stack.pop().last = statement
                continue
            statement.scopes = tuple(stack)
            if code == "contains" and stack:
                stack[-1].contains = True
            opened = opening_of(code)
            if opened:
                scope = Scope(*opened, statement)
                stack.append(scope)
                self.scopes.append(scope)

    def has_comment_above(self, statement):
        """Whether a comment that begins with !> ends on the line above."""
        k = statement.line - 2
        while k >= 0 and self.lines[k].lstrip().startswith("!"):
            if self.lines[k].lstrip().startswith("!>"):
                return len(self.lines[k].strip()) > 4
            k -= 1
        return False

    def inside(self, scope):
        """Statements that stand directly in a scope."""
        return [statement for statement in self.statements if statement.scopes and statement.scopes[-1] is scope]


def opening_of(code):
    """Kind and name of the scope that a statement opens, if it does."""
    match = re.match(r"(module|program)\s+(\w+)$", code)
    if match and match.group(2) != "procedure":
        return match.group(1), match.group(2)
    match = re.match(r"submodule\s*\([^)]*\)\s*(\w+)$", code)
    if match:
        return "submodule", match.group(1)
    match = re.match(r"(?:abstract\s+)?interface\b\s*(.*)$", code)
    if match:
        return "interface", match.group(1)
    match = TYPE.match(code)
    if match:
        return "type", match.group(1)
    match = OPENING.match(code)
    if match:
        return "procedure", match.group(2)
    return None


def without_strings(text):
    """A line in lower case: strings as quotes without their inside, its comment cut off."""
    out = []
    quote = ""
    for character in text:
        if quote:
            if character == quote:
                quote = ""
                out.append(character)
        elif character in "'\"":
            quote = character
            out.append(character)
        elif character == "!":
            break
        else:
            out.append(character)
    return "".join(out).strip().lower()


def statements_of(lines):
    """Join continued lines to statements; directives of OpenMP are statements too."""
    code, first, continued = "", 0, False
    for number, text in enumerate(lines, 1):
        directive = text.strip().lower().startswith("!$omp")
        piece = "!$omp " + without_strings(text.strip()[5:]).lstrip("&").strip() if directive else without_strings(text)
        if not piece or (continued and directive != code.startswith("!$omp")):
            continue
        if continued:
            code += " " + (piece[6:] if directive else piece.lstrip("&").strip())
        else:
            code, first = piece, number
        continued = code.endswith("&")
        code = code.rstrip("& ") if continued else code
        if not continued:
            yield Statement(first, number, code)


def split_commas(text):
    """Split at commas that stand outside parentheses."""
    parts, depth = [""], 0
    for character in text:
        depth += (character in "([") - (character in ")]")
        if character == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    return parts
