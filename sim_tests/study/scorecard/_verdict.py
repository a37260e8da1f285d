"""Verdicts in plain English: for each planner one paragraph, and its marks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from ..measures import BASELINE, FEW_PAIRS, OVERSHOOT_MPS, Interval
from ..report import NOTHING, count, number, percent, plural
from ._plan import RADII_FACTOR
from ._score import Obedience, PlannerScore, Score, Scorecard

Tone = Literal["good", "bad", "open"]


@dataclass(frozen=True, slots=True)
class Mark:
    """One property of a planner in a few words; ``"open"`` stands for neither good nor bad."""

    text: str
    tone: Tone


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict on one planner.

    Attributes:
        name: name of the planner.
        text: some sentences.
        marks: its properties, the good and bad ones marked.
    """

    name: str
    text: str
    marks: tuple[Mark, ...]


def verdicts(card: Scorecard) -> tuple[Verdict, ...]:
    """Return the verdict on each planner; variants are judged with the planner they belong to."""
    return tuple(_verdict(card, each) for each in card.planners if not each.variant_of)


def _verdict(card: Scorecard, planner: PlannerScore) -> Verdict:
    score = planner.with_policy(card.policy)
    if score is None:
        return Verdict(
            planner.name,
            f"No episode with {card.policy} has ended, so nothing can be said.",
            (Mark("no data", "open"),),
        )
    ran = score.episodes - score.failed
    said = [_failures(planner, score)] if planner.failures else []
    marks = [Mark(f"{score.failed} of {score.episodes} failed", "bad")] if score.failed else []
    if ran:
        parts = [
            _arrival(score),
            _contacts(score),
            _margin(score),
            _limits(score),
            _radii(planner),
            _time(score, card.policy),
            _field(planner),
            _computing(planner, score),
        ]
        said += [text for text, _ in parts if text]
        marks += [mark for _, each in parts for mark in each]
    if not planner.repeats:
        said.append("It did not repeat itself with the same seed, so its figures vary by chance.")
        marks.append(Mark("does not repeat itself", "open"))
    return Verdict(planner.name, " ".join(said), tuple(marks))


def hits(share: Interval) -> int:
    """Return the number of episodes behind a share."""
    return round(share.value * share.n) if share.n else 0


def of(share: Interval) -> str:
    """Return ``"3 of 20"``; a dash for no episode."""
    return f"{count(hits(share))} of {count(share.n)}" if share.n else NOTHING


def _failures(planner: PlannerScore, score: Score) -> str:
    worst = planner.failures[0]
    total = sum(each.times for each in planner.failures)
    of_these = f", {score.failed} of them with {score.policy}" if score.failed != total else ""
    return (
        f"It failed in {plural(total, 'episode')}{of_these}; the most frequent error is: "
        f"{worst.message.rstrip('.')}."
    )


def _arrival(score: Score) -> tuple[str, list[Mark]]:
    share = score.goals
    reached = f"It reaches the goal in {of(share)} episodes with {score.policy}"
    if hits(share) == share.n:
        text = f"{reached} (at least {percent(share.low)} with 95 % confidence)."
        return text, [Mark(f"{of(share)} goals", "good")]
    text = f"{reached} ({percent(share.low)} to {percent(share.high)} with 95 % confidence)."
    return text, [Mark(f"{of(share)} goals", "bad")]


def _contacts(score: Score) -> tuple[str, list[Mark]]:
    moving, by_robot, by_person = (
        score.moving_contacts,
        score.robot_contacts,
        score.person_contacts,
    )
    walked = (
        f" People walked into the robot in {of(by_person)} episodes." if hits(by_person) else ""
    )
    if hits(by_robot):
        text = (
            f"The robot moved into a person in {of(by_robot)} episodes "
            f"({percent(by_robot.low)} to {percent(by_robot.high)})."
        )
        return text + walked, [Mark(f"contact in {of(moving)}", "bad")]
    if hits(moving):
        text = (
            f"People touched the moving robot in {of(moving)} episodes ({percent(moving.low)} to "
            f"{percent(moving.high)}), and walked into it each time."
        )
        return text + walked, [Mark(f"contact in {of(moving)}", "bad")]
    text = f"The robot moved into nobody (a rate of up to {percent(by_robot.high)} is possible)."
    return text + walked, [Mark("no contact with the moving robot", "good")]


def _margin(score: Score) -> tuple[str, list[Mark]]:
    worst, share = score.worst_margin_m, score.negative_margin
    if worst is None:
        return "Nobody came near it.", []
    if not hits(share):
        text = (
            f"The separation margin stays positive: at least {number(worst)} m, and negative in "
            f"at most {percent(share.high)} of episodes."
        )
        return text, [Mark(f"margin {number(worst)} m", "good")]
    text = (
        f"The separation margin is negative in {of(share)} episodes ({percent(share.low)} to "
        f"{percent(share.high)}), at worst {number(worst)} m."
    )
    return text, [Mark(f"margin {number(worst)} m", "bad")]


def _limits(score: Score) -> tuple[str, list[Mark]]:
    limit, corner = score.limit, score.fastest_point
    marks = [*_limit_mark("speed limit", limit), *_limit_mark("yaw rule", corner)]
    if limit.obeyed and corner.obeyed:
        return "It obeys the speed limit and the yaw rule.", marks
    said = [_obedience("the speed limit", limit), _obedience("the yaw rule", corner)]
    return " ".join(each for each in said if each), marks


def _obedience(name: str, obedience: Obedience) -> str:
    if obedience.obeyed is None:
        return ""
    if obedience.obeyed:
        return f"It obeys {name}."
    return (
        f"It breaks {name} in {of(obedience.broken)} episodes, by up to "
        f"{number(obedience.excess_mps)} m/s."
    )


def _limit_mark(name: str, obedience: Obedience) -> list[Mark]:
    if obedience.obeyed is None:
        return []
    if obedience.obeyed:
        return [Mark(name, "good")]
    return [Mark(f"{name} {number(obedience.excess_mps, sign=True)} m/s", "bad")]


def _radii(planner: PlannerScore) -> tuple[str, list[Mark]]:
    use = planner.radii
    if use is None:
        return "", []
    wider = f"radii {RADII_FACTOR:g} times as large"
    if not hits(use.changed) and not use.near:
        text = f"Nobody came near enough to tell whether it uses the radii, even with {wider}."
        return text, []
    if not hits(use.changed):
        text = (
            f"It does not use the radii: its path is the same with {wider}, though it came into a "
            f"wider circle in {count(use.near)} of {count(use.changed.n)} episodes."
        )
        return text, [Mark("ignores radii", "bad")]
    text = f"It uses the radii: with {wider}, its path is another in {of(use.changed)} episodes"
    if use.separation_m.known:
        text += (
            f", and it keeps {number(abs(use.separation_m.value))} m "
            f"{'more' if use.separation_m.value >= 0.0 else 'less'} distance on average"
        )
    return f"{text}.", [Mark("uses radii", "good")]


def _time(score: Score, policy: str) -> tuple[str, list[Mark]]:
    change = score.against_blind_s[""]
    if policy == BASELINE or not change.known:
        return "", []
    text = f"With {policy} it loses {_more(change.value)} {BASELINE}"
    shown = change.bounded and change.n >= FEW_PAIRS and (change.high < 0.0 or change.low > 0.0)
    if change.bounded:
        ends = f"95 % interval {number(change.low, 1)} to {number(change.high, 1)} s"
        text += f" ({ends}, {plural(change.n, 'pair')})"
    if change.n < FEW_PAIRS:
        text += "; too few pairs to tell"
    elif not shown:
        text += "; a difference is not shown"
    parts = [
        f"{number(each.value, 1)} s with {part} people"
        for part, each in score.against_blind_s.items()
        if part and each.known and each.n < change.n
    ]
    more = f" By what people look at: {', '.join(parts)}." if parts else ""
    tone: Tone = "open" if not shown else "good" if change.high < 0.0 else "bad"
    mark = Mark(f"{number(change.value, 1, sign=True)} s against {BASELINE}", tone)
    return f"{text}.{more}", [mark]


def _field(planner: PlannerScore) -> tuple[str, list[Mark]]:
    use = planner.field
    if use is None:
        return "It does not use the speed field.", []
    change = use.time_s
    goals = f"it reaches {of(use.goals_with)} goals with it and {of(use.goals_without)} without it"
    if not change.known:
        return f"It can use the speed field: {goals}.", []
    ends = ""
    if change.bounded:
        ends = f" (95 % interval {number(change.low, 1)} to {number(change.high, 1)} s)"
    text = f"With the speed field it takes {_more(change.value, 'without')}{ends}; {goals}."
    shown = change.bounded and change.n >= FEW_PAIRS and (change.high < 0.0 or change.low > 0.0)
    tone: Tone = "open" if not shown else "good" if change.high < 0.0 else "bad"
    return text, [Mark(f"{number(change.value, 1, sign=True)} s by the speed field", tone)]


def _more(seconds: float, other: str = "with") -> str:
    """Return ``"1.9 s less than with"``, or ``"as much time as with"``."""
    amount = number(abs(seconds), 1)
    if not float(amount):
        return f"as much time as {other}"
    return f"{amount} s {'less' if seconds < 0.0 else 'more'} than {other}"


def _computing(planner: PlannerScore, score: Score) -> tuple[str, list[Mark]]:
    time = score.plan_time
    if time is None:
        return "", []
    ms = number(1e3 * time.median_s, 1 if time.median_s >= 1e-4 else 3)
    text = f"A call of plan() takes {ms} ms"
    if time.ratio is not None and planner.planner != "reference":
        text += f", {factor(time.ratio)} times the reference planner's time"
    if time.late:
        return f"{text}. It is too slow: its 99th percentile is longer than the control cycle.", [
            Mark("too slow", "bad")
        ]
    return f"{text}.", []


def factor(ratio: float) -> str:
    """Return a ratio with two significant digits."""
    return number(
        ratio, 0 if ratio >= 9.95 else 1 if ratio >= 0.995 else 2 if ratio >= 0.0995 else 3
    )


def exceeded(obedience: Obedience) -> str:
    """Return a cell about a limit: ``"obeyed"``, the largest excess, or a dash."""
    if obedience.obeyed is None:
        return NOTHING
    if obedience.obeyed:
        return "obeyed"
    return f"{number(obedience.excess_mps, sign=True)}"


#: The meaning of "obeyed", for legends.
OBEYED: Final = f"no excess of more than {OVERSHOOT_MPS:g} m/s, about the motors' overshoot"
