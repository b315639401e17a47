"""The packages as a wheel, installed into a fresh virtual environment beside nothing but its dependencies."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(os.environ["POLYDEM_SOURCE_DIR"])


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
    for package in ("polydem_post", "polydem_lab"):
        for path in (sources / package).rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                assert str(path.relative_to(sources)) in inside


def test_an_installed_wheel_reads_and_exports(wheel, tmp_path, heap_with_contacts):
    # The dependencies are those of this environment: nothing is downloaded.
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(tmp_path / "venv")], check=True)
    python = tmp_path / "venv" / "bin" / "python"
    packages = next((tmp_path / "venv" / "lib").glob("python*")) / "site-packages"
    zipfile.ZipFile(wheel).extractall(packages)
    (packages / "dependencies.pth").write_text("\n".join(path for path in sys.path if path.endswith("-packages")))
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
