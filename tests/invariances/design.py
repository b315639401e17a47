"""Which capabilities the scene of a seed has, so that rare pairs are drawn as often as others.

Seeds come in blocks. Scene by scene, a block takes the pair that it has had least, and adds what brings most pairs that
are rare so far. A capability that seldom acts on a touching body counts less, so it is taken more often.
"""

import functools
import itertools
import math
import random

from capabilities import ALTERNATIVES, CAPABILITIES, CONTAINERS, EXTRAS, IMPACTS, KINDS, SELDOM, alternatives

#: Seeds of a block
BLOCK = 60
#: Fewest and most capabilities of a scene beside container and model of contacts
FEWEST, MOST = 2, 7


def chosen_of(seed, impossible):
    """Container, model of contacts and further capabilities of the scene of a seed."""
    return block(seed//BLOCK, impossible)[seed % BLOCK]


@functools.lru_cache(maxsize=4)
def block(number, impossible):
    """The capabilities of all scenes of a block; none of impacts, which have no choice."""
    dice, design = random.Random(f"block {number}"), Design(impossible)
    first = number*BLOCK
    return [() if seed % IMPACTS == IMPACTS - 1 else design.scene(dice) for seed in range(first, first + BLOCK)]


class Design:
    """How often each pair of capabilities has been drawn in a block."""

    def __init__(self, impossible):
        self.impossible = impossible
        names = [name for name in CAPABILITIES if name != "walls"]
        self.count = {frozenset(pair): 0.0 for pair in itertools.combinations(names, 2)
                      if frozenset(pair) not in impossible and not alternatives(pair)}

    def goes(self, name, others):
        """Whether a capability goes with others."""
        return not any(frozenset((name, other)) in self.impossible for other in others) and all(
            name not in group or len(group & set(others)) < most for group, most in ALTERNATIVES)

    def need(self, pair):
        return 1/(0.3 + self.count[pair])

    def best(self, names, chosen, dice):
        """The capability that brings most of what is rare."""
        possible = [name for name in names if name not in chosen and self.goes(name, chosen)]
        gain = {name: sum(self.need(frozenset((name, other))) for other in chosen)*dice.uniform(0.7, 1)
                for name in possible}
        return max(possible, key=gain.get, default=None)

    def scene(self, dice):
        """The capabilities of one more scene."""
        rarest = max(self.count, key=lambda pair: self.need(pair)*dice.uniform(0.9, 1))
        chosen = sorted(rarest)
        for kind in (CONTAINERS, *KINDS):
            if not set(kind) & set(chosen):
                chosen.append(self.best(kind, chosen, dice))
        for _ in range(dice.randint(FEWEST, MOST) - len(set(chosen) & set(EXTRAS))):
            name = self.best(EXTRAS, chosen, dice)
            if name is None:
                break
            chosen.append(name)
        for pair in map(frozenset, itertools.combinations(chosen, 2)):
            if pair in self.count:
                self.count[pair] += math.prod(SELDOM.get(name, 1) for name in pair)
        return tuple(chosen)
