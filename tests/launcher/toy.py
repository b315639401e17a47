"""A toy project for tests of ./polydem, in a folder with a blank in its name.

The toy has the files that the launcher knows of and a program that prints its arguments. A made-up folder of
commands and a made-up apt-get, which links the real commands, stand for a machine with nothing installed.
"""

import os
import shutil
import subprocess
import tempfile
import time
import unittest

# The launcher that is tested
LAUNCHER = os.environ["POLYDEM_LAUNCHER"]

CMAKE_LISTS = """\
cmake_minimum_required(VERSION 3.25)
project(toy LANGUAGES Fortran)
add_subdirectory(src/app)
add_subdirectory(tests/verification)
enable_testing()
add_test(NAME good COMMAND ${CMAKE_COMMAND} -E true)
add_test(NAME bad COMMAND ${CMAKE_COMMAND} -E false)
add_test(NAME ranks COMMAND sh -c [[test -x "$POLYDEM_MPI_PROGRAM"]])
add_test(NAME checked COMMAND sh -c [[test -x "$POLYDEM_DEBUG_PROGRAM"]])
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
# Its only rank ends so, or lives; it does not look after it: the rank waits until it has become sleep.
if [[ $MPIRUN_WAITS = rank:* ]]; then
  waits='until read -r name <"/proc/$PPID/comm" && [ "$name" = sleep ]; do sleep 0.01; done; '
  (export OMPI_COMM_WORLD_RANK=0 && exec bash -c "$waits${MPIRUN_WAITS#*:}") &
  exec sleep "$MPIRUN_SECONDS"
fi
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

# How often a call is repeated that is delayed by other work
MOST_ATTEMPTS = 100

# Where the help texts of the verbs are
HELP_PLACES = ("src/app/help", "src/laboratory/help", "postproc/src/polydem_post/command_line/help",
               "postproc/src/polydem_lab/command_line/help")

# What ends an mpirun whose ranks have ended
WATCHER = "src/packaging/watch_ranks"

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
        os.makedirs(os.path.join(self.folder, "src", "packaging"))
        shutil.copy(os.path.join(os.path.dirname(LAUNCHER), WATCHER), os.path.join(self.folder, WATCHER))
        self.write("CMakeLists.txt", CMAKE_LISTS)
        self.write("CMakePresets.json", PRESETS)
        self.write("src/app/CMakeLists.txt", "add_executable(polydem main.f90)\nadd_custom_target(polydem_library)\n")
        self.write("src/app/main.f90", PROGRAM)
        self.write("tests/verification/CMakeLists.txt", "add_executable(verify ../../src/app/main.f90)\n")
        for place in HELP_PLACES:
            shutil.copytree(os.path.join(os.path.dirname(LAUNCHER), place), os.path.join(self.folder, place))
        self.write("postproc/pyproject.toml", "")
        self.write(".venv/.made", self.folder + "\n")
        self.write(".venv/.made_manual", "")
        self.write(".venv/.made_test", "")
        for name in ("mpirun", "mpifort", "h5pfc"):
            self.write(f"mpi/{name}", MPIRUN)
            os.chmod(os.path.join(self.folder, "mpi", name), 0o755)
        self.environment = {name: value for name, value in os.environ.items()
                            if not name.startswith(("GOMP_", "OMPI_", "OMP_", "POLYDEM_", "HDF5_", "CTEST_", "SLURM_"))}
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

    def assert_fast(self, limit, call):
        """Check that a call takes less than a number of seconds once: other work on this machine may delay it."""
        for _ in range(MOST_ATTEMPTS):
            start = time.perf_counter()
            call()
            seconds = time.perf_counter() - start
            if seconds < limit:
                return
        self.fail(f"{MOST_ATTEMPTS} calls took {limit} s or more each, the last one {seconds:.2f} s")

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
