"""Sections of a report: the errors of failed episodes, and the list of all episodes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from urllib.parse import quote

from ..runs import RunFiles
from ._arm import Arm, Episode
from ._run_data import RunData
from ._text import count, number, plural

#: Most lines in the list of episodes, which keeps a report below 2 MB.
MOST_LINES: Final = 3000
_MOST_REPLAYS: Final = 5


@dataclass(frozen=True, slots=True)
class Failure:
    """An error message with its number of episodes, its scenarios and replay commands."""

    message: str
    times: str
    scenarios: tuple[str, ...]
    replays: tuple[str, ...]
    more: int


def failures(run: RunData) -> tuple[Failure, ...]:
    """Return the error messages, the most frequent first."""
    groups: dict[str, list[Episode]] = {}
    for each in run.episodes:
        if each.record.error:
            groups.setdefault(each.record.error, []).append(each)
    ordered = sorted(groups.items(), key=lambda item: (-len(item[1]), item[0]))
    return tuple(_failure(run, message, episodes) for message, episodes in ordered)


def _failure(run: RunData, message: str, episodes: Sequence[Episode]) -> Failure:
    replays = [command for each in episodes if (command := run.replay(each))]
    return Failure(
        message,
        count(len(episodes)),
        tuple(sorted({each.record.scenario for each in episodes})),
        tuple(replays[:_MOST_REPLAYS]),
        max(len(replays) - _MOST_REPLAYS, 0),
    )


@dataclass(frozen=True, slots=True)
class EpisodeLine:
    """One episode as texts; ``look`` is the number of its arm's colour and shape.

    ``page`` is the address of its replay page, from the report; empty where there is none yet.
    """

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
    page: str


@dataclass(frozen=True, slots=True)
class EpisodeList:
    """The lines of the episodes, in the order of their numbers, and a note on those left out."""

    episodes: tuple[Episode, ...]
    lines: tuple[EpisodeLine, ...]
    left_out: str


def list_episodes(run: RunData, arms: Sequence[Arm], folder: Path | None = None) -> EpisodeList:
    """Return all episodes, or those with the smallest margins where there are too many.

    Args:
        run: the run.
        arms: the arms of the comparison.
        folder: of the report, where the links begin; None for that of the run.
    """
    folder = run.path if folder is None else folder
    arm_of = {id(each): arm for arm in arms for each in (*arm.episodes, *arm.others, *arm.errors)}
    chosen = list(run.episodes)
    left_out = ""
    if len(chosen) > MOST_LINES:
        left_out = (
            f"Left out: {plural(len(chosen) - MOST_LINES, 'episode')} of larger margins. "
            "episodes.csv has all episodes, and its lines are numbered in the same way."
        )
        order = sorted(range(len(chosen)), key=lambda i: worst_first(chosen[i]))
        chosen = [chosen[i] for i in sorted(order[:MOST_LINES])]
    return EpisodeList(
        tuple(chosen),
        tuple(_line(run, each, arm_of[id(each)], folder) for each in chosen),
        left_out,
    )


def worst_first(episode: Episode) -> tuple[int, float, tuple[str, int, int]]:
    """Return a sort key: contacts with the moving robot, then errors, then the smallest margins."""
    record = episode.record
    severity = 0 if record.moving_touched else 1 if record.error else 2
    margin = float("inf") if record.min_margin_m is None else record.min_margin_m
    return severity, margin, episode.pair


def outcome_of(episode: Episode) -> str:
    """Return a remark on the outcome of an episode; empty for a success."""
    record = episode.record
    if record.error:
        return f"failed: {record.error}"
    if record.robot_touched:
        return "robot moved into a person"
    if record.moving_touched:
        return "a person walked into the moving robot"
    if record.person_contacts:
        return "a person walked into the robot"
    return "goal not reached" if record.time_to_goal_s is None else ""


def _page(run: RunData, episode: Episode, folder: Path) -> str:
    """Return the address of an episode's replay page, from a folder; empty without a page."""
    if episode.number is None:
        return ""
    page = RunFiles(run.path).page(episode.number)
    if not page.is_file():
        return ""
    return quote(Path(os.path.relpath(page, folder)).as_posix())


def _line(run: RunData, episode: Episode, arm: Arm, folder: Path) -> EpisodeLine:
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
        bool(record.error or record.moving_touched),
        run.replay(episode) and f"{run.replay(episode)} --view",
        _page(run, episode, folder),
    )
