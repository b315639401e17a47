"""The values of the pixels of a picture: a file, a file of NumPy, or an array."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from ..base.result_file import ResultError, cannot_read, insist_on_file

#: A file, or the values of the pixels, (rows, columns)
Picture = Union[Path, npt.NDArray[Any]]
#: How a file of NumPy begins
NUMPY = b"\x93NUMPY"


def name_of(source: Picture) -> str:
    """What messages call a picture."""
    return str(source) if isinstance(source, Path) else "the array"


def read_picture(source: Picture, grey: bool = False) -> npt.NDArray[Any]:
    """The values of the pixels, (rows, columns), or of colours red, green, blue and opacity, (rows, columns, 4)."""
    if not isinstance(source, Path):
        return _checked(source, "the array")
    try:
        insist_on_file(source)
        with source.open("rb") as file:
            is_numpy = file.read(len(NUMPY)) == NUMPY
        if is_numpy:
            return _checked(np.load(source, allow_pickle=False), str(source))
    except (OSError, ValueError, EOFError, MemoryError) as error:
        raise cannot_read(source, error) from error
    picture = _opened(source)
    if grey and picture.mode not in ("L", "I", "F", "I;16", "I;16B"):
        picture = picture.convert("L")
    return np.asarray(picture.convert("RGBA") if picture.mode in ("RGB", "RGBA", "LA", "PA", "CMYK") else picture)


def _checked(values: npt.NDArray[Any], name: str) -> npt.NDArray[Any]:
    """An array, if it can be a picture."""
    if values.ndim != 2 or not values.size or values.dtype.kind not in "buif":
        raise ResultError(f"{name}: has the shape {values.shape} and the type {values.dtype}, but a picture has "
                          "numbers in rows and columns")
    if not np.isfinite(values).all():
        raise ResultError(f"{name}: has values that are no finite numbers")
    return values.astype(np.uint8) if values.dtype.kind == "b" else values


def _opened(path: Path) -> Any:
    """A picture of Pillow."""
    from PIL import Image, UnidentifiedImageError

    try:
        picture = Image.open(path)
        picture.load()
    except UnidentifiedImageError as error:
        raise ResultError(f"{path}: is not a picture that Pillow knows") from error
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise cannot_read(path, error) from error
    if getattr(picture, "n_frames", 1) > 1:
        raise ResultError(f"{path}: has {picture.n_frames} pictures; give a file with one")
    return picture
