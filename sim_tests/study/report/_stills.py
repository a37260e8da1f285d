"""The section of the worst episodes, with pictures of their worst instants."""

from __future__ import annotations

import sys
from typing import Final

from tqdm import tqdm

from ._page import Section, Still, number_cell
from ._results import Arm, Results
from ._run import Episode, Run
from ._sections import outcome_of, worst_first

#: Most episodes that are shown; of each scenario and arm only the worst.
MOST_STILLS: Final = 4


def stills_section(run: Run, results: Results, *, pictures: bool, progress: bool) -> Section | None:
    """Return the worst episodes, with pictures if wanted; None without any.

    A failure affects only its own episode. Contacts of any arm come first. Only the arms that
    verdicts are about count for the smallest margins.

    Args:
        run: the run, whose jobs are run again.
        results: its figures.
        pictures: run the episodes again for pictures.
        progress: show progress on standard error.
    """
    judged = {arm.name for arm in results.judged}
    points = [
        (arm, each)
        for arm in results.arms
        for each in (*arm.episodes, *arm.others)
        if each.record.moving_touched
        or (arm.name in judged and each.record.min_margin_m is not None)
    ]
    found: dict[tuple[str, str], tuple[Arm, Episode]] = {}
    for arm, each in sorted(points, key=lambda point: worst_first(point[1])):
        found.setdefault((arm.name, each.record.scenario), (arm, each))
    worst = list(found.values())[:MOST_STILLS]
    if not worst:
        return None
    silent = not (pictures and progress)
    with tqdm(worst, desc="stills", unit="episode", file=sys.stderr, disable=silent) as bar:
        stills = [_still(run, arm, each, pictures=pictures) for arm, each in bar]
    lead = (
        "Contacts with the moving robot first, then the smallest margins; of each scenario and arm "
        "only the worst."
    )
    if pictures:
        lead += (
            " Pictures show the instant of the smallest margin: the robot's camera, and the plan. "
            "Discs are people and fans where they look; rings are the obstacles that the robot "
            "kept clear of. Green is aware, red unaware, grey not known."
        )
    return Section("worst", "Worst", lead, stills=stills)


def _still(run: Run, arm: Arm, episode: Episode, *, pictures: bool) -> Still:
    record = episode.record
    parts = [
        f"seed {record.seed}",
        f"fault {record.fault}" if record.fault else "",
        f"smallest margin {number_cell(record.min_margin_m).text} m",
        f"smallest separation {number_cell(record.min_separation_m).text} m",
        outcome_of(episode),
    ]
    text = ", ".join(filter(None, parts))
    shown: tuple[tuple[str, str], ...] = ()
    if pictures:
        shown, trouble = _pictures(run, episode)
        text += trouble and f". {trouble}"
    return Still(f"{arm.name}, {record.scenario}", text, run.replay(episode), shown)


def _pictures(run: Run, episode: Episode) -> tuple[tuple[tuple[str, str], ...], str]:
    """Return the pictures of an episode, or the reason why there are none."""
    if episode.number is None:
        return (), "No picture: its job is not known."
    try:
        from ._pictures import pictures_of  # noqa: PLC0415 - needs the simulator

        return pictures_of(run.jobs[episode.number], episode.record)
    except Exception as error:  # a planner or a renderer may raise anything
        return (), f"No picture: {type(error).__name__}: {error}"
