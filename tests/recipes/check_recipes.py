"""Build and run the recipes of src, and compare the number of files that each touches with its limit.

usage: check_recipes.py ROOT BUILD NINJA

In a copy of src, each file of the folder examples goes to the place of the same name that the pages say, and to the
list of sources of its layer; diff blocks change the last file named before them. The copy is built as a whole, as new
entries and columns change types that most files use, without optimisation and with warnings as errors. Its libraries
are linked to try_recipes.f90, and its program does a run whose frames the Python package reads. All output goes to a
temporary folder.
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
        "An integrator": 2, "A column of the contact table": 3, "A participant of the step": 2,
        "A quantity of the series": 2, "A condition that ends a stage": 2, "A shape of grains": 2}
#: What the build of the copy needs beside src
ALSO = ("CMakeLists.txt", "LICENSE", "README.md", "CITATION.cff")
#: A block that slides on a floor with this speed [m/s], on which it rests at the start
SPEED = 0.25
SLIDE = f"""&grains name = 'g' region = 'at' at = 0, 0.0049999 shape = 'rectangle' width = 0.01 height = 0.01
 velocity = {SPEED}, 0 /
&wall name = 'w' outline = 'rectangle' low = -0.1, -0.01 high = 0.1, 0 /
&integrate duration = 1e-4 dt = 1e-5 / &output frame_interval = 1e-4 contacts = .true. folder = 'slide' /
"""
#: Prints the slip velocity of the contacts of the first frame
READ = ("from polydem_post import Trajectory\n"
        "contacts = Trajectory('slide')[0].contacts\n"
        "print(*contacts.others['slip'])\n")


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


def list_source(path):
    """Add a file to the sources of the layer whose folder it is in or below."""
    folder = os.path.dirname(path)
    while not os.path.exists(os.path.join(folder, "CMakeLists.txt")):
        folder = os.path.dirname(folder)
    with open(os.path.join(folder, "CMakeLists.txt"), "r+", encoding="utf-8") as stream:
        head, rest = stream.read().split(" SOURCES\n", 1)
        stream.seek(0)
        stream.write(f"{head} SOURCES\n  {os.path.relpath(path, folder)}\n{rest}")


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
                list_source(target)
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


def call(words, folder, wrong, **options):
    """Run a command in a folder; return what it prints."""
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False, **options)
    if done.returncode != 0:
        raise RecipeError(f"{wrong}:\n{done.stdout[-4000:]}{done.stderr[-4000:]}")
    return done.stdout


def build_copy(root, copy, build, ninja):
    """Build the program of the copy in the precision of a build; return the build folder."""
    for name in ALSO:
        shutil.copy(os.path.join(root, name), copy)
    with open(os.path.join(build, "CMakeCache.txt"), encoding="utf-8") as stream:
        known = [line.strip() for line in stream if re.match("POLYDEM_PRECISION:|CMAKE_Fortran_COMPILER:", line)]
    new = os.path.join(copy, "build")
    call(["cmake", "-S", copy, "-B", new, "-G", "Ninja", f"-DCMAKE_MAKE_PROGRAM={ninja}", "-DPOLYDEM_TESTS=OFF",
          "-DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF", "-DCMAKE_Fortran_FLAGS_RELEASE=-O0 -Werror",
          *(f"-D{line}" for line in known)], copy, "the copy cannot be configured")
    call([ninja, "-C", new, "src/app/polydem"], copy, "the copy does not compile")
    return new


def build_program(root, build, new, ninja, folder):
    """Compile the program of this test against the modules of the copy, and link it with its libraries."""
    with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as stream:
        entries = {entry["file"]: entry for entry in json.load(stream)}
    trial = os.path.join(root, "tests", "verification", "trial.f90")
    words, directory = shlex.split(entries[trial]["command"]), entries[trial]["directory"]
    layers = os.path.join(build, "layers")
    # The module folder of the tests becomes a search folder, behind that of this program and those of the layers.
    flags = [re.sub("^-J", "-I", word).replace(layers, os.path.join(new, "layers"))
             for word in words[1:words.index("-c")]]
    objects = []
    for source in (os.path.join(root, "tests", "simulation", "serial_simulation.f90"), trial,
                   os.path.join(root, "tests", "recipes", "try_recipes.f90")):
        objects.append(os.path.join(folder, os.path.basename(source) + ".o"))
        call([words[0], f"-I{folder}", *flags, "-Werror", f"-J{folder}", "-c", source, "-o", objects[-1]], directory,
             f"{source} does not compile")
    output = call([ninja, "-C", build, "-t", "commands", "tests/verification/verify"], build, "ninja -t commands")
    words = shlex.split(output.strip().split("\n")[-1].replace(": && ", "").replace(" && :", ""))
    libraries = [os.path.join(build, word) if word.startswith("tests/") else word
                 for word in words[words.index("-o") + 2:]]
    program = os.path.join(folder, "try_recipes")
    call([words[0], "-fopenmp", *objects, "-o", program, *libraries], new, "the program does not link")
    return program


def slip_in_python(root, new, folder):
    """The column of the contact table in the first frame of a run, as the Python package reads it."""
    with open(os.path.join(folder, "slide.nml"), "w", encoding="utf-8") as stream:
        stream.write(SLIDE)
    call([os.path.join(new, "src", "app", "polydem"), "run", "slide.nml"], folder, "the run with the column fails")
    python = os.path.join(root, ".venv", "bin", "python")
    environment = {**os.environ, "PYTHONPATH": os.path.join(root, "postproc", "src"), "PYTHONDONTWRITEBYTECODE": "1"}
    return call([python if os.path.exists(python) else sys.executable, "-c", READ], folder,
                "Python does not read the column", env=environment)


#: Values that the program prints, each with what it should be, the tolerance, and what is wrong otherwise. The area
#: law is linear up to the depth over the size of the bodies, here some 1e-3
WANTED = (
    ("area_restitution", (0.5,), 5e-3, "area: the restitution is not 1/2"),
    ("area_damping_work", (-0.75,), 1e-2, "area: damping does not dissipate 3/4 of the energy"),
    ("conservative_restitution", (0.5,), 1e-3, "conservative: the restitution is not 1/2"),
    ("conservative_damping_work", (-0.75,), 2e-3, "conservative: damping does not dissipate 3/4 of the energy"),
    ("stable_step_share", (0.5,), 1e-12, "four times the stiffness does not halve the stable step"),
    ("plasticity", (3.5, 7.0), 1e-12, "the parameter of the force part is not that of the pair of materials"),
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
            apply_recipes(root, copy)
            new = build_copy(root, copy, build, ninja)
            judge(call([build_program(root, build, new, ninja, folder)], folder, "the program fails"))
            slip = [float(word) for word in slip_in_python(root, new, folder).split()]
            print("slip", *slip)
            if len(slip) != 1 or abs(slip[0] + SPEED) > 1e-12:
                raise RecipeError("the column of the contact table is not the slip velocity")
        except RecipeError as error:
            print(f"recipes: {error}")
            return 1
    print(f"recipes: all {len(MOST)} work; {time.monotonic() - began:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main(*(os.path.abspath(argument) for argument in sys.argv[1:3]), sys.argv[3]))
