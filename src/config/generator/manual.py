"""The table of entries in the manual."""

import sys
from pathlib import Path

from .table import TEXTS


def manual(rows):
    """The table of entries in Markdown."""
    text = ("| group | key | type | unit | default | range | used with | meaning |\n"
            "|---|---|---|---|---|---|---|---|\n")
    for row in rows:
        kind = f"{row.count} {row.type}s" if row.count > 1 else row.type + (" list" if row.count == 0 else "")
        is_text = row.type in TEXTS and row.count > 0
        default = f"`'{row.default}'`" if is_text and row.default != "required" else row.default
        allowed = ", ".join(row.allowed.split()) if row.type == "word" else row.allowed
        if row.type == "name":
            allowed = f"name of a &{row.allowed}" if row.allowed else "at most 64 letters, digits, _"
        if row.usual:
            allowed += f"; usual: {row.usual.partition(': ')[0]}"
        key, _, words = row.needs.rpartition(":")
        used = ", ".join(words.split())
        cells = [f"&{row.group}", f"`{row.key}`", kind, row.unit, default, allowed,
                 f"{key} = {used}" if key not in ("", "name") else used, row.meaning]
        text += "|" + "".join(f" {cell} |" if cell else " |" for cell in cells) + "\n"
    return text


def update_manual(page, rows, checks):
    """Replace the table in the manual, or check that it is there."""
    path, opening, closing = Path(page), "<!-- entries -->\n", "<!-- /entries -->\n"
    before, _, rest = path.read_text(encoding="utf-8").partition(opening)
    present, mark, after = rest.partition(closing)
    if not mark:
        sys.exit(f"{page} has no lines {opening}and {closing}")
    if present == manual(rows):
        print(f"{page} has the table of entries")
    elif checks:
        sys.exit(f"the table of entries in {page} is not that of the code; "
                 "cmake --build BUILD --target entries_manual makes it")
    else:
        path.write_text(before + opening + manual(rows) + closing + after, encoding="utf-8")
        print(f"{page} has a new table of entries")
