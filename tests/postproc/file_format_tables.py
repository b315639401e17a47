"""Tables of the page postproc/file_formats.md, made from files that the program writes.

usage: file_format_tables.py PROGRAM       writes the tables into the page
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
from polydem_post.read.segments import ROWS_OF_FRAMES

PAGE = Path(__file__).resolve().parents[2] / "postproc" / "file_formats.md"

SCENE = """&scene
   name = 'heap'
   bodies = 37
/
&integrate
   duration = 0.02
/
&output
   contacts = .true.
/
"""

#: File of each table, with the settings that make it
FILES = {"trajectory": ("trajectory_0001.h5", ()), "profile": ("profile.h5", ()),
         "checkpoint": ("checkpoint_1.h5", ("checkpoint.steps=50",)), "trace": ("trace.h5", ("output.trace_steps=13",)),
         "steps": ("steps.h5", ("output.step_profile=.true.",))}

#: Those whose table is on the page; h5dump shows the others, whose data sets have the same attributes
ON_THE_PAGE = ("trajectory", "trace")


def write_file(program, table, folder):
    """Let the program write the file of a table."""
    name, settings = FILES[table]
    (folder / "scene.nml").write_text(SCENE, encoding="utf-8")
    words = [word for setting in settings for word in ("--set", setting)]
    subprocess.run([str(program), "run", "scene.nml", "--threads", "1", "--set", f"output.folder={table}", *words],
                   cwd=folder, check=True, stdout=subprocess.DEVNULL)
    return folder / table / name


def rows_of(path):
    """Rows of the table of a file: name, shape, type, unit and meaning of each data set outside `provenance`."""
    rows = []
    with h5py.File(path, "r") as file:
        lengths = _lengths(file)

        def add(name, item):
            if isinstance(item, h5py.Dataset) and not name.startswith("provenance/"):
                words = {key: value.decode() if isinstance(value, bytes) else str(value)
                         for key, value in item.attrs.items()}
                rows.append(f"| `{name}` | {_shape(name, item, lengths)} | {_type(item)} | "
                            f"{'' if words['unit'] == '1' else words['unit']} | "
                            f"{words['meaning']} |")

        file.visititems(add)
    return sorted(rows, key=lambda row: row.split("`")[1])


def _lengths(file):
    """Names of lengths in the shapes."""
    named = {"bodies/id": "n", "bodies/vertex": "v", "vertices/position": "v", "walls/id": "w", "body": "b",
             "profile/stage": "stages", "counters/name": "counters", "steps/stage_name": "stages",
             "steps/phase_name": "phases", "steps/count_name": "counts"}
    found = {file[key].shape[0]: name for key, name in named.items() if key in file and file[key].shape[0] > 1}
    return {**found, **{length + 1: f"{name} + 1" for length, name in found.items() if name == "n"}}


def _shape(name, item, lengths):
    if not item.shape:
        return "scalar"
    first = "p" if name.startswith("pairs/") else lengths.get(item.shape[0], item.shape[0])
    if item.maxshape[0] is None:
        group, _, column = name.partition("/")
        first = {"contacts": "contacts", "steps": "steps", name: "steps"}.get(group, "frames")
        if column == "start":
            first = "frames + 1"
        elif group == "frames" and column not in ROWS_OF_FRAMES:
            first = "rows"
    return "(" + ", ".join(str(word) for word in (first, *(lengths.get(k, k) for k in item.shape[1:]))) + ")"


def _type(item):
    return "text" if item.dtype.kind == "O" or item.dtype.kind == "S" else str(item.dtype)


def table_of(path):
    """The table of a file in Markdown."""
    return "\n".join(["| data set | shape | type | unit | meaning |", "|---|---|---|---|---|", *rows_of(path)]) + "\n"


def part_of(text, table):
    """The table that stands on the page, with the places before and behind."""
    return re.search(rf"(<!-- {table} -->\n\n)(.*?)(\n<!-- /{table} -->)", text, re.DOTALL)


def main():
    """Write all tables into the page."""
    program = Path(sys.argv[1]).resolve()
    text = PAGE.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        for table in ON_THE_PAGE:
            part = part_of(text, table)
            new = table_of(write_file(program, table, Path(folder)))
            text = text[:part.start(2)] + new + text[part.end(2):]
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
