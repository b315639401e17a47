"""State hashes of six short runs: those of every machine, and the same with every choice of instructions.

usage: check_hashes.py SOURCES FOLDER PROGRAM [--renew]

The runs are repeated with each instruction set of the kernels that this processor has, with two threads, and with the
variants of the C library for newer processors switched off. All must have the hash in hashes.csv, which was made on
another machine. After a change that is meant to change bits, `--renew` writes hashes.csv if all agree.
"""

import csv
import os
import pathlib
import subprocess
import sys

from small_runs import RUNS, state_hash

TABLE = pathlib.Path(__file__).with_name("hashes.csv")
#: Variants of functions of the C library that need more than the base instruction set
OLD_LIBRARY = "glibc.cpu.hwcaps=-AVX,-AVX2,-AVX_Usable,-AVX2_Usable,-FMA,-FMA_Usable,-FMA4,-FMA4_Usable,-AVX512F"


def environments():
    """Environment and number of threads of each repetition, by name."""
    found = {"usual": (1, {}), "threads": (2, {}), "base": (1, {"POLYDEM_ISA": "base"}),
             "old library": (1, {"POLYDEM_ISA": "base", "GLIBC_TUNABLES": OLD_LIBRARY})}
    if os.path.exists("/proc/cpuinfo"):
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            if " avx2 " in file.read().replace("\n", " "):
                found["avx2"] = (2, {"POLYDEM_ISA": "avx2"})
    return found


def check_choice(program):
    """What is wrong with what `info` says of the instruction set, for good and bad choices."""
    for name, (_, variables) in environments().items():
        if "POLYDEM_ISA" in variables:
            done = ask(program, variables)
            if done.returncode != 0 or f"kernels    {variables['POLYDEM_ISA']}\n" not in done.stdout:
                yield f"{name}: info says {done.stdout}{done.stderr}"
    done = ask(program, {"POLYDEM_ISA": "sse"})
    if done.returncode != 2 or "POLYDEM_ISA is 'sse'; it must be base, avx2 or unset" not in done.stderr:
        yield f"a wrong choice ends with code {done.returncode}: {done.stdout}{done.stderr}"


def ask(program, variables):
    """What `info` says with these variables in the environment."""
    return subprocess.run([program, "info"], capture_output=True, text=True, check=False,
                          env={**os.environ, **variables})


def main(sources, folder, program, *options):
    sources, folder = pathlib.Path(sources), pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    with open(TABLE, encoding="utf-8", newline="") as file:
        expected = {row["scene"]: row["hash"] for row in csv.DictReader(file)}
    found, faults = {}, list(check_choice(program))
    for scene in RUNS:
        hashes = {name: state_hash(program, sources, scene, folder / "result", threads, variables)
                  for name, (threads, variables) in environments().items()}
        print(scene, hashes)
        found[scene] = hashes["usual"]
        if len(set(hashes.values())) != 1:
            faults.append(f"{scene}: the hash depends on the instructions or threads")
        elif "--renew" not in options and expected.get(scene) != found[scene]:
            faults.append(f"{scene}: {found[scene]}, but hashes.csv has {expected.get(scene)}")
    if "--renew" in options and not faults:
        with open(TABLE, "w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerows([("scene", "hash"), *found.items()])
    for fault in faults:
        print(fault)
    return int(bool(faults))


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
