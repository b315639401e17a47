"""Tests of the job scripts for Slurm, without Slurm.

usage: test_slurm.py FOLDER

FOLDER holds job.sh, array.sh and ranks.sh. They run in a folder with a made-up polydem, which notes its arguments and
waits for a signal, and made-up scontrol and mpirun; the test stands for the queue.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

SCRIPTS = Path()

# Ends with the code in the file `code`; if there is none, waits for USR1, needs a while to write, and ends with 75.
POLYDEM = """\
#!/bin/bash
echo "$*" >>calls
echo "$OMP_NUM_THREADS $OMP_PROC_BIND" >environment
trap 'echo USR1 >>heard; sleep 0.3; echo saved >>heard; exit 75' USR1
trap 'echo TERM >>heard; exit 15' TERM
[ ! -f code ] || exit "$(<code)"
echo $$ >started
for k in {1..600}; do sleep 0.05; done
"""

SCONTROL = """\
#!/bin/bash
echo "$*" >>requeued
"""

# Notes its own words and becomes the program that stands behind them.
MPIRUN = """\
#!/bin/bash
while [ "$1" != ./polydem ]; do printf "%s\\n" "$1" >>ranks; shift; done
exec "$@"
"""

JOB = {"SLURM_JOB_ID": "4711", "SLURM_CPUS_PER_TASK": "3"}
RANKS = {**JOB, "SLURM_NTASKS": "5"}
ARRAY = {**JOB, "SLURM_ARRAY_JOB_ID": "4700", "SLURM_ARRAY_TASK_ID": "12"}


class Queue(unittest.TestCase):
    """A fresh folder for each test."""

    def setUp(self):
        top = tempfile.TemporaryDirectory(prefix="a job ")
        self.addCleanup(top.cleanup)
        self.folder = Path(top.name)
        for name, text in (("polydem", POLYDEM), ("scontrol", SCONTROL), ("mpirun", MPIRUN)):
            (self.folder / name).write_text(text, encoding="utf-8")
            (self.folder / name).chmod(0o755)

    def submit(self, script, environment, *arguments):
        names = {name: value for name, value in os.environ.items() if not name.startswith(("SLURM_", "OMP_"))}
        names.update(environment, PATH=f"{self.folder}:{os.environ['PATH']}")
        job = subprocess.Popen(["bash", str(SCRIPTS / script), *arguments], cwd=self.folder, env=names,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(job.communicate)
        self.addCleanup(job.kill)
        return job

    def read(self, name):
        path = self.folder / name
        return path.read_text(encoding="utf-8").splitlines() if path.exists() else []

    def await_start(self):
        for _ in range(30000):
            if self.read("started"):
                return
            time.sleep(0.02)
        self.fail("the run did not start")

    def test_the_end_of_a_run_is_the_end_of_the_job(self):
        for script, environment in (("job.sh", JOB), ("ranks.sh", RANKS), ("array.sh", ARRAY)):
            for code in (0, 1, 2, 3, 137):
                (self.folder / "code").write_text(str(code), encoding="utf-8")
                self.assertEqual(self.submit(script, environment, "x").wait(600), code)
        self.assertEqual(self.read("requeued"), [])

    def test_a_job_gives_the_run_its_threads_and_options(self):
        (self.folder / "code").write_text("0", encoding="utf-8")
        job = self.submit("job.sh", JOB, "inputs/my drum.nml", "--set", "scene.seed=2")
        self.assertEqual((job.wait(600), job.stderr.read()), (0, ""))
        self.assertEqual(self.read("calls"), ["run inputs/my drum.nml --set scene.seed=2 --threads 3 --continue"])
        self.assertEqual(self.read("environment"), ["3 close"])

    def test_a_job_of_several_ranks_gives_each_the_cores_of_a_task(self):
        (self.folder / "code").write_text("0", encoding="utf-8")
        job = self.submit("ranks.sh", RANKS, "inputs/my drum.nml")
        self.assertEqual((job.wait(600), job.stderr.read()), (0, ""))
        self.assertEqual(self.read("ranks")[:4], ["-n", "5", "--map-by", "slot:PE=3"])
        self.assertEqual(self.read("calls"), ["run inputs/my drum.nml --threads 3 --continue"])

    def test_a_job_of_an_array_runs_its_row(self):
        (self.folder / "code").write_text("0", encoding="utf-8")
        self.assertEqual(self.submit("array.sh", ARRAY, "results/sweep").wait(600), 0)
        self.assertEqual(self.read("calls"), ["sweep run results/sweep --rows 12 --cores 3 --threads 3"])

    def test_a_run_that_stopped_early_goes_back_into_the_queue(self):
        (self.folder / "code").write_text("75", encoding="utf-8")
        self.assertEqual(self.submit("job.sh", JOB, "x").wait(600), 75)
        self.assertEqual(self.submit("ranks.sh", RANKS, "x").wait(600), 75)
        self.assertEqual(self.submit("array.sh", ARRAY, "x").wait(600), 75)
        self.assertEqual(self.read("requeued"), ["requeue 4711", "requeue 4711", "requeue 4700_12"])

    def test_signals_of_the_queue_reach_the_run_as_usr1_and_its_end_is_awaited(self):
        for script, environment, queued in (("job.sh", JOB, "4711"), ("ranks.sh", RANKS, "4711"),
                                            ("array.sh", ARRAY, "4700_12")):
            for number in (signal.SIGUSR1, signal.SIGTERM):
                for name in ("started", "heard", "requeued"):
                    (self.folder / name).unlink(missing_ok=True)
                job = self.submit(script, environment, "x")
                self.await_start()
                job.send_signal(number)
                self.assertEqual(job.wait(600), 75)
                self.assertEqual(self.read("heard"), ["USR1", "saved"])
                self.assertEqual(self.read("requeued"), [f"requeue {queued}"])


if __name__ == "__main__":
    SCRIPTS = Path(sys.argv.pop(1)).resolve()
    unittest.main()
