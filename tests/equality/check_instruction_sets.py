"""Disassemble all objects of the program: no fused operation anywhere, AVX only in kernels for AVX2.

usage: check_instruction_sets.py BUILD      a built folder, with compile_commands.json

A fused multiply-add rounds once where two operations round twice, so its bits differ from those of a processor without
it; compilers emit it in spite of -ffp-contract=off (GCC bug 107647). One file is compiled anew for a processor that has
fused operations, as by FFLAGS=-march=native or by Spack. Ends with code 77 (skipped) without objdump.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

#: Fused operations of x86-64 and of AArch64
FUSED = re.compile(r"vfn?m(add|sub|addsub|subadd)\w+|fn?m(add|sub)|fml[as]\w*")
#: AVX of any width: all its instructions, and only they among those of a compiler, begin with v
AVX = re.compile(r"v[a-z]\w+")


def mnemonics(path):
    """The different mnemonics of an object file."""
    listing = subprocess.run(["objdump", "-d", "--no-show-raw-insn", path], check=True, capture_output=True, text=True)
    found = (re.match(r"\s+[0-9a-f]+:\s+(?:(?:rep|repz|repnz|lock|data16|bnd)\s+)*(\S+)", line)
             for line in listing.stdout.splitlines())
    return {match[1] for match in found if match}


def is_wide(path):
    """Whether an object is a kernel for AVX2."""
    return os.path.basename(path).split(".")[0].endswith("_avx2")


def objects_of(build):
    """Paths of the objects of the layers and the program, and the entry of the file that turns vertices."""
    with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as file:
        entries = json.load(file)
    found, turns = [], None
    for entry in entries:
        words = shlex.split(entry["command"])
        path = os.path.join(entry["directory"], words[words.index("-o") + 1])
        if os.path.relpath(path, build).startswith("src" + os.sep) and path.endswith(".f90.o"):
            found.append(path)
            turns = entry if os.path.basename(path) == "bodies.f90.o" else turns
    return found, turns


def faults_of(path, found):
    """What is wrong with an object that has these mnemonics."""
    fused = sorted(name for name in found if FUSED.fullmatch(name))
    wide = sorted(name for name in found if AVX.fullmatch(name))
    if fused:
        yield f"{path} has fused operations: {' '.join(fused)}"
    if wide and not is_wide(path):
        yield f"{path} has AVX and is for all processors: {' '.join(wide[:5])}"


def try_fused(compiler, folder):
    """Compile a product and a sum for a processor with fused operations, contracted: the check must find it."""
    source, result = os.path.join(folder, "fused.f90"), os.path.join(folder, "fused_avx2.f90.o")
    with open(source, "w", encoding="utf-8") as file:
        file.write("real function fused(a, b, c)\n real :: a, b, c\n fused = a*b + c\nend function fused\n")
    done = subprocess.run([compiler, "-O2", "-mfma", "-ffp-contract=fast", "-c", source, "-o", result], check=False)
    return done.returncode != 0 or len(list(faults_of(result, mnemonics(result)))) == 1


def try_named_processor(entry, folder):
    """Compile a file, as the build does, for a processor with fused operations: faults."""
    compiler, *words = shlex.split(entry["command"])
    result = os.path.join(folder, "bodies_avx2.f90.o")
    words[words.index("-o") + 1] = result
    # The modules of its layer are read where the build has them, and written elsewhere.
    words = [word.replace("-J", "-I") if word.startswith("-J") else word for word in words]
    subprocess.run([compiler, "-march=skylake-avx512", *words, f"-J{folder}"], check=True, cwd=entry["directory"])
    return list(faults_of(result, mnemonics(result)))


def main(build):
    if not shutil.which("objdump"):
        sys.exit(77)
    objects, turns = objects_of(build)
    found = {path: mnemonics(path) for path in objects}
    faults = [fault for path, names in found.items() for fault in faults_of(path, names)]
    if not any(map(is_wide, objects)):
        faults.append("there is no kernel for AVX2")
    if os.uname().machine == "x86_64":
        kernels = [path for path in objects if is_wide(path)]
        faults += [f"{path} has no AVX" for path in kernels if not any(map(AVX.fullmatch, found[path]))]
        with tempfile.TemporaryDirectory() as folder:
            if not try_fused(shlex.split(turns["command"])[0], folder):
                faults.append("the check does not find a fused operation")
            faults += try_named_processor(turns, folder)
    print(f"{len(objects)} objects, {sum(map(is_wide, objects))} for AVX2")
    for fault in faults:
        print(fault)
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
