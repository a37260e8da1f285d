"""The race of a trial against the base policy: few episodes first, and an end when it loses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, Literal

from ._evaluation import OBJECTIVES, Evaluation

#: Why a trial ended before all of its episodes; empty if it did not.
Dropped = Literal["", "contact", "loses"]

# With fewer pairs of episodes, the bootstrap interval is too narrow to end a trial.
_LEAST_PAIRS: Final = 12


def stages(seeds: range) -> Iterator[range]:
    """Yield consecutive parts of the seeds, after which 1, 2, 4, 8, … and all of them have run."""
    done = 0
    while done < len(seeds):
        step = min(max(done, 1), len(seeds) - done)
        yield seeds[done : done + step]
        done += step


def dropped(candidate: Evaluation, base: Evaluation) -> Dropped:
    """Return why a trial need not run more episodes, or an empty text.

    A contact that the robot caused ends it. So does an objective in which the paired 95 % interval
    shows that it is worse than the base policy, unless it is shown to be better in the other one:
    such a trial may still lie on the front.

    Args:
        candidate: the episodes of the trial so far.
        base: the base policy on at least the same episodes.
    """
    if candidate.robot_contacts:
        return "contact"
    differences = [candidate.minus(base, objective) for objective in OBJECTIVES]
    if min(each.n for each in differences) < _LEAST_PAIRS:
        return ""
    is_worse = any(each.low > 0.0 for each in differences)
    is_better = any(each.high < 0.0 for each in differences)
    return "loses" if is_worse and not is_better else ""
