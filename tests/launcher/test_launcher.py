"""Tests of ./polydem on a toy project.

usage: test_launcher.py LAUNCHER [TEST...]     with tests like test_ranks or test_ranks.Ranks

The exit code is 77 if tests were skipped, though the others passed.
"""

import os
import sys
import unittest

MODULES = ("test_words", "test_ranks", "test_build", "test_machine")

if __name__ == "__main__":
    os.environ["POLYDEM_LAUNCHER"] = os.path.abspath(sys.argv.pop(1))
    result = unittest.main(module=None, argv=[sys.argv[0], *(sys.argv[1:] or MODULES)], exit=False).result
    for test, reason in result.skipped:
        print(f"skipped: {test}: {reason}", file=sys.stderr)
    sys.exit(77 if result.skipped and result.wasSuccessful() else not result.wasSuccessful())
