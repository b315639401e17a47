"""Build and run the recipes of src, and compare the number of files that each touches with its limit.

usage: check_recipes.py ROOT BUILD NINJA

In a copy of src, each file of the folder examples goes to the place of the same name that the pages say, and diff
blocks change the last file named before them. The changed files are compiled with the flags of BUILD against its
modules, linked before its libraries, and run by try_recipes.f90. All output goes to a temporary folder.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time

#: The files that the guide adds
EXAMPLES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "examples")
#: Pages with recipes
PAGES = ("recipes.md", "recipes_scenes.md")
#: The most files that each recipe may touch; the list of CMake and the table of entries, from which sources are made,
#: do not count
MOST = {"A neighbour finder": 2, "A force part": 2, "A force on bodies": 2, "A motion of walls": 2, "A guard": 2,
        "An integrator": 2, "A participant of the step": 2, "A quantity of the series": 2,
        "A condition that ends a stage": 2, "A shape of grains": 2}


class RecipeError(Exception):
    """A recipe that does not work as described in the guide."""


def blocks_of(text):
    """The examples and diff blocks of a page, as (heading, path, lines of the diff); no lines for an example."""
    heading, path, lines = None, None, None
    for line in text.split("\n"):
        if lines is not None and line.startswith("```"):
            yield heading, path, lines
            lines = None
        elif lines is not None:
            lines.append(line)
        elif line.startswith("## "):
            heading = line[3:]
        elif line == "```diff":
            lines = []
        else:
            for path in re.findall(r"`(src/[\w/.]+)`", line):
                if os.path.exists(os.path.join(EXAMPLES, os.path.basename(path))):
                    yield heading, path, None


def changed(text, lines):
    """The text after a diff; the old lines of the diff must occur exactly once in the text."""
    before = "".join(line[1:] + "\n" for line in lines if not line.startswith("+"))
    after = "".join(line[1:] + "\n" for line in lines if not line.startswith("-"))
    if text.count(before) != 1:
        raise RecipeError(f"lines of a diff occur {text.count(before)} times instead of once:\n{before}")
    return text.replace(before, after)


def apply_recipes(root, copy):
    """Apply the recipes of the pages to a copy of the sources; return the files that each of them touches."""
    found = {}
    for page in PAGES:
        with open(os.path.join(root, "src", page), encoding="utf-8") as stream:
            text = stream.read()
        for heading, path, lines in blocks_of(text):
            target = os.path.join(copy, path)
            files = found.setdefault(heading, [])
            if path not in files:
                files.append(path)
            if lines is None:
                if os.path.exists(target):
                    raise RecipeError(f"{path} exists already")
                shutil.copy(os.path.join(EXAMPLES, os.path.basename(path)), target)
                continue
            with open(target, encoding="utf-8") as source:
                content = changed(source.read(), lines)
            with open(target, "w", encoding="utf-8") as source:
                source.write(content)
    if set(found) != set(MOST):
        raise RecipeError(f"the pages have the recipes {sorted(found)} instead of {sorted(MOST)}")
    touched = {heading: [path for path in files if path.endswith(".f90")] for heading, files in found.items()}
    for heading, files in touched.items():
        print(f"{heading}: {len(files)} files")
        if len(files) > MOST[heading]:
            raise RecipeError(f"{heading} touches {files}; at most {MOST[heading]} files are allowed")
    return touched


def commands_of(build):
    """Compile command and working folder of each source, by path."""
    with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as stream:
        return {entry["file"]: (shlex.split(entry["command"]), entry["directory"]) for entry in json.load(stream)}


def compile_file(source, like, commands, modules, folder):
    """Compile a file with the flags of another file, with the modules of this test first; return the object."""
    words, directory = commands[like]
    target = os.path.join(folder, os.path.basename(source) + ".o")
    # The module folder of the layer becomes a search folder.
    flags = [re.sub("^-J", "-I", word) for word in words[1:words.index("-c")]]
    done = subprocess.run([words[0], f"-I{modules}", *flags, "-Werror", f"-J{modules}", "-c", source, "-o", target],
                          cwd=directory, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RecipeError(f"{source} does not compile:\n{done.stderr[:4000]}")
    return target


def build_program(root, touched, copy, build, ninja, folder):
    """Compile the files that the recipes touch, and link them with the libraries of the build."""
    commands = commands_of(build)
    modules = os.path.join(folder, "modules")
    os.mkdir(modules)
    # The table makes sources, which differ from those of the build.
    config, made = os.path.join(copy, "src", "config"), os.path.join(folder, "made")
    subprocess.run([sys.executable, os.path.join(config, "make_entries.py"), os.path.join(config, "entries.txt"), made],
                   check=True)
    plan = [(os.path.join(made, "entry_table.f90"), os.path.join(build, "src", "config", "entry_table.f90"))]
    for files in touched.values():
        # New files before those that use them, with the flags of their layer
        known = [path for path in files if os.path.exists(os.path.join(root, path))]
        new = [path for path in files if path not in known]
        plan += [(os.path.join(copy, path), os.path.join(root, known[0])) for path in new]
        plan += [(os.path.join(copy, path), os.path.join(root, path)) for path in known]
    trial = os.path.join(root, "tests", "verification", "trial.f90")
    serial = os.path.join(root, "tests", "simulation", "serial_simulation.f90")
    plan += [(serial, trial), (trial, trial), (os.path.join(root, "tests", "recipes", "try_recipes.f90"), trial)]
    objects = [compile_file(path, like, commands, modules, folder) for path, like in plan]
    output = subprocess.run([ninja, "-C", build, "-t", "commands", "tests/verification/verify"], capture_output=True,
                            text=True, check=True).stdout
    words = shlex.split(output.strip().split("\n")[-1].replace(": && ", "").replace(" && :", ""))
    libraries = words[words.index("-o") + 2:]
    program = os.path.join(folder, "try_recipes")
    done = subprocess.run([words[0], "-fopenmp", *objects, "-o", program, *libraries], cwd=build, capture_output=True,
                          text=True, check=False)
    if done.returncode != 0:
        raise RecipeError(f"the program does not link:\n{done.stderr[:4000]}")
    return program


#: Values that the program prints, each with what it should be, the tolerance, and what is wrong otherwise. The area
#: law is linear up to the depth over the size of the bodies, here some 1e-3
WANTED = (
    ("area_restitution", (0.5,), 5e-3, "area: the restitution is not 1/2"),
    ("area_damping_work", (-0.75,), 1e-2, "area: damping does not dissipate 3/4 of the energy"),
    ("conservative_restitution", (0.5,), 1e-3, "conservative: the restitution is not 1/2"),
    ("conservative_damping_work", (-0.75,), 2e-3, "conservative: damping does not dissipate 3/4 of the energy"),
    ("stable_step_share", (0.5,), 1e-12, "four times the stiffness does not halve the stable step"),
    ("magnus", (0.5 * 3.0 * 0.4, 0.0), 1e-5,
     "the force on bodies does not turn the velocity with its rate, or does work"),
    ("orbit", (0.0, 0.0), 1e-12, "the motion does not lead to the point of its circle"),
    ("euler_order", (1.0,), 0.1, "the integrator is not of first order"),
    ("brake", ((1.0 - 1e-3) ** 400, 0.0), 1e-8,
     "the participant does not slow the body down, or its balance does not close"),
    ("greatest_speed", (2.0, 2.0), 2e-3,
     "the quantity is not the speed of the fastest body, or not that of the stage"),
    ("triangle_area", (0.5,), 1e-12, "the shape is no triangle"),
    ("spin_warnings", (0, 3), 0.0, "the guard does not warn at the checks of steps 0, 100 and 200"))


def judge(text):
    """Compare the output of the program with the statements of the pages."""
    print(text, end="")
    values = dict(line.split(maxsplit=1) for line in text.strip().split("\n"))
    if "error" in values:
        raise RecipeError(values["error"])
    for name, wanted, tolerance, wrong in WANTED:
        found = [float(word) for word in values[name].split()]
        if len(found) != len(wanted) or max(abs(x - y) for x, y in zip(found, wanted)) > tolerance:
            raise RecipeError(wrong)
    for law in ("area", "conservative"):
        if not float(values[f"{law}_greatest_area"]) > 0.0:
            raise RecipeError(f"{law}: the greatest area is not stored")
    if values["plain_loop_result"] != values["all_pairs_result"]:
        raise RecipeError("the finder of the recipe does not give the bits of all_pairs")


def main(root, build, ninja):
    """Test the recipes."""
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        copy = os.path.join(folder, "copy")
        shutil.copytree(os.path.join(root, "src"), os.path.join(copy, "src"))
        try:
            touched = apply_recipes(root, copy)
            program = build_program(root, touched, copy, build, ninja, folder)
            done = subprocess.run([program], cwd=folder, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise RecipeError(f"the program ended with {done.returncode}:\n{done.stdout}{done.stderr}")
            judge(done.stdout)
        except RecipeError as error:
            print(f"recipes: {error}")
            return 1
    print(f"recipes: all {len(MOST)} work; {time.monotonic() - began:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main(*(os.path.abspath(argument) for argument in sys.argv[1:3]), sys.argv[3]))
