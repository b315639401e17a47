"""Users without rights, closed streams, and machines with nothing installed."""

import os
import pty
import subprocess

from toy import Toy


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
        for part in (f"{self.folder} is not writable", "copy the whole folder", "have its owner call"):
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
            self.assertIn(f"the umask {mask:04o} removes your permissions", messages)
            self.assertFalse(os.path.exists(os.path.join(self.folder, "build")))


class Places(Toy):
    """Folders with odd names."""

    def call_in(self, name, *words):
        """Call the launcher of the project in a folder of another name."""
        usual, self.folder = self.folder, f"{self.folder} {name}"
        os.rename(usual, self.folder)
        try:
            return self.call(*words, launcher=os.path.join(self.folder, "polydem"))
        finally:
            os.rename(self.folder, usual)
            self.folder = usual

    def test_what_cmake_does_not_take_in_a_path_is_named(self):
        odd = ('a"b', "a\\b", "a;b", "a#b", "a<b", "a>b", "a|b", "a[b", "a]b", "a$b", "a\nb", "a\rb")
        for name in odd:
            code, output, messages = self.call_in(name, "run", "x.nml")
            self.assertEqual((code, output), (1, ""), name)
            self.assertEqual(len(messages.splitlines()), 1, messages)
            self.assertIn("CMake cannot build in ", messages)
            self.assertIn("its path must have none of", messages)
        # What is built already runs.
        self.call("--version")
        for name in odd:
            self.assertEqual(self.call_in(name, "run", "x.nml"), (0, "<run>\n<x.nml>\n", ""), name)

    def test_other_characters_are_no_obstacle(self):
        self.assertEqual(self.call_in("it's (a) & 5% ü*?!=+~^{}@`,:\t", "info")[:2], (0, "<info>\n"))


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
        try:
            shown, terminal = pty.openpty()
        except OSError as error:
            self.skipTest(f"no pseudo-terminal ({error}): mount devpts at /dev/pts")
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
