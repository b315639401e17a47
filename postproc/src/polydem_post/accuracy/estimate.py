"""Errors of one quantity, from its values in windows of other steps, stiffnesses and rounding errors.

All numbers are shares of the scale of the quantity. Steps and stiffnesses are factors of those of the scene.

Integration error. Values at three steps 2 dt, dt, dt/2 give the order m = log2((q(2 dt) - q(dt))/(q(dt) - q(dt/2)))
(L.F. Richardson & J.A. Gaunt, Phil. Trans. R. Soc. A 226 (1927) 299). Where they give none, the error is that of
order 1.

Distance from infinite stiffness. Values at E, 4 E and 16 E at an equal share of the stable step give the order
p = log4((q(E) - q(4 E))/(q(4 E) - q(16 E))) and the limit. The limit that E/4, E and 4 E give differs from it by what
the order changes: the uncertainty.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

#: Orders in the stiffness that are believed
LEAST_ORDER, GREATEST_ORDER = 0.15, 1.2

#: Orders in the time step that are believed; without one, the error is that of order 1
LEAST_STEP_ORDER, GREATEST_STEP_ORDER, UNKNOWN_STEP_ORDER = 0.7, 4.5, 1.0

#: Shares of the tolerance that integration and a fitted distance may have; the rest is for what the fit misses. A bound
#: of the distance may have all of it
INTEGRATION_SHARE, DISTANCE_SHARE, BOUND_SHARE = 1.0 / 3.0, 0.5, 2.0 / 3.0

#: A difference of two values below so many times the noise is noise
SPREADS = 2.0

#: Differences of stiffness are not separated from integration errors below this share of them
SEPARATE = 0.1

#: Ratio of the stiffnesses of neighbouring windows
RATIO = 4.0

#: The greatest factor of stiffness that is recommended
MOST = 100.0

#: States of an estimate
FITTED, CONVERGED, NOISE, REFUSED, CONSTANT = "fitted", "converged", "below the noise", "refused", "constant"


@dataclass(frozen=True)
class Integration:
    """Errors of integration at the stiffness of the scene."""

    #: Value for dt -> 0
    limit: float
    #: Measured order; None: order 1 is assumed
    order: float | None
    #: What the limit may be wrong by
    doubt: float
    #: Step -> value
    values: dict[float, float]

    def error(self, step: float) -> float:
        """Magnitude of the error at a step that was run."""
        return abs(self.values[step] - self.limit) + self.doubt

    def widest(self, allowed: float, stable: set[float]) -> float:
        """The largest of the stable steps with an error below the allowed one, as all smaller ones have."""
        kept = 0.0
        for step in sorted(self.values):
            if self.error(step) > allowed or step not in stable:
                break
            kept = step
        if kept > 0.0:
            return kept
        finest = min(self.values)
        order = UNKNOWN_STEP_ORDER if self.order is None else self.order
        return 0.9 * finest * (allowed / self.error(finest)) ** (1.0 / order)


def noise_of(value: float, changed: list[float], near: list[float]) -> float:
    """What a value may be off without a reason that can be fitted.

    It is the spread of windows that differ in last bits, or what the value lacks of the mean of those at stiffnesses
    just above and below, times two: a smooth function of the stiffness lacks nothing. Where the order of collisions
    depends on the stiffness the second is large long before last bits have grown.
    """
    spread = max([value, *changed]) - min([value, *changed])
    return max(spread, abs(sum(near) - len(near) * value))


def integrate(values: dict[float, float], noise: float) -> Integration:
    """Errors of integration from values at the steps 1/2 and 1 and at larger ones that could be run."""
    fine = values[1.0] - values[0.5]
    coarse = values[2.0] - values[1.0] if 2.0 in values else math.nan
    least = SPREADS * noise
    if abs(fine) > least and abs(coarse) > least and fine * coarse > 0.0:
        order = math.log2(coarse / fine)
        if LEAST_STEP_ORDER <= order <= GREATEST_STEP_ORDER:
            return Integration(values[1.0] - fine / (1.0 - 2.0**-order), order, 0.0, values)
    return Integration(values[0.5], None, abs(fine), values)


@dataclass
class Estimate:
    """All that the windows say of a quantity."""

    state: str
    #: Why, if it is refused or below the noise
    reason: str = ""
    #: See `noise_of`
    noise: float = 0.0
    integration: Integration | None = None
    #: Order in the stiffness, and the least one that the softer windows have, too; None: none was fitted
    order: float | None = None
    low_order: float | None = None
    #: Value for E -> infinity, and what it may be wrong by
    limit: float = math.nan
    doubt: float = math.nan
    #: Stiffness -> value
    values: dict[float, float] = field(default_factory=dict)

    @property
    def is_usable(self) -> bool:
        """Whether entries can be recommended for this quantity."""
        return self.state in (FITTED, CONVERGED, CONSTANT)

    @property
    def distance(self) -> float:
        """Distance of the scene from infinite stiffness, with its sign."""
        return self.values.get(1.0, math.nan) - self.limit

    def stiffness(self, tolerance: float) -> float:
        """The least factor of stiffness that keeps the tolerance, never below the softest window."""
        if self.state == CONSTANT:
            return min(self.values, default=1.0)
        allowed = DISTANCE_SHARE * tolerance
        softest = min(self.values)
        if self.state == CONVERGED:
            return softest if bound(self.values, softest, self.noise) <= BOUND_SHARE * tolerance else 1.0
        if softest < 1.0 and abs(self.values[softest] - self.limit) + self.doubt <= allowed:
            return softest
        if self.low_order is None:
            raise ValueError("a fitted estimate has an order")
        share = (abs(self.distance) + self.doubt) / allowed
        return max(1.0, share ** (1.0 / self.low_order))


def bound(values: dict[float, float], first: float, noise: float) -> float:
    """Greatest distance from the limit of the value at a stiffness if the order is the least that is believed."""
    known = sorted(stiffness for stiffness in values if stiffness >= first)
    steps = [abs(values[a] - values[b]) for a, b in zip(known, known[1:])]
    return max([*steps, noise]) / (1.0 - RATIO**-LEAST_ORDER)


def needs_separation(values: dict[float, float], integration: Integration, noise: float, tolerance: float) -> bool:
    """Whether integration errors may spoil the differences of stiffness, and these matter."""
    differences = [values[1.0] - values[4.0], values[4.0] - values[16.0]]
    if bound(values, 1.0, noise) <= BOUND_SHARE * tolerance or min(map(abs, differences)) <= SPREADS * noise:
        return False
    return integration.error(1.0) > SEPARATE * min(map(abs, differences))


def separated(stiff: dict[float, tuple[float, float]], integration: Integration) -> tuple[dict[float, float], float]:
    """Values for dt -> 0 from those at dt and dt/2, stiffness -> (value, value), and what they may be wrong by."""
    if integration.order is None:
        values = {stiffness: half for stiffness, (_, half) in stiff.items()}
        return values, max(abs(whole - half) for whole, half in stiff.values())
    share = 1.0 / (1.0 - 2.0**-integration.order)
    return {stiffness: whole - share * (whole - half) for stiffness, (whole, half) in stiff.items()}, 0.0


def estimate(values: dict[float, float], integration: Integration, noise: float, tolerance: float,
             doubt: float = 0.0) -> Estimate:
    """The distance from infinite stiffness from values at 1, 4 and 16, and at 1/4 if it could be run.

    `doubt` is what the values may be wrong by for reasons known before.
    """
    found = Estimate(NOISE, noise=noise, integration=integration, values=values)
    if noise > INTEGRATION_SHARE * tolerance:
        found.reason = f"windows that differ in last bits, or by 3 % of the stiffness, differ by {noise:.1e}"
        return found
    if bound(values, 1.0, noise) + doubt <= BOUND_SHARE * tolerance:
        found.state, found.limit = CONVERGED, values[16.0]
        found.doubt = bound({4.0: values[4.0], 16.0: values[16.0]}, 4.0, noise) * RATIO**-LEAST_ORDER + doubt
        return found
    first, second = values[1.0] - values[4.0], values[4.0] - values[16.0]
    if min(abs(first), abs(second)) <= SPREADS * noise:
        found.reason = f"differences {first:.1e} and {second:.1e}, noise {noise:.1e}"
        return found
    order, why = order_of(first, second)
    if order is None:
        found.state, found.reason = REFUSED, why
        return found
    limit = values[16.0] - second / (RATIO**order - 1.0)
    softer = order_of(values[0.25] - values[1.0], first)[0] if 0.25 in values else None
    found.state, found.order, found.limit = FITTED, order, limit
    if softer is None:
        # Nothing tells how the order changes: as if the last correction could be wrong altogether.
        found.low_order, change = order, abs(limit - values[16.0])
        if 0.25 in values:
            change = abs(values[1.0] - limit)
    else:
        found.low_order = min(order, softer)
        change = abs(limit - (values[4.0] - first / (RATIO**softer - 1.0)))
    found.doubt = change + noise / (RATIO**order - 1.0) + doubt
    return found


def order_of(first: float, second: float) -> tuple[float | None, str]:
    """Order in the stiffness from two differences, or why there is none that is believed."""
    if first * second <= 0.0:
        return None, f"the differences {first:.1e} and {second:.1e} change sign"
    order = math.log(first / second) / math.log(RATIO)
    if not LEAST_ORDER <= order <= GREATEST_ORDER:
        return None, f"the order {order:.2f} is not between {LEAST_ORDER:g} and {GREATEST_ORDER:g}"
    return order, ""
