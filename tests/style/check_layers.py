"""Who sees whom: what each target of the build declares, what its sources use, and what the compiler lets it use.

usage: check_layers.py BUILD      a built folder, with compile_commands.json and targets.txt

A layer or test target must name in CMake just those layers whose modules its sources use. For every target and every
layer that it does not name, a file that uses a module of that layer is compiled with its flags: the compiler must
say that it cannot open this module. A layer that is named must be seen. The same holds for the modules of HDF5 and MPI.
"""

import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

#: Libraries: the module that stands for each, and how the links that show it begin
LIBRARIES = {"the library HDF5": ("hdf5", "hdf5::"), "the library MPI": ("mpi_f08", "MPI::")}
USE = re.compile(r"^ *use\b *(?:, *(?:non_)?intrinsic *)?(?:::)? *(\w+)", re.MULTILINE | re.IGNORECASE)
MODULE = re.compile(r"^ *module +(?!procedure\b|subroutine\b|function\b)(\w+) *$", re.MULTILINE | re.IGNORECASE)


@dataclass
class Target:
    """A library or program of the build with Fortran sources."""

    name: str
    #: What it links, as CMake has it
    links: list
    #: Modules that its sources define, and use
    defined: set = field(default_factory=set)
    used: set = field(default_factory=set)
    #: Compiler with the options that say where modules are, and where it runs
    compiler: tuple = ()
    directory: str = "."

    @property
    def layer(self):
        """Name of the layer if this is one."""
        return self.name[len("polydem_"):] if self.name.startswith("polydem_") else None

    def declares(self, layer):
        """Whether it names a layer, or a library of LIBRARIES."""
        if layer in LIBRARIES:
            return any(link.startswith(LIBRARIES[layer][1]) for link in self.links)
        return f"polydem::{layer}" in self.links


def folders_of(command):
    """The compiler and the options of a command that say where modules are; where they are written, they are read."""
    words = shlex.split(command)
    found = [words[0]]
    for word, after in zip(words[1:], [*words[2:], ""]):
        if word.startswith("-I"):
            found.append(word)
        elif word == "-isystem":
            found += [word, after]
        elif word.startswith("-J"):
            found.append("-I" + word[2:])
    return tuple(found)


def read_targets(build):
    """All targets of a build that have Fortran sources, by name."""
    targets = {}
    with open(os.path.join(build, "targets.txt"), encoding="utf-8") as file:
        for line in file.read().split():
            name, _, links = line.partition("|")
            targets[name] = Target(name, links.split(";"))
    with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as file:
        entries = json.load(file)
    for entry in entries:
        match = re.search(r"CMakeFiles/([^/ ]+)\.dir/", entry["command"])
        if not match or not re.search(r"\.f90$", entry["file"], re.IGNORECASE):
            continue
        target = targets[match.group(1)]
        if not os.path.exists(entry["file"]):
            sys.exit(f"{entry['file']} is missing: build all of {build} first")
        with open(entry["file"], encoding="utf-8") as file:
            text = file.read()
        target.defined.update(name.lower() for name in MODULE.findall(text))
        target.used.update(name.lower() for name in USE.findall(text))
        target.compiler, target.directory = folders_of(entry["command"]), entry["directory"]
    return {name: target for name, target in targets.items() if target.compiler}


def layers_of(targets):
    """Layers by name, each with a module that stands for it; and the libraries."""
    found = {target.layer: min(target.defined) for target in targets.values() if target.layer and target.defined}
    return {**found, **{name: module for name, (module, _) in LIBRARIES.items()}}


def check_declarations(targets):
    """What is named and not used, and what is used and not named."""
    owner = {module: target.layer for target in targets.values() if target.layer for module in target.defined}
    owner.update({module: name for name, (module, _) in LIBRARIES.items()})
    for target in targets.values():
        used = {owner[module] for module in target.used if module in owner} - {target.layer}
        named = {layer for layer in set(owner.values()) if target.declares(layer)}
        for layer in sorted(used - named):
            yield f"{target.name} uses {layer} and does not name it"
        for layer in sorted(named - used):
            yield f"{target.name} names {layer} and does not use it"


def try_use(target, module, folder):
    """Compile a file that uses a module, with the flags of a target: the compiler's code and words."""
    path = os.path.join(folder, f"{target.name}_{module}.f90")
    with open(path, "w", encoding="utf-8") as file:
        file.write(f"program forbidden\n   use {module}, only:\n   implicit none\nend program forbidden\n")
    done = subprocess.run([*target.compiler, "-fsyntax-only", path], cwd=target.directory, capture_output=True,
                          text=True, env={**os.environ, "LC_ALL": "C"}, check=False)
    return done.returncode, done.stderr


def judge(target, layer, module, code, words):
    """What is wrong with what the compiler made of the use of a layer; None if nothing is."""
    refused = code != 0 and re.search(rf"Cannot open module file .{module}\.mod.", words)
    if target.declares(layer) and code != 0:
        return f"{target.name} names {layer} and does not see {module}:\n{words}"
    if not target.declares(layer) and code == 0:
        return f"{target.name} sees {module} of {layer}, which it does not name"
    if not target.declares(layer) and not refused:
        return f"{target.name}: the compiler refuses {module} of {layer} for another reason:\n{words}"
    return None


def check_visibility(targets, group):
    """Try every pair of a target of a group and a layer: what is wrong, how many were refused and how many seen."""
    layers = layers_of(targets)
    pairs = [(target, layer) for target in group for layer in layers if target.layer != layer]
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        answers = list(pool.map(lambda pair: try_use(pair[0], layers[pair[1]], folder), pairs))
    wrong = [judge(target, layer, layers[layer], *answer) for (target, layer), answer in zip(pairs, answers)]
    seen = sum(code == 0 for code, _ in answers)
    return [sentence for sentence in wrong if sentence], len(pairs) - seen, seen


def main():
    targets = read_targets(sys.argv[1])
    groups = {"layers": [target for target in targets.values() if target.layer],
              "programs and tests": [target for target in targets.values() if not target.layer]}
    if len(groups["layers"]) < 2:
        sys.exit(f"{sys.argv[1]}: no layers found")
    breaches = list(check_declarations(targets))
    for name, group in groups.items():
        wrong, refused, seen = check_visibility(targets, group)
        print(f"{len(group)} {name}: {refused} uses of layers and libraries that they do not name are refused, "
              f"{seen} of those that they name compile")
        breaches += wrong
    for breach in breaches:
        print(breach)
    return int(bool(breaches))


if __name__ == "__main__":
    sys.exit(main())
