"""What the MPI library says of its own, in a container without /sys, say, is not taken for words of the program."""

import shutil

import pytest
import runs
from runs import PARALLEL, complaints, contents, count, differences, run, state_hash
from scenes import write_scene

#: Warnings in the style of Open MPI and of hwloc, and a line that begins like one of ours
NOISE = """\
--------------------------------------------------------------------------
WARNING: Open MPI will create a shared memory backing file in a directory that
appears to be mounted on a network filesystem.

  Local host: here
  state hash: none
--------------------------------------------------------------------------
[here:00042] 3 more processes have sent help message help-opal-shmem-mmap.txt / mmap on nfs
****************************************************************************
* hwloc has encountered an error: no /sys
 polydem: not this
steps none
"""


@pytest.fixture
def noisy(tmp_path, monkeypatch):
    """mpirun that warns before and after, of ranks that warn: on standard error, and on standard output."""
    real = shutil.which("mpirun", path=runs.ENVIRONMENT["PATH"])
    (tmp_path / "noise").write_text(NOISE, encoding="utf-8")
    words = f"cat '{tmp_path}/noise'; cat '{tmp_path}/noise' >&2\n"
    for name, text in (("mpirun", f'{words}"{real}" "$@"\ncode=$?\n{words}exit $code\n'),
                       ("rank", f'{words}exec "{PARALLEL}" "$@"\n')):
        path = tmp_path / "noisy" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(f"#!/bin/sh\n{text}", encoding="utf-8")
        path.chmod(0o755)
    monkeypatch.setitem(runs.ENVIRONMENT, "PATH", f"{tmp_path / 'noisy'}:{runs.ENVIRONMENT['PATH']}")
    monkeypatch.setattr(runs, "PARALLEL", str(tmp_path / "noisy" / "rank"))


def test_a_run_is_judged_by_its_own_lines(noisy, expected, tmp_path):
    write_scene(tmp_path / "scene.nml", "gas")
    output, message = run(tmp_path / "scene.nml", tmp_path / "result", 2)
    # Two of mpirun and one of each rank
    assert message.count("hwloc") >= 4 and output.count("hwloc") >= 4
    assert complaints(message) == []
    assert state_hash(output) == expected("gas").hash
    assert (count(output, "steps"), count(output, "contacts")) == (expected("gas").steps, expected("gas").contacts)
    assert differences(expected("gas").contents, contents(tmp_path / "result")) == []


def test_an_error_among_foreign_lines_is_ours(noisy, tmp_path):
    write_scene(tmp_path / "scene.nml", "gas")
    options = ("--set", "forces.friction=exact")
    _, message = run(tmp_path / "scene.nml", tmp_path / "result", 2, 1, options, code=2)
    found = complaints(message)
    assert len(found) == 1 and "exact friction" in found[0], message


@pytest.mark.parametrize("line", (
    "polydem: scene.nml: no such file",
    "polydem: warning: 3 ranks of 2 threads take turns on 2 cores, which is slow",
    "At line 12 of file x.f90 (unit = 11, file = 'scene.nml')",
    "Fortran runtime error: End of file",
    "Error termination. Backtrace:",
    "Note: The following floating-point exceptions are signalling: IEEE_INVALID_FLAG",
    "Program received signal SIGSEGV: Segmentation fault - invalid memory reference.",
    "==42==ERROR: AddressSanitizer: heap-buffer-overflow on address 0x1",
    "x.f90:3:4: runtime error: signed integer overflow",
))
def test_no_line_of_ours_is_passed_over(line):
    assert complaints(NOISE + line + "\n" + NOISE) == [line]
