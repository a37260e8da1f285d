"""The command ``awarenav replay``: one episode of a run again, with video and map, or a page."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import astuple
from pathlib import Path
from typing import Any, Final, NoReturn

import cv2
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from awarenav.errors import counted
from awarenav.video import VideoWriter

from ...conditions import Perception, planner_name
from ...crossing import CrossingFrame, CrossingResult, Observer, Stage, TopView, camera_view
from ...crossing.sensors import CameraSensor, sensor_class
from ...viewing import CameraPictures, CrossingRecorder, outcome_text, show_page, write_page
from ...world.errors import SimError
from ..measures import RECORD_COLUMNS, EpisodeRecord, nondeterminism_notes, record_row
from ._episode import observed_episode
from ._plan import scenario_of
from ._run_files import Job, RunFiles, read_jobs, read_rows

Image = NDArray[np.uint8]

# The word for all episodes of a run.
_EVERY: Final = "all"
_VIDEO_HZ: Final = 10
_HEIGHT_PX: Final = 480
_MAP_WIDTH_PX: Final = 720
_MAP_MARGIN_M: Final = 3.0


class ReplayPictures(AbstractContextManager["ReplayPictures"]):
    """The video of an episode, and the map of its closest instant with all paths up to there."""

    def __init__(self, map_path: Path, video_path: Path | None, box_scale: float) -> None:
        self._box_scale = box_scale
        self._map_path = map_path
        self._video_path = video_path
        self._view: TopView | None = None
        self._video: VideoWriter | None = None
        self._cycles = 0
        self._closest_m = float("inf")
        self._closest: Image | None = None
        self.written: list[Path] = []

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Finish the video; that of an interrupted episode can be played, too."""
        if self._video is not None:
            self._video.close()
            self._video = None

    def finish(self) -> None:
        """Write the map and finish the video."""
        self.close()
        if self._video_path is not None and self._video_path.exists():
            self.written.append(self._video_path)
        if self._closest is not None:
            cv2.imwrite(str(self._map_path), cv2.cvtColor(self._closest, cv2.COLOR_RGB2BGR))
            self.written.append(self._map_path)

    def add(self, frame: CrossingFrame, stage: Stage) -> None:
        """Add one control cycle."""
        every = max(round(stage.scenario.control_hz / _VIDEO_HZ), 1)
        number, self._cycles = self._cycles, self._cycles + 1
        nearest_m = min(frame.separations_m, default=float("inf"))
        closer = nearest_m < self._closest_m or self._closest is None
        if self._view is None:
            self._view = TopView(
                stage,
                (_MAP_WIDTH_PX, _HEIGHT_PX),
                stage.scenario.robot.window_odom_m(_MAP_MARGIN_M),
            )
        self._view.watch(frame)
        if number % every and not closer:
            return
        above = self._view.draw(frame, stage)
        if closer:
            self._closest_m, self._closest = nearest_m, above
        if self._video_path is not None and number % every == 0:
            self._add_video_frame(frame, stage, above)

    def _add_video_frame(self, frame: CrossingFrame, stage: Stage, above: Image) -> None:
        spec = stage.scenario.camera
        seen = camera_view(
            frame,
            stage,
            round(_HEIGHT_PX / spec.height_px * spec.width_px),
            box_scale=self._box_scale,
            memory=None if self._view is None else self._view.memory,
        )
        image = np.hstack([seen, above])
        image = image[:, : image.shape[1] // 2 * 2]  # the codec needs an even width
        if self._video is None:
            size = (image.shape[1], image.shape[0])
            self._video = VideoWriter(self._video_path, _VIDEO_HZ, size)  # type: ignore[arg-type]
        self._video.add(image)


def replay_command(
    folder: Path, episode: str, *, out: Path | None, no_video: bool, view: bool
) -> int:
    """Run an episode again, write its pictures or its page, and compare its row with the run's."""
    jobs, files, rows = read_jobs(folder), RunFiles(folder), read_rows(folder)
    every = episode == _EVERY
    numbers = range(len(jobs)) if every else [find_episode(jobs, episode)]
    out = files.replays if out is None else out
    out.mkdir(parents=True, exist_ok=True)
    status = 0
    for number in numbers:
        job, path = jobs[number], out / files.page(number).name
        print(f"Episode {number}: {job.conditions.text}")
        before = next((row for row in rows if row.conditions == job.conditions), None)
        length_s = None if before is None else before.duration_s
        result, record, written = _drawn(job, path, length_s, video=not no_video, view=view)
        for each in written:
            print(f"Written: {each}")
        print(outcome_text(result))
        status = max(status, _compare_row(folder, before, record))
        if view and not every:
            show_page(path.resolve().as_uri())
    return status


def _drawn(
    job: Job, path: Path, length_s: float | None, *, video: bool, view: bool
) -> tuple[CrossingResult, EpisodeRecord, Sequence[Path]]:
    """Run one episode again; return its result, its row and the files written.

    Its progress counts to the length that it had before, or to its time limit.
    """
    scenario = scenario_of(job.scenario_text).draw(job.seed)
    total = round((length_s or scenario.duration_s) * scenario.control_hz)
    with tqdm(total=total, desc="replay", unit="frame", file=sys.stderr) as bar:
        if view:
            recorder = recorder_of(job)
            result, record = _observed(job, recorder, bar)
            write_page(path, recorder.begin, recorder.states, outcome_text(result), recorder.note)
            return result, record, [path]
        film = path.with_suffix(".mp4") if video else None
        with ReplayPictures(path.with_suffix(".png"), film, box_scale_of(job)) as pictures:
            result, record = _observed(job, pictures.add, bar)
            pictures.finish()
        return result, record, pictures.written


def _observed(
    job: Job, observer: Observer, bar: tqdm[NoReturn]
) -> tuple[CrossingResult, EpisodeRecord]:
    """Run and measure an episode, watched by an observer and a progress bar."""

    def observe(frame: CrossingFrame, stage: Stage) -> None:
        observer(frame, stage)
        bar.update()

    return observed_episode(job, observe)


def recorder_of(
    job: Job,
    *,
    camera: bool = True,
    share: float = 1.0,
    on_begin: Callable[[dict[str, Any]], None] | None = None,
    on_state: Callable[[dict[str, Any]], None] | None = None,
) -> CrossingRecorder:
    """Return an observer that records a job's crossing; ``share`` bounds the time of rendering."""
    pictures = CameraPictures(box_scale=box_scale_of(job), share=share) if camera else None
    return CrossingRecorder(job.conditions, pictures=pictures, on_begin=on_begin, on_state=on_state)


def box_scale_of(job: Job) -> float:
    """Return the size of the images of a job's boxes, over that of its scenario's camera."""
    spec = scenario_of(job.scenario_text).draw(job.seed).camera
    sensors = map(sensor_class, Perception.named(job.perception))
    return next((each.scale(spec) for each in sensors if issubclass(each, CameraSensor)), 1.0)


def find_episode(jobs: Sequence[Job], episode: str) -> int:
    """Return the number of an episode: a number, or SCENARIO:SEED:POLICY[:PLANNER][:FAULT]."""
    if episode.isdecimal():
        number = int(episode)
        if number >= len(jobs):
            raise SimError(
                f"the run has {counted(len(jobs), 'episode')}, numbered 0 to {len(jobs) - 1}, got "
                f"{number}"
            )
        return number
    parts = episode.split(":")
    if len(parts) < 3 or not parts[1].isdecimal():
        raise SimError(
            "the episode must be its number, or SCENARIO:SEED:POLICY (and :PLANNER or :FAULT where "
            f"that is not enough), got {episode!r}"
        )
    keys = [job.conditions for job in jobs]
    found = [
        number
        for number, key in enumerate(keys)
        if [key.scenario, str(key.seed), key.policy] == parts[:3]
        and all(part in (*astuple(key)[3:], planner_name(key.planner)) for part in parts[3:])
    ]
    if len(found) == 1:
        return found[0]
    if not found:
        near = [key for key in keys if key.scenario == parts[0]][:1] or keys[:1]
        example = f"{near[0].scenario}:{near[0].seed}:{near[0].policy}"
        raise SimError(f"the run has no episode {episode!r}; one that it has is {example}")
    listed = "; ".join(f"{number}: {keys[number].text}" for number in found[:6])
    raise SimError(f"{episode!r} is {len(found)} episodes of the run, give one's number: {listed}")


def _compare_row(folder: Path, before: EpisodeRecord | None, record: EpisodeRecord) -> int:
    """Print the difference to the row of the run; return 0 for the same row, else 1."""
    if before is None:
        print(f"{folder} has no row of this episode yet")
        return 0
    pairs = zip(RECORD_COLUMNS, record_row(before), record_row(record), strict=True)
    changed = [(name, was, now) for name, was, now in pairs if was != now]
    if not changed:
        print(f"The same row as in {folder}.")
        return 0
    print(
        f"Not the row in {folder}: "
        + "; ".join(
            f"{name} was {was or 'empty'}, is {now or 'empty'}" for name, was, now in changed
        )
    )
    for note in nondeterminism_notes([record]):
        print(note)
    return 1
