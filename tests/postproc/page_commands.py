"""Blocks of commands on the pages, and what the tests do with them.

A note, which is a comment of Markdown, may stand just below a block, so that readers meet the block first:

    <!-- tests run: COMMANDS -->                the same commands, each with more words that make it short
    <!-- tests do not run this: REASON -->      an excuse
    <!-- tests run first: COMMANDS -->          commands of other pages on which the block relies

A block of shell or Python commands without a note is run as it is. A note that matches no commands is an error:
one below nothing, below another kind of block, below a block without commands, or one of two of a kind. A block `csv`,
`json` or `nml` is a file, which is written before; the last file name above it is its name.
"""

import re
import shlex
from dataclasses import dataclass

RUN = ("sh", "python")

#: Languages of blocks that are files
FILES = ("csv", "json", "nml")

#: Languages of blocks that are only read
SHOWN = ("fortran", "f90", "diff", "cmake", "math", "text")

KINDS = ("tests run", "tests do not run this", "tests run first")
NOTE = re.compile(r"<!-- (tests [a-z ]+): (.*?)\s+-->", re.DOTALL)

#: Commands that must not hide in an indented block
COMMAND = re.compile(r"^ {4,}(\S*polydem |python|\./|cmake |ctest|mpirun |sbatch |pip |[A-Z_]+=\S+ )", re.MULTILINE)


class PageError(Exception):
    """A page with a block that nobody can judge."""


@dataclass
class Block:
    """A block of a page: its language, text, first line and notes by kind."""

    language: str
    text: str
    line: int
    notes: dict
    file: str

    @property
    def commands(self):
        """What the tests run for this block: shell commands, or Python; None if it is excused."""
        if "tests do not run this" in self.notes:
            return None
        return self.notes.get("tests run", self.text)


def words_of(line):
    """Words of a command without its comment; the quotes of the shell are gone."""
    return shlex.split(line, comments=True)


def check_variant(block):
    """Each command of a variant must be the one of the page with further words."""
    lines = [words for line in block.text.splitlines() if (words := words_of(line))]
    variant = [words for line in block.notes["tests run"].splitlines() if (words := words_of(line))]
    if len(lines) != len(variant):
        raise PageError(f"line {block.line}: the variant has {len(variant)} commands, the block {len(lines)}")
    for words, others in zip(lines, variant):
        rest = iter(others)
        if not all(word in rest for word in words):
            raise PageError(f"line {block.line}: {' '.join(others)} is not a variant of {' '.join(words)}")


def blocks_of(text):
    """All blocks of a page in their order."""
    blocks, language, lines, file, comment, below = [], None, [], "", None, False
    for number, line in enumerate(text.split("\n"), 1):
        fence = re.match(r"```(\w*)$", line)
        if comment is None and language is None and re.match(r"\s*<!--\s*tests?\b", line):
            if not below:
                raise PageError(f"line {number}: a note on tests must stand just below its block")
            comment = ""
        if comment is not None:
            comment += line + "\n"
            if "-->" in line:
                kind, words = _read_note(comment, number)
                if kind in blocks[-1].notes:
                    raise PageError(f"line {number}: a second note '{kind}' for one block")
                blocks[-1].notes[kind], comment = words, None
        elif fence and language is None:
            language, lines = fence.group(1), []
        elif line == "```" and language is not None:
            blocks.append(Block(language, "\n".join(lines) + "\n", number - len(lines), {}, file))
            language, below = None, True
        elif language is not None:
            lines.append(line)
        else:
            below = False
            file = (re.findall(r"`([\w/.]+\.\w+)`", line) or [file])[-1]
    if language is not None or comment is not None:
        raise PageError(f"the last block or note does not end: {comment or language}")
    hidden = COMMAND.search(re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL))
    if hidden:
        raise PageError(f"a command in an indented block, which must be a block ```sh: {hidden.group(0)}")
    return [_checked(block) for block in blocks]


def _read_note(comment, number):
    found = NOTE.fullmatch(comment.strip())
    if not found or found.group(1) not in KINDS:
        raise PageError(f"line {number}: a note on tests that is not known: {comment.strip()}")
    return found.group(1), "\n".join(line.strip() for line in found.group(2).strip().splitlines()) + "\n"


def _checked(block):
    if block.language not in RUN + FILES + SHOWN:
        raise PageError(f"line {block.line}: a block of '{block.language}', which is neither run nor known as text")
    if block.notes and (block.language not in RUN or not _has_commands(block)):
        raise PageError(f"line {block.line}: a note on tests matches no commands")
    if block.language in FILES and not block.file:
        raise PageError(f"line {block.line}: no name of a file above a block of '{block.language}'")
    if "tests run" in block.notes:
        if "tests do not run this" in block.notes:
            raise PageError(f"line {block.line}: both run and excused")
        check_variant(block)
    if block.commands is None and len(block.notes["tests do not run this"].split()) < 3:
        raise PageError(f"line {block.line}: an excuse without a reason")
    return block


def _has_commands(block):
    """Whether a block has anything but comments and empty lines."""
    return any(line.strip() and not line.strip().startswith("#") for line in block.text.splitlines())
