"""Section of a report: the worst episodes, with pictures of their worst instants."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from tqdm import tqdm

from ._arm import Arm, Episode, judged_arms
from ._episode_list import outcome_of, worst_first
from ._run_data import RunData
from ._text import number

#: Most episodes that are shown; of each scenario and arm only the worst.
MOST_STILLS: Final = 6


@dataclass(frozen=True, slots=True)
class Still:
    """One episode with its pictures.

    Attributes:
        look: number of the arm's colour and shape.
        title: arm and scenario.
        text: figures of the episode.
        replay: the command that replays it.
        pictures: ``data:`` addresses, each with a description.
        trouble: why there is no picture, or what is wrong with it; empty without trouble.
    """

    look: int
    title: str
    text: str
    replay: str
    pictures: tuple[tuple[str, str], ...]
    trouble: str


def worst_of(arms: Sequence[Arm]) -> tuple[tuple[Arm, Episode], ...]:
    """Return the worst episodes: contacts with the moving robot, then the smallest margins.

    Contacts of any arm count. Only the arms that verdicts are about count for the margins.
    """
    points = [(arm, each) for arm in arms for each in (*arm.episodes, *arm.others)]
    judged = {arm.name for arm in judged_arms(arms)}
    known = [
        (arm, each)
        for arm, each in points
        if each.record.moving_touched
        or (arm.name in judged and each.record.min_margin_m is not None)
    ]
    found: dict[tuple[str, str], tuple[Arm, Episode]] = {}
    for arm, each in sorted(known, key=lambda point: worst_first(point[1])):
        found.setdefault((arm.name, each.record.scenario), (arm, each))
    return tuple(found.values())[:MOST_STILLS]


def make_stills(
    run: RunData, arms: Sequence[Arm], *, pictures: bool, progress: bool
) -> tuple[Still, ...]:
    """Return the worst episodes, with pictures if wanted; a failure affects only its own episode.

    Args:
        run: the run, whose jobs are run again.
        arms: the arms of the comparison.
        pictures: run the episodes again for pictures.
        progress: show progress on standard error.
    """
    worst = worst_of(arms)
    if not pictures:
        return tuple(_still(run, arm, each, (), "") for arm, each in worst)
    stills = []
    with tqdm(worst, desc="stills", unit="episode", file=sys.stderr, disable=not progress) as bar:
        for arm, episode in bar:
            shown: tuple[tuple[str, str], ...] = ()
            if episode.number is None:
                trouble = "No picture: its job is not known."
            else:
                try:
                    from ._still_pictures import pictures_of  # noqa: PLC0415 - needs the simulator

                    shown, trouble = pictures_of(run.jobs[episode.number], episode.record)
                except Exception as error:  # a planner or a renderer may raise anything
                    trouble = f"No picture: {type(error).__name__}: {error}"
            stills.append(_still(run, arm, episode, shown, trouble))
    return tuple(stills)


def _still(
    run: RunData,
    arm: Arm,
    episode: Episode,
    pictures: tuple[tuple[str, str], ...],
    trouble: str,
) -> Still:
    record = episode.record
    parts = [
        f"seed {record.seed}",
        f"smallest margin {number(record.min_margin_m)} m",
        f"smallest separation {number(record.min_separation_m)} m",
        f"margin violated {number(record.violation_time_s)} s",
    ]
    if record.fault:
        parts.insert(1, f"fault {record.fault}")
    if outcome := outcome_of(episode):
        parts.append(outcome)
    return Still(
        arm.look,
        f"{arm.name}, {record.scenario}",
        ", ".join(parts),
        run.replay(episode),
        pictures,
        trouble,
    )
