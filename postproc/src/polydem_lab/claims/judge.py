"""All claims judged, and the page of verdicts."""

from __future__ import annotations

from ..bench.samples import Bench
from ..bench.scene_kinds import UNKNOWN
from ..bench.series import kind
from . import rules_scenes, rules_structure, rules_time  # noqa: F401  they register their rules
from .verdicts import CLAIMS, verdict_table


def judge_all(bench: Bench) -> list:
    """[(claim, finding)] in the order of the claims."""
    return [(each, each.judge(bench)) for each in sorted(CLAIMS.values(), key=lambda c: int(c.id[1:]))]


def _left_out(bench: Bench) -> str:
    """Which scenes no rule about kinds of scenes has counted; ends the sentence."""
    unknown = list(dict.fromkeys(case.scene for case in bench.select() if kind(case) == UNKNOWN))
    return f"; of {', '.join(unknown)} it is not recorded, so they count for no kind." if unknown else "."


def claims_document(bench: Bench, judged: list | None = None) -> str:
    """claims.md: the verdicts, then for each claim its rule and its reasons."""
    judged = judged or judge_all(bench)
    main = bench.on()
    lines = [
        "# The claims of the paper, and what these samples say",
        "",
        f"Samples: {', '.join(str(folder) for folder in bench.folders)}. Machines: "
        f"{'; '.join(bench.named('machine'))}. {bench.origin} "
        f"Verdicts are of {'; '.join(main.named('machine'))}, build {'; '.join(main.named('build'))}, if a rule "
        "does not "
        "compare machines or builds. Intervals: 95 %, over repeats on this machine. Confirmed: the whole interval is "
        "within the rule; contradicted: all of it is outside; else undecided. Of several parts: confirmed or "
        "contradicted "
        "if all parts are, confirmed in part if some are confirmed and some contradicted, undecided if undecided parts "
        "could change the verdict. What a scene is follows from the settings recorded with its samples"
        + _left_out(main),
        "",
        verdict_table(judged).written("markdown"),
        "",
        "## Rules and reasons",
        "",
    ]
    for each, finding in judged:
        lines += [
            f"* **{each.id}** {each.text}. *Rule:* {each.threshold}. *Verdict:* {finding.verdict}. "
            f"{finding.reason}".rstrip(),
        ]
    return "\n".join([*lines, ""])
