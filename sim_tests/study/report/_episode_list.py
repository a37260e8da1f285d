"""Episodes that ended in an error, those with the same message together.

Every episode as a line, with the command that shows it again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from ._arm import Arm, Episode
from ._figures import touched
from ._run_data import RunData
from ._text import count, number, plural

_EXAMPLES: Final = 5


@dataclass(frozen=True, slots=True)
class Failure:
    """One message, how often it came, in which scenarios, and how to see it again."""

    message: str
    times: str
    scenarios: tuple[str, ...]
    replays: tuple[str, ...]
    more: int


def failures(folder: RunData) -> tuple[Failure, ...]:
    """The messages, the most frequent first."""
    groups: dict[str, list[Episode]] = {}
    for each in folder.episodes:
        if each.record.error:
            groups.setdefault(each.record.error, []).append(each)
    ordered = sorted(groups.items(), key=lambda item: (-len(item[1]), item[0]))
    return tuple(_failure(folder, message, episodes) for message, episodes in ordered)


def _failure(folder: RunData, message: str, episodes: Sequence[Episode]) -> Failure:
    replays = [command for each in episodes if (command := folder.replay(each))]
    return Failure(
        message,
        count(len(episodes)),
        tuple(sorted({each.record.scenario for each in episodes})),
        tuple(replays[:_EXAMPLES]),
        max(len(replays) - _EXAMPLES, 0),
    )


#: A page stays below 2 MB with so many lines.
MOST_LINES: Final = 3000


@dataclass(frozen=True, slots=True)
class EpisodeLine:
    """One episode as texts; ``look`` is that of its arm's mark."""

    number: str
    scenario: str
    seed: int
    arm: str
    look: int
    fault: str
    lost: str
    margin: str
    separation: str
    outcome: str
    bad: bool
    replay: str


@dataclass(frozen=True, slots=True)
class EpisodeList:
    """The lines, in the order of their numbers, and which episodes are left out."""

    episodes: tuple[Episode, ...]
    lines: tuple[EpisodeLine, ...]
    left_out: str


def list_episodes(folder: RunData, arms: Sequence[Arm]) -> EpisodeList:
    """List all episodes, or those of the least margin where there are too many for a page."""
    arm_of = {id(each): arm for arm in arms for each in (*arm.episodes, *arm.others, *arm.errors)}
    chosen = list(folder.episodes)
    left_out = ""
    if len(chosen) > MOST_LINES:
        left_out = (
            f"{plural(len(chosen) - MOST_LINES, 'episode')} of larger margins are left out; "
            "episodes.csv has them all, and its lines are numbered in the same way."
        )
        order = sorted(range(len(chosen)), key=lambda i: badness(chosen[i]))
        chosen = [chosen[i] for i in sorted(order[:MOST_LINES])]
    return EpisodeList(
        tuple(chosen), tuple(_line(folder, each, arm_of[id(each)]) for each in chosen), left_out
    )


def badness(episode: Episode) -> tuple[int, float, tuple[str, int, int]]:
    """A key to sort by, the worst first: robot contacts and errors, then the smallest margin."""
    record = episode.record
    severe = 0 if touched(record) else 1 if record.error else 2
    margin = float("inf") if record.min_margin_m is None else record.min_margin_m
    return severe, margin, episode.pair


def outcome_of(episode: Episode) -> str:
    """What else there is to say about an episode; empty where all went well."""
    record = episode.record
    if record.error:
        return f"failed: {record.error}"
    if touched(record):
        return "robot moved into a person"
    if record.person_contacts:
        return "a person walked into the robot"
    return "goal not reached" if record.time_to_goal_s is None else ""


def _line(folder: RunData, episode: Episode, arm: Arm) -> EpisodeLine:
    record = episode.record
    return EpisodeLine(
        "" if episode.number is None else str(episode.number),
        record.scenario,
        record.seed,
        arm.name,
        arm.look,
        record.fault,
        number(record.time_lost_s, 1),
        number(record.min_margin_m),
        number(record.min_separation_m),
        outcome_of(episode),
        bool(record.error or touched(record)),
        folder.replay(episode),
    )
