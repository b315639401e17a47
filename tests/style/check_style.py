"""The rules of this project that a machine can check; .fortitude.toml and .ruff.toml have the generic ones.

usage: check_style.py ROOT      prints file:line: what is wrong, and ends with code 1 if anything is
"""

import os
import re
import sys

from fortran_source import Source, split_commas
from tracked_files import tracked_files

WIDEST = {".pf": 124, **dict.fromkeys((".js", ".css", ".html", ".sh", ""), 120)}  # columns; 124: what pFUnit can take
LONGEST_FILE = 400
LONGEST_PROCEDURE = 60
TEXTS = (".f90", ".in", ".pf", ".py", ".cmake", ".txt", ".md", ".json", ".toml", ".nml", ".cff", ".js", ".css", ".html",
         ".sh", ".yaml")
TREES = ("src", "tests", "postproc", "inputs")
REAL_LITERAL = re.compile(r"(?<![\w.])(?:\d+\.\d*|\.\d+)(?:[ed][+-]?\d+)?(?![\w.])|(?<![\w.])\d+[ed][+-]?\d+\b")
KIND_OF_NUMBER = re.compile(r"(?<!\w)(?:\d+\.?\d*|\.\d+)(?:[ed][+-]?\d+)?_(?=[a-z])")

#: Functions whose bits depend on the processor and its library
INTRINSIC = re.compile(r"(?<![%\w])(a?(?:sin|cos|tan)h?|atan2|exp|log|log10|log_gamma|gamma|hypot|norm2|erfc?|"
                       r"erfc_scaled|bessel_[jy][01n])\s*\(")
REAL_POWER = re.compile(r"\*\*\s*\(?\s*[-+]?\s*(?:\d+\.|\.\d|sqrt\b|real\b)")

# --- rules of one line -------------------------------------------------------------------------------------------

def check_lines(path, lines):
    """Rules of every text file."""
    widest = WIDEST.get(os.path.splitext(path)[1])
    for number, text in enumerate(lines, 1):
        if text != text.rstrip():
            yield number, "blanks at the end of the line"
        if "\t" in text:
            yield number, "a tabulator"
        if re.search(r"\b(TO" r"DO|FIX" r"ME|X" r"XX)\b", text):
            yield number, "an open issue belongs to the issues, not to the sources"
        if widest and len(text) > widest:
            yield number, f"{len(text)} columns, more than {widest}"
    if lines[-1] != "" or lines[-2:] == ["", ""]:
        yield len(lines), "the file must end with one newline"


# --- rules of one statement --------------------------------------------------------------------------------------

def check_statements(source, layer):
    """Rules that need to see a statement and its scopes."""
    for statement in source.statements:
        if os.path.basename(source.path) != "elementary.f90":
            for name in INTRINSIC.findall(statement.code):
                yield statement.line, (f"{name}: the bits of this intrinsic depend on the machine; "
                                       "see base/arithmetic/elementary.f90")
        if REAL_POWER.search(statement.code):
            yield statement.line, "the bits of a power with a real exponent depend on the machine"
        for message in [*of_any(statement, layer), *of_declaration(statement), *of_directive(statement)]:
            yield statement.line, message
        if is_pointer(statement) and not any("c_f_pointer" in other.code
                                             for other in source.inside(statement.scopes[-1])):
            yield statement.line, "no pointers: use allocatables and integer links (only c_f_pointer needs one)"


def is_pointer(statement):
    """Whether a statement declares a pointer."""
    return statement.is_declaration and statement.scopes and re.search(r",\s*pointer\b", statement.attributes)


#: Arguments that are named by a shorter form of the name of their type
SHORT_NAMES = {"communicator": "comm"}

#: Stages that have the name of a namelist group, not that of the layer that does the work
STAGES_OF_LAYERS = {"output": "io"}
#: Table of namelist entries, which names the groups
TABLE = os.path.join("src", "config", "entries.txt")


def of_any(statement, layer):
    """Statements that are nowhere allowed, or only in one layer."""
    code = statement.code
    if re.match(r"use\b.*\b(hdf5|h5lt|h5ds)\b\s*,", code) and layer != "hdf5":
        yield "the library HDF5 is used in the layer hdf5 only"
    if re.match(r"use\b.*\bmpi(_f08)?\b\s*,", code) and layer not in ("hdf5", "communicator"):
        yield "MPI is used in the layers communicator and hdf5 only"
    if re.match(r"(if\s*\(.*\)\s*)?(error\s+)?stop\b(?!\s*[=%(])", code) and layer != "app":
        yield "only the program in src/app stops"
    if re.search(r"\bcall\s+omp_set_num_threads\b", code) and layer not in ("app", "laboratory", "run"):
        yield "the number of threads is set in the layers app, laboratory and run only"
    if re.match(r"(if\s*\(.*\)\s*)?call\s+(exit|abort)\b", code) and layer != "app":
        yield "only the program in src/app stops"
    if re.match(r"(save|data|include)\b(?!\s*[=%(])", code) or re.match(r"save\s*/", code):
        yield f"{code.split()[0]} is not used here"
    if code.startswith("#"):
        yield "no preprocessor: CMake chooses files"
    if re.search(r"\bgo\s*to\b", code):
        yield "go to is not used here"
    if not code.startswith("!$omp"):
        for literal in REAL_LITERAL.findall(code):
            yield f"the real number {literal} has no kind"
    if re.search(r"%(law|damping|friction)\s*(==|/=)", code) and statement.scopes[-1].name != "choose_parts":
        yield "only `choose_parts` of the factory knows the words of force parts in the namelist"


def of_declaration(statement):
    """Declarations: no hidden or shared state."""
    if not statement.is_declaration or not statement.scopes:
        return
    attributes, scope = statement.attributes, statement.scopes[-1]
    if re.search(r",\s*save\b", attributes):
        yield "no save: state lives in arguments"
    elif scope.kind in ("module", "submodule") and not (
            "parameter" in attributes or attributes.startswith("procedure")):
        yield "a variable of a module: state lives in arguments"


def of_directive(statement):
    """OpenMP: everything said, nothing that depends on the number of threads."""
    code = statement.code
    if not code.startswith("!$omp"):
        return
    if re.match(r"!\$omp (parallel|task|teams)\b", code) and not re.search(r"default\s*\(\s*none\s*\)", code):
        yield "an OpenMP region without default(none)"
    if re.search(r"\breduction\s*\(\s*[-+*]", code):
        yield "a sum by reduction depends on the number of threads"
    if re.match(r"!\$omp (atomic|critical|ordered)\b", code):
        yield f"{code.split()[1]}: write disjointly and sum in a fixed order"
    if code.startswith("!$omp parallel") and re.search(r"\bnum_threads\b", code):
        yield "num_threads: a smaller team ends threads, and the next team starts them again; use if"


# --- rules of one file -------------------------------------------------------------------------------------------

def check_scopes(source):
    """Rules of modules and procedures."""
    if len(source.lines) - 1 > LONGEST_FILE:
        yield len(source.lines) - 1, f"{len(source.lines) - 1} lines, more than {LONGEST_FILE}"
    for scope in source.scopes:
        if not scope.first.scopes and not source.has_comment_above(scope.first):
            yield scope.first.line, f"no comment !> above {scope.kind} {scope.name}"
        length = scope.last.line - scope.first.line + 1 if scope.last else 0
        if scope.kind == "procedure" and length > LONGEST_PROCEDURE:
            yield scope.first.line, f"{scope.name} has {length} lines, more than {LONGEST_PROCEDURE}"


def check_imports(source):
    """Every name of a use statement occurs elsewhere, alone or as the kind of a number such as 1.0_wp."""
    imports, others = [], []
    for statement in source.statements:
        match = re.match(r"use\b.*\bonly\s*:(.*)", statement.code)
        if match:
            imports.extend((statement.line, name.split("=>")[0].strip()) for name in split_commas(match.group(1)))
        else:
            others.append(statement.code)
    words = {word for code in others for word in re.findall(r"[a-z]\w*", KIND_OF_NUMBER.sub(" ", code))}
    for line, name in imports:
        if re.fullmatch(r"\w+", name) and name not in words:
            yield line, f"{name} is not used"


def check_documentation(source):
    """A comment !> above what others see."""
    public = public_names(source)
    inherited = bound_names(source, extending=True)
    for scope in source.scopes:
        outer = scope.first.scopes[-1] if scope.first.scopes else None
        in_interface = outer is not None and outer.kind == "interface"
        if scope.kind == "type":
            if not source.has_comment_above(scope.first):
                yield scope.first.line, f"no comment !> above type {scope.name}"
            yield from undocumented(source, scope, None)
        elif scope.kind == "procedure" and (scope.name in public or in_interface):
            if not source.has_comment_above(scope.first):
                yield scope.first.line, f"no comment !> above {scope.name}"
            # The arguments are explained once: by the manual of a C function, by the abstract type of an extension.
            if "bind(c" not in scope.first.code.replace(" ", "") and scope.name not in inherited:
                yield from undocumented(source, scope, arguments_of(scope.first.code))


def undocumented(source, scope, wanted):
    """Components of a type, or arguments (`wanted`) of a procedure, without a comment."""
    in_bindings = False
    for statement in source.inside(scope):
        in_bindings = in_bindings or statement.code == "contains"
        if in_bindings or not statement.is_declaration:
            continue
        names = [name for name in statement.names if wanted is None or name in wanted]
        hidden = wanted is None and re.search(r",\s*private\b", statement.attributes)
        hidden = hidden or any(inner.code == "private" for inner in source.inside(scope) if wanted is None)
        explained = names == ["self"] or (wanted is not None and is_named_as_its_type(statement))
        if names and not explained and not hidden and not source.has_comment_above(statement):
            yield statement.line, f"no comment !> above {', '.join(names)}"


def is_named_as_its_type(statement):
    """Whether an argument has the name of its derived type, or its last words: `guard` of motion_guard_t."""
    match = re.match(r"(?:type|class)\s*\(\s*(\w+)_t\s*\)", statement.code)
    if not match or len(statement.names) != 1:
        return False
    return f"_{SHORT_NAMES.get(match.group(1), match.group(1))}".endswith(f"_{statement.names[0]}")


def arguments_of(code):
    """Names of the dummy arguments in the first statement of a procedure."""
    match = re.search(r"(?:subroutine|function)\s+\w+\s*\(([^)]*)\)", code)
    return [name.strip() for name in match.group(1).split(",")] if match else []


def public_names(source):
    """Procedures that others can call: by name or bound to a type; of a generic the first, which speaks for all."""
    names = bound_names(source)
    for statement in source.statements:
        if re.match(r"public\s*::", statement.code):
            names.update(statement.names)
    for statement in source.statements:
        match = re.match(r"module\s+procedure\s*(?:::)?\s*(.*)", statement.code)
        if match and statement.scopes and statement.scopes[-1].name in names:
            names.add(match.group(1).split(",")[0].strip())
        match = re.match(r"generic\b[^:]*::[^=]*=>\s*(\w+)", statement.code)
        if match:
            names.add(match.group(1))
    return names


def bound_names(source, extending=False):
    """Procedures that are publicly bound to a type, or to a type that extends another."""
    names = set()
    for statement in source.statements:
        scope = statement.scopes[-1] if statement.scopes else None
        if not scope or scope.kind != "type" or not re.match(r"procedure\b.*::", statement.code):
            continue
        if scope.contains and "private" not in statement.attributes and (
                not extending or "extends" in scope.first.code):
            names.update(target.split("=>")[-1].strip() for target in split_commas(statement.code.split("::", 1)[1]))
    return names


# --- rules of the tree -------------------------------------------------------------------------------------------

def check_names(sources):
    """Module polydem_x stands in x.f90; where CMake chooses between files, in x_*.f90."""
    found = []
    for source in sources:
        units = [scope for scope in source.scopes if scope.kind == "module" and not scope.first.scopes]
        found.extend((unit.name, os.path.dirname(source.path), source, unit.first.line) for unit in units)
    for name, folder, source, line in found:
        stem = os.path.splitext(os.path.basename(source.path))[0]
        twins = sum((name, folder) == (other, there) for other, there, _, _ in found)
        if name != f"polydem_{stem}" and not (twins > 1 and f"polydem_{stem}".startswith(name + "_")):
            yield source.path, line, f"module {name} should be polydem_{stem}, as its file"


def check_stages(sources, groups):
    """Timed stages are folders of src and groups of the namelist."""
    folders = {name for source in sources for name in source.path.split(os.sep)} | set(STAGES_OF_LAYERS)
    for source in sources:
        if not source.path.endswith(os.path.join("base", "timers.f90")):
            continue
        match = re.search(r"stage_names\(n_stages\)[^\[]*\[([^\]]*)\]", "\n".join(source.lines))
        for name in re.findall(r"'(\w+)'", match.group(1)) if match else ["(none found)"]:
            if name not in folders:
                yield source.path, 1, f"stage {name} is not a folder of src"
            if groups and name not in groups:
                yield source.path, 1, f"stage {name} is not a group of the namelist"


def check_source(path, layer, text):
    """All rules of one Fortran source of src."""
    source = Source(path, text)
    return sorted({*check_statements(source, layer), *check_scopes(source), *check_imports(source),
                   *check_documentation(source)})


def layer_of(root, name):
    """The layer of a source: the name of the deepest folder above it that CMake knows."""
    folder = os.path.dirname(name)
    while os.sep in folder and not os.path.exists(os.path.join(root, folder, "CMakeLists.txt")):
        folder = os.path.dirname(folder)
    return os.path.basename(folder if os.sep in folder else os.path.dirname(name))


def check_tree(root):
    """All rules: file, line and message of each breach."""
    sources, groups = [], set()
    for path in text_files(root):
        name = os.path.relpath(path, root)
        if path.endswith((".F90", ".f", ".F", ".for")):
            yield name, 1, "free-form .f90 without preprocessor only"
        with open(path, encoding="utf-8", newline="") as file:
            text = file.read()
        if name == TABLE:
            groups.update(re.findall(r"^group (\w+)", text, re.MULTILINE))
        yield from ((name, *found) for found in check_lines(name, text.split("\n")))
        if name.startswith("src" + os.sep) and name.endswith(".f90"):
            sources.append(Source(name, text))
            yield from ((name, *found) for found in check_source(name, layer_of(root, name), text))
    if not sources:
        yield "src", 1, "no sources found"
    yield from check_names(sources)
    yield from check_stages(sources, groups)


def text_files(root):
    """Paths of the files that the rules are for."""
    paths = [os.path.join(root, name) for name in os.listdir(root) if name.endswith(TEXTS) or name == "polydem"]
    for tree in TREES:
        for folder, folders, names in os.walk(os.path.join(root, tree)):
            folders[:] = [name for name in folders if name != "__pycache__" and not name.startswith(".")
                          and not name.endswith(".egg-info")]
            paths += [os.path.join(folder, name) for name in names
                      if name.endswith(TEXTS) or name.endswith((".F90", ".f", ".F", ".for"))]
    tracked = tracked_files(root)
    return sorted(path for path in paths if tracked is None or os.path.relpath(path, root) in tracked)


def main():
    breaches = list(check_tree(sys.argv[1]))
    for path, line, message in breaches:
        print(f"{path}:{line}: {message}")
    sys.exit(1 if breaches else 0)


if __name__ == "__main__":
    main()
