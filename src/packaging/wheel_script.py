#!python
"""The program of the wheel, which lies in the package. It is found without an import of the package, which is slow."""

import ctypes
import os
import sys
from importlib.util import find_spec

try:
    ctypes.CDLL("libgomp.so.1")
except OSError:
    sys.exit("polydem: the library libgomp.so.1 is missing; in Debian and Ubuntu it is in the package libgomp1")
program = os.path.join(os.path.dirname(find_spec("polydem").origin), "bin", "polydem")
os.execv(program, [program, *sys.argv[1:]])
