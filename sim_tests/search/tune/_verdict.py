"""The verdict of a tuning in sentences: whether a chosen policy is better than the base policy."""

from __future__ import annotations

from awarenav.errors import counted

from ...study.measures import FEW_PAIRS, Interval, zero_of_n_upper
from ._evaluation import BEATS_BASE, OBJECTIVE, Candidate, level_of
from ._tune import Tuning


def verdict_text(tuning: Tuning) -> str:
    """Return whether a chosen policy is better than the base policy, in sentences."""
    base, winner = tuning.base, tuning.winner
    if not tuning.ranked:
        return (
            f"keep {base.name}. No trial ran all of its episodes within the bounds and without "
            "a contact with the moving robot."
        )
    if winner is not None:
        return (
            f"{BEATS_BASE} ({_also(winner)}) is better than {base.name}. "
            + _comparison(tuning, winner)
            + " It has not been falsified yet."
        )
    nearest = nearest_candidate(tuning)
    if nearest is None:
        return (
            f"keep {base.name}. No trial within the bounds differs from it and the presets."
            + _better_preset(tuning)
        )
    reason = _reason(tuning, nearest)
    return (
        f"keep {base.name}. The nearest is {nearest.name} ({_also(nearest)}): {reason}. "
        + _comparison(tuning, nearest)
        + _better_preset(tuning)
    )


def _better_preset(tuning: Tuning) -> str:
    """Return a sentence on the preset with the least time lost, if the base policy loses more."""
    faster = [
        each
        for each in tuning.anchors[1:]
        if "scanner" not in each.names  # today's AMR is no policy to choose
        and not each.held_out.moving_contacts
        and tuning.allows(each)
        and tuning.minus_base(each).value < 0.0
    ]
    if not faster:
        return ""
    best = min(faster, key=lambda each: tuning.minus_base(each).value)
    return (
        f" Of the presets, {best.name} {change_text(tuning.minus_base(best))} than "
        f"{tuning.base.name}: compare with it, too."
    )


def nearest_candidate(tuning: Tuning) -> Candidate | None:
    """Return the chosen policy with the fewest contacts and the least time lost on held-out.

    One above the risk or the bound of requests comes after those within it.
    """
    return min(
        tuning.chosen,
        key=lambda each: (
            each.held_out.moving_contacts,
            not tuning.allows(each),
            each.held_out.figures,
        ),
        default=None,
    )


def is_undecided(tuning: Tuning) -> bool:
    """Return whether more held-out episodes could show that a chosen policy is better."""
    return tuning.winner is None and any(
        not each.held_out.moving_contacts
        and tuning.allows(each)
        and tuning.minus_base(each).value < 0.0
        for each in tuning.chosen
    )


def _also(candidate: Candidate) -> str:
    return ", ".join([f"trial {candidate.trial}", *candidate.names[1:]])


def _reason(tuning: Tuning, candidate: Candidate) -> str:
    """Return why a policy does not beat the base policy."""
    if candidate.held_out.moving_contacts:
        return "the moving robot and a person touched in held-out episodes"
    if not tuning.allows(candidate):
        risky = candidate.held_out.risk > tuning.held_out_risk
        what = "is above the risk" if risky else "asks for attention too often"
        return f"it {what} on held-out episodes"
    change = tuning.minus_base(candidate)
    if change.n < FEW_PAIRS:
        return f"fewer than {FEW_PAIRS} pairs of held-out episodes show nothing"
    if change.low <= 0.0 <= change.high:
        return "a difference is not shown"
    if change.low > 0.0:
        return "it is shown to lose more time"
    return "it does not hold in the held-out scenarios alone"


def _comparison(tuning: Tuning, candidate: Candidate) -> str:
    """Return the differences to the base policy on held-out episodes, and the contacts."""
    settings, base = tuning.settings, tuning.base
    level = level_of(len(tuning.chosen))
    held_out = candidate.held_out
    text = f"On {counted(len(held_out.records), 'held-out episode')} it " + change_text(
        tuning.minus_base(candidate)
    )
    if settings.hold_out_scenarios:
        alone = held_out.within(settings.hold_out_scenarios)
        where = counted(len(settings.hold_out_scenarios), "held-out scenario")
        text += f"; in the {where} alone it " + change_text(
            alone.minus(base.held_out, OBJECTIVE, level)
        )
    else:
        text += "; no scenario was held out"
    n, contacts = len(held_out.records), held_out.moving_contacts
    touched = (
        f"The moving robot touched nobody (at most {100.0 * zero_of_n_upper(n):.1f} % with 95 % "
        "confidence)."
        if not contacts
        else f"The moving robot and a person touched in {contacts} of them."
    )
    risk = (
        f"It has {held_out.risk:.2f} step-out impacts per 1 000 crossings, {base.name} "
        f"{base.held_out.risk:.2f}; {tuning.held_out_risk:.2f} are allowed."
    )
    if tuning.asks:
        most = "" if settings.requests is None else f"; {settings.requests:g} are allowed"
        risk += (
            f" It makes {held_out.requests:.2f} requests for attention per crossing, {base.name} "
            f"{base.held_out.requests:.2f}{most}."
        )
    return f"{text} ({100.0 * level:.4g} % intervals). {risk} {touched}"


def change_text(change: Interval) -> str:
    """Return a paired difference in time lost in words, such as ``"loses 0.30 s less (…)"``."""
    if not change.known:
        return "loses ? (no pair)"
    amount = f"{abs(change.value):.2f}"
    text = f"loses {amount} s {'less' if change.value < 0.0 else 'more'}"
    if not float(amount):
        text = "loses neither less nor more"
    if not change.bounded:
        return f"{text} (too few pairs for an interval)"
    return f"{text} ({change.low:+.2f} to {change.high:+.2f} s)"
