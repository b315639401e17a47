"""The viewer: one HTML file that plays a run in a browser, without a network."""

from __future__ import annotations

import html
import json
import sys
from pathlib import Path

from ..base.new_file import MARK, insist_on_own, new_file
from ..base.result_file import ResultError
from ..read.trajectory import Trajectory
from .view_data import Packed, pack_run

#: Sources of the page, and its scripts in the order in which they are joined
SOURCES = Path(__file__).parent / "viewer"
SCRIPTS = ("decode.js", "run.js", "columns.js", "tree.js", "overlays.js", "painter.js", "curves.js", "page.js")


def write_view(trajectory: Trajectory, numbers: list[int], path: Path, contacts: bool = True,
               colour: str = "speed") -> Packed:
    """Write the page of these frames."""
    insist_on_own(path)
    done = [0]

    def progress() -> None:
        done[0] += 1
        if sys.stderr.isatty():
            print(f"\rframe {done[0]} of {len(numbers)}", end="\r" if done[0] == len(numbers) else "",
                  file=sys.stderr, flush=True)

    packed = pack_run(trajectory, numbers, contacts, progress)
    if colour != "none" and colour not in packed.facts["quantities"]:
        raise ResultError(f"there is no colour {colour} in this page; there are "
                          f"{', '.join(packed.facts['quantities'])} and none")
    packed.facts["colour"] = colour
    with new_file(path) as part, part.open("w", encoding="utf-8") as file:
        for piece in page(packed):
            file.write(piece)
    return packed


def page(packed: Packed):
    """The pieces of the page: style, data and scripts in their places."""
    text = (SOURCES / "page.html").read_text(encoding="utf-8").replace("{mark}", MARK)
    head, rest = text.split("{style}")
    body, rest = rest.split("{data}")
    end, after = rest.split("{scripts}")
    style, name = (SOURCES / "style.css").read_text(encoding="utf-8"), html.escape(packed.facts["name"])
    yield "".join([head.replace("{name}", name), style, body.replace("{name}", name)])
    facts = json.dumps(packed.facts, separators=(",", ":"), allow_nan=False).replace("</", "<\\/")
    yield f'<script type="application/json" id="facts">{facts}</script>\n'
    for name, block in packed.blocks.items():
        yield f'<script type="text/plain" id="block-{name}">{block}</script>\n'
    yield end
    for name in SCRIPTS:
        yield f"<script>\n{(SOURCES / name).read_text(encoding='utf-8')}</script>\n"
    yield after
