"""Ctrl-C while the modules of a verb load, which takes a third of a second, ends it without a traceback.

`python -m polydem_post` imports the package first, and this module before all that takes long.
"""

from __future__ import annotations

import os
import signal
import sys


def end_at_once() -> None:
    """Let Ctrl-C end the process, as of a program that does not know the signal."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)


def raise_exceptions() -> None:
    """Let Ctrl-C be an exception again, which a verb handles."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)


# The first word is -m only while Python looks for the module that it runs.
if [os.path.basename(word) for word in sys.argv[:1]] in (["-m"], ["polydem-post"]):
    end_at_once()
