"""Every block of commands on the pages is run, in a folder that looks like the repository, or excused with a reason.

POLYDEM_PAGES=NAME,... chooses pages, POLYDEM_TIMES=1 prints the time of each block.
"""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest
from page_commands import FILES, PageError, blocks_of
from test_pages import PAGES, ROOT

PRESET = os.environ.get("POLYDEM_PRESET") or Path(os.environ["POLYDEM_PROGRAM"]).parents[2].name
LAUNCHED = Path(os.environ["POLYDEM_PROGRAM"]) == ROOT / "build" / PRESET / "src" / "app" / "polydem"
PATIENCE = 900  # s

NAMES = [str(page.relative_to(ROOT)) for page in PAGES]
CHOSEN = os.environ.get("POLYDEM_PAGES", ",".join(NAMES)).split(",")


def make_folder(folder):
    """A folder in which the commands of the pages work, and write results of their own."""
    for path in ROOT.iterdir():
        if path.name not in (".git", "results"):
            (folder / path.name).symlink_to(path)


def environment():
    """The environment of the commands: threads do not spin, the launcher takes this build."""
    words = {"OMP_NUM_THREADS": "2", "OMP_WAIT_POLICY": "passive", "POLYDEM_PRESET": PRESET, "MPLBACKEND": "Agg",
             "PYTHONPATH": str(ROOT / "postproc" / "src")}
    return {**os.environ, **words}


def run_block(folder, commands, language):
    """Run commands; anything but exit code 0 fails."""
    shell = {"sh": ["bash", "-euo", "pipefail", "-c", commands], "python": [sys.executable, "-c", commands]}
    began = time.perf_counter()
    done = subprocess.run(shell[language], cwd=folder, env=environment(), stdin=subprocess.DEVNULL, timeout=PATIENCE,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if os.environ.get("POLYDEM_TIMES"):
        print(f"{time.perf_counter() - began:6.1f} s  {commands.splitlines()[0]}", file=sys.__stderr__)
    assert done.returncode == 0, f"\n{commands}\nends with code {done.returncode}:\n{done.stdout[-3000:]}"


@pytest.mark.skipif(not LAUNCHED, reason="the launcher starts programs of build/PRESET only")
@pytest.mark.parametrize("name", CHOSEN)
def test_the_commands_of_a_page_work(name, tmp_path):
    make_folder(tmp_path)
    for block in blocks_of((ROOT / name).read_text(encoding="utf-8")):
        if block.language in FILES:
            (tmp_path / block.file).write_text(block.text, encoding="utf-8")
        if block.language in ("sh", "python") and block.commands is not None:
            run_block(tmp_path, block.notes.get("tests run first", "true"), "sh")
            run_block(tmp_path, block.commands, block.language)


def test_a_command_that_fails_is_found(tmp_path):
    with pytest.raises(AssertionError, match="code 3"):
        run_block(tmp_path, "false || (exit 3)\ntrue\n", "sh")


@pytest.mark.parametrize("text", [
    "    ./polydem run inputs/drum.nml\n",
    "```\n./polydem run inputs/drum.nml\n```\n",
    "```sh\n./polydem run inputs/drum.nml\n```\n<!-- tests run: ./polydem check inputs/drum.nml -->\n",
    "```sh\n./polydem run a.nml   # comment\n./polydem run b.nml\n```\n<!-- tests run: true -->\n",
    "```sh\n./polydem run inputs/drum.nml\n```\n<!-- tests do not run this: why -->\n",
    "```sh\n./polydem run inputs/drum.nml\n```\n<!-- tests skip: takes a week on one core -->\n",
    "```sh\n./polydem run inputs/drum.nml\n```\nText\n<!-- tests do not run this: takes a week on one core -->\n"])
def test_a_block_that_is_neither_run_nor_excused_is_found(text):
    with pytest.raises(PageError):
        blocks_of(text)


EXCUSE = "<!-- tests do not run this: takes a week on one core -->\n"
VARIANT = "<!-- tests run: true -->\n"


@pytest.mark.parametrize("text", [
    EXCUSE,
    "Text\n\n" + EXCUSE + "\n",
    EXCUSE + "```sh\ntrue\n```\n",
    "```sh\ntrue\n```\n\n" + EXCUSE,
    "```text\n./polydem run inputs/drum.nml\n```\n" + EXCUSE,
    "`a.csv`\n```csv\na,b\n```\n" + EXCUSE,
    "```sh\n```\n" + EXCUSE,
    "```sh\n# ./polydem run inputs/drum.nml\n\n```\n" + EXCUSE,
    "```python\n# nothing\n```\n" + EXCUSE,
    "```sh\ntrue\n```\n" + EXCUSE + EXCUSE,
    "```sh\ntrue\n```\n" + VARIANT + VARIANT,
    "```sh\ntrue\n```\n" + EXCUSE + VARIANT,
    "```sh\ntrue\n```\n<!--tests do not run this: takes a week on one core -->\n",
    " " + EXCUSE,
    "```sh\ntrue\n```\n<!-- tests do not run this: takes a week on one core\n",
    "```f90\nend\n```\n<!-- tests run first: true -->\n",
    "```sh\ntrue\n"])
def test_a_note_that_matches_no_commands_is_found(text):
    with pytest.raises(PageError):
        blocks_of(text)


def test_the_tests_that_excuses_name_exist():
    build = Path(os.environ["POLYDEM_PROGRAM"]).parents[2]
    listed = subprocess.run(["ctest", "--test-dir", str(build), "-N"], capture_output=True, text=True, check=True)
    known = set(re.findall(r"^ *Test +#\d+: (\S+)", listed.stdout, re.MULTILINE))
    for path in (ROOT / "tests").rglob("CMakeLists.txt"):  # also those that another build has
        known |= set(re.findall(r"\bNAME (\w+)", path.read_text(encoding="utf-8")))
    named = {name for page in PAGES for block in blocks_of(page.read_text(encoding="utf-8"))
             for name in re.findall(r"tests? `(\w+)`", block.notes.get("tests do not run this", ""))}
    assert len(named) > 5 and named - known == set()


def test_an_excuse_of_commands_is_accepted():
    block, = blocks_of("```sh\n# a note\n./polydem run inputs/drum.nml\n```\n" + EXCUSE)
    assert block.commands is None


def test_a_variant_has_more_words():
    block, = blocks_of("```sh\n./polydem run a.nml   # a note\n```\n"
                       "<!-- tests run: ./polydem run --threads 1 a.nml --set integrate.duration=1 -->\n")
    assert block.commands == "./polydem run --threads 1 a.nml --set integrate.duration=1\n"
