"""Time of a step on many ranks, predicted from counts.

What ranks tell each other is counted exactly, on any machine, by runs of the program (exchange_runs.py) and, in still
packings, by `count_exchange` (tests/ranks/partition). A rank has halo bodies in a strip around its region. If n grains
fill a square of side sqrt(n), in mean distances of grains, and the strip is w wide, then n + halo bodies =
(sqrt(n) + 2 w)^2, so

    halo bodies per grain = 4 w sqrt(P/N) + 4 w^2 P/N

for N grains on P ranks. Every count gives a w; how well these agree tells how well the law holds. Time then follows
from the cost of a body, latency and bandwidth, which are measured elsewhere and given.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from polydem_post.base.emit import Table
from polydem_post.base.result_file import ResultError

from ..bench.records import read_records
from ..bench.statistics import number

#: From so many ranks on one of them has neighbours on all sides
SURROUNDED = 9

#: Numbers of ranks of the table
RANKS = tuple(2**k for k in range(13))

#: Bytes of a rectangle that is told to all ranks
RECTANGLE = 32

#: What handing bodies out anew takes: calls in which all ranks take part, and rounds of messages to neighbours
REDISTRIBUTION_CALLS, REDISTRIBUTION_ROUNDS = 13, 9


@dataclass(frozen=True)
class Count:
    """What ranks would tell each other in a step; the columns of a file of count_exchange that are used here."""

    #: Packing: box or drum
    shape: str
    #: Grains of all ranks
    grains: int
    #: Number of ranks
    ranks: int
    #: How far grains may move until regions are found anew, in long axes; of runs in m, 0 if they choose it
    margin: float
    #: Grains of the rank that has most
    grains_most: int
    #: Halo bodies of all ranks
    halo_bodies: int
    #: Halo bodies of the rank that has most
    halo_bodies_most: int
    #: Messages of all ranks
    messages: int
    #: Messages of the rank that sends most
    messages_most: int
    #: Bytes of all messages
    bytes: int
    #: Bytes that the busiest rank sends or receives
    bytes_most: int
    #: Rectangles of all ranks
    rectangles: int

    @property
    def shows_strip(self) -> bool:
        """Whether there are enough ranks, and halo bodies."""
        return self.ranks >= SURROUNDED and min(self.halo_bodies, self.halo_bodies_most) > 0

    @property
    def strip(self) -> float:
        """Width of the strip of halo bodies around the rank that has most, in mean distances of grains."""
        own = self.grains / self.ranks
        return 0.5 * (math.sqrt(own + self.halo_bodies_most) - math.sqrt(own))


@dataclass(frozen=True)
class Machine:
    """What is measured elsewhere, and what is assumed."""

    #: Time of a step per body that a rank owns [s]
    body: float
    #: Time until a message of no length arrives [s]
    latency: float = 2e-6
    #: Bytes that a rank can send and receive in a second [B/s]
    bandwidth: float = 1e9
    #: What a halo body costs, in bodies: its box, its pairs, its contacts, but no motion
    halo_body: float = 0.5
    #: Greatest work of a rank over the mean
    imbalance: float = 1.1
    #: Sums over all ranks in a step: to redistribute or fail together, and to know of signals
    sums: int = 2
    #: Steps between two redistributions of bodies; the program aims at 40 or more
    interval: float = 40.0
    #: What a redistribution costs per own body, in steps
    redistribution: float = 4.0
    #: Bytes that it tells of a halo body: its shape and state
    redistributed_bytes: float = 300.0


@dataclass(frozen=True)
class Law:
    """What grows with the number of ranks, for one packing and margin."""

    #: Width of the strip of halo bodies, in mean distances of grains
    strip: float
    #: Least and greatest width that a single count gives
    spread: tuple
    #: Messages of the busiest rank in a step
    messages: int
    #: Bytes per halo body
    halo_bytes: float
    #: Rectangles per rank
    rectangles: float
    #: Number of counts that this stands on
    counts: int

    def halo_bodies(self, grains: float) -> float:
        """Halo bodies of a rank with so many grains."""
        return 4.0 * self.strip * math.sqrt(grains) + 4.0 * self.strip**2


@dataclass(frozen=True)
class Step:
    """Times of the busiest rank in a step [s]."""

    #: Own bodies
    bodies: float
    #: Halo bodies
    halo_bodies: float
    #: Messages to neighbours
    neighbours: float
    #: Sums over all ranks
    everyone: float
    #: The share of a step in a redistribution
    redistributing: float

    @property
    def total(self) -> float:
        """Time of the step [s]."""
        return self.bodies + self.halo_bodies + self.neighbours + self.everyone + self.redistributing


def read_counts(paths) -> list[Count]:
    """Counts of all files, which count_exchange wrote for different numbers of ranks."""
    counts = []
    for path in map(Path, paths):
        counts += read_records(path, Count, "count_exchange")
        for count in counts:
            numbers = [value for value in vars(count).values() if not isinstance(value, str)]
            if count.grains < 1 or count.ranks < 1 or min(numbers) < 0:
                raise ResultError(f"{path}: is not a file of count_exchange, or was damaged: a count is negative, "
                                  f"or there "
                                  "are no grains or ranks")
    if not counts:
        raise ResultError("there are no counts: give runs of several ranks or files of count_exchange")
    return counts


def fit_law(counts: list[Count], shape: str, margin: float) -> Law:
    """The law of one packing and margin, from counts of at least SURROUNDED ranks."""
    mine = [count for count in counts if (count.shape, count.margin) == (shape, margin)]
    if not counts:
        raise ResultError("the time on many ranks is computed from runs of several ranks, but none is given")
    if not mine:
        known = sorted({f"{count.shape} {count.margin:g}" for count in counts})
        raise ResultError(f"nothing was counted for {shape} {margin:g}; there are {', '.join(known)}")
    mine = [count for count in mine if count.shows_strip]
    if not mine:
        raise ResultError(f"a prediction needs counts of at least {SURROUNDED} ranks; there are none for "
                          f"{shape} {margin:g} (packing, margin)")
    strips = [count.strip for count in mine]
    return Law(
        strip=math.exp(sum(map(math.log, strips)) / len(strips)),
        spread=(min(strips), max(strips)),
        messages=max(count.messages_most for count in mine),
        halo_bytes=sum(count.bytes for count in mine) / sum(count.halo_bodies for count in mine),
        rectangles=sum(count.rectangles for count in mine) / sum(count.ranks for count in mine),
        counts=len(mine),
    )


def predict(law: Law, machine: Machine, bodies: float, ranks: int) -> Step:
    """Times of a step of so many bodies on so many ranks; one rank alone talks to nobody."""
    own = bodies / ranks
    if ranks == 1:
        return Step(own * machine.body, 0.0, 0.0, 0.0, 0.0)
    halo_bodies = law.halo_bodies(own)
    messages = min(law.messages, ranks - 1)
    stages = math.ceil(math.log2(ranks))
    waits = REDISTRIBUTION_CALLS * stages + REDISTRIBUTION_ROUNDS * messages
    told = ranks * law.rectangles * RECTANGLE + halo_bodies * machine.redistributed_bytes
    redistribution = waits * machine.latency + told / machine.bandwidth + machine.redistribution * machine.body * own
    return Step(
        bodies=machine.imbalance * own * machine.body,
        halo_bodies=halo_bodies * machine.halo_body * machine.body,
        neighbours=messages * machine.latency + halo_bodies * law.halo_bytes / machine.bandwidth,
        everyone=machine.sums * stages * machine.latency,
        redistributing=redistribution / machine.interval,
    )


def strip_table(counts: list[Count]) -> Table:
    """How wide the strip of halo bodies is, for everything that was counted."""
    heading = ("packing", "margin", "counts", "strip", "least", "most", "messages", "rectangles per rank")
    table = Table("strips", "Width of the strip of halo bodies, in mean distances of grains", heading, texts=1)
    enough = [count for count in counts if count.shows_strip]
    for shape, margin in sorted({(count.shape, count.margin) for count in enough}):
        law = fit_law(enough, shape, margin)
        widths = [f"{width:.2f}" for width in (law.strip, *law.spread)]
        table.add(shape, f"{margin:g}", law.counts, *widths, law.messages, f"{law.rectangles:.1f}")
    table.note = (
        "Halo bodies per body are 4 w sqrt(P/N) + 4 w^2 P/N for N bodies on P ranks and a strip of width w; the rank "
        f"with most halo bodies counts, and only runs and packings on {SURROUNDED} ranks or more. Messages: those of "
        "the busiest rank in a step. Margin: of packings in long axes, of runs in m; 0: they chose it."
    )
    return table


def scale_table(law: Law, machine: Machine, bodies: float, ranks=RANKS) -> Table:
    """Time of a step against the number of ranks, with all that is assumed."""
    heading = ("ranks", "bodies per rank", "halo bodies per body", "bodies [us]", "halo bodies [us]", "neighbours [us]",
               "everyone [us]", "redistributing [us]", "step [us]", "speed-up", "efficiency [%]")
    table = Table("scale", f"Time of a step of {bodies:g} bodies, predicted", heading, texts=0)
    alone = predict(law, machine, bodies, 1).total
    for size in ranks:
        step = predict(law, machine, bodies, size)
        own = bodies / size
        gain = alone / step.total
        times = (step.bodies, step.halo_bodies, step.neighbours, step.everyone, step.redistributing, step.total)
        table.add(size, number(own, 4), number(law.halo_bodies(own) / own if size > 1 else 0.0),
                  *(number(1e6 * time) for time in times), number(gain), f"{100.0 * gain / size:.0f}")
    table.note = _assumptions(law, machine)
    return table


def _assumptions(law: Law, machine: Machine) -> str:
    """What the table stands on, in words."""
    return "\n".join((
        "Predicted, not measured. Counted: "
        f"a strip of halo bodies {law.strip:.2f} mean distances wide ({law.spread[0]:.2f} to {law.spread[1]:.2f} in "
        f"{law.counts} counts), {law.messages} messages in a step, {law.halo_bytes:.3g} bytes per halo body, "
        f"{law.rectangles:.1f} rectangles per rank.",
        f"Given: {1e6 * machine.body:g} us per body and step, latency {1e6 * machine.latency:g} us, bandwidth "
        f"{1e-9 * machine.bandwidth:g} GB/s per rank. Assumed: a halo body costs {machine.halo_body:g} of a body; the "
        f"busiest rank works {machine.imbalance:g} times the mean; {machine.sums} sums over all ranks in a step; a "
        f"redistribution every {machine.interval:g} steps that costs {machine.redistribution:g} steps of the own "
        "bodies, "
        f"{REDISTRIBUTION_CALLS} calls of all ranks, {REDISTRIBUTION_ROUNDS} rounds of messages to neighbours and "
        f"{machine.redistributed_bytes:g} bytes per halo body, and sends all rectangles to all ranks. Sums and calls "
        "take a latency for each doubling of the ranks.",
        "Messages follow one another and hide behind no work; every rank has neighbours on all sides, which is too "
        f"much below {SURROUNDED} ranks. Left out: contention in the network, that ranks of one machine share memory "
        "and caches, output, and new decompositions of space.",
    ))
