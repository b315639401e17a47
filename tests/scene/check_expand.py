"""The parts of every scene make the same bodies: check_expand.py PROGRAM SOURCES.

For each namelist of inputs with a recipe, `check --expand` prints the parts. The namelist of parts runs to the same
state hash as the original, and expands into itself. Namelists that read a file which is not there are left out.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

#: A few steps; the first contacts of stacks and inclines are there from the start
SHORT = ("integrate.dt=1e-6", "integrate.duration=2e-5", "output.frame_interval=0", "output.trace_steps=0")
#: Recipes beside those of the namelists: entries that these do not give
OTHERS = {
    "gas_of_sizes": "&scene name='gas' bodies=150 size_ratio=5 speed=0.5 solid_fraction=0.3 spin=10 moving_grains=20 /",
    "hopper_descending": "&scene name='hopper' bodies=100 opening=0.05 slope=37 width=0.21 speed=0.2 seed=0 "
                         "order='descending' corners=3,20 density=1000 /",
    "incline_moving": "&scene name='incline' width=0.02 height=0.01 slope=31 speed=0.3 density=3000 /",
    "drum_turning": "&scene name='drum' boxes=300 radius=0.2 speed=0.1 / &motion name='turn' kind='rotation' rate=2 /",
    "bed_packed": "&scene name='bed' bodies=700 packing='packing' /",
    "bed_lifted": "&scene name='bed' bodies=50 / &motion name='up' kind='translation' velocity=0, 0.1 bodies=51, 53 /",
}
INTEGRATE = "\n&integrate duration = 1 /\n"


def short(namelist):
    """Overrides that make a run short: its duration, or the times of its stages."""
    text = namelist.read_text(encoding="utf-8")
    found = re.findall(r"^ *&stage\s+name = '(\w+)'([^/]*)", text, re.MULTILINE)
    if not found:
        return SHORT
    stages = [f"stage.{name}.{entry}" for name, entries in found for entry in (
        ("longest=2e-5", "at_limit=next", "hold=0") if "until" in entries else ("duration=2e-5",))]
    return [word for word in SHORT if "duration" not in word] + stages


def run(program, folder, namelist, *overrides):
    """The state hash of a run."""
    words = [word for entry in (*overrides, "output.folder=result") for word in ("--set", entry)]
    done = subprocess.run([program, "run", str(namelist), "--force", "--threads", "1", *words], cwd=folder, check=False,
                          capture_output=True, text=True)
    found = re.search(r"^state hash: (\w+)$", done.stdout, re.MULTILINE)
    return found[1] if found else done.stderr


def expand(program, folder, namelist):
    """What `check --expand` prints."""
    return subprocess.run([program, "check", str(namelist), "--expand"], cwd=folder, check=True, capture_output=True,
                          text=True).stdout


def scenes(sources, folder):
    """Namelists with a recipe, those of inputs and some more."""
    for path in sorted((sources / "inputs").rglob("*.nml")):
        text = path.read_text(encoding="utf-8")
        if "&scene" in text and not re.search(r"bodies_file|^ *packing *=", text, re.MULTILINE):
            yield path
    for name, text in OTHERS.items():
        path = folder / f"{name}.nml"
        path.write_text(text + INTEGRATE, encoding="utf-8")
        yield path


def main(program, sources):
    program, sources, faults, n = str(Path(program).resolve()), Path(sources).resolve(), 0, 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "patch.nml").write_text("&scene name='bed' bodies=600 /\n" + INTEGRATE, encoding="utf-8")
        run(program, folder, "patch.nml", *SHORT)
        (folder / "result").rename(folder / "packing")
        for path in scenes(sources, folder):
            n += 1
            parts = folder / "parts.nml"
            text = expand(program, folder, path)
            parts.write_text(text, encoding="utf-8")
            expected, found = run(program, folder, path, *short(path)), run(program, folder, parts, *short(path))
            if found != expected or len(found) != 16:
                faults += 1
                print(f"{path}: {expected}, but its parts: {found}")
            elif expand(program, folder, parts) != text:
                faults += 1
                print(f"{path}: its parts expand into something else")
            elif not re.search("&wall|&cell", text) or "bodies = " in re.sub("&motion[^/]*", "", text):
                faults += 1
                print(f"{path}: its parts name the recipe")
    print(f"{n} scenes, {faults} faults")
    sys.exit(faults > 0 or n < 20)


if __name__ == "__main__":
    main(*sys.argv[1:])
