"""The packages as a wheel, and one with program and library; installed into a fresh virtual environment beside nothing
but its dependencies.
"""

import importlib
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(os.environ["POLYDEM_SOURCE_DIR"])
PROGRAM = Path(os.environ["POLYDEM_PROGRAM"])


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    # A copy without build products, since setuptools would write beside the sources.
    names = subprocess.run(["git", "ls-files", "postproc"], cwd=ROOT, capture_output=True, text=True, check=True)
    for name in [*names.stdout.split(), *added(ROOT)]:
        source, target = ROOT / name, folder / name
        if not name.startswith("postproc/verdicts/") and source.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(source.read_bytes())
    subprocess.run([sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation",
                    "--disable-pip-version-check", "--wheel-dir", str(folder), str(folder / "postproc")], check=True,
                   cwd=folder)
    return next(folder.glob("*.whl"))


def added(root):
    """Files that are not committed yet."""
    command = ["git", "ls-files", "--others", "--exclude-standard", "postproc"]
    return subprocess.run(command, cwd=root, capture_output=True, text=True, check=True).stdout.split()


def test_a_wheel_has_all_files(wheel):
    inside = set(zipfile.ZipFile(wheel).namelist())
    sources = ROOT / "postproc" / "src"
    for package in ("polydem", "polydem_post", "polydem_lab"):
        for path in (sources / package).rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                assert str(path.relative_to(sources)) in inside


def virtual_environment(folder):
    """An empty environment with the dependencies of this one: nothing is downloaded."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
    packages = next((folder / "lib").glob("python*")) / "site-packages"
    (packages / "dependencies.pth").write_text("\n".join(path for path in sys.path if path.endswith("-packages")))
    return packages


def test_an_installed_wheel_reads_and_exports(wheel, tmp_path, heap_with_contacts):
    packages = virtual_environment(tmp_path / "venv")
    python = tmp_path / "venv" / "bin" / "python"
    zipfile.ZipFile(wheel).extractall(packages)
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}

    def call(*words):
        done = subprocess.run([str(python), "-P", *words] if sys.version_info >= (3, 11) else [str(python), *words],
                              cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    where = call("-c", "import polydem_post; print(polydem_post.__file__)").strip()
    assert Path(where).is_relative_to(packages)
    read = "import sys; from polydem_post import Trajectory; print(Trajectory(sys.argv[1])[-1].contacts)"
    assert "pairs" in call("-c", read, str(heap_with_contacts.folder))
    for words in (["export", str(heap_with_contacts.folder), "--to", "csv", "-o", "out.csv"], ["--help"],
                  ["plot", "--help"], ["scale", "--help"]):
        assert call("-m", "polydem_post", *words)
    assert (tmp_path / "out.csv").exists()


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The environment of a wheel of this build, and its packages."""
    pytest.importorskip("auditwheel", reason="auditwheel is not installed: pip install 'postproc[recipes]'")
    build = PROGRAM.parents[2]
    if build.name != "release":
        pytest.skip("a wheel is made of a release build")
    folder = tmp_path_factory.mktemp("binary")
    subprocess.run([sys.executable, str(ROOT / "src/packaging/make_wheel.py"), str(build), str(folder)], check=True,
                   capture_output=True)
    (wheel,) = folder.glob("polydem-*-py3-none-manylinux_*.whl")
    packages = virtual_environment(folder / "venv")
    subprocess.run([sys.executable, "-m", "pip", "--python", str(folder / "venv"), "install", "--quiet", "--no-deps",
                    "--ignore-installed", "--no-index", "--disable-pip-version-check", str(wheel)], check=True)
    return folder / "venv" / "bin", packages


def call_installed(*words, **variables):
    """Exit code, output and messages of a command that does not see this environment."""
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "POLYDEM_LIBRARY")}
    done = subprocess.run([str(word) for word in words], env={**environment, **variables}, capture_output=True,
                          text=True, check=False)
    return done.returncode, done.stdout, done.stderr


def test_program_and_library_of_a_wheel_have_the_bits_of_the_build(installed, tmp_path):
    programs, packages = installed
    hashes = []
    for number, program in enumerate((PROGRAM, programs / "polydem")):
        code, _, errors = call_installed(program, "run", ROOT / "inputs/first.nml", "--threads", "1", "--set",
                                         "integrate.duration=0.02", "--set", f"output.folder={tmp_path / str(number)}")
        assert code == 0, errors
        hashes += re.findall(r"state hash\D*(\S+)", (tmp_path / str(number) / "log.txt").read_text())
    code, shown, errors = call_installed(programs / "python", "-c", f"""
import polydem
with polydem.Simulation({str(ROOT / "inputs/first.nml")!r}, {{"integrate.duration": 0.02}}) as sim:
    sim.run()
    print(polydem.library.find_library(), sim.state_hash)
""")
    assert code == 0, errors
    place, found = shown.split()
    assert Path(place).parent == packages / "polydem"
    assert len(hashes) == 2 and set(hashes) == {found}
    assert call_installed(programs / "polydem-post", "--version")[0] == 0
    assert call_installed(programs / "polydem", "run", "none.nml")[0] == 2


def test_a_wheel_has_its_libraries_but_for_libgomp(installed):
    _, packages = installed
    inside = {path.name.partition("-")[0] for path in (packages / "polydem.libs").iterdir()}
    assert {"libgfortran", "libhdf5_serial"} <= inside or {"libgfortran", "libhdf5"} <= inside
    assert "libgomp" not in inside
    for path in (packages / "polydem/libpolydem.so.0", packages / "polydem/bin/polydem"):
        code, shown, _ = call_installed("ldd", path)
        assert code == 0 and "not found" not in shown
        place = Path(re.search(r"libgfortran\S* => (\S+)", shown)[1])
        assert place.resolve().parent == (packages / "polydem.libs").resolve()


def test_a_wheel_has_the_licences_of_its_libraries(installed):
    _, packages = installed
    (licences,) = packages.glob("polydem-*.dist-info/licenses")
    assert (licences / "LICENSE").read_text() == (ROOT / "LICENSE").read_text()
    folder = licences / "libraries"
    listed = dict(re.findall(r"(?m)^(lib\S+\.so\S*): (\S+) \S", (folder / "libraries.txt").read_text()))
    assert set(listed) == {path.name for path in (packages / "polydem.libs").iterdir()}
    for package in listed.values():
        text = (folder / package / "copyright").read_text()
        assert "Copyright" in text or "(c)" in text.lower()
        for place in set(re.findall(r"/usr/share/(common-licenses/[A-Z][\w.-]*\w)", text)):
            assert (folder / place).stat().st_size > 1000
    assert "Version 3, 29 June 2007" in (folder / "common-licenses" / "GPL-3").read_text()
    named = re.findall(r"(?m)^License-File: (.*)$", (licences.parent / "METADATA").read_text())
    assert sorted(named) == sorted(path.relative_to(licences).as_posix() for path in licences.rglob("*")
                                   if path.is_file())


def test_a_library_without_a_licence_is_refused(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "src/packaging"))
    licences = importlib.import_module("wheel_licences")
    monkeypatch.setattr(licences, "debian_package", lambda library: "")
    monkeypatch.setattr(licences, "COMMON", tmp_path / "common")
    library = tmp_path / "lib" / "libthing-2.5.so.1"
    documents, made = tmp_path / "share/doc/thing", tmp_path / "made"
    documents.mkdir(parents=True)
    known = {library.name: library}

    def refused(name, words):
        with pytest.raises(licences.LicenceError, match=words):
            licences.add_bundled(made, [name], known)

    refused("libother-0123abcd.so.1", r"neither program nor library loads libother\.so\.1")
    refused("libthing-2-0123abcd.5.so.1", r"libthing-2\.5\.so\.1: no package of Debian has it")
    (documents / "copyright").write_text("Of us. See /usr/share/common-licenses/{GPL-9,MIT}'.")
    (documents / "version").write_text("thing 2.5-1\n")
    refused("libthing-2-0123abcd.5.so.1", r"thing: its licence refers to \S+/common/\S+, which is not there")
    (tmp_path / "common").mkdir()
    for name in ("GPL-9", "MIT"):
        (tmp_path / "common" / name).write_text("Do as you like.")
    licences.add_bundled(made, ["libthing-2-0123abcd.5.so.1"], known)
    assert {path.relative_to(made).as_posix() for path in made.rglob("*") if path.is_file()} == {
        "libraries.txt", "thing/copyright", "common-licenses/GPL-9", "common-licenses/MIT"}
    assert "libthing-2-0123abcd.5.so.1: thing 2.5-1" in (made / "libraries.txt").read_text()


def test_a_library_that_cannot_be_loaded_is_named(tmp_path):
    (tmp_path / "libpolydem.so.0").write_text("no library")
    load = "import polydem; polydem.version()"
    code, _, errors = call_installed(sys.executable, "-c", load, POLYDEM_LIBRARY=str(tmp_path / "libpolydem.so.0"))
    assert code == 1
    assert re.search(r"PolydemError: \S+libpolydem.so.0 cannot be loaded: .*(invalid ELF|too short)", errors)
    missing = """
import ctypes
def load(name):
    raise OSError("libgomp.so.1: cannot open shared object file")
ctypes.CDLL = load
"""
    code, _, errors = call_installed(sys.executable, "-c", f"{missing}{load}",
                                     POLYDEM_LIBRARY=str(tmp_path / "libpolydem.so.0"))
    assert code == 1 and "in Debian and Ubuntu it is in the package libgomp1" in errors
