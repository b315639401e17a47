"""The recipes of src/README.md, tried: a new force part and a new finder, as they stand there.

usage: check_recipes.py ROOT BUILD NINJA

Blocks of Fortran of the manual become new files, blocks of a diff change files, in a copy of src; the file is the one
that the text names last. What changed is compiled with the flags of BUILD against its modules, linked before its
libraries, and run by try_recipes.f90. Nothing is written but into a temporary folder.
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

#: Files that a recipe may change: what is told to CMake and the namelist, and the factory
CHANGED = {"src/forces/walton_braun.f90": {"src/forces/force_law.f90", "src/forces/CMakeLists.txt",
                                           "src/config/namelist_entries.f90"},
           "src/neighbours/plain_loop.f90": {"src/neighbours/finder_factory.f90", "src/neighbours/CMakeLists.txt",
                                             "src/config/namelist_entries.f90"}}


class RecipeError(Exception):
    """A recipe that does not do what the manual says."""


def blocks_of(text):
    """The blocks of Fortran and diffs of a page, as (language, file named last before it, lines)."""
    path, language, lines = None, None, []
    for line in text.split("\n"):
        fence = re.match(r"```(\w*)$", line)
        if fence and language is None:
            language, lines = fence.group(1), []
        elif fence:
            if language in ("fortran", "diff"):
                yield language, path, lines
            language = None
        elif language is not None:
            lines.append(line)
        else:
            path = (re.findall(r"`(src/[\w/.]+)`", line) or [path])[-1]


def changed(text, lines):
    """A text after a diff: its lines that were there must be found once."""
    before = "".join(line[1:] + "\n" for line in lines if not line.startswith("+"))
    after = "".join(line[1:] + "\n" for line in lines if not line.startswith("-"))
    if text.count(before) != 1:
        raise RecipeError(f"found {text.count(before)} times, not once:\n{before}")
    return text.replace(before, after)


def apply_recipes(root, copy):
    """Make the files of the manual in a copy of the sources; by new file, the files that it changes beside."""
    found, new = {}, None
    with open(os.path.join(root, "src", "README.md"), encoding="utf-8") as page:
        text = page.read()
    for language, path, lines in blocks_of(text):
        target = os.path.join(copy, path)
        if language == "fortran":
            if os.path.exists(target):
                raise RecipeError(f"{path} is there already")
            new = path
            found[new] = set()
            content = "\n".join(lines) + "\n"
        else:
            with open(target, encoding="utf-8") as source:
                content = changed(source.read(), lines)
            found[new].add(path)
        with open(target, "w", encoding="utf-8") as source:
            source.write(content)
    if found != CHANGED:
        raise RecipeError(f"the manual changes {found}, not {CHANGED}")


def commands_of(build):
    """How each source is compiled: by its path, the command and where it runs."""
    with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as stream:
        return {entry["file"]: (shlex.split(entry["command"]), entry["directory"]) for entry in json.load(stream)}


def compile_file(source, like, commands, modules, folder):
    """Compile a file with the flags of another one and the modules of this test in front; returns the object."""
    words, directory = commands[like]
    target = os.path.join(folder, os.path.basename(source) + ".o")
    # Where the room writes its modules, others of the room are read.
    flags = [re.sub("^-J", "-I", word) for word in words[1:words.index("-c")]]
    done = subprocess.run([words[0], f"-I{modules}", *flags, "-Werror", f"-J{modules}", "-c", source, "-o", target],
                          cwd=directory, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RecipeError(f"{source} does not compile:\n{done.stderr[:4000]}")
    return target


def sources_of(folder):
    """Fortran files of a room in the order of its CMakeLists.txt, which is one in which they compile."""
    with open(os.path.join(folder, "CMakeLists.txt"), encoding="utf-8") as page:
        return [os.path.join(folder, name) for name in re.findall(r"^ +(\w+\.f90)$", page.read(), re.MULTILINE)]


def build_program(root, copy, build, ninja, folder):
    """Compile what the recipes change and link it with the libraries of the build."""
    commands = commands_of(build)
    modules = os.path.join(folder, "modules")
    os.mkdir(modules)
    plan = [(path, os.path.join(root, os.path.relpath(path, copy)))
            for path in sources_of(os.path.join(copy, "src", "config"))]
    forces, neighbours = (os.path.join(root, "src", *names) for names in (
        ("forces", "force_law.f90"), ("neighbours", "finder_factory.f90")))
    for name, like in (("forces/walton_braun.f90", forces), ("forces/force_law.f90", forces),
                       ("neighbours/plain_loop.f90", neighbours), ("neighbours/finder_factory.f90", neighbours)):
        plan.append((os.path.join(copy, "src", name), like))
    trial = os.path.join(root, "tests", "verification", "trial.f90")
    plan += [(trial, trial), (os.path.join(root, "tests", "recipes", "try_recipes.f90"), trial)]
    objects = [compile_file(path, like, commands, modules, folder) for path, like in plan]
    output = subprocess.run([ninja, "-C", build, "-t", "commands", "tests/verification/verify"], capture_output=True,
                            text=True, check=True).stdout
    words = shlex.split(output.strip().split("\n")[-1].replace(": && ", "").replace(" && :", ""))
    libraries = words[words.index("-o") + 2:]
    program = os.path.join(folder, "try_recipes")
    done = subprocess.run([words[0], "-fopenmp", *objects, "-o", program, *libraries], cwd=build, capture_output=True,
                          text=True, check=False)
    if done.returncode != 0:
        raise RecipeError(f"the program is not linked:\n{done.stderr[:4000]}")
    return program


def judge(text):
    """Compare what the program prints with what the manual promises."""
    print(text, end="")
    values = dict(line.split(maxsplit=1) for line in text.strip().split("\n"))
    if "error" in values:
        raise RecipeError(values["error"])
    for law in ("area", "conservative"):
        # The area law is linear up to the depth over the size of the bodies, here some 1e-3.
        tolerance = 5e-3 if law == "area" else 1e-3
        if abs(float(values[f"{law}_restitution"]) - 0.5) > tolerance:
            raise RecipeError(f"{law}: the restitution is not 1/2")
        if abs(float(values[f"{law}_damping_work"]) + 0.75) > 2 * tolerance:
            raise RecipeError(f"{law}: damping does not take 3/4 of the energy")
        if not float(values[f"{law}_greatest_area"]) > 0.0:
            raise RecipeError(f"{law}: the greatest area is not stored")
    if abs(float(values["stable_step_share"]) - 0.5) > 1e-12:
        raise RecipeError("four times the stiffness does not halve the stable step")
    if values["plain_loop_result"] != values["all_pairs_result"]:
        raise RecipeError("the finder of the manual does not give the bits of all_pairs")


def main(root, build, ninja):
    """Try the recipes."""
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        copy = os.path.join(folder, "copy")
        shutil.copytree(os.path.join(root, "src"), os.path.join(copy, "src"))
        try:
            apply_recipes(root, copy)
            program = build_program(root, copy, build, ninja, folder)
            done = subprocess.run([program], cwd=folder, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise RecipeError(f"the program ended with {done.returncode}:\n{done.stdout}{done.stderr}")
            judge(done.stdout)
        except RecipeError as error:
            print(f"recipes: {error}")
            return 1
    print(f"recipes: both parts of the manual work; {time.monotonic() - began:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main(*(os.path.abspath(argument) for argument in sys.argv[1:3]), sys.argv[3]))
