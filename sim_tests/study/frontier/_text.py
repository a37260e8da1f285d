"""The frontier in words: a table of the policies, and two sentences about awareness."""

from __future__ import annotations

from typing import Final

from awarenav.errors import counted

from ..measures import NOTHING, Interval
from ..report import Table
from ._frontier import Frontier, Worth

# The policy of the sentences, chosen beforehand: that of `balanced`.
_SPEED_MPS: Final = 1.5
_KINDS: Final = {"blind": "none", "aware": "who looks", "memory": "who looks or has looked"}
_HEADER: Final = (
    "policy",
    "U (m/s)",
    "awareness",
    "time lost (s)",
    "time over today's",
    "impacts",
    "wins at equal risk (s)",
    "avoids at equal time",
)


def frontier_text(frontier: Frontier) -> str:
    """Return the frontier as Markdown: the sentences, the episodes and a table."""
    worth = {each.member.name: each for each in frontier.worth}
    rows = []
    for point in frontier.points:
        own, member = worth.get(point.name), point.member
        rows.append(
            (
                f"`{point.name}`",
                NOTHING if member is None else f"{member.speed_mps:g}",
                NOTHING if member is None else _KINDS[member.kind],
                point.time_lost_s.text(),
                point.time_over_today.text(),
                point.step_out_unaware.text(),
                NOTHING if own is None else own.at_equal_risk_s.text(),
                NOTHING if own is None else own.at_equal_time.text(),
            )
        )
    table = Table(dict.fromkeys(_HEADER, ""), rows).markdown()
    episodes = (
        f"{counted(frontier.episodes, 'episode')} of each policy in "
        f"{counted(frontier.scenarios, 'scenario')}; 95 % intervals. Impacts: step-out impacts "
        "with unaware people, per 1 000 crossings."
    )
    return "\n\n".join([*sentences(frontier), episodes, table]) + "\n"


def sentences(frontier: Frontier) -> tuple[str, ...]:
    """Return what awareness wins at equal risk and at equal time, one sentence each.

    They are about the policy with the U of ``balanced``, and with its memory if the run has that.
    """
    rows = [each for each in frontier.worth if each.member.speed_mps == _SPEED_MPS]
    if not rows:
        return ()
    worth = rows[-1]  # memory comes last
    return _at_equal_risk(worth), _at_equal_time(worth)


def _at_equal_risk(worth: Worth) -> str:
    won = worth.at_equal_risk_s
    if not won.known:
        return "At equal risk: no figure, as no policy without awareness has so many impacts."
    text = (
        f"At equal risk, awareness {_verb(won, 'wins', 'loses')} {_amount(won)} s a crossing "
        f"{_bounds(won)}"
    )
    attentive = worth.attentive_s
    if attentive.known:
        text += (
            f", and {_verb(attentive, 'wins', 'loses')} {_amount(attentive)} s with attentive "
            f"people {_bounds(attentive)}"
        )
    return f"{text} (`{worth.member.name}`)."


def _at_equal_time(worth: Worth) -> str:
    avoided = worth.at_equal_time
    if not avoided.known:
        return "At equal time: no figure, as no policy without awareness is so slow."
    return (
        f"At equal time, it {_verb(avoided, 'avoids', 'adds')} {_amount(avoided)} step-out impacts "
        f"with unaware people per 1 000 crossings {_bounds(avoided)}."
    )


def _verb(interval: Interval, positive: str, negative: str) -> str:
    return positive if interval.value >= 0.0 else negative


def _amount(interval: Interval) -> str:
    return f"{abs(interval.value):.2f}"


def _bounds(interval: Interval) -> str:
    """Return the interval of the signed figure, ``"[?]"`` without bounds."""
    _, _, bounds = interval.text().partition(" ")
    return bounds
