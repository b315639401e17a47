"""The folder of a result: its segments, and whether its files are what the run wrote."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np

from ..base.result_file import OPEN_SUFFIX, ResultError, is_refused, reading
from .manifest import MANIFEST, Closed, Manifest, ManifestError, check_bytes, check_sizes, read_manifest
from .segments import SEGMENT_NAME, Segment, check_names, check_steps, find_segments, read_segment


class NoManifest(UserWarning):
    """A result without a manifest is read: whether its files are what the run wrote is not known."""


class ResultFolder:
    """The segments of a result, or one of them, and its profile; each file is checked when it is first used."""

    def __init__(self, path: Path, check: bool):
        if not path.exists():
            raise ResultError(f"{path}: there is no such file or folder")
        if path.is_file() and path.name == "profile.h5":
            path = path.parent
        self.folder = path if path.is_dir() else path.parent
        self.profile_path = self.folder / "profile.h5"
        self.segments = find_segments(path, _closed_files(path) if check else {}) if path.is_dir() else [
            read_segment(path)]
        if not self.segments and not self.profile_path.exists():
            raise ResultError(f"{path}: holds no result (neither trajectory_0001.h5 nor profile.h5){_nearby(path)}")
        self._manifest: Manifest | None = None
        self._unchecked: set[str] = set()
        #: Files that were looked through, as they were then
        self._known: dict[Path, tuple[int, ...]] = {}
        if check:
            self._check_manifest(path.is_dir())

    def _check_manifest(self, whole: bool) -> None:
        """Compare what is there with the manifest, but for the bytes of the segments."""
        try:
            manifest = read_manifest(self.folder)
            if manifest is None:
                warnings.warn(f"{self.folder}: has no {MANIFEST}, which every run writes: the file was removed; "
                              "nothing can be compared with what was written", NoManifest, stacklevel=4)
                return
            check_names(self.segments, manifest, whole)
            names = sorted(set(manifest.closed) & {segment.name for segment in self.segments})
            if whole:
                names = sorted(name for name in manifest.closed if SEGMENT_NAME.fullmatch(name))
            check_sizes(self.folder, names, manifest)
            for segment in self.segments:
                check_steps(segment, manifest.closed.get(segment.name))
        except ManifestError as error:
            if is_refused(error):
                raise ResultError(f"{self.folder}: {error}") from error
            raise ResultError(f"{self.folder}: {error}. The result is not what the run wrote: take it from a copy "
                              "or run it again; Trajectory(..., check=False) reads it as it is") from error
        self._manifest = manifest
        self._unchecked = {*names, "profile.h5"} & manifest.closed.keys()

    def _check_bytes(self, name: str) -> None:
        """Compare all bytes of a file with the manifest when it is first used."""
        if name not in self._unchecked or self._manifest is None:
            return
        try:
            check_bytes(self.folder, name, self._manifest)
        except ManifestError as error:
            raise ResultError(f"{self.folder}: {error}") from error
        self._unchecked.remove(name)

    @contextmanager
    def open_segment(self, segment: Segment) -> Iterator[h5py.File]:
        """A segment to read, after its check."""
        self._check_bytes(segment.name)
        with reading(segment.path, self._known) as file:
            yield file

    @contextmanager
    def open_profile(self) -> Iterator[h5py.File]:
        """The profile of a run that has ended."""
        if not self.profile_path.exists():
            raise ResultError(f"{self.profile_path}: there is no such file; it is written when a run ends")
        self._check_bytes(self.profile_path.name)
        with reading(self.profile_path, self._known) as file:
            yield file

    @contextmanager
    def open_any(self) -> Iterator[h5py.File]:
        """A file with the provenance of the run: the profile, or the first segment."""
        path = self.profile_path if self.profile_path.exists() else self.segments[0].path
        self._check_bytes(path.name.removesuffix(OPEN_SUFFIX))
        with reading(path, self._known) as file:
            yield file

    def locate(self, number: int) -> tuple[Segment, int]:
        """Segment and row of a frame of the run, counted from 0."""
        row = number
        for segment in self.segments:
            if row < len(segment.times):
                return segment, row
            row -= len(segment.times)
        raise AssertionError("frames are counted over the same segments")

    @property
    def times(self) -> np.ndarray:
        """Times of all frames [s]."""
        return np.concatenate([np.empty(0)] + [segment.times for segment in self.segments])

    @property
    def steps(self) -> np.ndarray:
        """Steps of all frames."""
        return np.concatenate([np.empty(0, dtype=np.int64)] + [segment.steps for segment in self.segments])


def _closed_files(folder: Path) -> dict[str, Closed]:
    """Files that the manifest of a result names as closed; none if it cannot be read, which its check tells."""
    try:
        manifest = read_manifest(folder)
    except ManifestError:
        return {}
    return manifest.closed if manifest else {}


def _nearby(folder: Path) -> str:
    """A hint at the results in the folders of a folder that is none itself."""
    found = sorted({path.parent for name in ("trajectory_0001.h5*", "profile.h5") for path in folder.glob(f"*/{name}")})
    if not found:
        return ""
    return f"; did you mean {', '.join(map(str, found[:4]))}{' ...' if len(found) > 4 else ''}?"
