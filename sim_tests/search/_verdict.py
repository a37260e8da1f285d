"""The end of a search: sentences about what it has shown, and the command to run next."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from ..crossing.eyes import Perception
from ..study.measures import FEW_PAIRS, Interval
from ..study.runs import Conditions


def print_verdict(text: str, next_command: str) -> None:
    """Print a verdict in sentences, and the command to run next."""
    print(f"Verdict: {text}\nNext: {next_command}")


def episode_words(conditions: Conditions) -> list[str]:
    """Return the words of the command line that repeat scenarios, people, sensors and planner."""
    (planner,), (sensors,) = conditions.planner, conditions.sensors
    words = ["--scenario", *conditions.scenario]
    words += Perception.of(conditions.perception, sensors).options.split()
    for name, value in (
        ("--camera", conditions.camera),
        ("--robot", conditions.robot),
        ("--population", conditions.population),
        ("--planner", planner),
    ):
        if value:
            words += [name, value]
    return words


def command_text(*words: object) -> str:
    """Return a command that a shell reads as these words."""
    return shlex.join(["awarenav", *map(str, words)])


def is_shown(change: Interval) -> bool:
    """Return whether an interval of paired differences excludes 0, over enough pairs."""
    return change.n >= FEW_PAIRS and (change.low > 0.0 or change.high < 0.0)


def change_text(change: Interval, decimals: int, verb: str) -> str:
    """Return a paired difference of seconds in words, such as ``"loses 0.3 s less (…)"``.

    Args:
        change: mean difference with its interval.
        decimals: of the seconds.
        verb: the words before the amount.
    """
    if not change.known:
        return f"{verb} ? (no pair)"
    amount = f"{abs(change.value):.{decimals}f}"
    if float(amount):
        text = f"{verb} {amount} s {'less' if change.value < 0.0 else 'more'}"
    else:
        text = f"{verb} neither less nor more"
    if not change.bounded:
        return f"{text} (too few pairs for an interval)"
    return f"{text} ({change.low:+.{decimals}f} to {change.high:+.{decimals}f} s)"


def listed(words: Sequence[str]) -> str:
    """Return words as ``"a, b and c"``."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
