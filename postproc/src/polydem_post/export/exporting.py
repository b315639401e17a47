"""Which files each format has, and how they are written: all of them or none."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from ..base.result_file import ResultError, cannot_write, is_of_run
from ..read.frames import Frame
from ..read.trajectory import Trajectory
from .csv_tables import write_balance_csv, write_bodies_csv, write_contacts_csv, write_vertices_csv
from .gsd_file import write_gsd
from .meshes import Mesh, body_mesh, contact_mesh, filled_contact_mesh
from .vtkhdf import VtkhdfFile
from .vtp import VTP_NAME, VtpFiles
from .xdmf import XdmfFile

#: Format -> end of the name of its first file
FORMATS = {"vtkhdf": ".vtkhdf", "vtp": ".pvd", "xdmf": ".xdmf", "gsd": ".gsd", "csv": ".csv"}

#: What reports progress: frames that are done, and all
Report = Callable[[int, int], None]


def export_result(run: Trajectory, form: str, output: str | os.PathLike[str], *, contacts: bool = True,
                  overwrite: bool = False, report: Report | None = None) -> list[Path]:
    """Write the frames of a trajectory in one of FORMATS; return the files.

    Coordinates are those before `import --origin`, except in a file of GSD, whose single precision does not hold
    them. Contacts are written if the run has them, unless `contacts` is false. `output` is the first file; the names
    of the others begin like it. Files that exist are an error unless `overwrite` is true. Memory does not grow with
    the number of frames.
    """
    if form not in FORMATS:
        raise ResultError(f"there is no format {form}; there are {', '.join(FORMATS)}")
    path = Path(output)
    if path.suffix.lower() != FORMATS[form]:
        raise ResultError(f"{path}: the name of a file for --to {form} ends with {FORMATS[form]}")
    if len(run) == 0:
        raise ResultError(f"{run.folder}: holds no frames")
    job = _Job(run if form == "gsd" else run.in_world(), path, contacts and run.has_contacts, report)
    targets = job.targets(form)
    for name, target in targets.items():
        _insist_on_free_place(name, target, overwrite)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return job.write(form, targets)
    except OSError as error:
        raise cannot_write(path, error) from error


def _insist_on_free_place(name: str, target: Path, overwrite: bool) -> None:
    """Refuse to replace what exists, unless that is wished, and what no export can have made in any case."""
    try:
        str(target).encode()
    except UnicodeEncodeError as error:
        raise ResultError(f"{target}: is no name in UTF-8, which the files of an export must have; choose one with "
                          "--output") from error
    if not target.exists():
        return
    if not overwrite:
        raise ResultError(f"{target}: exists already; --force replaces it")
    if target.is_dir() != (name == "folder"):
        raise ResultError(f"{target}: is {'a folder' if target.is_dir() else 'a file'}, which an export does not "
                          "replace; choose another name")
    if name == "folder":
        others = [path.name for path in target.iterdir() if not VTP_NAME.fullmatch(path.name)]
        if others:
            raise ResultError(f"{target}: holds {others[0]}, which no export made; choose another name or remove it")
    elif target.suffix == ".h5" and is_of_run(target):
        raise ResultError(f"{target}: is a file of a run, which an export does not replace; choose another name")


def _remove(path: Path) -> None:
    """Remove a file or a folder, if it is there."""
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


class _Job:
    """One export: files are written under other names and renamed when all are complete."""

    def __init__(self, run: Trajectory, path: Path, with_contacts: bool, report: Report | None):
        self.run, self.path, self.with_contacts = run, path, with_contacts
        self.report = report or (lambda done, total: None)

    def targets(self, form: str) -> dict[str, Path]:
        """The files that a format has, and its folder."""
        suffix = FORMATS[form]
        found = {"bodies": self.path}
        if self.with_contacts and form != "gsd":
            found["contacts"] = self._beside(f"_contacts{suffix}")
        if form == "vtp":
            found["folder"] = self._beside("_vtp")
        if form == "xdmf":
            found |= {f"{name}_data": path.with_suffix(".h5") for name, path in found.items()}
        if form == "csv":
            found["vertices"] = self._beside("_vertices.csv")
            if self.run.energy_balance:
                found["balance"] = self._beside("_energy.csv")
        return found

    def _beside(self, end: str) -> Path:
        return self.path.with_name(self.path.stem + end)

    def write(self, form: str, targets: dict[str, Path]) -> list[Path]:
        """Write all files of a format."""
        unfinished = {name: path.with_name(f".{path.name}.unfinished") for name, path in targets.items()}
        for path in unfinished.values():  # of an export that was killed
            _remove(path)
        try:
            if form in ("vtkhdf", "vtp", "xdmf"):
                self._write_meshes(form, targets, unfinished)
            elif form == "gsd":
                write_gsd(self.run, unfinished["bodies"], self.with_contacts)
            else:
                self._write_csv(unfinished)
            for name, path in targets.items():
                _remove(path)
                os.replace(unfinished[name], path)
        finally:
            for path in unfinished.values():
                _remove(path)
        return list(targets.values())

    def _write_csv(self, files: dict[str, Path]) -> None:
        write_bodies_csv(self.run, files["bodies"])
        write_vertices_csv(self.run, files["vertices"])
        if "contacts" in files:
            write_contacts_csv(self.run, files["contacts"])
        if "balance" in files:
            write_balance_csv(self.run, files["balance"])

    def _write_meshes(self, form: str, targets: dict[str, Path], files: dict[str, Path]) -> None:
        makers: dict[str, Callable[[Frame], Mesh]] = {
            "bodies": lambda frame: body_mesh(frame, self.with_contacts),
            "contacts": contact_mesh if form == "vtp" else filled_contact_mesh}
        if form == "vtp":
            files["folder"].mkdir()
        writers: dict[str, VtkhdfFile | VtpFiles | XdmfFile] = {}
        with ExitStack() as stack:
            for name in makers:
                if name not in files:
                    continue
                if form == "vtkhdf":
                    writers[name] = VtkhdfFile(files[name])
                elif form == "vtp":
                    writers[name] = VtpFiles(files[name], files["folder"], targets["folder"].name, name)
                else:
                    data = f"{name}_data"
                    writers[name] = XdmfFile(files[name], files[data], targets[data].name)
                stack.callback(writers[name].close)
            for done, frame in enumerate(self.run, 1):
                for name, writer in writers.items():
                    writer.add(frame.time, makers[name](frame))
                self.report(done, len(self.run))
