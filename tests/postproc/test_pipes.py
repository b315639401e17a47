"""Files that users name: a pipe in place of one is refused, since opening it would wait until somebody writes."""

import os
import subprocess
import sys

import pytest

#: What reads a file -> call of it; FILE is the pipe
READERS = {
    "outlines": "from polydem_post.outlines import read_outlines as read; read(FILE, 'wkt')",
    "sweep table": "from polydem_post.sweep.batch import read_table as read; read(FILE)",
    "result": "from polydem_post import Trajectory as read; read(FILE)",
    "bench records": "from polydem_lab.bench.records import heading_of as read; read(FILE)",
    "bench": "from polydem_lab.comparison.bench_file import read_bench_file as read; read(FILE)",
    "plan": "from polydem_lab.comparison.plan import plan_of_file as read; read(FILE, FILE.parent)",
    "samples": "from polydem_lab.precision.samples import FILE as NAME, read_samples as read; "
               "FILE.rename(NAME); read(FILE.parent)",
    "trace of the cache": "from polydem_lab.costs.cache import count_one as read; read({}, FILE, *[None] * 4)",
    "trace of exchanges": "from polydem_lab.fine_grained.exchanges import way_in as read; read(FILE)",
}


@pytest.mark.parametrize("reader", READERS)
def test_a_pipe_is_refused(reader, tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    code = f"from pathlib import Path; FILE = Path('pipe.csv'); {READERS[reader]}"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False,
                          stdin=subprocess.DEVNULL, timeout=600)
    assert done.returncode == 1 and "it is a pipe or a device; write what it gives to a file first" in done.stderr, \
        done.stderr


@pytest.mark.parametrize("words", [["import", "pipe", "-o", "out.h5", "--from", "text"], ["plot", "pipe"],
                                   ["export", "pipe", "--to", "vtp"],
                                   ["sweep", "make", "pipe.csv", "base.nml", "--output", "swept"]])
def test_a_pipe_in_the_command_line_is_told_in_a_sentence(words, tmp_path):
    program = ["--program", "none"] if words[0] == "sweep" else []
    for name in ("pipe", "pipe.csv"):
        os.mkfifo(tmp_path / name)
    (tmp_path / "base.nml").write_text("&scene name = 'gas' /\n")
    done = subprocess.run([sys.executable, "-m", "polydem_post", words[0], *program, *words[1:]], cwd=tmp_path,
                          capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL, timeout=600)
    assert done.returncode == 2 and ": cannot be read (it is a pipe or a device" in done.stderr, done.stderr
    assert "Traceback" not in done.stderr
