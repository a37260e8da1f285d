"""What ``awarenav replay`` does: one episode of a run again, seen from above and by the robot."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from tqdm import tqdm

from .._crossing import CrossingFrame
from .._errors import SimError
from .._stage import Stage
from ..measures._episode_record import EpisodeRecord
from ..measures._record_file import read_record_file
from ..measures._record_row import RECORD_COLUMNS, record_row
from ._episode import observed_episode
from ._job import Job
from ._plan import describe, job_key, template_of
from ._replay_pictures import ReplayPictures
from ._run_folder import EPISODES, key_of, read_jobs

_FOLDER: Final = "replays"


def replay_command(options: argparse.Namespace) -> int:
    """Run an episode again, write its pictures and say whether its row is the same.

    Raises:
        SimError: the folder holds no run, or not this episode.
    """
    jobs = read_jobs(options.dir)
    number = find_episode(jobs, options.episode)
    job = jobs[number]
    print(f"Episode {number}: {describe(job_key(job))}")
    out = options.out if options.out is not None else options.dir / _FOLDER
    out.mkdir(parents=True, exist_ok=True)
    name = f"episode_{number:05d}"
    scenario = template_of(job.scenario).for_seed(job.seed)
    total = round(scenario.duration_s * scenario.control_hz)
    with (
        tqdm(total=total, desc="replay", unit="frame", file=sys.stderr) as bar,
        ReplayPictures(
            out / f"{name}.png", None if options.no_video else out / f"{name}.mp4"
        ) as pictures,
    ):

        def observe(frame: CrossingFrame, stage: Stage) -> None:
            pictures.add(frame, stage)
            bar.update()

        record = observed_episode(job, observe)[1]
        pictures.finish()
    for path in pictures.written:
        print(f"Written: {path}")
    print(_in_words(record))
    return _compared(options.dir, job, record)


def find_episode(jobs: Sequence[Job], episode: str) -> int:
    """The number of an episode from its number, or from SCENARIO:SEED:POLICY[:PLANNER][:FAULT].

    Raises:
        SimError: there is none such, or more than one.
    """
    if episode.isdecimal():
        number = int(episode)
        if number >= len(jobs):
            raise SimError(
                f"the run has {len(jobs)} episodes, numbered 0 to {len(jobs) - 1}, got {number}"
            )
        return number
    parts = episode.split(":")
    if len(parts) < 3 or not parts[1].isdecimal():
        raise SimError(
            "the episode must be its number, or SCENARIO:SEED:POLICY (and :PLANNER or :FAULT where "
            f"that is not enough), got {episode!r}"
        )
    keys = [job_key(job) for job in jobs]
    found = [
        number
        for number, key in enumerate(keys)
        if [key.scenario, str(key.seed), key.policy] == parts[:3]
        and all(part in (key.planner, key.fault, key.perception) for part in parts[3:])
    ]
    if len(found) == 1:
        return found[0]
    if not found:
        near = [key for key in keys if key.scenario == parts[0]][:1] or keys[:1]
        example = f"{near[0].scenario}:{near[0].seed}:{near[0].policy}"
        raise SimError(f"the run has no episode {episode!r}; one that it has is {example}")
    listed = "; ".join(f"{number}: {describe(keys[number])}" for number in found[:6])
    raise SimError(f"{episode!r} is {len(found)} episodes of the run, give one's number: {listed}")


def _compared(folder: Path, job: Job, record: EpisodeRecord) -> int:
    key = job_key(job)
    before = [each for each in read_record_file(folder / EPISODES).records if key_of(each) == key]
    if not before:
        print(f"{folder / EPISODES} has no row of this episode yet")
        return 0
    pairs = zip(RECORD_COLUMNS, record_row(before[0]), record_row(record), strict=True)
    changed = [(name, was, now) for name, was, now in pairs if was != now]
    if not changed:
        print(f"The same row as in {folder / EPISODES}.")
        return 0
    print(
        f"Not the row in {folder / EPISODES}: "
        + "; ".join(
            f"{name} was {was or 'empty'}, is {now or 'empty'}" for name, was, now in changed
        )
    )
    return 1


def _in_words(record: EpisodeRecord) -> str:
    goal = "goal not reached"
    if record.time_to_goal_s is not None:
        goal = f"goal after {record.time_to_goal_s:.2f} s"
    parts = [goal]
    if record.min_separation_m is not None:
        parts.append(f"least separation {record.min_separation_m:.2f} m")
    if record.min_margin_m is not None:
        parts.append(f"least margin {record.min_margin_m:.2f} m")
    if record.contact:
        parts.append(f"contact, caused by the {record.contact_by}")
    return ", ".join(parts)
