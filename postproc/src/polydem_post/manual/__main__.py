"""Command line of the verb manual."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ..base.result_file import reason
from ..command_line.main import INPUT_ERROR

#: Default folder of the site, below the root of the repository
FOLDER = Path("build") / "manual"


def main() -> int:
    """Build the manual and say where it is; returns the exit code."""
    parser = argparse.ArgumentParser(prog="./polydem manual", description=__doc__)
    parser.add_argument("--root", type=Path, default=Path.cwd())
    parser.add_argument("--output", type=Path, metavar="FOLDER")
    parser.add_argument("--sources", action="store_true")
    options = parser.parse_args()
    from .site import ManualError, build_site

    root = options.root.resolve()
    output = (options.output or root / FOLDER).resolve()
    try:
        pages = build_site(root, output, options.sources)
        if options.sources:
            from .sources import build_sources

            print("reading the sources with FORD, which takes a minute", file=sys.stderr)
            build_sources(root, output / "sources", root / "build" / "ford")
    except ManualError as error:
        print(f"error: {error}", file=sys.stderr)
        return INPUT_ERROR
    except OSError as error:
        print(f"error: {error.filename or output}: {reason(error)}", file=sys.stderr)
        return INPUT_ERROR
    print(f"{len(pages)} pages; open {(output / 'index.html').as_uri()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
