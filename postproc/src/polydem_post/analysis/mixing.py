"""How well two kinds of bodies are mixed."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..base.result_file import ResultError
from ..read.frames import Frame


def lacey_index(frame: Frame, kind: Any, cell: float) -> float:
    """Mixing index of Lacey of the free bodies: 0 for separate kinds, about 1 for a random mixture.

    M = (s0^2 - s^2)/(s0^2 - sr^2) with the share p of the bodies of one kind, s0^2 = p (1 - p), the variance of the
    share between square cells of the given size [m], s^2 = sum_k n_k (p_k - p)^2/N, and its value in a random
    mixture, sr^2 = p (1 - p) K/N; K cells have n_k > 0 of the N bodies, by their centres of mass (P.M.C. Lacey, J.
    Appl. Chem. 4 (1954) 257, weighted with the number in each cell). `kind` is true for the bodies of one kind, (n);
    cells are counted from the origin.
    """
    chosen = np.asarray(kind, dtype=bool)
    if len(chosen) != len(frame) or not cell > 0.0:
        raise ResultError("lacey_index needs a truth value per body and a cell size above 0")
    chosen = chosen[frame.free]
    share = float(chosen.mean()) if len(chosen) else 0.0
    if not 0.0 < share < 1.0:
        raise ResultError("lacey_index needs free bodies of both kinds")
    places = np.floor(frame.position[frame.free] / cell).astype(np.int64)
    _, index = np.unique(places, axis=0, return_inverse=True)
    count = np.bincount(index.ravel())
    own = np.bincount(index.ravel(), weights=chosen)
    total, apart = len(chosen), share * (1.0 - share)
    if len(count) == total:
        raise ResultError("every cell has one body: choose larger cells")
    variance = float(np.sum(count * (own / count - share) ** 2)) / total
    return (apart - variance) / (apart - apart * len(count) / total)
