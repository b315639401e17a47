"""The tables of exceptions.txt: what breaks an invariance for a reason, and which pairs no scene has."""

import re
from pathlib import Path

#: Where the tables are
FILE = Path(__file__).with_name("exceptions.txt")


def read_table(name):
    """The table of a name: capabilities of the first column, several between commas, and words of the second."""
    table = FILE.read_text(encoding="utf-8").partition(f"[{name}]\n")[2].partition("\n[")[0]
    rows = re.findall(r"^([\w +,]+) \| ([\w, ]+) \| .+$", table, re.MULTILINE)
    if not rows or len(rows) != len(table.split("\n")) - table.split("\n").count(""):
        raise ValueError(f"{FILE.name}: the table of {name} was not understood")
    return [(frozenset(tags.split(" + ")), word) for cell, words in rows
            for tags in cell.split(", ") for word in words.split(", ")]


def impossible_pairs():
    """Pairs of capabilities that no scene has."""
    return frozenset(tags | {word} for tags, word in read_table("impossible"))


def excepted(scene, name, table):
    """Whether the table says that a scene need not have an invariance."""
    return any(other == name and tags <= scene.tags for tags, other in table)
