"""How near a run came to the stable time step of its contacts."""

from __future__ import annotations

import re
from pathlib import Path


def stable_share(path: Path) -> float:
    """Greatest ratio of dt to the stable time step of the contacts, from the log of a run; NaN without contacts."""
    # Older logs use the second wording.
    found = re.search(r"(?:max dt / stable dt|greatest share of the stable step) of the contacts: *(\S+)",
                      path.read_text(encoding="utf-8"))
    return float(found.group(1)) if found else float("nan")
