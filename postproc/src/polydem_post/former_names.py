"""Names in results of file layout 1, and what they are called today.

Readers look a name up here, so results of all versions appear under the names of today.
"""

from __future__ import annotations

#: Stages of the time step
STAGES = {"exchange": "decomposition"}

#: Counters of a run and counts of a finder
COUNTERS = {
    "settlements": "redistributions",
    "divisions of space": "partitions of space",
    "processes": "ranks",
    "ghosts, summed over steps": "halo bodies, summed over steps",
    "messages to ghosts": "halo messages",
    "bytes to ghosts": "halo bytes",
    "most of a process: bodies": "maximum per rank: bodies",
    "most of a process: pairs": "maximum per rank: pairs",
    "most of a process: ghosts": "maximum per rank: halo bodies",
    "most of a process: messages": "maximum per rank: messages",
    "most of a process: bytes": "maximum per rank: bytes",
    "pair_contradictions": "pair contradictions",
    "finder leavers": "finder left_leaf",
    "leavers": "left_leaf",
}

#: Entries of the namelist, group.key
ENTRIES = {
    "exchange.cut": "decomposition.partition",
    "exchange.margin": "decomposition.margin",
    "exchange.balance": "decomposition.balance",
    "exchange.imbalance": "decomposition.imbalance",
    "output.ledger": "output.energy_balance",
    "scene.movers": "scene.moving_grains",
}

#: Columns of tables of counts
COLUMNS = {
    "cut": "partition",
    "settlements": "redistributions",
    "divisions": "partitions",
    "ghosts": "halo_bodies",
    "ghosts_most": "halo_bodies_most",
    "most_ghosts": "most_halo_bodies",
    "ghosts_per_grain": "halo_bodies_per_grain",
}

#: Data sets of the energy balance lie in the first of these groups that a file has
BALANCE_GROUPS = ("energy_balance", "ledger")


def present(names: dict, name: str) -> str:
    """The name of today."""
    return names.get(name, name)


def balance_of(file):
    """Group of the energy balance in an open segment; empty if the run did not compute it."""
    return next((file[group] for group in BALANCE_GROUPS if group in file), {})
