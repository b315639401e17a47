"""What a user chooses for the tracing of a picture or a drawing."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from ..base.result_file import ResultError

#: Least length over which light may vary [pixels]
NARROWEST = 3


@dataclass(frozen=True)
class Tracing:
    """How outlines are found and simplified; None is the default."""

    #: Greatest distance of a simplified outline from that of the file, over the square root of the area of its grain
    tolerance: float | None = None
    #: Grey value above which a pixel is of a grain, or 'otsu'; None: a pixel's value is the number of its grain
    threshold: float | str | None = None
    #: Whether grains are darker than the threshold
    dark: bool | None = None
    #: Standard deviation of the Gaussian that smooths a grey picture [pixels]
    smooth: float | None = None
    #: Necks narrower than this share of the smaller grain are cut
    split: float | None = None
    #: Grains of fewer pixels are left out
    least: float | None = None
    #: Whether grains at the border of the picture stay
    border: bool | None = None
    #: Under uneven light: the threshold is that of the pixels within about this length, wider than a grain [pixels]
    uneven: float | None = None
    #: Whether grains become their convex hulls
    convex: bool | None = None

    def insist_on(self, path: Any, allowed: tuple[str, ...], kind: str) -> None:
        """Refuse what makes no sense for a kind of file, and numbers out of range."""
        for each in fields(self):
            value = getattr(self, each.name)
            if value is not None and each.name not in allowed:
                raise ResultError(f"{path}: --{each.name} is not for {kind}")
        for name, value in (("tolerance", self.tolerance), ("smooth", self.smooth), ("split", self.split),
                            ("least", self.least), ("uneven", self.uneven)):
            if value is not None and not 0.0 < value < float("inf"):
                raise ResultError(f"--{name} is {value}, but must be a number above 0")
        if self.tolerance is not None and self.tolerance > 0.3:
            raise ResultError(f"--tolerance is {self.tolerance}, but must be at most 0.3, a share of a grain's size")
        if self.uneven is not None and self.uneven < NARROWEST:
            raise ResultError(f"--uneven is {self.uneven}, but must be at least {NARROWEST} pixels")
        if self.split is not None and self.split > 1.0:
            raise ResultError(f"--split is {self.split}, but must be at most 1, a share of the width of a grain")
        for name in ("dark", "smooth", "split", "uneven"):
            if getattr(self, name) and self.threshold is None:
                raise ResultError(f"{path}: --{name} is for grey pictures and needs --threshold")
        if self.uneven and self.threshold not in (None, "otsu"):
            raise ResultError(f"{path}: --uneven finds the threshold at each pixel, so it needs --threshold otsu")
