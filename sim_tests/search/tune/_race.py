"""The race of a trial against the base policy: few episodes first, and an end when it loses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, Literal

from ._evaluation import OBJECTIVE, RISK, Evaluation

#: Why a trial ended before all of its episodes; empty if it did not.
Dropped = Literal["", "contact", "risk", "loses"]

# With fewer pairs of episodes, the bootstrap interval is too narrow to end a trial.
_LEAST_PAIRS: Final = 12


def stages(seeds: range) -> Iterator[range]:
    """Yield consecutive parts of the seeds, after which 1, 2, 4, 8, … and all of them have run."""
    done = 0
    while done < len(seeds):
        step = min(max(done, 1), len(seeds) - done)
        yield seeds[done : done + step]
        done += step


def dropped(candidate: Evaluation, base: Evaluation, risk: float) -> Dropped:
    """Return why a trial need not run more episodes, or an empty text.

    A contact of a moving robot ends it. So does a 95 % interval of the step-out impacts above the
    given risk, and a paired one that shows that it loses more time than a base policy within that
    risk.

    Args:
        candidate: the episodes of the trial so far.
        base: the base policy on at least the same episodes.
        risk: the given step-out impacts per 1 000 crossings.
    """
    if candidate.moving_contacts:
        return "contact"
    slower = candidate.minus(base, OBJECTIVE)
    if slower.n < _LEAST_PAIRS:
        return ""
    if candidate.interval(RISK).low > risk:
        return "risk"
    return "loses" if slower.low > 0.0 and base.risk <= risk else ""
