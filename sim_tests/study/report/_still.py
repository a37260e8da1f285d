"""The worst episodes of a run, run again for pictures of their worst instants."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from tqdm import tqdm

from ._arm import Arm, Episode, judged
from ._episode_list import badness, outcome_of
from ._figures import touched
from ._run_data import RunData
from ._text import number

#: So many at most, and of one scenario with one policy only the worst.
MOST_STILLS: Final = 6


@dataclass(frozen=True, slots=True)
class Still:
    """One episode with its pictures.

    Attributes:
        look: of its arm.
        title: arm and scenario.
        text: what happened, in figures.
        replay: the command that shows it again.
        pictures: ``data:`` addresses and what they show.
        trouble: why there is no picture, or what is wrong with it; empty for nothing.
    """

    look: int
    title: str
    text: str
    replay: str
    pictures: tuple[tuple[str, str], ...]
    trouble: str


def worst_of(arms: Sequence[Arm]) -> tuple[tuple[Arm, Episode], ...]:
    """The worst episodes: robot contacts of any arm, then the least margins of those judged."""
    points = [(arm, each) for arm in arms for each in (*arm.episodes, *arm.others)]
    chosen = {arm.name for arm in judged(arms)}
    known = [
        (arm, each)
        for arm, each in points
        if touched(each.record) or (arm.name in chosen and each.record.min_margin_m is not None)
    ]
    found: dict[tuple[str, str], tuple[Arm, Episode]] = {}
    for arm, each in sorted(known, key=lambda point: badness(point[1])):
        found.setdefault((arm.name, each.record.scenario), (arm, each))
    return tuple(found.values())[:MOST_STILLS]


def make_stills(
    folder: RunData, arms: Sequence[Arm], *, pictures: bool, progress: bool
) -> tuple[Still, ...]:
    """Describe the worst episodes, with pictures if wanted; trouble with one costs only it.

    Args:
        folder: of the run, whose jobs are run again.
        arms: what is compared.
        pictures: run the episodes again.
        progress: show it on the standard error stream.
    """
    worst = worst_of(arms)
    if not pictures:
        return tuple(_still(folder, arm, each, (), "") for arm, each in worst)
    stills = []
    with tqdm(worst, desc="stills", unit="episode", file=sys.stderr, disable=not progress) as bar:
        for arm, episode in bar:
            shown: tuple[tuple[str, str], ...] = ()
            if episode.number is None:
                trouble = "No picture: its job is not known."
            else:
                try:
                    from ._still_pictures import pictures_of  # noqa: PLC0415 - needs the simulator

                    shown, trouble = pictures_of(folder.jobs[episode.number], episode.record)
                except Exception as error:  # whatever a planner or a renderer raises
                    trouble = f"No picture: {type(error).__name__}: {error}"
            stills.append(_still(folder, arm, episode, shown, trouble))
    return tuple(stills)


def _still(
    folder: RunData,
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
        folder.replay(episode),
        pictures,
        trouble,
    )
