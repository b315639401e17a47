"""Check that the two compilations of the tree finders differ in inlining.

usage: check_inlining.py INLINED.o CALLED.o

The object without inlining must call the small procedures of the traversal, and the other object must not. Prints the
number of calls by the tree of its own procedures. (Krengel et al. 2026, section 5, compare such a pair.)
"""

import re
import subprocess
import sys

# Procedure, and a small procedure that it calls in its inner loop
PAIRS = [
    ("quadtree_search_{}_MOD_search", "is_new"),
    ("quadtree_search_{}_MOD_search", "candidates_{}_MOD_meet"),
    ("quadtree_search_{}_MOD_search", "ancestor_around"),
    ("candidates_{}_MOD_list_separated", "candidates_{}_MOD_meet"),
    ("quadtree_nodes_{}_MOD_move", "quadtree_cells_{}_MOD_holds"),
]

#: Parts of the names of the procedures of the tree; the same objects contain the filter of the filtered quadtree
TREE = ("polydem_quadtree", "__polydem_candidates", "__polydem_linked_candidates")


def calls(path):
    """Names called by each procedure of an object file, in the order of the calls."""
    listing = subprocess.run(["objdump", "-d", "-r", "--no-show-raw-insn", path], check=True, capture_output=True,
                             text=True).stdout
    found, procedure, waits = {}, None, False
    for line in listing.splitlines():
        head = re.match(r"[0-9a-f]+ <(\S+)>:", line)
        call = re.search(r"\b(?:call|jmp|bl|b)q?\s+[0-9a-f]+ <([^>+]+)", line)
        target = re.search(r"R_\S+\s+(\S+?)(?:[-+]0x[0-9a-f]+)?$", line)
        if head:
            procedure = head.group(1)
            found[procedure] = []
        elif target and waits:
            found[procedure].append(target.group(1))
        elif call and call.group(1) != procedure:
            found[procedure].append(call.group(1))
        waits = bool(re.search(r"\b(?:call|jmp|bl)q?\s", line)) if not target else False
    return found


def is_called(found, variant, procedure, small):
    """Whether a procedure, or a part that the compiler split off from it, calls a small procedure."""
    procedure, small = procedure.format(variant), small.format(variant)
    places = [name for name in found if procedure in name]
    if not places:
        sys.exit(f"check_inlining: there is no procedure {procedure}")
    return any(small in target for name in places for target in found[name])


def main(inlined_path, called_path):
    inlined, called = calls(inlined_path), calls(called_path)
    # Procedures of other layers are other objects, which neither compilation can inline. Those of the filter are large.
    numbers = [sum(f"_{variant}_MOD_" in target and any(part in target for part in TREE)
                   for name, targets in found.items() if any(part in name for part in TREE) for target in targets)
               for variant, found in (("inlined", inlined), ("called", called))]
    print(f"calls by the tree of its own procedures: {numbers[0]} inlined, {numbers[1]} not inlined")
    wrong = []
    for procedure, small in PAIRS:
        if not is_called(called, "called", procedure, small):
            wrong.append(f"{procedure.format('called')} does not call {small}")
        if is_called(inlined, "inlined", procedure, small):
            wrong.append(f"{procedure.format('inlined')} still calls {small}")
    if numbers[1] < 2 * numbers[0]:
        wrong.append("fewer than twice as many calls without inlining")
    for text in wrong:
        print(text)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
