"""Means over time with the standard error of correlated values, from blocks."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base.polygons import FloatArray
from ..base.result_file import ResultError

#: Length of a block, and least length of a series, in correlation times
BLOCK_LENGTH, LEAST_LENGTH = 10.0, 20.0
#: Least and greatest number of blocks: more would make the error hardly more certain, and shorter blocks correlate more
LEAST_BLOCKS, MOST_BLOCKS = 4, 40
#: The sum over the autocorrelation ends at this many correlation times
WINDOW = 5.0


class ShortSeries(UserWarning):
    """A series so short that its standard error is uncertain, and probably too small."""


@dataclass(frozen=True)
class BlockAverage:
    """Mean of a series of correlated values, and its standard error from the means of blocks.

    Fields:

        mean              [that of the values]  mean of the series
        error             [that of the values]  standard error of the mean; NaN for fewer than 4 values
        blocks            [1]                   number of blocks; the error has one degree of freedom less
        correlation_time  [values]              integrated autocorrelation time; 1/2 if the values are independent
        count             [1]                   number of values
    """

    mean: float
    error: float
    blocks: int
    correlation_time: float
    count: int

    @property
    def is_short(self) -> bool:
        """Whether the series has fewer than 20 correlation times [1]: then the error is probably too small."""
        return not self.count >= LEAST_LENGTH * self.correlation_time


def block_average(values: Any, weights: Any = None, *, blocks: int = 0) -> BlockAverage:
    """Mean of a series of values at equal intervals of time, and its standard error.

    Values that follow each other are correlated, so the standard deviation over the root of their number is too small.
    The series is cut into blocks of (nearly) equal length; the means of blocks longer than the correlation are
    independent, and their scatter gives the error (H. Flyvbjerg & H.G. Petersen, J. Chem. Phys. 91 (1989) 461).

    With r the deviation from the mean, the integrated autocorrelation time is 1/2 + sum_k <r(i) r(i + k)>/<r^2>, with
    the sum to five of these times (A.D. Sokal, in Functional Integration (1997) 131). A block has ten times
    that time less one half, or more, and there are 4 to 40 blocks; `blocks` chooses their number instead. A series
    shorter than 20 correlation times has the warning `ShortSeries`. In 95 % of all cases the true mean lies within
    `error` times Student's t for `blocks` - 1 degrees of freedom. With `weights` the mean is sum(w v)/sum(w), and r is
    w (v - mean).
    """
    series = np.asarray(values, dtype=float)
    if series.ndim != 1 or len(series) == 0 or not np.isfinite(series).all():
        raise ResultError("block_average needs a series of finite values")
    weight = np.ones(len(series)) if weights is None else np.asarray(weights, dtype=float)
    if weight.shape != series.shape or not (weight >= 0.0).all() or not weight.sum() > 0.0:
        raise ResultError("block_average needs one weight per value, none negative and not all 0")
    if blocks and not 2 <= blocks <= len(series):
        raise ResultError(f"block_average needs 2 to {len(series)} blocks, not {blocks}")
    found = average_in_blocks(series, weight, blocks)
    if found.is_short and found.count >= LEAST_BLOCKS:
        warnings.warn(f"{found.count} values are {found.count / found.correlation_time:.0f} correlation times, fewer "
                      f"than {LEAST_LENGTH:.0f}: the standard error is uncertain, and probably too small; average over "
                      "a longer time", ShortSeries, stacklevel=2)
    return found


def average_in_blocks(values: FloatArray, weights: FloatArray, blocks: int = 0) -> BlockAverage:
    """As `block_average`, of sound values and weights and without the warning."""
    count, total = len(values), float(weights.sum())
    mean = float(weights @ values) / total
    deviation = weights * (values - mean)
    time = _correlation_time(deviation)
    if count < max(LEAST_BLOCKS, blocks):
        return BlockAverage(mean, math.nan, min(count, 1), time, count)
    # Values that are independent, with a time of one half, need no blocks.
    length = max(1, math.ceil(BLOCK_LENGTH * (time - 0.5)))
    number = blocks or min(max(LEAST_BLOCKS, count // length), MOST_BLOCKS)
    edges = np.linspace(0, count, number + 1).astype(int)
    sums = np.add.reduceat(deviation, edges[:-1])
    return BlockAverage(mean, math.sqrt(number / (number - 1) * float(sums @ sums)) / total, number, time, count)


def _correlation_time(deviation: FloatArray) -> float:
    """Integrated autocorrelation time of deviations from a mean, in values; at least one half."""
    n = len(deviation)
    spectrum = np.fft.rfft(deviation, 2 * n)
    covariance = np.fft.irfft(np.abs(spectrum) ** 2, 2 * n)[:n]
    if n < 2 or not covariance[0] > 0.0:
        return 0.5
    times = 0.5 + np.cumsum(covariance[1:] / covariance[0])
    lag = np.arange(1, n)
    enough = lag >= WINDOW * times
    last = int(np.argmax(enough)) if enough.any() else n - 2
    # The deviations are those from the mean of the same series, which lowers each covariance by that of the mean.
    return max(0.5, float(times[last] * (1.0 + (2 * lag[last] + 1) / n)))
