"""The tables of the page: what breaks an invariance for a reason, and which pairs no scene has."""

import re
from pathlib import Path

#: Where the tables are
PAGE = Path(__file__).with_name("README.md")


def read_table(name):
    """The table of a page: capabilities of its first column, several `in ticks` each a row, and words of the second."""
    table = PAGE.read_text(encoding="utf-8").split(f"<!-- {name} -->")[1].split(f"<!-- /{name} -->")[0]
    rows = re.findall(r"^\| (`[\w +]+`(?:, `[\w +]+`)*) \| ([\w, ]+) \| .+ \|$", table, re.MULTILINE)
    if len(rows) != table.count("\n|") - 2:
        raise ValueError(f"README.md: the table of {name} was not understood")
    return [(frozenset(tags.split(" + ")), word) for cell, words in rows
            for tags in re.findall(r"`([^`]+)`", cell) for word in words.split(", ")]


def impossible_pairs():
    """Pairs of capabilities that no scene has."""
    return frozenset(tags | {word} for tags, word in read_table("impossible"))


def excepted(scene, name, table):
    """Whether the table says that a scene need not have an invariance."""
    return any(other == name and tags <= scene.tags for tags, other in table)
