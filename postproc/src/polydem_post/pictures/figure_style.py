"""How figures look, and the forms in which they are written."""

from __future__ import annotations

import logging

from ..base.new_file import MARK

# Fonts for symbols that no figure has may be missing.
logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)

#: Forms in which every figure is written, and what keeps the time of writing out of each
FORMS = {"pdf": {"CreationDate": None, "Creator": MARK}, "svg": {"Date": None, "Creator": MARK},
         "png": {"Software": MARK}}

#: Settings of matplotlib under which figures are drawn and written
SETTINGS = {
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "svg.hashsalt": "polydem",
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
    "path.simplify": False,
}
