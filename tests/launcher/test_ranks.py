"""Runs on several ranks."""

import os
import shutil
import signal
import subprocess
import time

from toy import APT_GET, Toy


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
        words = ["run", "my drum.nml", "--set", "a.b=--ranks"]
        self.assertEqual(output, [f"{cores} ranks", *(f"<{word}>" for word in words)])
        self.assertEqual(messages, ["polydem: building program in build/mpi"])
        self.assertEqual((noted["OMPI_MCA_hwloc_base_binding_policy"], noted["OMP_PROC_BIND"]), ("none", "false"))
        self.assertNotIn("OMPI_MCA_mpi_yield_when_idle", noted)
        self.assertEqual(noted.get("OMPI_ALLOW_RUN_AS_ROOT"), "1" if os.getuid() == 0 else None)
        output, _, _ = self.run_ranks("check", "--ranks=1", "--threads=1", "--", "--ranks")
        self.assertEqual(output, ["1 ranks", "<check>", "<--threads=1>", "<-->", "<--ranks>"])
        self.assertEqual(self.call("run", "--ranks", "2", "--version")[1], "<run>\n<--version>\n")
        self.assertEqual(self.call("info", "--ranks", "2")[1], "<info>\n<--ranks>\n<2>\n")

    def test_the_program_shares_the_cores_and_too_many_ranks_take_turns(self):
        cores = len(os.sched_getaffinity(0))
        output, messages, _ = self.run_ranks("run", "x", "--ranks", "1")
        self.assertEqual(output, ["1 ranks", "<run>", "<x>"])
        output, messages, noted = self.run_ranks("run", "x", "--ranks", str(2*cores), OMP_NUM_THREADS="3,1")
        self.assertEqual(output[3], "<3>")
        self.assertEqual(messages, [f"polydem: warning: {2*cores} ranks of 3 threads take turns on {cores} cores, "
                                    "which is slow"])
        self.assertEqual((noted["OMPI_MCA_rmaps_base_oversubscribe"], noted["OMPI_MCA_mpi_yield_when_idle"],
                          noted["OMP_WAIT_POLICY"]), ("1", "1", "passive"))

    def test_a_number_of_threads_that_is_none_is_refused_alike_for_one_process_and_ranks(self):
        for value in ("abc", "0", "-2", "1.5"):
            for words in (("run", "x"), ("run", "x", "--ranks", "2")):
                self.assertEqual(self.call(*words, OMP_NUM_THREADS=value), (
                    2, "", f"polydem: OMP_NUM_THREADS={value}: an integer from 1 to 999999 was expected\n"))
            self.assertEqual(self.call("run", "x", "--threads", "1", OMP_NUM_THREADS=value)[0], 0)

    def test_waiting_threads_soon_sleep_unless_the_user_has_chosen(self):
        for chosen, expected in (({}, "10000"), ({"GOMP_SPINCOUNT": "7"}, "7"), ({"OMP_WAIT_POLICY": "active"}, None)):
            noted = self.run_ranks("run", "x", "--ranks", "1", "--threads", "1", **chosen)[2]
            self.assertEqual(noted.get("GOMP_SPINCOUNT"), expected)

    def test_memory_comes_in_large_pages_unless_the_user_has_chosen(self):
        usual = "glibc.malloc.hugetlb=1:glibc.malloc.mmap_max=0:glibc.malloc.trim_threshold=4294967296"
        for chosen, expected in (({}, usual), ({"GLIBC_TUNABLES": ""}, ""), ({"GLIBC_TUNABLES": "a.b=1"}, "a.b=1")):
            noted = self.run_ranks("run", "x", "--ranks", "1", "--threads", "1", **chosen)[2]
            self.assertEqual(noted["GLIBC_TUNABLES"], expected)

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
                         "polydem: there is no apt-get: install these packages, or their programs, in another way\n")
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
                                   env=self.environment, timeout=600, check=False)
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
        self.assertIn("--ranks cannot be combined with mpirun", messages)

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
            self.assertEqual((run.wait(600), run.stderr.read()), (75, ""))
            self.assertEqual(self.read("heard"), ["USR1"])

    def test_the_second_signal_ends_all(self):
        self.call("--version", POLYDEM_PRESET="mpi")
        run = self.begin("long")
        run.send_signal(signal.SIGTERM)
        self.await_file("heard")
        run.send_signal(signal.SIGINT)
        self.assertEqual(run.wait(600), 128 + signal.SIGINT)
        self.assertEqual(self.read("heard"), ["USR1", "TERM"])
        self.assertIn("--continue continues from the last checkpoint", run.stderr.read())

    def hanging(self, end, seconds):
        """Environment of an mpirun that lives so long, whatever its rank does"""
        return {**self.environment, "MPIRUN_WAITS": f"rank:{end}", "MPIRUN_SECONDS": str(seconds)}

    def test_an_mpirun_that_hangs_after_its_ranks_is_killed(self):
        self.call("--version", POLYDEM_PRESET="mpi")
        killed = "polydem: all ranks had ended, but mpirun had not ten seconds later: it was killed\n"
        signalled = ("polydem: a signal ended the run; the same command with --continue continues from the last "
                     "checkpoint\n")
        # How the rank ends, how long mpirun lives, what the launcher gives and says
        cases = (("exit 3", 3600, 3, killed),
                 ("kill -KILL $$", 3600, 137, killed + signalled),
                 ("exec sleep 15", 14, 0, ""))
        runs = [subprocess.Popen([self.launcher, "run", "x.nml", "--ranks", "1", "--threads", "1"],
                                 stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                 env=self.hanging(end, seconds)) for end, seconds, _, _ in cases]
        for run, (end, _, code, messages) in zip(runs, cases):
            said = run.communicate(timeout=600)[1]
            self.assertEqual((run.returncode, said), (code, messages), end)

    def test_a_watched_mpirun_keeps_its_number_and_its_streams(self):
        watcher = os.path.join(self.folder, "src", "packaging", "watch_ranks")
        words = [watcher, "bash", "-c", "echo $$; exit 5"]
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as run:
            self.assertEqual(run.communicate()[0], f"{run.pid}\n")
        self.assertEqual(run.returncode, 5)
        words = [watcher, os.path.join(self.folder, "mpi", "mpirun"), "-n", "1"]
        hung = subprocess.run(words, check=False, timeout=600, env=self.hanging("exit 2", 3600))
        self.assertEqual(hung.returncode, -signal.SIGKILL)
