"""The licences of a wheel: of the program, and of each library of the build machine that auditwheel copied into it."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

#: Where Debian has the texts to which the files copyright refer
COMMON = Path("/usr/share/common-licenses")
REFERENCE = re.compile(r"common-licenses/(\{[^}]*\}|[\w.+-]*\w)")
HEAD = """\
The libraries of this wheel, copied from packages of Debian: file, binary package with version, source package with
version. The file copyright of a package has its licences; common-licenses has the texts to which these files refer.
Debian has the sources: apt-get source PACKAGE=VERSION.

"""


class LicenceError(Exception):
    """A library of which no licence is known."""


def linked_libraries(binary: Path) -> dict[str, Path]:
    """The libraries that a program or library loads, by the names of the files that links point to."""
    shown = subprocess.run(["ldd", binary], capture_output=True, text=True, check=True).stdout
    places = [Path(place).resolve() for place in re.findall(r"=> (/\S+)", shown)]
    return {place.name: place for place in places}


def debian_package(library: Path) -> str:
    """The installed package that owns a library, or an empty string."""
    # A package may have its files in /lib, which is a link to /usr/lib.
    for place in (str(library), str(library).removeprefix("/usr")):
        found = subprocess.run(["dpkg", "-S", place], capture_output=True, text=True, check=False)
        if found.returncode == 0:
            return found.stdout.partition(": ")[0].split(",")[0]
    return ""


def find_licence(library: Path) -> tuple[Path, str, str]:
    """The file of licences of a library, its package with version, and the source of these."""
    package = debian_package(library)
    if package:
        fields = ("Package", "Version", "source:Package", "source:Version")
        form = "\n".join(f"${{{field}}}" for field in fields)
        name, version, source, source_version = subprocess.run(
            ["dpkg-query", "--show", f"--showformat={form}", package], capture_output=True, text=True,
            check=True).stdout.split("\n")
        text = Path("/usr/share/doc") / name / "copyright"
        about = f"{name} {version}", f"{source} {source_version}"
    else:
        # As make_hdf5.sh installs HDF5
        text = next(library.parents[1].glob("share/doc/*/copyright"), Path())
        if text.is_file():
            version = text.with_name("version").read_text(encoding="utf-8").strip()
            about = f"{version} (built without S3)", version
    if not text.is_file():
        raise LicenceError(f"{library}: no licence in {text}" if package else
                           f"{library}: no package of Debian has it, and there is no share/doc/*/copyright beside it")
    return text, *about


def common_texts(text: str) -> set[str]:
    """The names of the texts in COMMON to which a file of licences refers."""
    return {name for group in REFERENCE.findall(text) for name in group.strip("{}").split(",")}


def add_bundled(licences: Path, bundled: list[str], known: dict[str, Path]) -> None:
    """Fill a folder with the licences of libraries, named as auditwheel does, that are copies of known ones."""
    lines = []
    for name in sorted(bundled):
        original = re.sub(r"^([^.]*)-[0-9a-f]+\.", r"\1.", name)
        if original not in known:
            raise LicenceError(f"{name}: neither program nor library loads {original}")
        text, package, source = find_licence(known[original])
        lines.append(f"{name}: {package}, of {source}\n")
        folder = licences / package.split()[0]
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(text, folder / "copyright")
    for text in list(licences.glob("*/copyright")):
        for name in common_texts(text.read_text(encoding="utf-8")):
            if not (COMMON / name).is_file():
                raise LicenceError(f"{text.parent.name}: its licence refers to {COMMON / name}, which is not there")
            (licences / "common-licenses").mkdir(exist_ok=True)
            shutil.copyfile(COMMON / name, licences / "common-licenses" / name)
    (licences / "libraries.txt").write_text(HEAD + "".join(lines), encoding="utf-8")


def add_licences(tree: Path, own: Path, binaries: list[Path]) -> None:
    """Give an unpacked wheel its licences and name them in its metadata, as PEP 639 says."""
    (about,) = tree.glob("*.dist-info")
    licences = about / "licenses"
    licences.mkdir()
    shutil.copyfile(own, licences / own.name)
    known = {name: place for binary in binaries for name, place in linked_libraries(binary).items()}
    add_bundled(licences / "libraries", [path.name for path in tree.glob("*.libs/*")], known)
    metadata = (about / "METADATA").read_text(encoding="utf-8")
    names = [path.relative_to(licences).as_posix() for path in sorted(licences.rglob("*")) if path.is_file()]
    fields = ["Metadata-Version: 2.4", *(f"License-File: {name}" for name in names)]
    (about / "METADATA").write_text("\n".join([*fields, metadata.partition("\n")[2]]), encoding="utf-8")
