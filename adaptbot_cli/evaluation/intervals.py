"""95 % intervals: Wilson's for shares, the percentile bootstrap for means."""

import math
import random
from collections.abc import Sequence

Z = 1.959963984540054
"""The 97.5 % quantile of the normal distribution."""

RESAMPLES = 2000
Interval = tuple[float, float]


def wilson(successes: int, n: int) -> Interval:
    """Return Wilson's score interval for a share (Wilson, 1927); needs n > 0."""
    share = successes / n
    spread = Z * Z / n
    centre = (share + spread / 2) / (1 + spread)
    half = Z * math.sqrt(share * (1 - share) / n + spread / (4 * n)) / (1 + spread)
    return max(0.0, centre - half), min(1.0, centre + half)


def bootstrap(values: Sequence[float], resamples: int = RESAMPLES) -> Interval:
    """Return the percentile bootstrap interval of a mean (Efron, 1979), the same each time."""
    n = len(values)
    if min(values) == max(values):
        return float(values[0]), float(values[0])
    chance = random.Random(n)
    means = sorted(sum(chance.choices(values, k=n)) / n for _ in range(resamples))
    return means[int(0.025 * resamples)], means[int(0.975 * resamples) - 1]


def mcnemar(better: int, worse: int) -> float:
    """Return the exact two-sided p of McNemar's test for pairs that changed (Fay, 2010)."""
    n = better + worse
    if n == 0:
        return 1.0
    tail: float = sum(math.comb(n, k) for k in range(min(better, worse) + 1)) / 2**n
    return min(1.0, 2 * tail)
