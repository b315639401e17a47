"""Tab completion and man page of a program, made from the help texts of its verbs.

usage: shell_texts.py PROGRAM bash|zsh|fish|man VERSION ENTRIES.md... HELP.txt...

A help text has the call of its verb in its first line, the meaning in its second one, and its options below. What a
help text names is completed, so completion and man page never differ from the help: verbs, options, and the values of
an option that are listed below it. Entries of the namelist come from the tables of the manual.
"""

import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path

#: An option at the start of a line: its names, its value, its meaning
OPTION = re.compile(r"  (-[-\w]+)(?:, (--[-\w]+))?(?: ([A-Z][^ ]*))?(?:  +| )(\S.*)?$")
#: A value of an option, or several, at the start of a line below it, and what follows them
VALUES = re.compile(r" {28}(\w+(?:, \w+)*)(?:  |$)")
#: What stands for an entry of the namelist, and for the name of a group that may be there several times
ENTRY, NAME = "GROUP.KEY=VALUE", "NAME"
#: Words of a call that are chosen, as in sweep make|run|collect
CHOICE = re.compile(r"^[\w-]+(?:\|[\w-]+)+$")

#: What a program is, and what it does
PURPOSES = {
    "polydem": ("discrete elements for convex polygons in two dimensions",
                "polydem simulates granular matter made of convex polygons.",
                "A namelist describes a simulation; results are folders of HDF5 files."),
    "polydem_lab": ("compares algorithms of neighbour search",
                    "polydem_lab finds the pairs of boxes that runs of polydem recorded, and times each algorithm.",
                    "A namelist describes a bench."),
}

EXIT_CODES = (("0", "done"), ("1", "the run failed, for example because a guard stopped it"),
              ("2", "bad input: namelist, bodies file, trace or command line"),
              ("3", "a file or folder cannot be read or written, or a checksum is wrong"),
              ("75", "ended early with a checkpoint; the same command with --continue continues the run"))

ENVIRONMENT = (("OMP_NUM_THREADS", "number of threads of a run without --threads; if unset, the run chooses it"),
               ("GOMP_SPINCOUNT", "how long a waiting thread spins before it sleeps. If unset, for about 10 ms, which "
                "slows runs on a machine that other programs use; with 10000 for less than 1 ms. The launcher of the "
                "sources sets 10000"),
               ("GLIBC_TUNABLES", "with glibc.malloc.hugetlb=1:glibc.malloc.mmap_max=0:"
                "glibc.malloc.trim_threshold=4294967296 memory comes in large pages and freed memory is kept, which "
                "makes steps of large scenes 4 to 6 % faster. The launcher of the sources sets this"),
               ("POLYDEM_ISA", "base or avx2: instruction set of the kernels; results have the same bits"),
               ("POLYDEM_PATIENCE", "seconds that a parallel write may hang before it ends the run (default: 600)"))


@dataclass(frozen=True)
class Verb:
    """A verb as its help text describes it."""

    name: str
    call: str
    meaning: str
    #: Lines below the meaning
    lines: tuple
    #: Options: name, value (empty if it takes none), meaning
    options: tuple
    #: Words of which one follows the verb
    choices: tuple
    #: What stands for the value of an option -> the values that are listed
    values: dict


def read_verb(path):
    """The verb that a help text describes."""
    call, meaning, *lines = Path(path).read_text(encoding="utf-8").splitlines()
    options, values, kind = {}, {}, ""
    for line in lines:
        match, listed = OPTION.match(line), VALUES.match(line)
        if match:
            kind = match[3] or ""
            for name in filter(None, match.groups()[:2]):
                options.setdefault(name, (name, match[3] or "", match[4] or ""))
        elif listed and kind.isalpha():
            values.setdefault(kind, []).extend(listed[1].split(", "))
    words = call.split()
    choices = next((tuple(word.split("|")) for word in words[1:] if CHOICE.match(word)), ())
    return Verb(words[0], call, meaning, tuple(lines), tuple(options.values()), choices, values)


def read_entries(paths):
    """Entries as `--set` takes them, from the manual; the name of a group that may be there several times is NAME."""
    several, found = set(), {}
    page = "".join(Path(path).read_text(encoding="utf-8") for path in paths)
    for group, key, kind in re.findall(r"^\| &(\w+) \| `(\w+)` \| (\w+) ", page, re.MULTILINE):
        if (key, kind) == ("name", "name"):
            several.add(group)
        found[f"{group}.{NAME}.{key}=" if group in several else f"{group}.{key}="] = None
    return tuple(found)


def values_of(verbs, entries):
    """What stands for the value of an option -> its values, of any verb."""
    listed = {kind: values for verb in verbs for kind, values in verb.values.items()}
    return {**listed, ENTRY: entries}


def plain(entries):
    """Entries of the groups that have no name."""
    return [entry for entry in entries if f".{NAME}." not in entry]


def bash_text(verbs, entries, program):
    """Completion for bash."""
    cases, known = [], values_of(verbs, entries)
    kinds = {name: value for verb in verbs for name, value, _ in verb.options if value in known}
    sorts = [f"    {' | '.join(name for name in kinds if kinds[name] == kind)}) values='{' '.join(values)}' ;;"
             for kind, values in known.items()]
    for verb in verbs:
        values = [name for name, value, _ in verb.options if value]
        cases.append(f"    {verb.name})\n      options='{' '.join(name for name, _, _ in verb.options)}'\n"
                     f"      valued='{' '.join(values)}'\n      choices='{' '.join(verb.choices)}'\n      ;;")
    names = " ".join([*(verb.name for verb in verbs), "help", "--help", "--version"])
    return "\n".join([
        f"# Tab completion of {program} for bash", f"_{program}() {{",
        "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} options='' valued='' choices=''",
        "  local values='' name",
        "  COMPREPLY=()", "  if [ \"$COMP_CWORD\" -eq 1 ]; then",
        f"    mapfile -t COMPREPLY < <(compgen -W '{names}' -- \"$word\")", "    return", "  fi",
        "  case ${COMP_WORDS[1]} in", *cases, "    help | --help)",
        f"      choices='{' '.join(verb.name for verb in verbs)}'", "      ;;", "  esac",
        "  if [[ \" $valued \" == *\" $before \"* ]]; then", "    case $before in", *sorts, "    esac",
        "    # An entry of a group that may be there several times follows the name that is typed.",
        "    name=${word#*.}",
        "    [[ $word != *.*.* ]] || values=${values//.NAME./.${name%%.*}.}",
        "    mapfile -t COMPREPLY < <(compgen -W \"$values\" -X '*.NAME.*' -- \"$word\")",
        "    [[ ${COMPREPLY[0]-} != *= ]] || compopt -o nospace 2> /dev/null || true",
        "    return 0", "  fi", "  if [[ $word == -* ]]; then",
        "    mapfile -t COMPREPLY < <(compgen -W \"$options\" -- \"$word\")",
        "  elif [ \"$COMP_CWORD\" -eq 2 ] && [ -n \"$choices\" ]; then",
        "    mapfile -t COMPREPLY < <(compgen -W \"$choices\" -- \"$word\")", "  fi", "}",
        "# Where nothing is suggested, files are.", f"complete -o default -F _{program} {program}", ""])


def zsh_text(verbs, entries, program):
    """Completion for zsh."""
    known = values_of(verbs, entries)

    def action(value):
        """How a value is completed."""
        if value == ENTRY:
            return f"_{program}_entries"
        return f"({' '.join(known[value])})" if value in known else "_files"

    def quoted(text):
        return re.sub(r"([\[\]:\\])", r"\\\1", text).replace("'", "'\\''")

    lines = [f"#compdef {program}", f"# Tab completion of {program} for zsh", f"_{program}_entries() {{",
             "  # An entry of a group that may be there several times follows the name that is typed.",
             f"  local -a entries=({' '.join(entries)})", "  local name=${PREFIX#*.}",
             "  [[ $PREFIX != *.*.* ]] || entries=(${entries/.NAME./.${name%%.*}.})",
             "  compadd -S '' -- ${entries:#*.NAME.*}", "}", f"_{program}() {{", "  local -a verbs",
             "  verbs=("]
    lines += [f"    '{verb.name}:{quoted(verb.meaning)}'" for verb in verbs]
    lines += ["    'help:print the options of a verb'", "  )", "  if (( CURRENT == 2 )); then",
              "    _describe 'verb' verbs", "    return", "  fi", "  local verb=$words[2]", "  shift words",
              "  (( CURRENT -= 1 ))", "  case $verb in"]
    for verb in verbs:
        specs = [f"'*{name}[{quoted(meaning)}]{f':{quoted(value)}:{action(value)}' if value else ''}'"
                 for name, value, meaning in verb.options]
        first = f"'1:step:({' '.join(verb.choices)})' " if verb.choices else ""
        lines.append(f"    {verb.name}) _arguments {' '.join(specs)} {first}'*:file:_files' ;;")
    lines += ["    help) _describe 'verb' verbs ;;", "  esac", "}",
              f'if [ "$funcstack[1]" = _{program} ]; then _{program} "$@"; else compdef _{program} {program}; fi', ""]
    return "\n".join(lines)


def fish_text(verbs, entries, program):
    """Completion for fish."""
    known = values_of(verbs, plain(entries))

    def quoted(text):
        return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"

    def taken(value):
        """How a value is completed."""
        return f" -x -a '{' '.join(known[value])}'" if value in known else " -r" if value else ""

    lines = [f"# Tab completion of {program} for fish"]
    for verb in verbs:
        lines.append(f"complete -c {program} -n __fish_use_subcommand -f -a {verb.name} -d {quoted(verb.meaning)}")
        seen = f"-n '__fish_seen_subcommand_from {verb.name}'"
        lines += [f"complete -c {program} {seen} -a {choice}" for choice in verb.choices]
        for name, value, meaning in verb.options:
            short = "-s" if len(name) == 2 else "-o"
            form = f"-l {name[2:]}" if name.startswith("--") else f"{short} {name[1:]}"
            lines.append(f"complete -c {program} {seen} {form}{taken(value)} -d {quoted(meaning)}")
    return "\n".join([*lines, ""])


def man_text(verbs, version, program):
    """Man page in the macros `man`."""
    def escaped(text):
        text = text.replace("\\", "\\e").replace("-", "\\-").replace("'", "\\(aq").replace("`", "\\(ga")
        return f"\\&{text}" if text.startswith(".") else text

    short, *purpose = PURPOSES[program]
    lines = [f'.TH {program.upper()} 1 "" "polydem {version}" "User Commands"', ".SH NAME", f"{program} \\- {short}",
             ".SH SYNOPSIS", f".B {program}", ".I VERB", "[\\fIARGUMENTS\\fR]", ".SH DESCRIPTION", *purpose,
             ".SH VERBS"]
    for verb in verbs:
        lines += [f'.SS "{escaped(verb.call)}"', escaped(verb.meaning), ".nf"]
        lines += [escaped(line) if line else ".sp" for line in verb.lines] + [".fi"]
    lines += [".SH EXIT STATUS"]
    for code, meaning in EXIT_CODES:
        lines += [".TP", f".B {code}", escaped(meaning)]
    lines += [".SH ENVIRONMENT"]
    for name, meaning in ENVIRONMENT:
        lines += [".TP", f".B {name}", escaped(meaning)]
    return "\n".join([*lines, ""])


def main():
    """Print the text that the command line asks for."""
    program, kind, version, *files = sys.argv[1:]
    verbs = [read_verb(path) for path in files if path.endswith(".txt")]
    entries = read_entries(path for path in files if path.endswith(".md"))
    texts = {"bash": bash_text, "zsh": zsh_text, "fish": fish_text,
             "man": lambda found, _, name: man_text(found, version, name)}
    if kind not in texts:
        sys.exit(f"there is no text {kind}, but {', '.join(texts)}")
    try:
        sys.stdout.write(texts[kind](verbs, entries, program))
        sys.stdout.flush()
    except BrokenPipeError:
        give_up(141)  # as a shell says of a program that nobody reads any more
    except OSError as error:
        print(f"polydem: standard output: cannot be written ({error.strerror})", file=sys.stderr)
        give_up(3)


def give_up(code):
    """End without what is still to be written."""
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    main()
