"""Numbers that others published or measured, beside which ours are set.

Paper: Krengel, Watanabe, Kandori, Chen, Matuttis, "Tree codes and sort-and-sweep algorithms for neighborhood
computation: A cache-conscious comparison" (2026). What its figures show without a number in the text is not here.
"""

#: Table 1: processor, its clock [GHz], processors/cores, memory, caches
MACHINES = (
    ("Intel Xeon E5-2667v2 (Xeon32)", "3.3", "2/32", "DDR3", "512 KB, 4 MB, 50 MB"),
    ("Intel Xeon E5-2680v4 (Xeon56)", "2.4", "2/56", "DDR4", "896 KB, 7 MB, 70 MB"),
    ("Apple M2, P-core", "3.5", "1/4", "LPDDR5", "128 KB, 16 MB shared, undisclosed"),
    ("Apple M2, E-core", "2.4", "1/4", "LPDDR5", "64 KB, 4 MB shared, undisclosed"),
    ("Apple M4, P-core", "4.4", "1/4", "LPDDR5X", "128 KB, 16 MB shared, undisclosed"),
    ("Apple M4, E-core", "2.6", "1/6", "LPDDR5X", "64 KB, 4 MB shared, undisclosed"),
)

#: Table 2: boxes -> (depth of the tree, nodes reserved)
DEPTH_AND_NODES = {2522: (9, 87381), 5058: (9, 87381), 7599: (10, 349525), 10014: (10, 349525), 12651: (10, 349525)}

#: Table 3: part of the program -> cyclomatic complexity of sweep, tree inlined, tree not inlined
COMPLEXITY = {
    "initialization": (4, 19, 19),
    "updating data structure": (64, 45, 25),
    "updating contact list": (2, 209, 33),
    "total": (70, 273, 77),
}

#: Fig. 9: exponents of time over size, and time of the tree over that of the sweep
TOTAL_SLOPE = {"sort_and_sweep": 0.992, "quadtree": 0.994}
TOTAL_RATIO = 0.9

#: Fig. 10: the same of the update of the structure alone
UPDATE_SLOPE = {"sort_and_sweep": 1.43, "quadtree": 1.39}
UPDATE_RATIO = 0.1

#: Fig. 11: exponents with and without inlining; below the first number of boxes inlining hurts, beyond the second
#: it helps; near the first one times lie above the trend
INLINING_SLOPE = {"quadtree": 0.994, "quadtree_called": 1.1}
INLINING_HURTS_BELOW = 5000
INLINING_HELPS_BEYOND = 10000

#: Fig. 12: interpreted over compiled, for the smallest and for the largest system
COMPILED_GAIN = (8.0, 18.0)

#: Smallest and largest drum of the paper [boxes]
SIZES = (2522, 12651)

#: Rate of rotation of the paper's drum [revolutions/s]
RATE = 0.25

#: Boxes -> processor time per step of (tree, sweep) [ms] when the authors' published MATLAB example runs in GNU Octave
#: 7.3: an interpreter without just-in-time compilation, on a shared virtual machine of two cores, 15 to 60 steps of a
#: drum in prescribed rotation. It is neither MATLAB nor the authors' code for the paper: an indication, no more.
OCTAVE = {
    1871: (123.34, 214.70),
    2508: (142.87, 257.94),
    5111: (287.14, 613.51),
    7603: (598.42, 1371.38),
    10001: (1053.44, 2302.26),
    12651: (1146.13, 2811.87),
}


def full_tree(depth: int) -> int:
    """Nodes of a quadtree with all its levels: the array that the paper's program reserves."""
    return (4**depth - 1) // 3
