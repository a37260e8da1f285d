"""The verdict of a tuning against its base policy."""

from __future__ import annotations

from collections.abc import Container
from typing import Final

from awarenav.errors import counted

from ...study.measures import FEW_PAIRS, zero_of_n_upper
from .._verdict import change_text, is_shown, listed
from ._evaluation import OBJECTIVES
from ._finalists import BEATS_BASE, NO_WORSE, Candidate, beats, level_of
from ._tune import Tuning

_WORDS: Final = {
    "time_lost_s": (2, "loses"),
    "violation_time_s": (3, "violates the margin"),
}


def verdict_text(tuning: Tuning) -> str:
    """Return whether a chosen policy is better than the base policy, in sentences."""
    base, winner = tuning.base, tuning.winner
    if not tuning.front:
        return (
            f"keep {base.name}. No trial ran all of its episodes without a contact that the robot "
            "caused, or without losing to it."
        )
    if winner is not None:
        return (
            f"{BEATS_BASE} ({_also(winner)}) is better than {base.name}. "
            + _comparison(tuning, winner)
            + " It has not been falsified yet."
        )
    nearest = nearest_candidate(tuning)
    if nearest is None:
        return f"keep {base.name}. The front has no policy that differs from it and the presets."
    reason = _reason(tuning, nearest)
    return (
        f"keep {base.name}. The nearest is {nearest.name} ({_also(nearest)}): {reason}. "
        + _comparison(tuning, nearest)
    )


def nearest_candidate(tuning: Tuning) -> Candidate | None:
    """Return the chosen policy with the fewest contacts and the least time lost on held-out."""
    return min(
        tuning.chosen,
        key=lambda each: (each.held_out.robot_contacts, *each.held_out.objectives),
        default=None,
    )


def is_undecided(tuning: Tuning) -> bool:
    """Return whether more held-out episodes could show that a chosen policy is better."""
    return tuning.winner is None and any(
        not each.held_out.robot_contacts
        and any(tuning.minus_base(each, name).value < 0.0 for name in OBJECTIVES)
        and not any(
            is_shown(change) and change.low > 0.0
            for change in (tuning.minus_base(each, name) for name in OBJECTIVES)
        )
        for each in tuning.chosen
    )


def _also(candidate: Candidate) -> str:
    names = [name for name in candidate.names[1:] if name != NO_WORSE]
    return ", ".join([f"trial {candidate.trial}", *names])


def _reason(tuning: Tuning, candidate: Candidate) -> str:
    """Return why a policy does not beat the base policy."""
    if candidate.held_out.robot_contacts:
        return "the robot moved into a person in held-out episodes"
    changes = {name: tuning.minus_base(candidate, name) for name in OBJECTIVES}
    if min(each.n for each in changes.values()) < FEW_PAIRS:
        return f"fewer than {FEW_PAIRS} pairs of held-out episodes show nothing"
    if any(each.low > 0.0 for each in changes.values()):
        return "it is shown to be worse in one of the two"
    if not any(each.high < 0.0 for each in changes.values()):
        return "a difference is not shown"
    none: Container[str] = ()
    if beats(candidate, tuning.base, none, level_of(len(tuning.chosen))):
        return "it does not hold in the held-out scenarios alone"
    return "it is not shown to be better"


def _comparison(tuning: Tuning, candidate: Candidate) -> str:
    """Return the differences to the base policy on held-out episodes, and the contacts."""
    settings, base = tuning.settings, tuning.base
    level = level_of(len(tuning.chosen))
    held_out = candidate.held_out
    text = f"On {counted(len(held_out.records), 'held-out episode')} it " + listed(
        [change_text(tuning.minus_base(candidate, name), *_WORDS[name]) for name in OBJECTIVES]
    )
    if settings.hold_out_scenarios:
        alone = held_out.within(settings.hold_out_scenarios)
        where = counted(len(settings.hold_out_scenarios), "held-out scenario")
        text += f"; in the {where} alone it " + listed(
            [
                change_text(alone.minus(base.held_out, name, level), *_WORDS[name])
                for name in OBJECTIVES
            ]
        )
    else:
        text += "; no scenario was held out"
    n, contacts = len(held_out.records), held_out.robot_contacts
    touched = (
        f"The robot moved into nobody (at most {100.0 * zero_of_n_upper(n):.1f} % with 95 % "
        "confidence)."
        if not contacts
        else f"The robot moved into a person in {contacts} of them."
    )
    return f"{text} ({100.0 * level:.4g} % intervals). {touched}"
