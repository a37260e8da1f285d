"""The command ``awarenav watch``: one crossing, shown in the browser while it runs."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any, Final

from ..conditions import Experiment
from ..crossing import drive
from ..viewing import LivePage, outcome_text, page_text, show_page, write_page
from ..world.errors import SimError
from .runs import Job, experiment_jobs, recorder_of, setup_of

# Rendering takes at most this share of the time, so that states arrive often.
_PICTURE_SHARE: Final = 0.25
_DELIVERY_S: Final = 5.0
_CATCH_UP_S: Final = 0.3


def watch_command(
    experiment: Experiment,
    *,
    speed: float,
    port: int,
    wait: float,
    out: Path | None,
    no_camera: bool,
    no_browser: bool,
) -> int:
    """Serve the page, run the crossing at the pace of the clock, and end with it.

    Raises:
        SimError: an unknown or unusable option.
        NavError: an unknown preset or unusable policy file.
        PerceptionError: for pixels, the shipped networks cannot be loaded.
    """
    job = _job(experiment)
    if out is not None and not out.parent.is_dir():
        raise SimError(f"cannot write {out}: there is no folder {out.parent}")
    with LivePage(page_text(f"awarenav watch: {job.scenario}"), port) as page:
        print(f"{job.conditions.text}\nWatch it at {page.url} (Ctrl-C ends it)", flush=True)
        if not no_browser:
            show_page(page.url)
        pace = _Pace(page, speed, wait)
        recorder = recorder_of(
            job,
            camera=not no_camera,
            share=_PICTURE_SHARE,
            on_begin=pace.begin,
            on_state=pace.state,
        )
        result = drive(setup_of(job), recorder)
        outcome = outcome_text(result)
        page.end(outcome, recorder.note)
        page.wait_for_delivery(_DELIVERY_S)
        print(f"{outcome}.", flush=True)
        if not page.opened:
            print("Nobody opened the page.")
    if out is not None:
        write_page(out, recorder.begin, recorder.states, outcome, recorder.note)
        print(f"Written: {out}")
    return 0


class _Pace:
    """Sends states to a page, not before their time.

    The clock starts when somebody reads the page, or after ``wait_s``.
    """

    def __init__(self, page: LivePage, speed: float, wait_s: float) -> None:
        self._page = page
        self._speed = speed
        self._open_until = time.monotonic() + wait_s
        self._started = 0.0

    def begin(self, begin: dict[str, Any]) -> None:
        """Send hall and robot; wait for a reader."""
        self._page.begin(begin)
        left_s = self._open_until - time.monotonic()
        if not self._page.wait_for_reader(max(left_s, 0.0)):
            print("Nobody has opened the page yet; the crossing starts.", flush=True)
        self._started = time.monotonic()

    def state(self, state: dict[str, Any]) -> None:
        """Send a state when its time has come."""
        due = self._started + state["t_s"] / self._speed
        late_s = time.monotonic() - due
        time.sleep(max(-late_s, 0.0))
        # A slow computer sets its own pace; only a short delay, as of a picture, is made up for.
        self._started += max(late_s - _CATCH_UP_S, 0.0)
        self._page.state(state)


def _job(experiment: Experiment) -> Job:
    """Return the job of the options, as a run of ``awarenav crossings`` would plan it."""
    jobs = experiment_jobs(experiment)
    if len(jobs) != 1:
        scenario, fault = experiment.one("scenario"), experiment.one("fault")
        raise SimError(
            f"watch shows one crossing, but scenario {scenario!r} with fault {fault!r} stands for "
            f"{len(jobs)}; give one of each"
        )
    return jobs[0]
