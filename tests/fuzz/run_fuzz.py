"""Spoilt input by the thousand: run_fuzz.py FUZZ INPUTS COUNT [KIND ...] [--first K] [--limit SECONDS].

The program FUZZ tries the cases of a kind one after the other. When it dies or hangs, the case is told, and the next
process goes on behind it. Whose fault a crash is, the stack tells: its innermost frame outside of the libraries of
language and sanitizers. HDF5 may crash on files whose bytes are not what they were (kinds named
..._bytes); a crash of the program, a hang, or a broken promise of a reader ends this script with code 1.
"""

import argparse
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

KINDS = ("namelist", "override", "scene", "bodies", "trace", "checkpoint", "packing", "result",
         "bodies_bytes", "trace_bytes", "checkpoint_bytes", "packing_bytes", "result_bytes")

#: What a process may take, in a build without sanitizers as address space [bytes]
MEMORY = 4 << 30

SANITIZERS = {
    # HDF5 is left to ask for more memory than there is; caches of HDF5 are no leaks of ours.
    "ASAN_OPTIONS": "detect_leaks=0:hard_rss_limit_mb=3000:max_allocation_size_mb=3000:allocator_may_return_null=1",
    "UBSAN_OPTIONS": "halt_on_error=1:print_stacktrace=1",
}

FRAME = re.compile(r"^ *#\d+ +0x([0-9a-f]+)", re.MULTILINE)

#: Libraries that only do what they are told
TOOLS = re.compile(r"/lib(asan|ubsan|gfortran|quadmath|c|m|pthread|gomp|gcc_s)[.-]|\[vdso\]")


def fault_of(messages, maps, fuzz):
    """Who crashed: 'HDF5', 'polydem' or 'unknown'; `maps` says which addresses belong to which file."""
    areas = []
    for line in maps.splitlines():
        words = line.split(maxsplit=5)
        low, high = (int(word, 16) for word in words[0].split("-"))
        areas.append((low, high, words[5] if len(words) == 6 else ""))
    for address in FRAME.findall(messages):
        owners = [path for low, high, path in areas if low <= int(address, 16) < high]
        if not owners or TOOLS.search(owners[0]):
            continue
        if "libhdf5" in owners[0]:
            return "HDF5"
        return "polydem" if owners[0] == fuzz else "unknown"
    return "unknown"


def case_of(folder):
    """Number of the case that was being tried; None if there is none."""
    try:
        return int.from_bytes((folder / "case").read_bytes()[:4], sys.byteorder)
    except FileNotFoundError:
        return None


def seconds_of(process):
    """Processor time that a process has used [s]; elapsed time where nobody tells."""
    try:
        words = Path(f"/proc/{process.pid}/stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()
        return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")
    except (OSError, IndexError):
        return time.monotonic()


def watch(process, folder, limit):
    """Wait for a process; give False if it had to be killed since a case took too long.

    What counts is processor time, since the machine may be busy; ten times that for one that only waits.
    """
    case, since, used = None, time.monotonic(), 0.0
    while process.poll() is None:
        time.sleep(0.02)
        now = case_of(folder)
        if now != case:
            case, since, used = now, time.monotonic(), seconds_of(process)
        elif time.monotonic() - since > limit and (seconds_of(process) - used > limit or
                                                   time.monotonic() - since > 10 * limit):
            process.kill()
            process.wait()
            return False
    return True


def stack_of_the_greedy(command, folder, environment):
    """Messages of a process that takes more and more memory, ended by a signal on its way so that its stack is told."""
    options = environment["ASAN_OPTIONS"] + ":handle_abort=1:hard_rss_limit_mb=0"
    with open(folder / "messages", "w+b") as messages:
        process = subprocess.Popen(command, cwd=folder, env={**environment, "ASAN_OPTIONS": options},
                                   stdout=subprocess.DEVNULL, stderr=messages)
        while process.poll() is None:
            time.sleep(0.02)
            pages = Path(f"/proc/{process.pid}/statm").read_text(encoding="utf-8").split()
            if pages and int(pages[1]) * resource.getpagesize() > MEMORY // 4:
                process.send_signal(signal.SIGABRT)
                process.wait()
        messages.seek(0)
        return messages.read().decode("utf-8", errors="replace")


def limit_memory():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def try_kind(fuzz, inputs, kind, first, last, limit):
    """All cases of a kind; gives the findings: case, what, messages."""
    findings = []
    environment = {**os.environ, **SANITIZERS, "OMP_NUM_THREADS": "1"}
    sanitized = b"__asan_init" in Path(fuzz).read_bytes()
    with tempfile.TemporaryDirectory() as top:
        folder = Path(top)
        while first <= last:
            with open(folder / "messages", "w+b") as messages:
                process = subprocess.Popen([fuzz, kind, inputs, str(first), str(last)], cwd=folder, env=environment,
                                           stdout=subprocess.DEVNULL, stderr=messages,
                                           preexec_fn=None if sanitized else limit_memory)  # noqa: PLW1509
                in_time = watch(process, folder, limit)
                messages.seek(0)
                text = messages.read().decode("utf-8", errors="replace")
            if in_time and process.returncode == 0:
                print(text.strip().splitlines()[-1])
                break
            case = case_of(folder)
            if case is None:
                findings.append((first, "unknown", text))
                break
            what = "hang"
            if in_time:
                if "hard rss limit exhausted" in text:
                    text += stack_of_the_greedy([fuzz, kind, inputs, str(case), str(case)], folder, environment)
                maps = (folder / "maps").read_text(errors="replace")
                what = "broken promise" if "broken promise" in text else fault_of(text, maps, fuzz)
            findings.append((case, what, text))
            first = case + 1
    return findings


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("fuzz")
    parser.add_argument("inputs")
    parser.add_argument("count", type=int)
    parser.add_argument("kinds", nargs="*")
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--limit", type=float, default=60.0, help="processor time that a case may take [s]")
    options = parser.parse_args()
    fuzz, inputs = os.path.realpath(options.fuzz), os.path.abspath(options.inputs)
    wrong = 0
    for kind in options.kinds or KINDS:
        began = time.monotonic()
        last = options.first + options.count - 1
        findings = try_kind(fuzz, inputs, kind, options.first, last, options.limit)
        excused = [case for case, what, _ in findings if what == "HDF5" and kind.endswith("_bytes")]
        print(f"{kind}: {options.count} cases in {time.monotonic() - began:.0f} s, "
              f"{len(findings) - len(excused)} findings, {len(excused)} crashes inside HDF5 {excused[:20] or ''}",
              flush=True)
        for case, what, text in findings:
            if case not in excused:
                print(f"{kind} {case}: {what}\n{text[:3000]}", flush=True)
                wrong += 1
    # The memory of the largest process says whether one blew up.
    most = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    print(f"most memory of a process: {most // 1024} MiB")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
