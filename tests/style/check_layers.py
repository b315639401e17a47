"""Every layer, program and test sees the layers that its sources use, and no others.

usage: check_layers.py BUILD      a configured and built folder, with compile_commands.json

What a target of CMake sees are the folders of modules in its compile commands: the links are PRIVATE, so the compiler
refuses all that the target does not name. HDF5 and MPI may lie where every compiler looks: OWNERS lists who
may use them.
"""

import json
import re
import sys
from collections import defaultdict
from pathlib import Path

#: Modules of libraries, and the targets that may use them
OWNERS = {"hdf5": {"polydem_hdf5", "test_hdf5", "fuzz"}, "mpi_f08": {"polydem_communicator", "polydem_hdf5"}}
USE = re.compile(r"^ *use\b *(?:, *(?:non_)?intrinsic *)?(?:::)? *(\w+)", re.MULTILINE | re.IGNORECASE)
MODULE = re.compile(r"^ *module +(?!procedure\b|subroutine\b|function\b)(\w+) *$", re.MULTILINE | re.IGNORECASE)


def targets_of(entries):
    """By name of the target: modules that its sources define, modules that they use, and layers that it sees."""
    targets = defaultdict(lambda: (set(), set(), set()))
    for entry in entries:
        match = re.search(r"CMakeFiles/([^/ ]+)\.dir/", entry["command"])
        if not match or not entry["file"].endswith(".f90"):
            continue
        text = Path(entry["file"]).read_text(encoding="utf-8")
        defined, used, seen = targets[match[1]]
        defined.update(name.lower() for name in MODULE.findall(text))
        used.update(name.lower() for name in USE.findall(text))
        seen.update(re.findall(r"-I\S*/layers/(\w+)", entry["command"]))
    return targets


def breaches(targets):
    """What is seen and not used, or used and not seen."""
    owner = {module: name.removeprefix("polydem_") for name, (defined, _, _) in targets.items()
             if name.startswith("polydem_") for module in defined}
    for name, (_, modules, seen) in sorted(targets.items()):
        used = {owner[module] for module in modules if module in owner} - {name.removeprefix("polydem_")}
        yield from (f"{name} sees {layer} and does not use it: name it no more" for layer in sorted(seen - used))
        yield from (f"{name} uses {layer} and does not name it" for layer in sorted(used - seen))
        yield from (f"{name} may not use the module {module}" for module, owners in OWNERS.items()
                    if module in modules and name not in owners)


def main():
    targets = targets_of(json.loads((Path(sys.argv[1]) / "compile_commands.json").read_text(encoding="utf-8")))
    found = [*breaches(targets)] if "polydem_base" in targets else [f"{sys.argv[1]}: no layers found"]
    print("\n".join([*found, f"{len(targets)} targets"]))
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
