"""The recipes of src/packaging agree with the project: version, options, dependencies.

usage: test_recipes.py SOURCES
"""

import re
import sys
import unittest
from pathlib import Path

SOURCES = Path()


def text_of(name):
    return (SOURCES / name).read_text(encoding="utf-8")


class Recipes(unittest.TestCase):
    def test_options_are_those_of_the_project(self):
        known = set(re.findall(r"^(?:option|set)\((POLYDEM_\w+)", text_of("CMakeLists.txt"), re.MULTILINE))
        for name in ("Containerfile", "spack/package.py"):
            used = set(re.findall(r"POLYDEM_\w+", text_of(f"src/packaging/{name}")))
            self.assertTrue(used)
            self.assertLessEqual(used, known, name)

    def test_the_version_is_that_of_the_project(self):
        version = re.search(r"project\(polydem VERSION (\S+)", text_of("CMakeLists.txt"))[1]
        for name in ("postproc/pyproject.toml", "CITATION.cff"):
            self.assertRegex(text_of(name), rf'(?m)^version(?: = "|: ){re.escape(version)}"?$')

    def test_the_container_installs_what_the_launcher_installs(self):
        listed = re.search(r"local pair pairs=\((.*?)\"", text_of("polydem"))[1]
        wanted = {pair.partition(":")[2] for pair in listed.split()} | {"libhdf5-dev", "python3"}
        first = re.search(r"--no-install-recommends ([^&]*?)\s+&&", text_of("src/packaging/Containerfile"))[1]
        self.assertEqual(set(first.replace("\\", " ").split()), wanted)

    def test_the_recipe_for_spack_is_python(self):
        compile(text_of("src/packaging/spack/package.py"), "package.py", "exec")


if __name__ == "__main__":
    SOURCES = Path(sys.argv.pop(1))
    unittest.main()
