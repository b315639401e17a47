"""Replay of a recorded trace through every finder, from the command line.

usage: check_replay.py PROGRAM FOLDER

The folder holds 160 boxes of a rotating drum at six steps, and the same with one wrong number of pairs.
"""

import subprocess
import sys

FINDERS = ("all_pairs", "sort_and_sweep", "unsorted_sweep", "partitioned_sweep", "quadtree", "quadtree_called",
           "pruned_quadtree", "binary_tree", "linked_cells", "verlet", "hierarchical_grid", "odd_even_sweep",
           "locked_sweep", "mended_sweep")
# Counted and hashed by brute force in exact arithmetic when the trace was made.
EXPECTED = {"boxes": "160", "walls": "5", "steps": "6", "pairs_total": "2128", "pair_hash": "0x37b90deb093a35a5",
            "checked_against": "npairs", "result": "ok"}
WRONG_STEP = 3


def replay(program, *arguments):
    """Run the verb; return exit code, key=value lines and error messages."""
    done = subprocess.run([program, "replay", *arguments], capture_output=True, text=True, timeout=600, check=False)
    lines = dict(line.split("=", 1) for line in done.stdout.splitlines() if "=" in line)
    return done.returncode, lines, done.stderr


def main():
    program, folder = sys.argv[1:]
    for finder in FINDERS:
        for threads in ("1", "2"):
            code, lines, errors = replay(program, f"{folder}/drum_cut.h5", "--finder", finder, "--threads", threads,
                                         "--repeat", "3")
            assert code == 0, errors
            for key, value in EXPECTED.items():
                assert lines.get(key) == value, (finder, threads, key, lines.get(key))
            assert lines["finder"] == finder and lines["threads"] == threads and lines["repeats"] == "3"
            for key in ("ns_per_box_per_step", "ns_per_box_per_step_after_first"):
                assert float(lines[key]) > 0, (finder, key)
            for phase in ("structure", "search", "filter", "order", "merge", "waiting"):
                assert float(lines[f"ns_{phase}_after_first"]) >= 0, (finder, phase)
        code, lines, errors = replay(program, f"{folder}/drum_cut_wrong.h5", "--finder", finder)
        assert code == 1 and f"step {WRONG_STEP}: {finder} found" in errors, (finder, code, errors)
        assert "result" not in lines
    code, _, errors = replay(program, f"{folder}/drum_cut.h5", "--finder", "octree")
    assert code == 2 and "octree" in errors, (code, errors)
    code, _, errors = replay(program, f"{folder}/missing.h5")
    assert code == 2 and "missing.h5" in errors, (code, errors)


if __name__ == "__main__":
    main()
