"""Summary of a report: for each arm one sentence and four figures with their uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from ..measures import ATTENTIVE_FROM, FEW_PAIRS, SHARES, Comparison, Interval
from ._arm import Arm, judged_arms
from ._statistics import RunStatistics, Unconfirmed, moving_contacts
from ._text import NOTHING, count, percent, plural

# Above this upper bound, "none seen" says too little.
_LARGEST_SHARE: Final = 0.05

Tone = Literal["good", "bad", "open"]


@dataclass(frozen=True, slots=True)
class Card:
    """One figure.

    Attributes:
        title: name of the figure.
        figure: the number.
        detail: its uncertainty.
        chip: the assessment in two or three words.
        tone: tone of the chip; ``"open"`` for no assessment.
    """

    title: str
    figure: str
    detail: str
    chip: str
    tone: Tone


@dataclass(frozen=True, slots=True)
class Verdict:
    """The summary of one arm; ``note`` names what its figures leave out."""

    name: str
    look: int
    sentence: str
    cards: tuple[Card, ...]
    note: str = ""


def verdicts(statistics: RunStatistics) -> tuple[Verdict, ...]:
    """Return the verdict of each candidate, or of every arm without candidates."""
    return tuple(_verdict(statistics, arm) for arm in judged_arms(statistics.arms))


def _verdict(statistics: RunStatistics, arm: Arm) -> Verdict:
    # Contacts count under every fault.
    episodes = (*arm.episodes, *arm.others)
    contacts = moving_contacts(episodes)
    if not contacts.n:
        card = Card(
            SHARES["moving_contacts"].title, NOTHING, "no episode finished", "no data", "open"
        )
        return Verdict(arm.name, arm.look, "No episode finished, so nothing can be said.", (card,))
    by_robot = sum(each.record.robot_touched for each in episodes)
    cards = [_contact_card(arm, contacts, by_robot)]
    sentence = _contact_sentence(contacts, by_robot)
    note = ""
    whole = statistics.against(arm)
    if whole is not None:
        unconfirmed = statistics.unconfirmed(arm)
        attentive = statistics.against(arm, "attentive")
        if attentive is not None and attentive.won_back.known:
            cards.append(_won_back_card("attentive people", attentive))
            sentence += _won_back_sentence("attentive people", attentive)
        elif unconfirmed:
            cards.append(_nobody_attentive_card())
            sentence += " Nobody was measured to be attentive, so time won back cannot be stated."
        else:
            cards.append(_won_back_card("people", whole))
            sentence += _won_back_sentence("people", whole)
        cards.append(_violation_card(statistics, arm, whole))
        note = unconfirmed_note(unconfirmed)
    elif arm.role != "reference":
        sentence += " Without the policy blind on the same seeds, time won back cannot be stated."
    cards.append(_arrival_card(arm))
    return Verdict(arm.name, arm.look, sentence, tuple(cards), note)


def unconfirmed_note(unconfirmed: Sequence[Unconfirmed]) -> str:
    """Return the sentences on pairs that count as attentive by their label alone."""
    reasons = (
        (
            f"not everybody was aware of the robot for {percent(ATTENTIVE_FROM)} of the time",
            [(each.inattentive, each.scenario) for each in unconfirmed],
        ),
        (
            "what people look at was not measured",
            [(each.not_measured, each.scenario) for each in unconfirmed],
        ),
    )
    sentences = []
    for reason, amounts in reasons:
        total = sum(amount for amount, _ in amounts)
        if total:
            names = ", ".join(f"{name} {count(n)}" for n, name in amounts if n)
            sentences.append(
                f"{plural(total, 'pair')} labelled attentive {'is' if total == 1 else 'are'} left "
                f"out of the time won back, because {reason}: {names}."
            )
    return " ".join(sentences)


def _nobody_attentive_card() -> Card:
    return Card(
        "Time won back with attentive people",
        NOTHING,
        "no pair whose people were measured to be attentive",
        "no data",
        "open",
    )


def _hits(share: Interval) -> int:
    return round(share.value * share.n)


def _contact_card(arm: Arm, share: Interval, by_robot: int) -> Card:
    title = SHARES["moving_contacts"].title
    hits = _hits(share)
    figure = f"{count(hits)} of {count(share.n)}"
    under = f", {plural(len(arm.others), 'episode')} of them under faults" if arm.others else ""
    if hits:
        detail = (
            f"{count(by_robot)} by the robot, {count(hits - by_robot)} by a person; "
            f"{percent(share.low)} to {percent(share.high)} with 95 % confidence{under}"
        )
        return Card(title, figure, detail, "contacts seen", "bad")
    detail = f"at most {percent(share.high)} with 95 % confidence{under}"
    if share.high > _LARGEST_SHARE:
        return Card(title, figure, detail, "none seen, too few to tell", "open")
    return Card(title, figure, detail, "none seen", "good")


def _contact_sentence(share: Interval, by_robot: int) -> str:
    hits = _hits(share)
    if hits:
        return (
            f"A person and the moving robot touched in {count(hits)} of "
            f"{plural(share.n, 'episode')} ({percent(share.value)}): look at these before anything "
            f"else. The robot moved into the person in {count(by_robot)} of them, and a person "
            f"walked into the moving robot in {count(hits - by_robot)}."
        )
    return (
        f"The moving robot touched nobody in {plural(share.n, 'episode')}; a true rate of up to "
        f"{percent(share.high)} remains possible."
    )


def _won_back_card(who: str, against: Comparison) -> Card:
    back, reference = against.won_back, against.baseline
    title = f"Time won back with {who}"
    if not back.known:
        return Card(title, NOTHING, f"no pair with {reference} loses time", "no data", "open")
    chip, tone = _direction(back, "gain shown", "loss shown", "no gain shown", more_is_good=True)
    detail = _detail(back, f"of what {reference} loses")
    return Card(title, percent(back.value), detail, chip, tone)


def _won_back_sentence(who: str, against: Comparison) -> str:
    back, reference = against.won_back, against.baseline
    if not back.known:
        return f" No pair with {reference} tells what it wins back."
    if back.n < FEW_PAIRS:
        return (
            f" Over only {plural(back.n, 'pair')} with {reference} it wins back "
            f"{percent(back.value)} of the time lost to {who}: too few to tell."
        )
    if back.low > 0.0:
        return (
            f" It wins back {percent(back.value)} of the time that {reference} loses to {who} "
            f"(95 % interval {_ends(back)})."
        )
    if back.high < 0.0:
        return (
            f" It loses {percent(-back.value)} more time to {who} than {reference} (95 % "
            f"interval {percent(-back.high)} to {percent(-back.low)})."
        )
    return f" Whether it wins back time from {who} is not shown (95 % interval {_ends(back)})."


def _violation_card(statistics: RunStatistics, arm: Arm, whole: Comparison) -> Card:
    unaware = statistics.against(arm, "unaware")
    who, against = ("people", whole) if unaware is None else ("unaware people", unaware)
    change, base = against.violation_excess, "violation time"
    if not change.known:  # the reference violates nothing
        change, base = against.violation_excess_of_time, "time"
    reference = against.baseline
    title = f"Margin violated longer with {who}"
    if not change.known:
        return Card(title, NOTHING, f"no pair with {reference}", "no data", "open")
    chip, tone = _direction(change, "longer", "shorter", "no change shown", more_is_good=False)
    detail = _detail(change, f"of {reference}'s {base}", sign=True)
    return Card(title, percent(change.value, sign=True), detail, chip, tone)


def _arrival_card(arm: Arm) -> Card:
    arrived = sum(each.record.time_to_goal_s is not None for each in arm.episodes)
    total = len(arm.episodes)
    if not total:
        return Card("Goals reached", NOTHING, "no episode without a fault", "no data", "open")
    detail = f"{count(arrived)} of {plural(total, 'episode')}"
    if arrived == total:
        return Card("Goals reached", percent(1.0), detail, "all", "good")
    chip = f"{count(total - arrived)} missed"
    return Card("Goals reached", percent(arrived / total), detail, chip, "open")


def _detail(change: Interval, base: str, *, sign: bool = False) -> str:
    if not change.bounded:
        return f"{base}; {plural(change.n, 'pair')}, too few for an interval"
    return f"{_ends(change, sign=sign)} {base}, {plural(change.n, 'pair')}"


def _ends(change: Interval, *, sign: bool = False) -> str:
    if not change.bounded:
        return "not bounded"
    return f"{percent(change.low, sign=sign)} to {percent(change.high, sign=sign)}"


def _direction(
    change: Interval, up: str, down: str, neither: str, *, more_is_good: bool
) -> tuple[str, Tone]:
    if change.n < FEW_PAIRS:
        return "too few to tell", "open"
    if change.low > 0.0:
        return up, "good" if more_is_good else "bad"
    if change.high < 0.0:
        return down, "bad" if more_is_good else "good"
    return neither, "open"
