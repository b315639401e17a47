"""The grains of a picture: the number of its grain for each pixel."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.optional import need
from ..base.polygons import FloatArray, IntArray
from ..base.result_file import ResultError
from .choices import Tracing
from .picture_files import Picture, name_of, read_picture
from .thresholds import STEP, above_threshold

#: Share of the picture above which what the border cuts may be the background
SUSPECT = 0.1
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


def read_labels(source: Picture, choices: Tracing) -> Labels:
    """The grains of a picture file or of an array."""
    said: list[str] = []
    if choices.threshold is None:
        level = None
        label = _label(_labelled(source))
        if label.max() > 0.05 * label.size:
            raise ResultError(f"{name_of(source)}: has {label.max()} regions of one value on {label.size} pixels, so "
                              "it is no labelled picture; give --threshold for a grey one")
        label = _chosen(label, choices, said)
    else:
        level, step = above_threshold(source, choices, said)
        label = _grains(level, choices, said)
        said.append(_at_other_thresholds(level, step, choices, label))
    if not label.any():
        raise ResultError(f"{name_of(source)}: no grains are left: "
                          f"{'; '.join(said) or 'every pixel has the value 0 or is black'}")
    padded = np.pad(label, 1)
    if level is not None:
        # The line between a grain and the outside is the edge of the picture.
        level = np.pad(level, 1, mode="edge")
        for edge in (np.s_[0, :], np.s_[-1, :], np.s_[:, 0], np.s_[:, -1]):
            level[edge] *= -1.0
    return Labels(padded, level, said)


def _label(values: npt.NDArray[Any]) -> IntArray:
    """Connected regions of one value, numbered from 1."""
    found: IntArray = skimage("measure").label(values, connectivity=1, background=0).astype(np.int64)
    return found


def _labelled(source: Picture) -> IntArray:
    """The value of each pixel; each colour is one, and black and transparent pixels are 0."""
    if isinstance(source, Path) and source.suffix.lower() in LOSSY:
        raise ResultError(f"{source}: JPEG changes the values of pixels, so it has no labels; give --threshold, or a "
                          "PNG")
    values = read_picture(source)
    if values.ndim == 3:
        colour = values.astype(np.int64)
        return np.where(colour[..., 3] > 0, colour[..., 0] << 16 | colour[..., 1] << 8 | colour[..., 2], 0)
    if values.dtype.kind == "f" and not (values == np.round(values)).all():
        raise ResultError(f"{name_of(source)}: its values are no whole numbers, so it has no labels; give --threshold")
    if values.min() < 0:
        raise ResultError(f"{name_of(source)}: has the label {values.min():g}, but labels are whole numbers from 0 on; "
                          "for a grey picture give --threshold")
    return values.astype(np.int64)


def _grains(level: FloatArray, choices: Tracing, said: list[str]) -> IntArray:
    """The grains of a grey picture that stay."""
    label = _label(level > 0.0)
    if choices.split is not None:
        before = label.max()
        label = _split(label, choices.split)
        said.append(f"grains after the cuts of narrow necks: {label.max()}, before: {before}")
    return _chosen(label, choices, said)


def _at_other_thresholds(level: FloatArray, step: FloatArray, choices: Tracing, label: IntArray) -> str:
    """What a slightly different threshold would change."""
    others = [_grains(level + sign * step, choices, []) for sign in (1.0, -1.0)]
    area = [100.0 * ((other > 0).sum() / max((label > 0).sum(), 1) - 1.0) for other in others]
    number = [len(np.unique(other[other > 0])) for other in others]
    words = " and ".join(f"{round(change, 1) + 0.0:+.1f} % (grains: {count})" for change, count in zip(area, number))
    return (f"accuracy of the threshold: {float(np.median(step)):.2g} grey values ({100 * STEP:g} % of the difference "
            f"between the means of the two sorts of pixels) nearer to the background, or farther from it, change the "
            f"total area of all grains by {words}")


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
    left: dict[str, list[int]] = {"border": [], "small": [], "inside": []}
    holes = 0
    inner: set[int] = set()
    for region in sorted(measure.regionprops(label), key=lambda each: (-each.area_filled, each.label)):
        top, first, bottom, last = region.bbox
        if region.label in inner:
            left["inside"].append(int(region.area))
        elif region.area < least:
            left["small"].append(int(region.area))
        elif not choices.border and (top == 0 or first == 0 or bottom == rows or last == columns):
            left["border"].append(int(region.area))
        else:
            filled = region.image_filled
            window = np.s_[top:bottom, first:last]
            hole = filled & ~region.image
            holes += int(measure.label(hole, connectivity=1).max()) if hole.any() else 0
            inner |= set(np.unique(label[window][hole]).tolist()) - {0}
            out[window][filled] = region.label
    for name, words, remedy in (("border", "at the border of the picture", "--border keeps them"),
                                ("small", f"below {least:g} pixels", "--least"),
                                ("inside", "in holes of other grains", "")):
        if left[name]:
            share = sum(left[name]) / label.size
            uneven = name == "border" and choices.threshold is not None and not choices.uneven and (
                share > SUSPECT or max(left[name]) > np.bincount(out.ravel())[1:].max(initial=0))
            said.append(f"left out, {words}: {len(left[name])}, {100 * share:.2g} % of the picture"
                        f"{f' ({remedy})' if remedy else ''}{'; uneven light? See --uneven' if uneven else ''}")
    if holes:
        said.append(f"holes that were filled: {holes}")
    return out
