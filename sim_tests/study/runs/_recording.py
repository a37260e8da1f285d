"""The recorder of an episode, for a page that shows it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...crossing.eyes import Perception
from ...viewing import CameraPictures, CrossingRecorder, Episode
from ._job import Job
from ._plan import job_key


def recorder_of(
    job: Job,
    *,
    camera: bool = True,
    share: float = 1.0,
    on_begin: Callable[[dict[str, Any]], None] | None = None,
    on_state: Callable[[dict[str, Any]], None] | None = None,
) -> CrossingRecorder:
    """Return an observer that records a job's crossing.

    Args:
        job: the episode.
        camera: whether to render the robot's camera.
        share: most of the elapsed time that rendering may take; 1 for no limit.
        on_begin: as for :class:`~sim_tests.viewing.CrossingRecorder`.
        on_state: likewise.
    """
    episode = Episode(**job_key(job)._asdict())
    scaled = Perception.named(job.perception).kind == "pixels"
    pictures = CameraPictures(boxes_are_scaled=scaled, share=share) if camera else None
    return CrossingRecorder(episode, pictures=pictures, on_begin=on_begin, on_state=on_state)
