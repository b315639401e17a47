"""Tests of ./polydem on a toy project.

usage: test_launcher.py LAUNCHER [TEST...]     with tests like test_ranks or test_ranks.Ranks
"""

import os
import sys
import unittest

MODULES = ("test_words", "test_ranks", "test_build", "test_machine")

if __name__ == "__main__":
    os.environ["POLYDEM_LAUNCHER"] = os.path.abspath(sys.argv.pop(1))
    unittest.main(module=None, argv=[sys.argv[0], *(sys.argv[1:] or MODULES)])
