"""CMake: the compiler that it wants, the revision that it asks for, what it installs, and its workflows.

usage: test_cmake.py SOURCES BUILD CMAKE      sources, a built folder, the program cmake
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCES = BUILD = pathlib.Path()
CMAKE = ""


def call(*words, **options):
    """Exit code, output and messages of a command."""
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False, **options)
    return done.returncode, done.stdout, done.stderr


class Scene(unittest.TestCase):
    """An empty folder for each test."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)


class Compiler(Scene):
    def test_only_a_new_gfortran_is_accepted(self):
        for name, version, accepted in (("GNU", "12.2.0", True), ("GNU", "15.1", True), ("GNU", "11.4.0", False),
                                        ("LLVMFlang", "20.1", False), ("IntelLLVM", "2025.0", False), ("", "", False)):
            with self.subTest(compiler=name, version=version):
                code, _, message = call(CMAKE, "-D", f"CMAKE_Fortran_COMPILER_ID={name}", "-D",
                                        f"CMAKE_Fortran_COMPILER_VERSION={version}", "-D",
                                        "CMAKE_Fortran_COMPILER=/opt/it", "-P", SOURCES / "src/cmake/compiler.cmake")
                self.assertEqual(code == 0, accepted, message)
                if not accepted:
                    sentence = f"polydem needs gfortran 12 or newer, but /opt/it is {name} {version}."
                    self.assertIn(sentence, " ".join(message.split()).replace("is .", "is  ."))

    def test_the_project_refuses_another_compiler(self):
        code, _, message = call(CMAKE, "-S", SOURCES, "-B", self.folder, "-G", "Ninja",
                                "-D", "CMAKE_Fortran_COMPILER_FORCED=1", "-D", "CMAKE_Fortran_COMPILER_ID_RUN=1",
                                "-D", "CMAKE_Fortran_COMPILER_ID=LLVMFlang", "-D", "CMAKE_Fortran_COMPILER_VERSION=20")
        self.assertNotEqual(code, 0)
        self.assertIn("polydem needs gfortran 12 or newer", message)

    def test_a_release_without_tests_names_the_optimisation_once_and_has_a_man_page(self):
        code, _, message = call(CMAKE, "-S", SOURCES, "-B", self.folder, "-G", "Ninja", "-D", "POLYDEM_TESTS=OFF")
        self.assertEqual(code, 0, message)
        for entry in json.loads((self.folder / "compile_commands.json").read_text(encoding="utf-8")):
            if not entry["file"].endswith("_o2.f90"):
                self.assertEqual(re.findall(r" -O\S+", entry["command"]), [" -O3"])
        code, output, message = call(CMAKE, "--build", self.folder, "--target", "shell_texts")
        self.assertEqual(code, 0, output + message)
        for name in ("polydem", "polydem_lab"):
            text = (self.folder / f"src/packaging/{name}.1").read_text(encoding="utf-8")
            self.assertTrue(text.startswith(f".TH {name.upper()} ") and ".SH ENVIRONMENT" in text)


class Revision(Scene):
    def setUp(self):
        super().setUp()
        self.clone = self.folder / "clone"
        self.clone.mkdir()

    def git(self, *words):
        code, output, message = call("git", "-c", "user.name=n", "-c", "user.email=e", *words, cwd=self.clone)
        self.assertEqual(code, 0, message)
        return output.strip()

    def ask(self):
        """The revision in a new build_info.f90."""
        result = self.folder / "build_info.f90"
        layer = SOURCES / "src/platform/system"
        code, _, message = call(CMAKE, "-D", f"TEMPLATE={layer / 'build_info.f90.in'}", "-D", f"RESULT={result}",
                                "-D", f"SOURCE_DIR={self.clone}", "-D", "VERSION=1", "-D", "BUILD_TYPE=Release",
                                "-P", layer / "build_info.cmake")
        self.assertEqual(code, 0, message)
        return result.read_text(encoding="utf-8").split("git_revision = '")[1].split("'")[0]

    def test_the_revision_follows_commits_and_edits_and_outlives_git(self):
        self.assertEqual(self.ask(), "unknown")
        self.git("init", "--quiet")
        (self.clone / "a").write_text("a\n", encoding="utf-8")
        self.git("add", "a")
        self.git("commit", "--quiet", "--message", "first")
        first = self.git("rev-parse", "--short", "HEAD")
        self.assertEqual(self.ask(), first)
        (self.clone / "a").write_text("b\n", encoding="utf-8")
        self.assertEqual(self.ask(), f"{first}-dirty")
        self.git("commit", "--quiet", "--all", "--message", "second")
        second = self.git("rev-parse", "--short", "HEAD")
        self.assertNotEqual(first, second)
        self.assertEqual(self.ask(), second)
        (self.clone / ".git").rename(self.clone / "gone")
        self.assertEqual(self.ask(), second)


class Install(Scene):
    def test_installed_programs_run(self):
        code, _, message = call(CMAKE, "--install", BUILD, "--prefix", self.folder)
        self.assertEqual(code, 0, message)
        program, laboratory = (self.folder / "bin" / name for name in ("polydem", "polydem_lab"))
        self.assertEqual(call(program, "--version"), call(BUILD / "src/app/polydem", "--version"))
        self.assertEqual(call(laboratory, "--version"), call(program, "--version"))
        self.assertEqual(call(program, "--version")[0], 0)
        # The launcher, which may have started this test, has another name for the program.
        own = {name: value for name, value in os.environ.items() if name != "POLYDEM_CALL"}
        self.assertEqual(call(program, "help", "run", env=own)[1].split()[:3], ["usage:", "polydem", "run"])
        code, output, message = call(program, "check", self.folder / "share/polydem/inputs/stack.nml", cwd=self.folder)
        self.assertEqual(code, 0, output + message)
        self.assertTrue((self.folder / "share/doc/polydem/LICENSE").exists())
        code, _, message = call(laboratory, "replay", SOURCES / "tests/laboratory/traces/drum_cut.h5", "--steps", "1")
        self.assertEqual(code, 0, message)
        for name, option, other in (("polydem", "walltime", "oracle"), ("polydem_lab", "oracle", "walltime")):
            for place in (f"man/man1/{name}.1", f"bash-completion/completions/{name}",
                          f"zsh/site-functions/_{name}", f"fish/vendor_completions.d/{name}.fish"):
                text = (self.folder / "share" / place).read_text(encoding="utf-8").replace("\\-", "-")
                self.assertIn(f"--{option}" if "fish" not in place else f"-l {option}", text)
                self.assertNotIn(other, text)

    def test_other_programs_find_the_installed_library(self):
        self.assertEqual(call(CMAKE, "--install", BUILD, "--prefix", self.folder / "usr")[0], 0)
        example, scene = SOURCES / "tests/library/example.c", SOURCES / "inputs/first.nml"
        (self.folder / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.25)\nproject(other LANGUAGES C)\nfind_package(polydem 0.1 REQUIRED)\n"
            f"add_executable(other {example})\ntarget_link_libraries(other PRIVATE polydem::polydem)\n",
            encoding="utf-8")
        code, output, message = call(CMAKE, "-S", self.folder, "-B", self.folder / "b",
                                     f"-DCMAKE_PREFIX_PATH={self.folder / 'usr'}")
        self.assertEqual(code, 0, output + message)
        code, output, message = call(CMAKE, "--build", self.folder / "b")
        self.assertEqual(code, 0, output + message)
        expected = call(BUILD / "tests/library/library_example_c", scene, "20")
        self.assertEqual(expected[0], 0)
        self.assertEqual(call(self.folder / "b/other", scene, "20"), expected)
        [listed] = (self.folder / "usr").rglob("polydem.pc")
        words = dict(re.findall(r"^(Libs|Cflags|prefix|libdir|includedir)[:=] *(.*)$",
                                listed.read_text("utf-8"), re.MULTILINE))
        words["prefix"] = words["prefix"].replace("${pcfiledir}", str(listed.parent))
        for name in ("libdir", "includedir", "prefix"):
            words = {key: text.replace(f"${{{name}}}", words[name]) for key, text in words.items()}
        code, _, message = call("cc", example, *words["Cflags"].split(), *words["Libs"].split(), "-o",
                                self.folder / "plain")
        self.assertEqual(code, 0, message)
        own = {**os.environ, "LD_LIBRARY_PATH": words["libdir"]}
        self.assertEqual(call(self.folder / "plain", scene, "20", env=own), expected)

    @unittest.skipUnless(shutil.which("dpkg-deb"), "no dpkg-deb: nothing can be packed")
    def test_a_package_has_the_program_with_its_libraries_as_dependencies(self):
        code, output, message = call(pathlib.Path(CMAKE).with_name("cpack"), "-G", "DEB", "-B", self.folder, cwd=BUILD)
        self.assertEqual(code, 0, output + message)
        [package] = self.folder.glob("polydem_*.deb")
        needs = call("dpkg-deb", "-f", package, "Depends")[1]
        for name in ("libgfortran5", "libgomp1", "libhdf5-", "libhdf5-fortran"):
            self.assertIn(name, needs)
        self.assertEqual(call("dpkg-deb", "-x", package, self.folder / "root")[0], 0)
        for name in ("polydem", "polydem_lab"):
            self.assertEqual(call(self.folder / "root/usr/bin" / name, "--version")[0], 0)
        self.assertTrue((self.folder / "root/usr/share/polydem/inputs/first.nml").exists())


class Workflows(unittest.TestCase):
    def test_workflows_configure_build_and_test(self):
        presets = json.loads((SOURCES / "CMakePresets.json").read_text(encoding="utf-8"))
        self.assertEqual([flow["name"] for flow in presets["workflowPresets"]], ["release", "debug", "sanitize"])
        for flow in presets["workflowPresets"]:
            steps = [(step["type"], step["name"]) for step in flow["steps"]]
            self.assertEqual(steps, [(kind, flow["name"]) for kind in ("configure", "build", "test")])
        # CMake reads the whole file and refuses steps that it does not know.
        code, output, message = call(CMAKE, "--workflow", "--list-presets", cwd=SOURCES)
        self.assertEqual((code, message), (0, ""))
        for flow in presets["workflowPresets"]:
            self.assertIn(f'"{flow["name"]}"', output)


if __name__ == "__main__":
    SOURCES, BUILD, CMAKE = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    unittest.main(argv=sys.argv[:1], verbosity=2)
