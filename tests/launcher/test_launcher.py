"""Tests of ./polydem on a toy project, in a folder with a blank in its name.

usage: test_launcher.py LAUNCHER

The toy has the files that the launcher knows of and a program that prints its arguments. A made-up folder of
commands and a made-up apt-get, which links the real commands, stand for a machine with nothing installed.
"""

import os
import pty
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

LAUNCHER = ""

CMAKE_LISTS = """\
cmake_minimum_required(VERSION 3.25)
project(toy LANGUAGES Fortran)
add_subdirectory(src/app)
add_subdirectory(tests/verification)
enable_testing()
add_test(NAME good COMMAND ${CMAKE_COMMAND} -E true)
add_test(NAME bad COMMAND ${CMAKE_COMMAND} -E false)
add_test(NAME ranks COMMAND sh -c [[test -x "$POLYDEM_MPI_PROGRAM"]])
add_test(NAME odd COMMAND ${CMAKE_COMMAND} -E false)
set_tests_properties(good odd PROPERTIES LABELS "fine;c.d")
set_tests_properties(bad PROPERTIES LABELS broken)
set_tests_properties(odd PROPERTIES SKIP_RETURN_CODE 1)
"""

PRESETS = """\
{"version": 6, "configurePresets": [
  {"name": "release", "generator": "Ninja", "binaryDir": "${sourceDir}/build/${presetName}"},
  {"name": "mpi", "generator": "Ninja", "binaryDir": "${sourceDir}/build/${presetName}"},
  {"name": "single", "generator": "Ninja", "binaryDir": "${sourceDir}/build/${presetName}"},
  {"name": "quadruple", "generator": "Ninja", "binaryDir": "${sourceDir}/build/${presetName}"},
  {"name": "debug", "generator": "Ninja", "binaryDir": "${sourceDir}/build/${presetName}"}]}
"""

PROGRAM = """\
program polydem
   implicit none
   character(len=80) :: word
   integer :: k
   do k = 1, command_argument_count()
      call get_command_argument(k, word)
      print '(a)', '<'//trim(word)//'>'
   end do
end program polydem
"""

# Notes its environment and becomes the program, unless it shall wait for signals.
MPIRUN = """\
#!/bin/bash
env >"$NOTES/environment"
[ "$1" = -n ] || exit 9
echo "$2 ranks"
shift 2
[ -n "$MPIRUN_WAITS" ] || exec "$@"
trap 'echo USR1 >>"$NOTES/heard"; [ "$MPIRUN_WAITS" = long ] || { sleep 0.3; exit 75; }' USR1
trap 'echo TERM >>"$NOTES/heard"; exit 1' TERM
touch "$NOTES/started"
for k in {1..600}; do sleep 0.05; done
"""

APT_GET = """\
#!/bin/bash
echo "apt-get $*" >>"$APT_LOG"
[ "$1" = install ] || exit 0
[ -z "$APT_FAILS" ] || { echo "no such package"; exit 100; }
for name in gfortran cmake ninja git h5fc; do ln -sf "$(PATH=$REAL_PATH command -v $name)" "$COMMANDS/$name"; done
"""

# Where the help texts of the verbs are
HELP_PLACES = ("src/app/help", "postproc/src/polydem_post/help")

# What the launcher and the tools may call on a bare machine.
COMMANDS = ("ar as bash cat cp dirname env find flock grep head id ld ln mkdir mv nproc ranlib readlink rm sed "
            "setsid sh tail true").split()


class Toy(unittest.TestCase):
    """A fresh toy project for each test."""

    def setUp(self):
        self.folder = os.path.realpath(tempfile.mkdtemp(prefix="a toy "))
        self.addCleanup(shutil.rmtree, self.folder)
        self.launcher = os.path.join(self.folder, "polydem")
        shutil.copy(LAUNCHER, self.launcher)
        self.write("CMakeLists.txt", CMAKE_LISTS)
        self.write("CMakePresets.json", PRESETS)
        self.write("src/app/CMakeLists.txt", "add_executable(polydem main.f90)\n")
        self.write("src/app/main.f90", PROGRAM)
        self.write("tests/verification/CMakeLists.txt", "add_executable(verify ../../src/app/main.f90)\n")
        for place in HELP_PLACES:
            shutil.copytree(os.path.join(os.path.dirname(LAUNCHER), place), os.path.join(self.folder, place))
        self.write("postproc/pyproject.toml", "")
        self.write(".venv/.made", self.folder + "\n")
        self.write(".venv/.made_manual", "")
        for name in ("mpirun", "mpifort", "h5pfc"):
            self.write(f"mpi/{name}", MPIRUN)
            os.chmod(os.path.join(self.folder, "mpi", name), 0o755)
        self.environment = {name: value for name, value in os.environ.items()
                            if not name.startswith(("OMPI_", "OMP_", "POLYDEM_", "HDF5_", "CTEST_", "SLURM_"))}
        self.environment["PATH"] = os.path.join(self.folder, "mpi") + ":" + self.environment["PATH"]
        self.environment["NOTES"] = self.folder

    def write(self, path, text):
        path = os.path.join(self.folder, path)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)

    def write_command(self, name, text):
        """Make up a command of the bare machine; a link to the real one goes first, or that would be written to."""
        path = os.path.join(self.folder, "commands", name)
        if os.path.lexists(path):
            os.remove(path)
        self.write(path, text)
        os.chmod(path, 0o755)

    def call(self, *arguments, launcher=None, **environment):
        """Exit code, output and messages of a call."""
        result = subprocess.run([launcher or self.launcher, *arguments], capture_output=True, text=True, check=False,
                                env={**self.environment, **environment}, cwd="/")
        return result.returncode, result.stdout, result.stderr

    def read(self, name):
        with open(os.path.join(self.folder, name), encoding="utf-8") as file:
            return file.read().splitlines()

    def bare_machine(self):
        """Environment in which only the shell's own tools and the made-up apt-get are found."""
        commands = os.path.join(self.folder, "commands")
        os.mkdir(commands)
        for name in COMMANDS:
            found = shutil.which(name)
            if found:
                os.symlink(found, os.path.join(commands, name))
        self.write_command("apt-get", APT_GET)
        self.write_command("sudo", '#!/bin/bash\nexec "$@"\n')
        return {"PATH": commands, "REAL_PATH": os.environ["PATH"], "COMMANDS": commands,
                "APT_LOG": os.path.join(self.folder, "apt.log")}


class Words(Toy):
    """What needs no preparation."""

    def verbs(self):
        """Verbs that the launcher lists."""
        code, output, messages = self.call("--help")
        self.assertEqual((code, messages), (0, ""))
        return [verb for verb in re.findall(r"^  ([a-z]+) ", output, re.MULTILINE) if verb != "help"]

    def test_every_verb_has_help_at_once_and_without_any_tool(self):
        verbs = self.verbs()
        texts = [name for place in HELP_PLACES for name in os.listdir(os.path.join(self.folder, place))]
        self.assertEqual(sorted(verbs), sorted({name[:-len(".txt")] for name in texts} - {"table"}))
        machine = self.bare_machine()
        for verb in verbs:
            seconds = []
            for words in ((verb, "--help"), (verb, "-h"), ("help", verb), ("--help", verb), (verb, "x", "--a=b", "-h")):
                start = time.perf_counter()
                code, output, messages = self.call(*words, **machine)
                seconds.append(time.perf_counter() - start)
                self.assertEqual((code, messages), (0, ""))
                self.assertTrue(output.startswith(f"usage: ./polydem {verb}"), output)
                self.assertIn("\n  -h, --help  ", output)
            # Other work on this machine may delay some of the calls.
            self.assertLess(min(seconds), 0.3)
        for words in (["--help"], ["-h"], ["help"], ["help", "--help"], ["help", "help"]):
            self.assertEqual(self.call(*words, **machine), (0, self.call("--help")[1], ""))
        self.assertFalse(os.path.exists(os.path.join(self.folder, "build")))
        self.assertFalse(os.path.exists(machine["APT_LOG"]))

    def test_the_help_names_every_option_of_the_launcher(self):
        output = self.call("--help")[1]
        for word in ("--help", "--version", "--no-install", "--yes"):
            self.assertIn(f" {word}", output)
        self.assertIn("\n  --ranks R ", self.call("help", "run")[1])
        self.assertLessEqual(max(map(len, output.splitlines())), 120)

    def test_the_help_of_verify_names_every_benchmark(self):
        path = os.path.join(os.path.dirname(LAUNCHER), "tests/verification/benchmarks.f90")
        with open(path, encoding="utf-8") as file:
            text = file.read()
        listed, long = (re.findall(r"'([^']+)'", re.search(rf":: {name}\(\*\) = \[[^:]*::([^\]]*)\]", text)[1])
                        for name in ("benchmark_names", "long_names"))
        said = re.search(r"\nBenchmarks, .*:\n((?:  .*\n)+)", self.call("help", "verify")[1])[1].splitlines()
        names = [word for line in said for word in line[:24].replace("*", " ").replace(",", " ").split()]
        self.assertEqual(sorted([*listed, "exact"]), sorted(names))
        self.assertEqual(sorted(long), sorted(line.split()[0] for line in said if "*" in line[:24]))
        for line in said:
            self.assertRegex(line, r"^  [B0-9., *]{24}[a-z].* \(.*\)$|^  exact {19}[a-z].*\)$")

    def test_wrong_verbs_and_options_give_2(self):
        self.assertEqual(self.call()[0], 2)
        self.assertEqual(self.call("fly"), (2, "", "polydem: there is no verb fly; see ./polydem --help\n"))
        for words in (("help", "fly"), ("fly", "--help")):
            self.assertEqual(self.call(*words), (2, "", "polydem: there is no verb fly; see ./polydem --help\n"))
        said = "polydem: the verb comes first: ./polydem VERB --threads ...; see ./polydem --help\n"
        self.assertEqual(self.call("--threads", "2", "run", "a.nml"), (2, "", said))
        self.assertEqual(self.call("test", "a", "b")[0], 2)
        self.assertEqual(self.call("test", "--quick")[0], 2)
        self.assertEqual(self.call("build", "--quick")[0], 2)


class Ranks(Toy):
    """Runs of several processes; what mpirun does, the made-up one only notes."""

    def run_ranks(self, *arguments, **environment):
        """Output, messages and the noted environment of a call that ends with 0."""
        code, output, messages = self.call(*arguments, **environment)
        self.assertEqual(code, 0, messages)
        noted = dict(line.split("=", 1) for line in self.read("environment") if "=" in line)
        return output.splitlines(), messages.splitlines(), noted

    def test_ranks_are_taken_out_and_the_rest_goes_to_the_program_with_mpi(self):
        cores = len(os.sched_getaffinity(0))
        output, messages, noted = self.run_ranks("run", "my drum.nml", "--ranks", str(cores), "--set", "a.b=--ranks")
        words = ["run", "--threads", "1", "my drum.nml", "--set", "a.b=--ranks"]
        self.assertEqual(output, [f"{cores} ranks", *(f"<{word}>" for word in words)])
        self.assertEqual(messages, ["polydem: building program in build/mpi"])
        self.assertEqual((noted["OMPI_MCA_hwloc_base_binding_policy"], noted["OMP_PROC_BIND"]), ("none", "false"))
        self.assertNotIn("OMPI_MCA_mpi_yield_when_idle", noted)
        self.assertEqual(noted.get("OMPI_ALLOW_RUN_AS_ROOT"), "1" if os.getuid() == 0 else None)
        output, _, _ = self.run_ranks("check", "--ranks=1", "--threads=1", "--", "--ranks")
        self.assertEqual(output, ["1 ranks", "<check>", "<--threads=1>", "<-->", "<--ranks>"])
        self.assertEqual(self.call("run", "--ranks", "2", "--version")[1], "<run>\n<--version>\n")
        self.assertEqual(self.call("info", "--ranks", "2")[1], "<info>\n<--ranks>\n<2>\n")

    def test_cores_are_shared_and_too_many_ranks_take_turns(self):
        cores = len(os.sched_getaffinity(0))
        output, messages, _ = self.run_ranks("run", "x", "--ranks", "1")
        self.assertEqual(output[3], f"<{cores}>")
        output, messages, noted = self.run_ranks("run", "x", "--ranks", str(2*cores), OMP_NUM_THREADS="3,1")
        self.assertEqual(output[3], "<3>")
        self.assertEqual(messages, [f"polydem: warning: {2*cores} ranks of 3 threads take turns on {cores} cores"])
        self.assertEqual((noted["OMPI_MCA_rmaps_base_oversubscribe"], noted["OMPI_MCA_mpi_yield_when_idle"],
                          noted["OMP_WAIT_POLICY"]), ("1", "1", "passive"))

    def test_mpirun_that_went_after_the_build_is_installed_or_named(self):
        self.call("--version", POLYDEM_PRESET="mpi")
        machine = self.bare_machine()
        commands = machine["COMMANDS"]
        for name in ("gfortran", "cmake", "ninja", "git"):
            os.symlink(shutil.which(name), os.path.join(commands, name))
        for name in ("mpifort", "h5pfc"):
            os.symlink(os.path.join(self.folder, "mpi", name), os.path.join(commands, name))
        os.remove(os.path.join(commands, "apt-get"))
        code, output, messages = self.call("run", "x", "--ranks", "1", **machine)
        self.assertEqual((code, output), (1, ""))
        self.assertEqual(messages, "polydem: missing Debian packages: openmpi-bin\n"
                         "polydem: no apt-get here: please install them (or what they contain) yourself\n")
        real = os.path.join(self.folder, "mpi", "mpirun")
        self.write_command("apt-get", APT_GET + f'ln -sf "{real}" "$COMMANDS/mpirun"\n')
        code, output, messages = self.call("run", "x", "--ranks", "1", "--threads", "1", **machine)
        self.assertEqual((code, output.splitlines()[:2]), (0, ["1 ranks", "<run>"]), messages)
        self.assertIn("missing Debian packages: openmpi-bin", messages)

    def test_a_reader_who_stops_does_not_end_mpirun(self):
        self.call("--version", POLYDEM_PRESET="mpi")
        # As mpirun does, this one ends badly if it cannot write.
        self.write("mpi/mpirun", "#!/bin/bash\nfor k in {1..20000}; do echo line $k || exit 9; done\n"
                   'echo warning >&2 || exit 9\necho done >"$NOTES/done"\nexit 75\n')
        for streams in ("", "2>&1"):
            line = f"{{ '{self.launcher}' run x --ranks 1 --threads 1 {streams}; echo $? >'{self.folder}/code'; }}"
            shown = subprocess.run(["bash", "-c", f"{line} | head -n 1"], capture_output=True, text=True,
                                   env=self.environment, timeout=60, check=False)
            self.assertEqual((shown.stdout, self.read("code"), self.read("done")), ("line 1\n", ["75"], ["done"]))
            os.remove(os.path.join(self.folder, "done"))
        code, output, messages = self.call("run", "x", "--ranks", "1", "--threads", "1")
        self.assertEqual((code, len(output.splitlines()), messages), (75, 20000, "warning\n"))

    def test_a_small_stack_is_named(self):
        self.call("--version", POLYDEM_PRESET="mpi")
        for size, expected in ((64, 2), (1023, 2), (1024, 0), (8192, 0)):
            line = f"ulimit -s {size}; exec '{self.launcher}' run x --ranks 1 --threads 1"
            shown = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False,
                                   env=self.environment)
            self.assertEqual(shown.returncode, expected, shown.stderr)
            self.assertEqual(f"the stack may have {size} KiB only" in shown.stderr, expected == 2)

    def test_a_binding_of_the_user_stays(self):
        _, _, noted = self.run_ranks("run", "x", "--ranks", "1", "--threads", "1", OMP_PROC_BIND="close",
                                     OMPI_MCA_rmaps_base_mapping_policy="slot:PE=1")
        self.assertEqual(noted["OMP_PROC_BIND"], "close")
        self.assertNotIn("OMPI_MCA_hwloc_base_binding_policy", noted)

    def test_a_number_of_ranks_is_a_number(self):
        for words in (["0"], ["-1"], ["two"], ["1000000"], ["2.5"], [""], []):
            code, _, messages = self.call("run", "x.nml", "--ranks", *words)
            self.assertEqual(code, 2)
            self.assertIn("an integer from 1 to 999999 was expected", messages)
        self.assertFalse(os.path.exists(os.path.join(self.folder, "build")))

    def test_under_mpirun_every_rank_becomes_the_program_with_mpi(self):
        code, _, messages = self.call("run", "x.nml", OMPI_COMM_WORLD_SIZE="2")
        self.assertEqual(code, 1)
        self.assertIn("not built; call POLYDEM_PRESET=mpi ./polydem --version once outside mpirun", messages)
        self.assertFalse(os.path.exists(os.path.join(self.folder, "build")))
        self.assertEqual(self.call("--version", POLYDEM_PRESET="mpi")[:2], (0, "<--version>\n"))
        self.assertEqual(self.call("run", "x.nml", OMPI_COMM_WORLD_SIZE="2"), (0, "<run>\n<x.nml>\n", ""))
        code, _, messages = self.call("run", "x.nml", "--ranks", "2", OMPI_COMM_WORLD_SIZE="2")
        self.assertEqual(code, 2)
        self.assertIn("--ranks does not go with mpirun", messages)

    def begin(self, waits):
        """A call whose mpirun waits for signals."""
        for name in ("started", "heard"):
            if os.path.exists(os.path.join(self.folder, name)):
                os.remove(os.path.join(self.folder, name))
        run = subprocess.Popen([self.launcher, "run", "x.nml", "--ranks", "1"], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True, env={**self.environment, "MPIRUN_WAITS": waits})
        self.addCleanup(run.communicate)
        self.addCleanup(run.kill)
        self.await_file("started")
        return run

    def await_file(self, name):
        end = time.monotonic() + 60
        while not os.path.exists(os.path.join(self.folder, name)):
            self.assertLess(time.monotonic(), end)
            time.sleep(0.02)

    def test_the_first_signal_becomes_usr1_and_the_end_is_awaited(self):
        self.call("--version", POLYDEM_PRESET="mpi")
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGUSR1):
            run = self.begin("short")
            run.send_signal(number)
            self.assertEqual((run.wait(60), run.stderr.read()), (75, ""))
            self.assertEqual(self.read("heard"), ["USR1"])

    def test_the_second_signal_ends_all(self):
        self.call("--version", POLYDEM_PRESET="mpi")
        run = self.begin("long")
        run.send_signal(signal.SIGTERM)
        self.await_file("heard")
        run.send_signal(signal.SIGINT)
        self.assertEqual(run.wait(60), 128 + signal.SIGINT)
        self.assertEqual(self.read("heard"), ["USR1", "TERM"])
        self.assertIn("--continue goes on from the last checkpoint", run.stderr.read())


class Build(Toy):
    """What builds the toy."""

    def test_builds_once_and_passes_arguments_on(self):
        arguments = ["run", "my drum.nml", "--set", "time.dt=1e-5", "--threads", "2", "--force"]
        code, output, messages = self.call(*arguments)
        self.assertEqual((code, output), (0, "".join(f"<{word}>\n" for word in arguments)))
        self.assertEqual(messages, "polydem: building program in build/release\n")
        link = os.path.join(self.folder, "another name")
        os.symlink(self.launcher, link)
        self.assertEqual(self.call("--version", launcher=link), (0, "<--version>\n", ""))
        seconds = []
        for _ in range(9):
            start = time.perf_counter()
            self.assertEqual(self.call("info"), (0, "<info>\n", ""))
            seconds.append(time.perf_counter() - start)
        self.assertLess(min(seconds), 0.2)

    def test_verify_builds_and_runs_the_benchmarks_alone(self):
        code, output, messages = self.call("verify", "B8")
        self.assertEqual((code, output, messages), (0, "<B8>\n", "polydem: building verify in build/release\n"))
        self.assertFalse(os.path.exists(os.path.join(self.folder, "build", "release", "src", "app", "polydem")))

    def test_verify_runs_the_exact_comparison_behind_all_or_by_name(self):
        self.write("tests/verification/CMakeLists.txt", "add_executable(verify verify.f90)\n")
        ends = "   end do\n   if (word == 'B9') stop 1\n   if (word == 'B0') stop 2\n"
        self.write("tests/verification/verify.f90", PROGRAM.replace("   end do\n", ends))
        self.write("tests/geometry/check_exact_overlap.py", "import os, sys\nprint(*sys.argv[1:], sep=' ')\n"
                   "sys.exit(int(os.environ.get('EXACT_CODE', 0)))\n")
        streamed = os.path.join(self.folder, "build/release/tests/geometry/overlap_stream")
        exact = f"{streamed} --full --table results/verify"
        for words, expected in ((("verify",), exact + " --behind\n"),
                                (("verify", "exact"), exact + "\n"),
                                (("verify", "exact", "B8"), f"<B8>\n{exact} --behind\n"),
                                (("verify", "--quick"), "<--quick>\n")):
            self.assertEqual(self.call(*words)[:2], (0, expected))
        self.assertEqual(self.call("verify", "exact", EXACT_CODE="1")[0], 1)
        code, output, _ = self.call("verify", "B9", "exact")
        self.assertEqual((code, output), (1, f"<B9>\n{exact} --behind\n"))
        self.assertEqual(self.call("verify", "B0", "exact")[:2], (2, "<B0>\n"))

    def test_a_sweep_knows_the_program(self):
        self.write(".venv/bin/python", '#!/bin/bash\nprintf "<%s>\\n" "$@"\n')
        os.chmod(os.path.join(self.folder, ".venv/bin/python"), 0o755)
        program = os.path.join(self.folder, "build/release/src/app/polydem")
        code, output, _ = self.call("sweep", "run", "my sweep", "--cores", "2")
        self.assertEqual((code, os.path.exists(program)), (0, True))
        words = ["-m", "polydem_post", "sweep", "--program", program, "run", "my sweep", "--cores", "2"]
        self.assertEqual(output, "".join(f"<{word}>\n" for word in words))

    def test_a_changed_source_is_built_and_an_error_shown(self):
        self.call("--version")
        self.write("src/app/main.f90", PROGRAM.replace("'<'", "'['"))
        code, output, messages = self.call("--version")
        self.assertEqual((code, output), (0, "[--version>\n"))
        self.assertIn("building", messages)
        self.write("src/app/main.f90", PROGRAM.replace("integer :: k", ""))
        for _ in range(2):
            code, output, messages = self.call("--version")
            self.assertEqual((code, output), (1, ""))
            self.assertIn("Error: Symbol", messages)

    def test_ninja_knows_every_source(self):
        self.write("src/app/CMakeLists.txt", "add_executable(polydem main.f90 ../../elsewhere/idle.f90)\n")
        self.write("elsewhere/idle.f90", "subroutine idle()\nend subroutine idle\n")
        self.assertEqual(self.call("info")[0], 0)
        self.assertEqual(self.call("info"), (0, "<info>\n", ""))
        self.write("elsewhere/idle.f90", "subroutine idle(\nend subroutine idle\n")
        self.assertEqual(self.call("info")[0], 1)
        self.write("elsewhere/idle.f90", "subroutine idle()\nend subroutine idle\n")
        self.assertEqual(self.call("info"), (0, "<info>\n", "polydem: building program in build/release\n"))

    def test_without_ninja_or_compiler_the_built_program_runs(self):
        self.call("info")
        machine = self.bare_machine()
        self.write("src/app/main.f90", PROGRAM.replace("'<'", "'['"))
        for name in ("ninja", "cmake"):
            self.assertEqual(self.call("info", **machine), (0, "<info>\n", ""))
            os.symlink(shutil.which(name), os.path.join(machine["COMMANDS"], name))
        self.assertEqual(self.call("info", **machine), (0, "<info>\n", ""))
        self.assertFalse(os.path.exists(machine["APT_LOG"]))

    def test_the_first_call_keeps_the_working_folder(self):
        self.write("src/app/main.f90", "program here\n   open (10, file='mark')\nend program here\n")
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([self.launcher, "info"], env=self.environment, cwd=folder, capture_output=True, check=True)
            self.assertEqual(os.listdir(folder), ["mark"])

    def test_the_preset_chooses_the_folder_and_a_moved_project_is_built_anew(self):
        self.assertEqual(self.call("info", POLYDEM_PRESET="debug")[0], 0)
        self.assertFalse(os.path.exists(os.path.join(self.folder, "build", "release")))
        moved = self.folder + " moved"
        shutil.copytree(self.folder, moved, symlinks=True)
        self.addCleanup(shutil.rmtree, moved)
        code, output, messages = self.call("info", launcher=os.path.join(moved, "polydem"), POLYDEM_PRESET="debug")
        self.assertEqual((code, output), (0, "<info>\n"))
        self.assertIn("building", messages)

    def test_scale_needs_only_python(self):
        self.write(".venv/bin/python", '#!/bin/bash\nprintf "<%s>\\n" "$@"\n')
        os.chmod(os.path.join(self.folder, ".venv", "bin", "python"), 0o755)
        code, output, messages = self.call("scale", "my counts.csv", "--body", "1e-6")
        self.assertEqual((code, messages), (0, ""))
        self.assertEqual(output, "<-m>\n<polydem_post>\n<scale>\n<my counts.csv>\n<--body>\n<1e-6>\n")
        self.assertFalse(os.path.exists(os.path.join(self.folder, "build", "release", "src")))

    def test_workprecision_builds_three_precisions_and_hands_their_programs_on(self):
        self.write(".venv/bin/python", '#!/bin/bash\nprintf "%s\\n" "$@"\n')
        os.chmod(os.path.join(self.folder, ".venv", "bin", "python"), 0o755)
        code, output, messages = self.call("workprecision", "stack", "--repeats", "2")
        self.assertEqual(code, 0, messages)
        expected = ["-m", "polydem_post", "workprecision"]
        for precision, preset in (("double", "release"), ("single", "single"), ("quadruple", "quadruple")):
            program = os.path.join(self.folder, "build", preset, "src", "app", "polydem")
            self.assertTrue(os.access(program, os.X_OK))
            expected += ["--program", f"{precision}={program}"]
        self.assertEqual(output.splitlines(), [*expected, "stack", "--repeats", "2"])
        self.assertEqual(self.call("workprecision", "--report-only")[1].splitlines(), [*expected[:3], "--report-only"])

    def test_build_judges_every_preset(self):
        presets = ("release", "mpi", "single", "quadruple", "debug")
        verdict = re.compile(r"(\w+) +(ok, \d+ s|failed)")

        def judge(*names):
            code, output, messages = self.call("build", *names)
            found = [verdict.fullmatch(line).groups() for line in output.splitlines()]
            return code, [name for name, _ in found], {name for name, word in found if word == "failed"}, messages

        code, names, failed, messages = judge()
        self.assertEqual((code, names, failed), (0, list(presets), set()), messages)
        for name in presets:
            for path in ("src/app/polydem", "tests/verification/verify"):
                self.assertTrue(os.access(os.path.join(self.folder, "build", name, path), os.X_OK))
        self.write("src/app/CMakeLists.txt",
                   "add_executable(polydem main.f90)\ntarget_compile_options(polydem PRIVATE -Wall)\n"
                   "if(PROJECT_BINARY_DIR MATCHES quadruple)\n  target_sources(polydem PRIVATE wrong.f90)\nendif()\n"
                   "if(PROJECT_BINARY_DIR MATCHES single)\n  target_sources(polydem PRIVATE loose.f90)\nendif()\n")
        self.write("src/app/wrong.f90", "subroutine wrong()\n   integer :: k = 'no number'\nend subroutine wrong\n")
        self.write("src/app/loose.f90", "subroutine loose()\n   integer :: idle\nend subroutine loose\n")
        # A program that is there and up to date must not hide its warnings.
        self.assertEqual(self.call("--version", POLYDEM_PRESET="single")[0], 0)
        for _ in range(2):
            code, names, failed, messages = judge()
            self.assertEqual((code, names, failed), (1, list(presets), {"single", "quadruple"}), messages)
            self.assertIn("Warning: Unused variable", messages)
            self.assertIn("Error: ", messages)
        self.write("src/app/loose.f90", "subroutine loose()\nend subroutine loose\n")
        self.assertEqual(judge("single", "mpi")[:3], (0, ["single", "mpi"], set()))
        self.assertEqual(judge("single", "quadruple")[:3], (1, ["single", "quadruple"], {"quadruple"}))
        code, output, messages = self.call("build", "single", "triple")
        self.assertEqual((code, output), (2, ""))
        self.assertIn("there is no preset triple, but release", messages)

    def test_simultaneous_first_calls_build_once(self):
        calls = [subprocess.Popen([self.launcher, "info"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                  env=self.environment) for _ in range(3)]
        results = [call.communicate() for call in calls]
        self.assertEqual([output for output, _ in results], 3*["<info>\n"])
        self.assertEqual("".join(messages for _, messages in results).count("building"), 1)
        calls = [subprocess.Popen([self.launcher, "info"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                  env=self.environment) for _ in range(6)]
        self.assertEqual([call.communicate() for call in calls], 6*[("<info>\n", "")])

    def test_tests_are_chosen_by_label_and_counted_in_the_last_line(self):
        code, output, _ = self.call("test")
        self.assertNotEqual(code, 0)
        self.assertEqual(output.splitlines()[-1], "2 passed, 1 failed, 1 skipped")
        self.assertTrue(os.path.exists(os.path.join(self.folder, "build", "mpi", "src", "app", "polydem")))
        code, output, _ = self.call("test", "c.d")
        self.assertEqual((code, output.splitlines()[-1]), (0, "1 passed, 0 failed, 1 skipped"))
        code, output, _ = self.call("test", "broken")
        self.assertNotEqual(code, 0)
        self.assertEqual(output.splitlines()[-1], "0 passed, 1 failed")
        for label in ("fin", "c-d", "unheard_of"):
            code, _, messages = self.call("test", label)
            self.assertEqual(code, 2)
            self.assertIn(f"no test has the label {label}", messages)


class Stranger(Toy):
    """Calls by a user without rights; root may do everything, so that root becomes that user."""

    def call_as_stranger(self, *words, mask=0o022):
        def before():
            if os.getuid() == 0:
                os.setgroups([])
                os.setgid(65534)
                os.setuid(65534)
            os.umask(mask)
        done = subprocess.run([self.launcher, *words], capture_output=True, text=True, env=self.environment, cwd="/tmp",
                              preexec_fn=before, check=False)
        return done.returncode, done.stdout, done.stderr

    def open_to_all(self, mode):
        for folder, _, names in os.walk(self.folder):
            os.chmod(folder, mode)
            for name in names:
                path = os.path.join(folder, name)
                runs = path.endswith(("polydem", "mpirun"))
                if not os.path.islink(path):
                    os.chmod(path, mode if runs else mode & 0o666)

    def test_a_folder_that_may_only_be_read_is_named(self):
        self.open_to_all(0o555)
        self.addCleanup(self.open_to_all, 0o755)
        code, output, messages = self.call_as_stranger("run", "x.nml")
        self.assertEqual((code, output), (1, ""))
        self.assertEqual(len(messages.splitlines()), 1, messages)
        for part in (f"{self.folder} may not be written to", "copy the whole folder", "have its owner call"):
            self.assertIn(part, messages)
        self.assertFalse(os.path.exists(os.path.join(self.folder, "build")))
        # What is built already runs.
        self.open_to_all(0o755)
        self.call("--version")
        self.open_to_all(0o555)
        self.assertEqual(self.call_as_stranger("run", "x.nml"), (0, "<run>\n<x.nml>\n", ""))
        self.assertEqual(self.call_as_stranger("--help")[0], 0)

    def test_a_umask_that_takes_ones_own_rights_is_named(self):
        self.open_to_all(0o777)
        for mask in (0o777, 0o277, 0o700, 0o400, 0o200, 0o100):
            code, output, messages = self.call_as_stranger("info", mask=mask)
            self.assertEqual((code, output), (1, ""))
            self.assertEqual(len(messages.splitlines()), 1, messages)
            self.assertIn(f"the umask {mask:04o} takes from you the rights", messages)
            self.assertFalse(os.path.exists(os.path.join(self.folder, "build")))


class Streams(Toy):
    """Streams that are closed, and pipes that nobody reads."""

    def test_closed_streams(self):
        self.call("--version")
        for k in range(8):
            closed = " ".join(("<&-", ">&-", "2>&-")[i] for i in range(3) if k & 1 << i)
            for words, code in (("--help", 0), ("info", 0), ("fly", 2)):
                done = subprocess.run(["bash", "-c", f"'{self.launcher}' {words} {closed}"], capture_output=True,
                                      text=True, env=self.environment, check=False)
                self.assertEqual(done.returncode, code, (closed, words, done))
                self.assertEqual(done.stdout == "", k & 2 != 0 or code == 2)
                self.assertEqual(done.stderr == "", k & 4 != 0 or code == 0, (closed, words, done))

    def test_a_message_that_nobody_reads_does_not_end_a_call(self):
        reader, writer = os.pipe()
        os.close(reader)
        done = subprocess.run([self.launcher, "info"], stdout=subprocess.PIPE, stderr=writer, text=True,
                              env=self.environment, check=False)
        os.close(writer)
        self.assertEqual((done.returncode, done.stdout), (0, "<info>\n"))


class BareMachine(Toy):
    """What happens where the tools are missing."""

    def test_no_install_only_lists(self):
        machine = self.bare_machine()
        code, output, _ = self.call("run", "x.nml", "--no-install", **machine)
        self.assertEqual(code, 1)
        for package in ("gfortran", "cmake", "ninja-build", "git", "libhdf5-dev"):
            self.assertIn(package, output.split())
        self.assertNotIn("valgrind", output.split())
        self.assertIn("valgrind", self.call("cache", "results/bench", "--no-install", **machine)[1].split())
        parallel = self.call("run", "x.nml", "--ranks", "2", "--no-install", **machine)[1].split()
        for package in ("gfortran", "openmpi-bin", "libopenmpi-dev", "libhdf5-openmpi-dev"):
            self.assertIn(package, parallel)
        self.assertNotIn("libhdf5-dev", parallel)
        self.assertFalse(os.path.exists(machine["APT_LOG"]))

    def test_says_what_is_missing_installs_it_and_runs(self):
        machine = self.bare_machine()
        code, output, messages = self.call("info", **machine)
        self.assertEqual((code, output), (0, "<info>\n"), messages)
        said = messages.splitlines()
        self.assertEqual(said[0], "polydem: missing Debian packages: gfortran cmake ninja-build git libhdf5-dev")
        self.assertIn("building", said[-1])
        with open(machine["APT_LOG"], encoding="utf-8") as file:
            self.assertEqual(file.read().splitlines(), [
                "apt-get update",
                "apt-get install -y --no-install-recommends gfortran cmake ninja-build git libhdf5-dev"])
        self.assertEqual(self.call("--no-install", **machine)[0], 0)

    def call_on_a_terminal(self, machine, *words, answer=""):
        """Exit code, output and messages of a call whose input and messages are a terminal; the user is not root."""
        self.write_command("id", "#!/bin/bash\necho 1000\n")
        self.write_command("sudo", '#!/bin/bash\necho "sudo $*" >>"$APT_LOG"\nexec "$@"\n')
        shown, terminal = pty.openpty()
        with subprocess.Popen([self.launcher, *words], stdin=terminal, stdout=subprocess.PIPE, stderr=terminal,
                              text=True, env={**self.environment, **machine}, cwd="/") as call:
            os.close(terminal)
            os.write(shown, answer.encode())
            messages = b""
            while True:
                try:
                    messages += os.read(shown, 4096)
                except OSError:
                    break
            output = call.stdout.read()
        os.close(shown)
        return call.returncode, output, messages.decode().replace("\r\n", "\n")

    def test_a_terminal_is_asked_before_sudo(self):
        machine = self.bare_machine()
        question = "polydem: install them with sudo apt-get? [y/N] "
        for answer in ("n\n", "\n", "\x04"):
            code, output, messages = self.call_on_a_terminal(machine, "info", answer=answer)
            self.assertEqual((code, output), (1, ""))
            self.assertIn("missing Debian packages: gfortran cmake ninja-build git libhdf5-dev\n", messages)
            self.assertIn(question, messages)
            self.assertIn("polydem: nothing is installed; ", messages)
        self.assertFalse(os.path.exists(machine["APT_LOG"]))
        code, output, messages = self.call_on_a_terminal(machine, "info", "--threads", "2", answer="y\n")
        self.assertEqual((code, output), (0, "<info>\n<--threads>\n<2>\n"), messages)
        self.assertIn(question, messages)
        self.assertIn("sudo apt-get update", self.read("apt.log"))

    def test_yes_answers_in_advance_and_the_program_does_not_see_it(self):
        machine = self.bare_machine()
        code, output, messages = self.call_on_a_terminal(machine, "info", "--yes", "--", "--yes")
        self.assertEqual((code, output), (0, "<info>\n<-->\n<--yes>\n"), messages)
        self.assertNotIn("[y/N]", messages)
        self.assertIn("sudo apt-get update", self.read("apt.log"))

    def test_without_a_terminal_sudo_is_not_asked_for(self):
        machine = self.bare_machine()
        self.write_command("id", "#!/bin/bash\necho 1000\n")
        code, output, messages = self.call("info", **machine)
        self.assertEqual((code, output), (0, "<info>\n"), messages)
        self.assertNotIn("[y/N]", messages)

    def test_shows_why_the_installation_failed(self):
        code, output, messages = self.call("info", APT_FAILS="yes", **self.bare_machine())
        self.assertEqual((code, output), (1, ""))
        self.assertIn("no such package", messages)


if __name__ == "__main__":
    LAUNCHER = os.path.abspath(sys.argv.pop(1))
    unittest.main()
