"""The rules of this project that fortitude, ruff and the compiler do not have.

usage: check_style.py ROOT      prints file:line: what is wrong, and ends with code 1 if anything is
"""

import re
import subprocess
import sys
from pathlib import Path

LONGEST_FILE, LONGEST_PROCEDURE = 400, 60
#: Columns by suffix, unless fortitude or ruff counts them; 124 is what pFUnit can take
WIDEST = {".pf": 124, **dict.fromkeys((".js", ".css", ".html", ".sh", ""), 120)}
TEXTS = {".f90", ".in", ".py", ".cmake", ".txt", ".md", ".json", ".toml", ".nml", ".cff", ".yaml"} | set(WIDEST)
FOLDERS = {"src", "tests", "postproc", "inputs"}
TOP_LEVEL = FOLDERS | {".ci", ".editorconfig", ".fortitude.toml", ".fprettify.rc", ".gitignore", ".ruff.toml",
                       "CITATION.cff", "CMakeLists.txt", "CMakePresets.json", "LICENSE", "README.md", "polydem"}

#: What no statement may have: pattern, path of files that may have it, message
FORBIDDEN = [(re.compile(pattern), re.compile(allowed), message) for pattern, allowed, message in (
    (r"^(if *\(.*\) *)?((error +)?stop\b(?! *[=%(])|call +(exit|abort)\b)", "^src/app/",
     "only the programs stop: by their end in src/app"),
    (r"\bcall +omp_set_num_threads\b", "^src/(app|laboratory|library|run)/",
     "the folders app, laboratory, library and run set the threads"),
    (r"^(save|data)\b(?! *[=%(])|^[^:]*, *save\b[^:]*::", "^$", "no save, no data: state lives in arguments"),
    (r"^[^:]*, *pointer\b[^:]*::", "^src/(platform|library)/", "no pointers: use allocatables and integer links"),
    (r"(?<!\w)settings(%\w+(\([^()]*\))?)+ *=(?![=>])|\btype *\( *settings_t *\) *, *intent *\( *(in)?out *\)",
     "^src/config/", "settings do not change once they are read"),
    (r"\bgo *to\b", "^$", "go to is not used here"),
    (r"%(law|damping|friction) *(==|/=)", "/law_factory.f90$",
     "only `choose_parts` of law_factory.f90 knows these words"),
    (r"(?<![%\w])(a?(sin|cos|tan)h?|atan2|exp|log|log10|(log_)?gamma|hypot|norm2|erf(c(_scaled)?)?|bessel_[jy].) *\(",
     "/elementary.f90$", "the bits of this intrinsic depend on the machine; see base/arithmetic/elementary.f90"),
    (r"\*\* *\(? *[-+]? *(\d+\.|\.\d|sqrt\b|real\b)", "^$",
     "the bits of a power with a real exponent depend on the machine"),
    (r"^!\$omp (parallel|task|teams)\b(?!.*\bdefault *\( *none *\))", "^$", "an OpenMP region without default(none)"),
    (r"^!\$omp.*\breduction *\( *[-+*]", "^$", "a sum by reduction depends on the number of threads"),
    (r"^!\$omp (atomic|critical|ordered)\b", "^$", "write disjointly and sum in a fixed order"),
    (r"^!\$omp parallel.*\bnum_threads\b", "^$",
     "a smaller team ends threads, which the next one starts again; use if"),
)]
DECLARATION = re.compile(r"(integer|real|logical|complex|character|type|class|procedure)\b[^:]*::")
OPENING = [(kind, re.compile(pattern)) for kind, pattern in (
    ("module", r"(?:sub)?module *(?:\([^)]*\))? *(?!procedure\b)(\w+)$"),
    ("program", r"program +(\w+)$"),
    ("interface", r"(?:abstract +)?interface\b *(.*)$"),
    ("type", r"type *(?:,[^:]*)?(?::: *| )(\w+)$"),
    ("procedure", r"(?:(?:[a-z]\w*|[a-z]\w* *\([^()]*(?:\([^()]*\)[^()]*)*\)) +)*(?:subroutine|function) +(\w+)"),
)]
ENDING = re.compile(r"end *(module|submodule|program|type|interface|subroutine|function)\b")


class Scope:
    """A module, interface, type or procedure, with the statements that stand directly in it."""

    def __init__(self, kind="file", name="", line=0, code="", outer=None):
        self.kind, self.name, self.line, self.code, self.outer = kind, name, line, code, outer
        self.length, self.statements = 0, []

    def declarations(self):
        """Line, code, and names of the declarations that stand directly in it, before its `contains`."""
        for line, code in self.statements:
            if code == "contains":
                return
            if DECLARATION.match(code):
                names = code.split("::", 1)[1]
                while (outer := re.sub(r"[(\[][^()\[\]]*[)\]]", "", names)) != names:
                    names = outer
                yield line, code, [re.match(r"\w*", part.strip())[0] for part in names.split(",")]


def statements_of(lines):
    """Line and code of each statement: joined, in lower case, strings empty, comments gone but those of OpenMP."""
    code, first = "", 0
    for number, line in enumerate(lines, 1):
        text = re.sub(r"'[^']*'|\"[^\"]*\"", "''", line.strip().lower())
        text = "!$omp " + text[5:].lstrip(" &") if text.startswith("!$omp") else text.partition("!")[0].strip()
        if not text or (code and code.startswith("!$omp") != text.startswith("!$omp")):
            continue
        first = first if code else number
        code = code + " " + text.removeprefix("!$omp ").lstrip("& ") if code else text
        if code.endswith("&"):
            code = code.rstrip("& ")
            continue
        yield first, code
        code = ""


def scopes_of(statements):
    """All scopes, the file itself first."""
    scopes = [Scope()]
    stack = [*scopes]
    for line, code in statements:
        opened = next(((kind, match[1]) for kind, pattern in OPENING if (match := pattern.match(code))), None)
        if ENDING.match(code) and len(stack) > 1:
            scope = stack.pop()
            scope.length = line - scope.line + 1
        elif opened:
            stack.append(Scope(*opened, line, code, stack[-1]))
            scopes.append(stack[-1])
        else:
            stack[-1].statements.append((line, code))
    return scopes


# --- rules --------------------------------------------------------------------------------------------------------

def check_lines(path, lines):
    """Rules of every text file."""
    widest = WIDEST.get(Path(path).suffix, 10000)
    for number, text in enumerate(lines, 1):
        if text != text.rstrip() or "\t" in text:
            yield number, "blanks at the end of the line, or a tabulator"
        if re.search(r"\b(TO" r"DO|FIX" r"ME|X" r"XX)\b", text):
            yield number, "an open issue belongs to the issues, not to the sources"
        if len(text) > widest:
            yield number, f"{len(text)} columns, more than {widest}"
    if lines[-1] != "" or lines[-2:] == ["", ""]:
        yield len(lines), "the file must end with one newline"


def check_source(path, lines):
    """Rules of a Fortran source of src."""
    statements = list(statements_of(lines))
    scopes = scopes_of(statements)
    for line, code in statements:
        yield from ((line, message) for pattern, allowed, message in FORBIDDEN
                    if pattern.search(code) and not allowed.search(path))
    if len(lines) - 1 > LONGEST_FILE:
        yield len(lines) - 1, f"{len(lines) - 1} lines, more than {LONGEST_FILE}"
    for scope in scopes:
        if scope.kind == "procedure" and scope.length > LONGEST_PROCEDURE:
            yield scope.line, f"{scope.name} has {scope.length} lines, more than {LONGEST_PROCEDURE}"
        if scope.kind == "module":
            yield from ((line, "a variable of a module: state lives in arguments")
                        for line, code, _ in scope.declarations()
                        if not re.match(r"procedure|.*\bparameter\b.*::", code))
            if scope.code.startswith("module ") and not f"polydem_{Path(path).stem}_".startswith(f"{scope.name}_"):
                yield scope.line, f"module {scope.name} is not named as its file"
    yield from check_imports(statements)
    yield from check_comments(scopes, lines)


def check_imports(statements):
    """Every name of a use statement occurs elsewhere, alone or as the kind of a number such as 1.0_wp."""
    others = " ".join(code for _, code in statements if not re.match(r"use\b", code))
    words = set(re.findall(r"[a-z]\w*", re.sub(r"(?<!\w)(\d+\.?\d*|\.\d+)([ed][+-]?\d+)?_(?=[a-z])", " ", others)))
    for line, code in statements:
        match = re.match(r"use\b.*\bonly *:(.*)", code)
        for name in match[1].split(",") if match else ():
            name = name.split("=>")[0].strip()
            if re.fullmatch(r"\w+", name) and name not in words:
                yield line, f"{name} is not used"


def check_comments(scopes, lines):
    """A comment !> above modules, types, their components, and what others call with its arguments."""
    public, inherited = public_names(scopes)
    for scope in scopes[1:]:
        is_called = scope.kind == "procedure" and (scope.name in public or scope.outer.kind == "interface")
        if (is_called or scope.kind in ("type", "module")) and not is_explained(lines, scope.line):
            yield scope.line, f"no comment !> above {scope.name}"
        # Arguments are explained once: by the manual of a C function, by the abstract type of an extension.
        explained = "bind(c" in scope.code.replace(" ", "") or scope.name in inherited
        arguments = re.search(r"\w+ *\(([^)]*)\)(?: *result|$| *bind)", scope.code) if is_called else None
        arguments = {name.strip() for name in arguments[1].split(",")} if arguments and not explained else set()
        is_open = scope.kind == "type" and all(code != "private" for _, code in scope.statements)
        for line, code, names in scope.declarations():
            wanted = (is_open and not re.search(r", *private\b.*::", code)) or (
                arguments & set(names) and names != ["self"] and not is_named_as_its_type(code, names))
            if wanted and not is_explained(lines, line):
                yield line, f"no comment !> above {', '.join(names)}"


def is_explained(lines, number):
    """Whether a comment that begins with !> ends on the line above."""
    above = number - 2
    while lines[above].strip().startswith("!") and not lines[above].strip().startswith("!>"):
        above -= 1
    return re.match(r" *!> *\S", lines[above]) is not None


def is_named_as_its_type(code, names):
    """Whether an argument has the name of its derived type, or its last words: `guard` of motion_guard_t."""
    match = re.match(r"(?:type|class) *\( *(\w+)_t *\)", code)
    return bool(match) and len(names) == 1 and f"_{match[1]}".replace("communicator", "comm").endswith(f"_{names[0]}")


def public_names(scopes):
    """Procedures that others call, by name or bound to a type; and those bound to an extension of another type."""
    public, inherited, generics = set(), set(), []
    for scope in scopes:
        is_bound = False
        for _, code in scope.statements:
            is_bound = is_bound or (scope.kind == "type" and code == "contains")
            attributes, _, names = code.partition("::")
            names = [name.split("=>")[-1].strip() for name in names.split(",")]
            if attributes.startswith("public"):
                public.update(names)
            elif is_bound and attributes.startswith("procedure") and "private" not in attributes:
                public.update(names)
                inherited.update(names if "extends" in scope.code else ())
            elif attributes.startswith("generic"):
                public.add(names[0])
            elif scope.kind == "interface" and code.startswith("module procedure"):
                generics.append((scope.name, re.findall(r"\w+", code)[2]))
    return public | {first for name, first in generics if name in public}, inherited


def check_tree(root):
    """All rules: file, line and message of each breach."""
    names = files_of(root)
    if not any(name.startswith("src/") for name in names):
        yield "src", 1, "no sources found"
    for name in sorted({name.split("/")[0] for name in names} - TOP_LEVEL):
        yield name, 1, "this file or folder does not belong at the top level"
    for name in names:
        suffix = Path(name).suffix
        if suffix in (".F90", ".F", ".f", ".for"):
            yield name, 1, "free-form .f90 without preprocessor only"
        if suffix in TEXTS and not name.startswith("."):
            lines = (Path(root) / name).read_bytes().decode().split("\n")
            yield from ((name, *found) for found in check_lines(name, lines))
            if name.startswith("src/") and suffix == ".f90":
                yield from ((name, *found) for found in check_source(name, lines))


def files_of(root):
    """Names of the tracked files that exist; in an archive all of the folders with sources."""
    listed = subprocess.run(["git", "-C", root, "ls-files"], capture_output=True, text=True, check=False)
    if (Path(root) / ".git").exists():
        return [name for name in sorted(listed.stdout.splitlines()) if (Path(root) / name).is_file()]
    return sorted(str(path.relative_to(root)) for folder in FOLDERS for path in (Path(root) / folder).rglob("*")
                  if path.is_file())


def main():
    breaches = list(check_tree(sys.argv[1]))
    for path, line, message in breaches:
        print(f"{path}:{line}: {message}")
    sys.exit(1 if breaches else 0)


if __name__ == "__main__":
    main()
