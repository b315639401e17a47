"""Verdicts on the paper's claims, each computed from the samples by a rule that states its threshold.

A claim is confirmed if the whole interval of what was measured lies within the rule, contradicted if it lies outside
altogether, else undecided: a verdict does not hang on noise. Counts are exact and have no interval.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from string import ascii_lowercase

from polydem_post.base.emit import Table

from ..bench.samples import Bench

CONFIRMED = "confirmed"
IN_PART = "confirmed in part"
CONTRADICTED = "contradicted"
UNDECIDED = "undecided"
NOT_TESTABLE = "not testable here"
NOT_MEASURED = "not measured"

#: Stands for our value of a claim whose parts have values of their own
PARTS_BELOW = "by part"

#: Begins the verdict in the table that counts verdicts on parts
OF_PARTS = "parts "

#: Undecided by the quick comparison; the full one measures more
UNDECIDED_QUICK = "undecided (quick)"


class Missing(Exception):
    """What a rule needs is not among the samples; the message says what to run."""


class Elsewhere(Missing):
    """What a rule needs cannot be measured on this machine alone, however long."""


@dataclass(frozen=True)
class Part:
    """What a rule found of one part of a claim."""

    #: What the paper says
    says: str
    #: Whether that holds; None: undecided
    holds: bool | None
    #: Our value with its interval
    ours: str
    #: The verdict if it is undecided
    left_open: str = UNDECIDED

    @property
    def verdict(self) -> str:
        """The verdict on this part."""
        return self.left_open if self.holds is None else CONFIRMED if self.holds else CONTRADICTED


@dataclass(frozen=True)
class Finding:
    """What a rule found."""

    verdict: str
    #: Our value with its interval
    ours: str
    #: Why, with numbers
    reason: str = ""
    #: Whether more samples on this machine could decide it, if it is undecided or not measured
    open_here: bool = True
    #: What it found of each part of the claim, if it has several
    parts: tuple[Part, ...] = ()


@dataclass(frozen=True)
class Claim:
    """A claim of the paper and the rule that judges it."""

    id: str
    text: str
    #: The paper's value
    paper: str
    #: When it counts as confirmed
    threshold: str
    #: Tables and figures that show more
    where: str
    #: Rule: Bench -> Finding; raises Missing
    rule: Callable[[Bench], Finding]

    def judge(self, bench: Bench) -> Finding:
        """The verdict on the claim."""
        try:
            return self.rule(bench)
        except Missing as missing:
            return Finding(NOT_MEASURED, "-", f"It needs {missing}.", not isinstance(missing, Elsewhere))


#: All claims by identifier, filled by the modules of rules
CLAIMS: dict[str, Claim] = {}


def claim(identifier: str, text: str, paper: str, threshold: str, where: str):
    """Register a rule under the claim that it judges."""

    def register(rule):
        CLAIMS[identifier] = Claim(identifier, text, paper, threshold, where, rule)
        return rule

    return register


def of_parts(parts: list) -> str:
    """Verdict of a claim of several parts, each True, False or None for undecided.

    All true: confirmed; all false: contradicted; some true and some false: confirmed in part. If undecided parts could
    change that, the claim is undecided.
    """
    if True in parts and False in parts:
        return IN_PART
    if None in parts:
        return UNDECIDED
    return CONFIRMED if all(parts) else CONTRADICTED


def in_parts(parts: list[Part], reason: str = "", more: str = "") -> Finding:
    """What a rule found of a claim of several parts; `more` stands behind our values of the parts."""
    values = list(dict.fromkeys(part.ours for part in parts))
    return Finding(of_parts([part.holds for part in parts]), "; ".join([*values, *filter(None, [more])]), reason,
                   parts=tuple(parts))


def word(part: bool | None) -> str:
    """yes, no or undecided."""
    return "undecided" if part is None else "yes" if part else "no"


def said(**parts) -> str:
    """Which parts are as the paper says: bed yes, gas no, overlaps undecided."""
    return ", ".join(f"{name.replace('_', ' ')} {word(part)}" for name, part in parts.items())


def needed(found, what: str):
    """What was found, or Missing if that is nothing."""
    if not found:
        raise Missing(what)
    return found


def verdict_table(judged: list) -> Table:
    """The verdicts as a table: of each claim, and below it of each of its parts."""
    table = Table("claims", "Claims of the paper", ("claim", "says", "paper", "ours", "verdict", "look at"), texts=6)
    for each, finding in judged:
        table.add(each.id, each.text, each.paper, PARTS_BELOW if finding.parts else finding.ours, finding.verdict,
                  each.where)
        for letter, part in zip(ascii_lowercase, finding.parts):
            table.add(each.id + letter, part.says, "-", part.ours, part.verdict, "-")
    return table


def reasons_table(judged: list) -> Table:
    """Behind every verdict its rule and the reason."""
    table = Table("reasons", "Rules and reasons behind the verdicts", ("claim", "rule", "reason"), texts=3)
    for each, finding in judged:
        table.add(each.id, each.threshold, finding.reason or "-")
    return table


def counts_table(judged: list) -> Table:
    """How many claims have each verdict, and how many parts of claims."""
    table = Table("verdicts", "Claims by verdict", ("verdict", "number", "claims"), texts=1)
    claims = [(each.id, finding.verdict) for each, finding in judged]
    parts = [(each.id + letter, part.verdict) for each, finding in judged
             for letter, part in zip(ascii_lowercase, finding.parts)]
    for what, found in (("", claims), (OF_PARTS, parts)):
        for verdict in dict.fromkeys(verdict for _, verdict in found):
            named = [name for name, each in found if each == verdict]
            table.add(what + verdict, len(named), ", ".join(named))
    return table


def of_quick(judged: list) -> list:
    """The same verdicts where few repeats were taken: what they leave open is undecided for now."""
    left_open, quick = (UNDECIDED, NOT_MEASURED), []
    for each, finding in judged:
        parts = tuple(replace(part, left_open=UNDECIDED_QUICK) for part in finding.parts)
        is_open = finding.open_here and finding.verdict in left_open
        quick.append((each, replace(finding, verdict=UNDECIDED_QUICK if is_open else finding.verdict, parts=parts)))
    return quick
