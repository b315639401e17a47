"""The sources of the program compile without a warning in every preset of CMakePresets.json.

usage: check_presets.py SOURCES FOLDER CMAKE

Presets that differ only in the flags of the compiler are one, and the compiler only checks: it writes modules, but no
code, which takes a tenth of the time. Double precision has the sources of the others. Of the preset with MPI only the
layers are tried that have sources of their own there. What needs code, and the tests, is built by `./polydem build`.
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

SOURCES = FOLDER = pathlib.Path()
CMAKE = ""

#: Entries of a preset that decide on flags alone
FLAGS = {"CMAKE_BUILD_TYPE"}
#: No code, so nothing to put into libraries and programs; an empty object says that a source was checked. No source has
#: lines for a preprocessor.
ONLY_CHECK = ["-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_Fortran_FLAGS_RELEASE=-fsyntax-only", "-DPOLYDEM_TESTS=OFF",
              "-DCMAKE_Fortran_PREPROCESS=OFF",
              "-DCMAKE_Fortran_COMPILE_OBJECT=<CMAKE_Fortran_COMPILER> <DEFINES> <INCLUDES> <FLAGS> -c <SOURCE> "
              "-o <OBJECT> && touch <OBJECT>",
              "-DCMAKE_Fortran_ARCHIVE_CREATE=<CMAKE_COMMAND> -E touch <TARGET>", "-DCMAKE_Fortran_ARCHIVE_FINISH=",
              "-DCMAKE_Fortran_CREATE_SHARED_LIBRARY=<CMAKE_COMMAND> -E touch <TARGET>",
              "-DCMAKE_Fortran_LINK_EXECUTABLE=<CMAKE_COMMAND> -E touch <TARGET>"]
#: Layers with other sources if the program is built with MPI
OF_MPI = ("polydem_communicator", "polydem_hdf5")
COMPLAINT = re.compile(r"^(?:.*: )?(?:Warning|Error|warning|error|Fatal Error):.*", re.MULTILINE)


def presets():
    """Entries of the cache by name of the preset, those of its ancestors included."""
    listed = json.loads((SOURCES / "CMakePresets.json").read_text(encoding="utf-8"))["configurePresets"]
    by_name = {preset["name"]: preset for preset in listed}

    def entries(name):
        parents = by_name[name].get("inherits", [])
        found = {}
        for parent in [parents] if isinstance(parents, str) else reversed(parents):
            found.update(entries(parent))
        return {**found, **by_name[name].get("cacheVariables", {})}

    return {preset["name"]: entries(preset["name"]) for preset in listed if not preset.get("hidden")}


def distinct():
    """Entries that make a difference to the sources, by the names of the presets that have them."""
    groups = {}
    for name, entries in presets().items():
        kept = frozenset((key, value) for key, value in entries.items() if key not in FLAGS)
        groups.setdefault(kept, []).append(name)
    return {tuple(names): dict(entries) for entries, names in groups.items()}


def has_mpi():
    """Whether MPI is here, and an HDF5 built with it, as the launcher looks for them"""
    return bool(shutil.which("mpifort") and (os.environ.get("HDF5_ROOT") or shutil.which("h5pfc")))


def complaints(sources, entries, folder, *targets):
    """What the compiler says of the sources with these entries: lines with warnings and errors."""
    options = [f"-D{name}={value}" for name, value in entries.items()]
    configured = subprocess.run([CMAKE, "-S", str(sources), "-B", str(folder), "-G", "Ninja", *options, *ONLY_CHECK],
                                capture_output=True, text=True, check=False)
    if configured.returncode != 0:
        return [configured.stderr]
    built = subprocess.run([CMAKE, "--build", str(folder), "--parallel", "2", "--target", *(targets or ["all"]),
                            "--", "-k", "0"], capture_output=True, text=True, check=False)
    found = [match[0] for match in COMPLAINT.finditer(built.stdout + built.stderr)]
    if built.returncode != 0 and not found:
        return [built.stdout[-2000:] + built.stderr]
    for line in found:
        print(built.stdout[max(0, built.stdout.find(line) - 400):][:500 + len(line)])
    return found


class Presets(unittest.TestCase):
    def test_every_preset_compiles_without_a_warning(self):
        self.assertGreaterEqual(len(distinct()), 4)
        for names, entries in distinct().items():
            if not entries:
                continue
            with self.subTest(presets=names):
                if entries.get("POLYDEM_MPI") == "ON" and not has_mpi():
                    print("no MPI: not tried")
                    continue
                targets = OF_MPI if "POLYDEM_MPI" in entries else ()
                found = complaints(SOURCES, entries, FOLDER / names[0], *targets)
                if found:
                    # What is checked gives no warning again.
                    shutil.rmtree(FOLDER / names[0])
                self.assertEqual(found, [])

    def test_every_preset_can_be_built_and_is_named_in_the_manual(self):
        listed = json.loads((SOURCES / "CMakePresets.json").read_text(encoding="utf-8"))
        self.assertEqual([preset["name"] for preset in listed["buildPresets"]], list(presets()))
        manual = (SOURCES / "inputs" / "getting_started.md").read_text(encoding="utf-8")
        for words in ["./polydem build ", *(f"`{name}`" for name in presets())]:
            self.assertTrue(words in manual, f"inputs/getting_started.md does not have: {words}")

    def test_planted_faults_are_found(self):
        copy = FOLDER / "copy"
        for folder in (copy, FOLDER / "planted"):
            shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(SOURCES / "src", copy / "src")
        shutil.copy(SOURCES / "CMakeLists.txt", copy)
        kinds = copy / "src/base/kinds.f90"
        sound = kinds.read_text(encoding="utf-8")
        for precision, line, words in (
                ("quadruple", "real(dp), parameter :: planted = real(0.25_wp*huge(1.0_wp), dp)", "Error: Arithmetic"),
                ("single", "real(wp), parameter :: planted = real(1.0e300_dp, wp)", "Error: Arithmetic"),
                ("double", "integer, parameter :: planted = 1/2", "Warning: Integer division")):
            with self.subTest(precision=precision):
                spoilt = sound.replace("end module", f"   public :: planted\n   {line}\nend module")
                kinds.write_text(spoilt, encoding="utf-8")
                found = complaints(copy, {"POLYDEM_PRECISION": precision}, FOLDER / "planted", "polydem_base")
                self.assertTrue(found and all(words in line for line in found[:1]), found)
        shutil.rmtree(copy)


if __name__ == "__main__":
    SOURCES, FOLDER, CMAKE = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    unittest.main(argv=sys.argv[:1], verbosity=2)
