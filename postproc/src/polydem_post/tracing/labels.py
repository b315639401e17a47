"""The grains of a picture: the number of its grain for each pixel."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.optional import need
from ..base.polygons import FloatArray, IntArray
from ..base.result_file import ResultError, cannot_read, insist_on_file
from .choices import Tracing

#: Pixels that a grain has at least, unless it is chosen
LEAST = 100
#: Suffixes of pictures whose compression changes the values of pixels
LOSSY = (".jpg", ".jpeg")


@dataclass(frozen=True)
class Labels:
    """A picture with a border of one empty pixel all round."""

    #: Number of the grain of each pixel, from 1; 0: none
    label: IntArray
    #: Grey value above the threshold, the sign such that it is positive in grains; None: a labelled picture
    level: FloatArray | None
    #: What was left out, filled and chosen, in sentences
    said: list[str]


def skimage(part: str) -> Any:
    """A part of scikit-image."""
    return need(f"skimage.{part}", "pictures", "the import of pictures", "scikit-image")


def read_labels(path: Path, choices: Tracing) -> Labels:
    """The grains of a picture file."""
    measure = skimage("measure")
    values, level, said = _labelled(path) if choices.threshold is None else _grey(path, choices)
    label = measure.label(values, connectivity=1, background=0).astype(np.int64)
    if level is not None and choices.split is not None:
        before = label.max()
        label = _split(label, choices.split)
        said.append(f"grains after the cuts of narrow necks: {label.max()}, before: {before}")
    if level is None and label.max() > 0 and label.max() > 0.05 * label.size:
        raise ResultError(f"{path}: has {label.max()} regions of one value on {label.size} pixels, so it is no "
                          "labelled picture; give --threshold for a grey one")
    label = _chosen(label, choices, said)
    if not label.any():
        raise ResultError(f"{path}: no grains are left: {'; '.join(said)}")
    padded = np.pad(label, 1)
    if level is not None:
        # The line between a grain and the outside is the edge of the picture.
        level = np.pad(level, 1, mode="edge")
        for edge in (np.s_[0, :], np.s_[-1, :], np.s_[:, 0], np.s_[:, -1]):
            level[edge] *= -1.0
    return Labels(padded, level, said)


def _opened(path: Path) -> Any:
    """A picture of Pillow."""
    from PIL import Image, UnidentifiedImageError

    try:
        insist_on_file(path)
        picture = Image.open(path)
        picture.load()
    except UnidentifiedImageError as error:
        raise ResultError(f"{path}: is not a picture that Pillow knows") from error
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise cannot_read(path, error) from error
    if getattr(picture, "n_frames", 1) > 1:
        raise ResultError(f"{path}: has {picture.n_frames} pictures; give a file with one")
    return picture


def _labelled(path: Path) -> tuple[IntArray, None, list[str]]:
    """The value of each pixel; each colour is one, and black and transparent pixels are 0."""
    if path.suffix.lower() in LOSSY:
        raise ResultError(f"{path}: JPEG changes the values of pixels, so it has no labels; give --threshold, or a PNG")
    picture = _opened(path)
    if picture.mode in ("RGB", "RGBA", "LA", "PA", "CMYK"):
        colour = np.asarray(picture.convert("RGBA"), dtype=np.int64)
        values = np.where(colour[..., 3] > 0, colour[..., 0] << 16 | colour[..., 1] << 8 | colour[..., 2], 0)
    else:
        values = np.asarray(picture)
        if values.dtype.kind == "f" and not (values == np.round(values)).all():
            raise ResultError(f"{path}: its values are no whole numbers, so it has no labels; give --threshold")
        values = values.astype(np.int64)
    return values, None, []


def _grey(path: Path, choices: Tracing) -> tuple[npt.NDArray[np.bool_], FloatArray, list[str]]:
    """Where the grains of a grey picture are, and how far the grey value is above the threshold."""
    filters = skimage("filters")
    picture = _opened(path)
    if picture.mode not in ("L", "I", "F", "I;16", "I;16B"):
        picture = picture.convert("L")
    grey = np.asarray(picture, dtype=float)
    if choices.smooth is not None:
        grey = filters.gaussian(grey, choices.smooth, preserve_range=True)
    low, high = float(grey.min()), float(grey.max())
    threshold = choices.threshold
    if threshold == "otsu" and low < high:
        bright = grey > filters.threshold_otsu(grey)
        # In the middle of the two sorts, edges are where they are
        threshold = 0.5 * float(grey[bright].mean() + grey[~bright].mean())
    if isinstance(threshold, str) or threshold is None or not low < threshold < high:
        raise ResultError(f"{path}: the threshold is {threshold}, but the grey values are from {low:g} to {high:g}")
    level = (threshold - grey) if choices.dark else (grey - threshold)
    side = "darker" if choices.dark else "brighter"
    share = float((level > 0.0).mean())
    said = f"grains are {side} than the grey value {threshold:.4g}: {100 * share:.0f} % of the area"
    return level > 0.0, level, [said]


def _split(label: IntArray, share: float) -> IntArray:
    """Cut necks: watersheds of the distance from the outside, joined again where the neck is wide.

    A neck stays if it is at least `share` times as wide as the smaller of the two parts, both measured by the greatest
    circle inside.
    """
    from scipy import ndimage

    segmentation = skimage("segmentation")
    depth = ndimage.distance_transform_edt(np.pad(label > 0, 1))[1:-1, 1:-1]
    basin = segmentation.watershed(-ndimage.gaussian_filter(depth, 1.0), mask=label > 0)
    one = np.concatenate([basin[:, :-1].ravel(), basin[:-1].ravel()])
    two = np.concatenate([basin[:, 1:].ravel(), basin[1:].ravel()])
    neck = np.concatenate([np.minimum(depth[:, :-1], depth[:, 1:]).ravel(), np.minimum(depth[:-1], depth[1:]).ravel()])
    meets = (one != two) & (one > 0) & (two > 0)
    one, two, neck = np.minimum(one, two)[meets], np.maximum(one, two)[meets], neck[meets]
    pairs, which = np.unique(np.stack([one, two], axis=1), axis=0, return_inverse=True)
    width = np.zeros(len(pairs))
    np.maximum.at(width, which.ravel(), neck)
    peak = np.asarray(ndimage.maximum(depth, basin, np.arange(basin.max() + 1)), dtype=float)
    joined = np.arange(basin.max() + 1)
    for k in np.argsort(-width, kind="stable"):
        a, b = (_root(joined, int(each)) for each in pairs[k])
        if a != b and width[k] >= share * min(peak[a], peak[b]):
            joined[max(a, b)] = min(a, b)
            peak[min(a, b)] = max(peak[a], peak[b])
    roots = np.array([_root(joined, k) for k in range(len(joined))])
    return np.unique(roots[basin], return_inverse=True)[1].reshape(basin.shape).astype(np.int64)


def _root(joined: Any, part: int) -> int:
    """The part that stands for all parts joined with it."""
    while joined[part] != part:
        part = int(joined[part])
    return part


def _chosen(label: IntArray, choices: Tracing, said: list[str]) -> IntArray:
    """The grains that stay, without holes; what goes is said."""
    measure = skimage("measure")
    least = LEAST if choices.least is None else choices.least
    rows, columns = label.shape
    out = np.zeros_like(label)
    left = dict.fromkeys(("border", "small", "inside"), 0)
    holes = 0
    inner: set[int] = set()
    for region in sorted(measure.regionprops(label), key=lambda each: (-each.area_filled, each.label)):
        top, first, bottom, last = region.bbox
        if region.label in inner:
            left["inside"] += 1
        elif region.area < least:
            left["small"] += 1
        elif not choices.border and (top == 0 or first == 0 or bottom == rows or last == columns):
            left["border"] += 1
        else:
            filled = region.image_filled
            window = np.s_[top:bottom, first:last]
            hole = filled & ~region.image
            holes += int(measure.label(hole, connectivity=1).max()) if hole.any() else 0
            inner |= set(np.unique(label[window][hole]).tolist()) - {0}
            out[window][filled] = region.label
    said += [sentence for sentence in (
        f"left out, at the border of the picture: {left['border']} (--border keeps them)" if left["border"] else "",
        f"left out, below {least:g} pixels: {left['small']} (--least)" if left["small"] else "",
        f"left out, in holes of other grains: {left['inside']}" if left["inside"] else "",
        f"holes that were filled: {holes}" if holes else "") if sentence]
    return out
