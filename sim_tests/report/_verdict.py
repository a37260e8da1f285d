"""What a reader in a hurry takes away: a sentence and four figures, none claiming too much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from ._arm import Arm, judged
from ._episode import Episode
from ._estimates import Estimate, difference_of, share_of, won_back_of
from ._measure import VIOLATION
from ._text import count, number, percent, plural

Tone = Literal["good", "bad", "open"]


@dataclass(frozen=True, slots=True)
class Card:
    """One figure.

    Attributes:
        title: what it is.
        figure: the number, large.
        detail: its uncertainty.
        chip: what it amounts to, in two or three words.
        tone: of the chip; ``"open"`` where nothing can be said.
    """

    title: str
    figure: str
    detail: str
    chip: str
    tone: Tone


@dataclass(frozen=True, slots=True)
class Verdict:
    """What can be said about one arm."""

    name: str
    look: int
    sentence: str
    cards: tuple[Card, ...]


def verdicts(arms: Sequence[Arm]) -> tuple[Verdict, ...]:
    """One verdict for each arm that is to be judged."""
    reference = next((arm for arm in arms if arm.role == "reference"), None)
    return tuple(_verdict(arm, reference) for arm in judged(arms))


def robot_contacts(episodes: Sequence[Episode]) -> Estimate | None:
    """The share of episodes in which the robot moved into a person."""
    return share_of(sum(each.record.robot_contacts > 0 for each in episodes), len(episodes))


def of_attention(episodes: Sequence[Episode], attention: str) -> tuple[Episode, ...]:
    """The episodes of scenarios of that attention."""
    return tuple(each for each in episodes if each.record.attention == attention)


def _verdict(arm: Arm, reference: Arm | None) -> Verdict:
    # Touching somebody counts whatever made it happen.
    episodes = (*arm.episodes, *arm.faulted)
    contacts = robot_contacts(episodes)
    if contacts is None:
        nothing = Card("Contacts caused by the robot", "–", "no episode finished", "no data", "open")
        return Verdict(arm.name, arm.look, "No episode finished, so nothing can be said.", (nothing,))
    cards = [_contact_card(arm, contacts)]
    sentence = _contact_sentence(contacts)
    if reference is not None and arm is not reference:
        who, back = _won_back(arm, reference)
        cards += [_won_back_card(who, back, reference), _violation_card(arm, reference)]
        sentence += _won_back_sentence(who, back, reference)
    elif reference is None:
        sentence += " Without the policy blind on the same seeds, time won back cannot be stated."
    cards.append(_arrival_card(arm))
    return Verdict(arm.name, arm.look, sentence, tuple(cards))


def _hits(share: Estimate) -> int:
    return round(share.value * share.count)


def _contact_card(arm: Arm, share: Estimate) -> Card:
    hits = _hits(share)
    figure = f"{count(hits)} of {count(share.count)}"
    under = f", {plural(len(arm.faulted), 'episode')} of them under faults" if arm.faulted else ""
    if hits:
        detail = f"{percent(share.low)} to {percent(share.high)} with 95 % confidence{under}"
        return Card("Contacts caused by the robot", figure, detail, "contacts seen", "bad")
    detail = f"at most {percent(share.high)} with 95 % confidence{under}"
    return Card("Contacts caused by the robot", figure, detail, "none seen", "good")


def _contact_sentence(share: Estimate) -> str:
    hits = _hits(share)
    if hits:
        return (
            f"The robot moved into a person in {count(hits)} of {plural(share.count, 'episode')} "
            f"({percent(share.value)}): do not use it as it is."
        )
    return (
        f"The robot moved into nobody in {plural(share.count, 'episode')}; a true rate of up to "
        f"{percent(share.high)} remains possible."
    )


def _won_back(arm: Arm, reference: Arm) -> tuple[str, Estimate | None]:
    """With attentive people where there are such scenarios, else with all."""
    attentive = won_back_of(
        of_attention(reference.episodes, "attentive"), of_attention(arm.episodes, "attentive")
    )
    if attentive is not None:
        return "attentive people", attentive
    return "people", won_back_of(reference.episodes, arm.episodes)


def _won_back_card(who: str, back: Estimate | None, reference: Arm) -> Card:
    title = f"Time won back with {who}"
    if back is None:
        return Card(title, "–", f"no pair with {reference.name} loses time", "no data", "open")
    chip, tone = _direction(back, "gain shown", "loss shown", "no gain shown", more_is_good=True)
    detail = (
        f"{percent(back.low)} to {percent(back.high)} of what {reference.name} loses, "
        f"{plural(back.count, 'pair')}"
    )
    return Card(title, percent(back.value), detail, chip, tone)


def _won_back_sentence(who: str, back: Estimate | None, reference: Arm) -> str:
    if back is None:
        return f" There is no pair with {reference.name} that would tell what it wins back."
    interval = f"(95 % interval {percent(back.low)} to {percent(back.high)})"
    if back.low > 0.0:
        return (
            f" It wins back {percent(back.value)} of the time that {reference.name} loses to {who} "
            f"{interval}."
        )
    if back.high < 0.0:
        return f" It loses {percent(-back.value)} more time to {who} than {reference.name}."
    return f" Whether it wins back time from {who} is not shown {interval}."


def _violation_card(arm: Arm, reference: Arm) -> Card:
    who = "unaware people"
    change = difference_of(
        of_attention(reference.episodes, "unaware"),
        of_attention(arm.episodes, "unaware"),
        VIOLATION.value,
    )
    if change is None:
        who = "people"
        change = difference_of(reference.episodes, arm.episodes, VIOLATION.value)
    title = f"Margin violated with {who}, against {reference.name}"
    if change is None:
        return Card(title, "–", f"no pair with {reference.name}", "no data", "open")
    chip, tone = _direction(change, "more", "less", "no difference shown", more_is_good=False)
    detail = (
        f"{number(change.low, sign=True)} to {number(change.high, sign=True)} s an episode, "
        f"{plural(change.count, 'pair')}"
    )
    return Card(title, f"{number(change.value, sign=True)} s", detail, chip, tone)


def _arrival_card(arm: Arm) -> Card:
    arrived = share_of(
        sum(each.record.time_to_goal_s is not None for each in arm.episodes), len(arm.episodes)
    )
    if arrived is None:
        return Card("Goals reached", "–", "no episode without a fault", "no data", "open")
    detail = f"{count(_hits(arrived))} of {plural(arrived.count, 'episode')}"
    if arrived.value == 1.0:
        return Card("Goals reached", percent(1.0), detail, "all", "good")
    left = arrived.count - _hits(arrived)
    return Card("Goals reached", percent(arrived.value, 1), detail, f"{count(left)} missed", "open")


def _direction(
    change: Estimate, up: str, down: str, neither: str, *, more_is_good: bool
) -> tuple[str, Tone]:
    if change.low > 0.0:
        return up, "good" if more_is_good else "bad"
    if change.high < 0.0:
        return down, "bad" if more_is_good else "good"
    return neither, "open"
