"""The end of a search: sentences about what it has shown, and the command to run next."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from ..crossing.eyes import Perception, PerceptionKind, SensorSet
from ..study.measures import FEW_PAIRS, Interval


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict of a search.

    Attributes:
        text: some sentences; the first is the verdict itself.
        next_command: the command to run next.
    """

    text: str
    next_command: str

    def lines(self) -> list[str]:
        """Return the verdict as lines of text."""
        return [f"Verdict: {self.text}", f"Next: {self.next_command}"]


class EpisodeOptions(Protocol):
    """The options that all commands with episodes share."""

    @property
    def scenario(self) -> tuple[str, ...]:
        """Names and files, or ``"all"``."""

    @property
    def perception(self) -> PerceptionKind:
        """Perception of people."""

    @property
    def sensors(self) -> SensorSet:
        """Sensors of the robot."""

    @property
    def camera(self) -> str:
        """Another camera; empty for each scenario's own."""

    @property
    def population(self) -> str | None:
        """Another population of people; None for each scenario's own."""

    @property
    def robot(self) -> str:
        """Another robot; empty for the Nova Carter."""

    @property
    def planner(self) -> str:
        """``"module:Class"``, empty for the reference planner."""


def episode_words(options: EpisodeOptions) -> list[str]:
    """Return the words of the command line that repeat scenarios, people, sensors and planner."""
    words = ["--scenario", *options.scenario]
    words += Perception.of(options.perception, options.sensors).options.split()
    for name, value in (
        ("--camera", options.camera),
        ("--robot", options.robot),
        ("--population", options.population),
        ("--planner", options.planner),
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
