"""Which pixels of a grey picture are of grains: one threshold, or under uneven light one for each pixel."""

from __future__ import annotations

import numpy as np

from ..base.optional import need
from ..base.polygons import FloatArray
from ..base.result_file import ResultError
from .choices import Tracing
from .picture_files import Picture, name_of, read_picture

#: A small change of the threshold, over the difference between the means of the two sorts of pixels
STEP = 0.05
#: Rounds after which thresholds under uneven light end at the latest
ROUNDS = 10
#: What the means of the whole picture count, over the share of the pixels of a sort nearby: where there are hardly any
#: grains nearby, noise must not become grains
FAR = 0.02
#: The same for the dark pixels, which are nearly everywhere
FAR_DARK = 1e-3


def above_threshold(source: Picture, choices: Tracing, said: list[str]) -> tuple[FloatArray, FloatArray]:
    """How far each pixel is above its threshold, and a small step of the threshold, to see what depends on it.

    The sign is such that both are positive in grains, also in dark ones.
    """
    filters = need("skimage.filters", "pictures", "the import of pictures", "scikit-image")
    grey = read_picture(source, grey=True).astype(np.float64)
    if choices.smooth is not None:
        grey = filters.gaussian(grey, choices.smooth, preserve_range=True)
    low, high = float(grey.min()), float(grey.max())
    if not low < high:
        raise ResultError(f"{name_of(source)}: all pixels have the grey value {low:g}, so no threshold tells grains")
    sign = -1.0 if choices.dark else 1.0
    side = "darker" if choices.dark else "brighter"
    if choices.uneven is not None:
        threshold, step = _of_each_pixel(source, sign * grey, choices.uneven)
        level: FloatArray = sign * grey - threshold
        from_to = " to ".join(f"{each:.4g}" for each in sorted((sign * threshold.min(), sign * threshold.max())))
        than = f"the middle between grains and background within about {choices.uneven:g} pixels, {from_to}"
    else:
        value = choices.threshold
        if isinstance(value, str) or value is None:
            bright = grey > filters.threshold_otsu(grey)
            # In the middle of the two sorts, edges are where they are
            value = 0.5 * float(grey[bright].mean() + grey[~bright].mean())
        if not low < value < high:
            raise ResultError(f"{name_of(source)}: the threshold is {value}, but the grey values are from {low:g} to "
                              f"{high:g}, so no pixel is {'brighter' if value >= high else 'darker'}")
        bright = grey > value
        step = np.full(grey.shape, STEP * float(grey[bright].mean() - grey[~bright].mean()))
        level, than = sign * (grey - value), f"the grey value {value:.4g}"
    said.append(f"grains are {side} than {than}: {100 * float((level > 0.0).mean()):.0f} % of the picture")
    return level, step


def _of_each_pixel(source: Picture, grey: FloatArray, width: float) -> tuple[FloatArray, FloatArray]:
    """The middle between the means of the two sorts of pixels around each pixel, and a step of it.

    The means are over a square, three times, which is nearly a Gaussian of half the width. The sorts are first those
    of Otsu above a morphological opening, which no grain enters, then those of the threshold of the round before.
    """
    from scipy import ndimage

    filters = need("skimage.filters", "pictures", "the import of pictures", "scikit-image")
    if width >= max(grey.shape):
        raise ResultError(f"{name_of(source)}: --uneven is {width:g}, but the picture has {grey.shape[1]} x "
                          f"{grey.shape[0]} pixels")

    def around(values: FloatArray) -> FloatArray:
        for _ in range(3):
            values = ndimage.uniform_filter(values, round(width), mode="nearest")
        return values

    opened = ndimage.grey_opening(grey, size=(round(width), round(width)), mode="nearest")
    above = grey - ndimage.uniform_filter(opened, round(width), mode="nearest")
    bright = above > filters.threshold_otsu(above)
    for _ in range(ROUNDS):
        behind = around(np.where(bright, 0.0, grey)) + FAR_DARK * grey[~bright].mean()
        behind /= around(1.0 * ~bright) + FAR_DARK
        contrast = around(np.where(bright, grey - behind, 0.0)) + FAR * (grey - behind)[bright].mean()
        contrast /= around(1.0 * bright) + FAR
        threshold = behind + 0.5 * contrast
        before, bright = bright, grey > threshold
        if (bright == before).all() or not bright.any() or bright.all():
            break
    return threshold, STEP * contrast
